"""What an examination of a run adds to its verdict: objections to a PASS, and what was not checked.

An examination looks at one question beside the criteria, such as what efforts mean or how hard the
chassis was braked. safeguards.py judges by what all of them state.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from ugv_acceptance.evaluation.margin_table import MarginRows


@dataclass(frozen=True, slots=True)
class Objection:
    """Why a run cannot pass, whatever its criteria: `verdict` is FAIL or INCONCLUSIVE.

    `safeguard` is the name (a key of safeguards.SAFEGUARDS) by which criteria can waive it,
    `reason` one sentence, `evidence` more of them.
    """

    safeguard: str
    verdict: str
    reason: str
    evidence: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class NotChecked:
    """A thing that no number of this run could tell: `what` it is and `why` it was not checked.

    `seconds` is how much of the run it concerns, None for all of it.
    """

    what: str
    why: str
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class Statement:
    """What an examination found: its part of the `result` by key, objections, what is unchecked.

    `unfounded` are alerts (code, subject) that rest on what turned out to be no measurement: they
    stay in the log, but are no objections. `torques` are the joints whose measured effort is known
    to be their torque.
    """

    result: Mapping[str, object] = field(default_factory=dict)
    objections: tuple[Objection, ...] = ()
    not_checked: tuple[NotChecked, ...] = ()
    unfounded: frozenset[tuple[str, str]] = frozenset()
    torques: frozenset[str] = frozenset()


class Examination(Protocol):
    """Looks at the margins of a recording part by part, and states at the end what it found."""

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""

    def statement(self, start: int, end: int) -> Statement:
        """Return what was found in the recording from `start` to `end` (ns)."""
