"""The statement of a campaign for JSON: hours, failures, MTBF, success, trend.

The same runs give the same statement, by whatever workers and in whatever order. Hours are those
that could be judged; runs that are INCONCLUSIVE, DOUBTFUL or BROKEN are counted, but not as a
success. While
a run is NOT_JUDGED its verdict is unknown: then nothing is stated but what was seen so far.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from itertools import accumulate

from ugv_acceptance import __version__
from ugv_acceptance.campaign.failures import Failure, counts
from ugv_acceptance.campaign.groups import comparison
from ugv_acceptance.campaign.run_table import NOT_JUDGED, VERDICTS, Row
from ugv_acceptance.studies.reliability import (
    Bounded,
    availability,
    demonstrated_mtbf,
    hours_still_to_run,
    hours_to_demonstrate,
    mtbf,
    proportion,
    trend,
)
from ugv_acceptance.type_aliases import Json

# Version of the layout; changes where a reader of campaigns must change.
CAMPAIGN_VERSION = 3
# What a campaign states; None while it cannot.
STATED = (
    'mtbf_h',
    'endurance',
    'availability',
    'success',
    'trend',
    'requirement',
    'comparison',
)
# A failure at the very start is dated here (s): the power law has no rate at zero.
_EARLIEST = 1.0


@dataclass(frozen=True, slots=True)
class Question:
    """The options of a statement: confidence, MTBF (h) to demonstrate, how the test ended, groups.

    `groups` pairs the names of two groups with the patterns of their runs' names.
    """

    confidence: float = 0.8
    required: float | None = None
    failure_terminated: bool = False
    groups: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Origin:
    """The configuration and criteria that the runs were judged by: names and hashes."""

    robot: str
    config_sha256: str
    criteria: str
    criteria_sha256: str | None


def statement(
    rows: Sequence[Row], failures: Sequence[Failure], question: Question, origin: Origin
) -> Json:
    """Return the statement on `rows` (in order) and their failures, those of a log included.

    While a run is NOT_JUDGED, `no_statement` says so and what would be stated is None.
    """
    judged, recorded = (
        sum(getattr(r, f) for r in rows) / 3600.0 for f in ('judged_s', 'duration_s')
    )
    times = failure_times(rows, failures)
    by_failure = question.failure_terminated and bool(times)
    hours = times[-1] if by_failure else judged
    said: Json = {
        'version': CAMPAIGN_VERSION,
        'software': __version__,
        **asdict(origin),
        'confidence': question.confidence,
        'runs': _runs(rows),
        'no_statement': no_statement(rows),
        'hours': {'recorded': recorded, 'judged': judged, 'counted': hours},
        'failures': {
            'chargeable': len(times),
            'not_chargeable': len(failures) - len(times),
            **counts(failures),
            'each': [f.json() for f in failures],
        },
        **dict.fromkeys(STATED),
        'each_run': [row.json() for row in rows],
    }
    if said['no_statement'] is None:
        shown = mtbf(hours, len(times), question.confidence, failure_terminated=by_failure)
        said |= {
            'mtbf_h': {**bounded(shown), 'ended_by': 'failure' if by_failure else 'time'},
            'endurance': _endurance(rows, failures, question.confidence),
            'availability': _availability(
                hours, failures, question.confidence, by_failure=by_failure
            ),
            'success': _success(rows, question.confidence),
            'trend': _trend(times, hours, question.confidence, by_failure=by_failure),
            'requirement': _requirement(question, hours, len(times), shown),
            'comparison': comparison(rows, failures, question.groups, question.confidence),
        }
    return said


def no_statement(rows: Sequence[Row]) -> str | None:
    """Return why nothing can be stated, None where a statement is possible."""
    count = sum(row.verdict == NOT_JUDGED for row in rows)
    were = 'run was' if count == 1 else 'runs were'
    return f'{count} {were} not judged: no statement' if count else None


def failure_times(rows: Sequence[Row], failures: Sequence[Failure]) -> list[float]:
    """Return the judged time (h, over the whole campaign) of each chargeable failure, in order.

    Within a run the judged time is taken to be spread evenly.
    """
    before = accumulate((row.judged_s for row in rows), initial=0.0)
    starts = {row.name: (start, row) for start, row in zip(before, rows, strict=False)}
    times = []
    for failure in failures:
        if failure.chargeable:
            start, row = starts[failure.run]
            share = min(1.0, failure.at_s / row.duration_s) if row.duration_s > 0.0 else 0.0
            times.append(max(_EARLIEST, start + share * row.judged_s) / 3600.0)
    return sorted(times)


def bounded(number: Bounded) -> Json:
    """Return a number with its confidence bounds for JSON; a missing bound is None."""
    return {k: _finite(v) for k, v in asdict(number).items()}


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _runs(rows: Sequence[Row]) -> Json:
    words = [row.verdict for row in rows]
    return {
        'total': len(rows),
        **{word: words.count(word) for word in VERDICTS},
        'copies': sum(len(row.also) for row in rows),
    }


def _endurance(rows: Sequence[Row], failures: Sequence[Failure], confidence: float) -> Json | None:
    """Return the MTBF (h) that the longest run demonstrates by itself; None without such a run."""
    row = max(rows, key=lambda r: r.judged_s, default=None)
    if row is None or row.judged_s <= 0.0:
        return None
    hours, failed = row.judged_s / 3600.0, sum(f.chargeable for f in failures if f.run == row.name)
    shown = demonstrated_mtbf(hours, failed, confidence)
    return {'run': row.name, 'hours': hours, 'failures': failed, 'demonstrated_h': shown}


def _availability(
    hours: float, failures: Sequence[Failure], confidence: float, *, by_failure: bool
) -> Json:
    """Return the availability by repairs of known duration, and the number of unknown ones."""
    counted = [f for f in failures if f.chargeable]
    known = [f.repair_h for f in counted if f.repair_h is not None]
    repaired = len(known) == len(counted)
    shown = availability(hours, len(known), sum(known), confidence, failure_terminated=by_failure)
    empty = replace(shown, value=None, low=0.0, high=1.0, demonstrated=0.0)
    return {
        **bounded(shown if repaired else empty),
        'down_h': sum(known),
        'repairs_known': len(known),
        'repairs_unknown': len(counted) - len(known),
    }


def _success(rows: Sequence[Row], confidence: float) -> Json:
    """Return the share of runs that passed, and the share if all had that did not FAIL."""
    words = [row.verdict for row in rows]
    passed = words.count('PASS')
    at_best = len(words) - words.count('FAIL')
    return {
        **bounded(proportion(passed, len(words), confidence)),
        'passed': passed,
        'runs': len(words),
        'if_unclear_had_passed': bounded(proportion(at_best, len(words), confidence)),
    }


def _trend(times: Sequence[float], hours: float, confidence: float, *, by_failure: bool) -> Json:
    found = trend(times, hours, confidence, failure_terminated=by_failure)
    # A constant rate that the data reject at this confidence makes the MTBF's bounds doubtful.
    constant = found is None or min(found.p_growth, found.laplace_p) >= 1.0 - confidence
    return {
        'power_law': None if found is None else asdict(found),
        'constant_rate_plausible': constant,
        'failure_times_h': list(times),
    }


def _requirement(question: Question, hours: float, failures: int, found: Bounded) -> Json | None:
    """Return whether an MTBF is demonstrated, excluded or open, and the hours still missing."""
    required, confidence = question.required, question.confidence
    if required is None:
        return None
    verdict = 'INCONCLUSIVE'
    if found.demonstrated >= required:
        verdict = 'PASS'
    elif found.high < required:
        verdict = 'FAIL'
    return {
        'mtbf_h': required,
        'verdict': verdict,
        'demonstrated_h': found.demonstrated,
        'hours_without_failure': hours_to_demonstrate(required, 0, confidence),
        'hours_with_these_failures': hours_to_demonstrate(required, failures, confidence),
        'still_to_run_h': 0.0
        if verdict == 'PASS'
        else hours_still_to_run(required, hours, failures, confidence),
        'still_to_run_after_one_more_failure_h': hours_still_to_run(
            required, hours, failures + 1, confidence
        ),
    }
