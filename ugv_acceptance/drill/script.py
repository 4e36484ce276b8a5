"""A drill by a script: for each situation what is answered, and when.

    # how an operator answers who follows the advice, but is slow on stairs
    all: follow-advice
    stairs: stop at 1 s, follow-advice at 4 s
    load: go on

An answer is `follow-advice`, `ignore` (go on as planned), `nothing`, the key of an answer, or words
of it; it comes after 2 s unless the line says when. A line for a situation wins over `all`.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ugv_acceptance import BadConfig
from ugv_acceptance.drill.course import Course
from ugv_acceptance.drill.outcome import Outcome
from ugv_acceptance.drill.play import ASK, JUDGED, Play
from ugv_acceptance.drill.situation import ADVICE, GO_ON
from ugv_acceptance.drill.situations import SITUATIONS

# Seconds to an answer for which the script gives none.
USUAL = 2.0
ALL, NOTHING = 'all', 'nothing'
# Words of a script that are no key.
_NAMES = {'follow-advice': ADVICE, 'ignore': GO_ON}
_TIMED = re.compile(r'^(?P<what>.*?)(?:\s+at\s+(?P<at>\d+(?:\.\d*)?)\s*s?)?$')


@dataclass(frozen=True, slots=True)
class Answer:
    """What a script answers, `after` s from the question."""

    what: str
    after: float = USUAL


Script = Mapping[str, Sequence[Answer]]


def script_from(text: str) -> Script:
    """Return a script from its text. Raises BadConfig naming the line that is wrong."""
    script: dict[str, tuple[Answer, ...]] = {}
    for number, line in enumerate(text.splitlines(), 1):
        said = line.split('#')[0].strip()
        if not said:
            continue
        name, colon, answers = said.partition(':')
        name = name.strip()
        if not colon or name not in {*SITUATIONS, ALL}:
            known = ', '.join((*SITUATIONS, ALL))
            raise BadConfig(f'line {number}: expected SITUATION: ANSWER, of {known}; got {said!r}')
        script[name] = tuple(_answer(part.strip(), number) for part in answers.split(','))
    if not script:
        raise BadConfig('expected a line such as "all: follow-advice", got none')
    return script


def _answer(text: str, number: int) -> Answer:
    found = _TIMED.match(text)
    if found is None or not found['what']:
        raise BadConfig(f'line {number}: expected ANSWER or ANSWER at 2 s, got {text!r}')
    after = USUAL if found['at'] is None else float(found['at'])
    return Answer(found['what'], after)


def choice_of(what: str, play: Play) -> str:
    """Return the key of the answer that a script means. Raises BadConfig: none, or several."""
    offered = play.choices
    key = _NAMES.get(what, what.replace(' ', '_'))
    if any(choice.key == key for choice in offered):
        return key
    words = what.lower().split()
    found = [c.key for c in offered if all(word in c.words.lower() for word in words)]
    if len(found) != 1:
        told = '; '.join(f'{choice.key} ({choice.words})' for choice in offered)
        raise BadConfig(f'{play.situation.name}: expected one of: {told}; got {what!r}')
    return found[0]


def perform(play: Play, answers: Sequence[Answer], step: float = 0.05) -> None:
    """Play a situation to its end with a script's answers. Raises BadConfig for one not offered."""
    waiting = sorted((a for a in answers if a.what != NOTHING), key=lambda a: a.after)
    while play.phase != JUDGED:
        play.advance(step)
        while waiting and play.phase == ASK and play.asked_for >= waiting[0].after - 1e-9:
            play.choose(choice_of(waiting.pop(0).what, play))


def run_script(
    course: Course, script: Script, told: Callable[[Outcome], None] = lambda _: None
) -> None:
    """Play a whole drill by a script; `told` takes the outcome of each situation as it ends.

    A situation that the script does not name gets no answer. Raises BadConfig as `perform`.
    """
    while not course.over:
        name = course.play.situation.name
        perform(course.play, script.get(name, script.get(ALL, ())))
        course.advance(0.0)
        told(course.outcomes[-1])
        course.next()
