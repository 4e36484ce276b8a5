"""The table of a campaign: one row per run with verdict, hours and failures, ordered by time."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from ugv_acceptance.campaign.failures import Failure, from_result
from ugv_acceptance.report.format import doubts_of
from ugv_acceptance.type_aliases import Json

DOUBTFUL, BROKEN, NOT_JUDGED = 'DOUBTFUL', 'BROKEN', 'NOT_JUDGED'
VERDICTS = ('PASS', 'FAIL', 'INCONCLUSIVE', DOUBTFUL, BROKEN, NOT_JUDGED)
# Reasons kept of a run; its own result has all.
_REASONS = 3


@dataclass(frozen=True, slots=True)
class Row:
    """One run of the table: times in s, its start in ns.

    A run that passed although something speaks against it is DOUBTFUL; one that could not be read
    is BROKEN; one that something else kept from being judged is NOT_JUDGED; all with the reason.
    `judged_s` is the time in which the margins were known: only that counts as operated without a
    failure. `also` names other copies of the same recording.
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
        """Return the row for JSON; failures are listed elsewhere."""
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
    """Return the row of a run that was judged; a PASS with doubts is DOUBTFUL."""
    verdict, reasons = result['verdict'], result['reasons']
    doubts = doubts_of(result) if verdict == 'PASS' else []
    return Row(
        name,
        DOUBTFUL if doubts else verdict,
        tuple([*doubts, *reasons][:_REASONS]),
        result['bag']['sha256'],
        result['start_ns'],
        result.get('recorded'),
        result['coverage']['duration_s'],
        result['coverage']['evaluated_s'],
        tuple(from_result(name, result)),
        result=f'runs/{key}.json',
    )


def broken_row(name: str, error: str) -> Row:
    """Return the row of a run that could not be read."""
    return Row(name, BROKEN, (error,))


def unjudged_row(name: str, why: str) -> Row:
    """Return the row of a run that was not judged for a reason outside the run."""
    return Row(name, NOT_JUDGED, (why,))


def in_order(rows: Iterable[Row]) -> list[Row]:
    """Return the rows by start time, each recording once; those without a result last, by name.

    Two are copies if they have one result: of equal files one may lack what another one has.
    """
    first: dict[str, Row] = {}
    copies: dict[str, list[str]] = {}
    for row in sorted(rows, key=lambda r: r.name):
        key = row.result or f'unread {row.name}'
        copies.setdefault(key, []).append(row.name)
        first.setdefault(key, row)
    single = [_with_copies(row, copies[key][1:]) for key, row in first.items()]
    return sorted(single, key=lambda r: (not r.sha256, r.start_ns, r.sha256, r.name))


def _with_copies(row: Row, names: Sequence[str]) -> Row:
    return replace(row, also=tuple(names)) if names else row
