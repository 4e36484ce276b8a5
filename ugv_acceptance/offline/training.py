"""Puts the records of operators' drills into a result, and says what each is worth for this run.

A record tells that somebody passed a drill. Whether it tells anything of this run is another
question: of which robot it was, when, whose, and whether anybody edited it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path

from ugv_acceptance.evaluation.criteria.criteria import INCONCLUSIVE, PASS, THIS_ROBOT
from ugv_acceptance.type_aliases import Json

# Days after which a drill is old.
LASTS = 365
_DAY = 86400.0
# A recording that begins before (ns, the year 2000) has a clock that tells no date.
_NO_DATE = 946_684_800_000_000_000


@dataclass(frozen=True, slots=True)
class TrainingRecord:
    """The record of a drill (schema/drill.schema.json), read from a file with this hash.

    `started` is when the drill began, `edited` whether its content is not what the drill wrote.
    """

    path: Path
    sha256: str
    record: Json
    started: datetime
    edited: bool


# Said of a run whose criteria ask for a trained operator.
_WHO: Json = {
    'what': 'who operated the robot',
    'why': "nobody entered it (--identity operator=NAME), so a record may be another person's",
    'seconds': None,
}


def with_training(
    result: Json, records: Sequence[TrainingRecord], required: str | None, start_ns: int
) -> Json:
    """Return the parts of a result that change by the records of drills.

    `required` is ANY_ROBOT or THIS_ROBOT where the criteria ask for a trained operator: without a
    record that counts a PASS becomes INCONCLUSIVE. `start_ns` is when the recording begins.
    """
    if not records and required is None:
        return {}
    entries = [_entry(one, result, start_ns) for one in records]
    counting = [one for one in entries if one['counts']]
    if required == THIS_ROBOT:
        counting = [one for one in counting if one['same_robot']]
    met = None if required is None else bool(counting)
    found: Json = {'operator_training': {'required': required, 'met': met, 'records': entries}}
    if met and result['identity'].get('operator') is None:
        found['not_checked'] = [*result['not_checked'], _WHO]
    if met is not False:
        return found
    reason = f'operator training: {_why_not(entries)}'
    if result['verdict'] == PASS:
        return {**found, 'verdict': INCONCLUSIVE, 'reasons': [reason]}
    return {**found, 'reasons': [*result['reasons'], reason]}


def _why_not(entries: Sequence[Json]) -> str:
    if not entries:
        return 'the criteria require the record of a drill (--drill), none was given'
    said = [f'{one["operator"]}: {"; ".join([one["outcome"], *one["remarks"]])}' for one in entries]
    return f'no record shows a trained operator ({", ".join(said)})'


def _entry(one: TrainingRecord, result: Json, start_ns: int) -> Json:
    """Return a record as it stands in the result. `counts`: it shows that its operator passed."""
    record = one.record
    robot, judged = record['robot'], result['robot']
    same_robot = robot['sha256'] == judged['sha256']
    days = _days_before(one.started, start_ns)
    speaks_against = [
        *(['edited: this is not what the drill wrote, so it counts for nothing'] * one.edited),
        *(['answered by a script, not by a person'] * record['scripted']),
        *_whose(record['operator'], result['identity'].get('operator')),
        *_when(days),
    ]
    remarks = speaks_against if same_robot else [*speaks_against, _other_robot(robot, judged)]
    return {
        'file': str(one.path),
        'file_sha256': one.sha256,
        'counts': record['outcome'] == 'passed' and not speaks_against,
        'edited': one.edited,
        'same_robot': same_robot,
        'days_before_run': days,
        'remarks': remarks,
        **{key: record[key] for key in _COPIED},
    }


# What of a record stands in the result as it is.
_COPIED = (
    'operator',
    'started',
    'minutes',
    'robot',
    'software',
    'seed',
    'outcome',
    'to_repeat',
    'not_done',
    'situations',
)


def _days_before(started: datetime, start_ns: int) -> float | None:
    """Return how long (days) before a recording a drill was; None if its clock tells no date."""
    if start_ns < _NO_DATE:
        return None
    began = datetime.fromtimestamp(start_ns // 10**9, timezone.utc)
    return round((began - started).total_seconds() / _DAY, 6)


def _when(days: float | None) -> list[str]:
    if days is None:
        return ['the recording does not tell its date: nobody knows whether the drill was before']
    if days < 0.0:
        return ['the drill was after the run']
    return [f'old: the drill was {days:.0f} days before the run'] if days > LASTS else []


def _whose(drilled: str, entered: object) -> list[str]:
    if not entered or _plain(drilled) == _plain(str(entered)):
        return []
    return [f'of another person: the operator entered for this run is {entered}']


def _plain(name: str) -> str:
    return ' '.join(name.casefold().split())


def _other_robot(robot: Json, judged: Json) -> str:
    said, here = robot['sha256'][:12], judged['sha256'][:12]
    if robot['name'] == judged['name']:
        return f'another configuration of this robot ({said}; this run: {here})'
    return f'another robot: {robot["name"]} ({said}); this run: {judged["name"]} ({here})'
