"""Whether the monitor's advice passes every situation of the drill, and ignoring it fails each.

Each situation is drawn with many seeds and played by an operator who follows the advice two seconds
after the question, and by one who goes on as planned.

    python -m bench.bench_drill [seeds, 20 by default]
"""

import sys
from collections import Counter

from ugv_acceptance.config import load
from ugv_acceptance.drill.play import Play
from ugv_acceptance.drill.script import Answer, perform
from ugv_acceptance.drill.situations import SITUATIONS

OPERATORS = 'follow-advice', 'ignore'
FIRST_SEED = 101


def main(seeds: int) -> None:
    """Print for each situation how many seeds each operator passed, and what was not expected."""
    config = load('packbot')
    print(f'{"situation":<12} {"follow-advice":>14} {"ignore":>8}   of {seeds}')
    for name, situation in SITUATIONS.items():
        passed = Counter[str]()
        for seed in range(FIRST_SEED, FIRST_SEED + seeds):
            for operator in OPERATORS:
                play = Play(config, situation, seed)
                perform(play, [Answer(operator)])
                outcome = play.outcome
                if outcome is None:
                    continue
                passed[operator] += outcome.passed
                if outcome.passed != (operator == OPERATORS[0]):
                    print(f'  {name}, seed {seed}, {operator}: {outcome.happened}')
        print(f'{name:<12} {passed[OPERATORS[0]]:>14} {passed[OPERATORS[1]]:>8}', flush=True)


if __name__ == '__main__':
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
