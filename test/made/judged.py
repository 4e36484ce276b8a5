"""A recording judged as a user would have it judged, and what must come of it."""

import io
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console

from ugv_acceptance import AcceptanceError
from ugv_acceptance.cli.result_text import print_result
from ugv_acceptance.config import Config
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.offline.judge import Options

PASS, FAIL, INCONCLUSIVE, EXIT_2 = 'PASS', 'FAIL', 'INCONCLUSIVE', 'exit 2'
# Parts of a result that people read, beside what the terminal shows.
TOLD = ('reasons', 'not_checked', 'limits_relaxed', 'alerts', 'inputs')


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict (or `exit 2`), its first reason, and all that was told, as one text."""

    word: str
    reason: str
    told: str


@dataclass(frozen=True, slots=True)
class Expected:
    """Verdicts that may come; patterns that must and that must not be found in what is told.

    Patterns are regular expressions in which capitals do not matter.
    """

    verdicts: tuple[str, ...]
    says: tuple[str, ...] = ()
    never: tuple[str, ...] = ()

    def wrong(self, verdict: Verdict) -> str:
        """Return what is not as it must be; '' where all is."""
        if verdict.word not in self.verdicts:
            return f'{verdict.word} ({verdict.reason})'
        missing = [p for p in self.says if not re.search(p, verdict.told, re.IGNORECASE)]
        if missing:
            return f'{verdict.word}, but does not say: {", ".join(missing)}'
        found = [p for p in self.never if re.search(p, verdict.told, re.IGNORECASE)]
        return f'{verdict.word}, but says: {", ".join(found)}' if found else ''

    @property
    def words(self) -> str:
        """What must come, in a line."""
        told = [f'says /{p}/' for p in self.says] + [f'never /{p}/' for p in self.never]
        return ' or '.join(self.verdicts) + (f'; {"; ".join(told)}' if told else '')


def judged(
    path: Path | list[Path],
    config: Config | Path | None = None,
    criteria: Path | None = None,
    *,
    full: bool = True,
) -> Verdict:
    """Evaluate a recording; `full`: with its efforts compared, and all that the terminal shows."""
    try:
        options = Options(compare_effort=full)
        done = evaluate(path, config=config, criteria=criteria, options=options)
    except AcceptanceError as error:
        return Verdict(EXIT_2, str(error), str(error))
    result = done.result
    return Verdict(result['verdict'], result['reasons'][0], told(result) if full else '')


def told(result: Mapping[str, Any]) -> str:
    """Return the text that `evaluate` prints and the sentences of its result."""
    out = io.StringIO()
    print_result(dict(result), Console(file=out, highlight=False), verbose=True)
    kept = {key: result.get(key) for key in TOLD} | {'warnings': result['robot']['warnings']}
    text = ' '.join(out.getvalue().split()) + json.dumps(kept, ensure_ascii=False)
    for path in result['bag']['path']:  # the name of a case is no word of ours
        text = text.replace(str(path), 'run').replace(str(Path(path).parent), 'run')
    return text
