"""One line a run: verdict, hours, failures; in the order of time."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from ugv_acceptance.campaign.failures import Failure, from_alerts
from ugv_acceptance.type_aliases import Json

BROKEN, NOT_JUDGED = 'BROKEN', 'NOT_JUDGED'
VERDICTS = ('PASS', 'FAIL', 'INCONCLUSIVE', BROKEN, NOT_JUDGED)
# Reasons kept of a run; its own result has all.
_REASONS = 3


@dataclass(frozen=True, slots=True)
class Row:
    """A run: times in s, its start in ns. One that could not be read is BROKEN, with the reason.

    One is NOT_JUDGED where that was prevented by something else than itself, with the reason.
    `judged_s` is the time in which the margins were known: only that can count as operated without
    a failure. `also` names other copies of the same recording.
    """

    name: str
    verdict: str
    reasons: tuple[str, ...]
    sha256: str = ''
    start_ns: int = 0
    recorded: str | None = None
    duration_s: float = 0.0
    judged_s: float = 0.0
    failures: tuple[Failure, ...] = ()
    also: tuple[str, ...] = ()
    result: str | None = None

    def json(self) -> Json:
        """Return it for JSON; the failures stand in a list of their own."""
        return {
            'name': self.name,
            'verdict': self.verdict,
            'reasons': list(self.reasons),
            'sha256': self.sha256 or None,
            'started_ns': self.start_ns,
            'recorded': self.recorded,
            'duration_s': self.duration_s,
            'judged_s': self.judged_s,
            'failures': len(self.failures),
            'also': list(self.also),
            'result': self.result,
        }


def row_of(name: str, key: str, result: Json) -> Row:
    """Return the line of a run that was judged."""
    return Row(
        name,
        result['verdict'],
        tuple(result['reasons'][:_REASONS]),
        result['bag']['sha256'],
        result['start_ns'],
        result.get('recorded'),
        result['coverage']['duration_s'],
        result['coverage']['evaluated_s'],
        tuple(from_alerts(name, result)),
        result=f'runs/{key}.json',
    )


def broken_row(name: str, error: str) -> Row:
    """Return the line of a run that could not be read."""
    return Row(name, BROKEN, (error,))


def unjudged_row(name: str, why: str) -> Row:
    """Return the line of a run that was not judged, by no fault of its own."""
    return Row(name, NOT_JUDGED, (why,))


def in_order(rows: Iterable[Row]) -> list[Row]:
    """Return runs by their start, each recording once; those without a result last, by name."""
    first: dict[str, Row] = {}
    copies: dict[str, list[str]] = {}
    for row in sorted(rows, key=lambda r: r.name):
        key = row.sha256 or f'unread {row.name}'
        copies.setdefault(key, []).append(row.name)
        first.setdefault(key, row)
    single = [_with_copies(row, copies[key][1:]) for key, row in first.items()]
    return sorted(single, key=lambda r: (not r.sha256, r.start_ns, r.sha256, r.name))


def _with_copies(row: Row, names: Sequence[str]) -> Row:
    return replace(row, also=tuple(names)) if names else row
