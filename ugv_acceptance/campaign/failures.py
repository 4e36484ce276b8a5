"""The failures of a campaign: from the results of its runs and from the failure log.

Class, impact and repairability are those of Carlson and Murphy's taxonomy. An alert shows only the
effect of a failure, so the class derived from it is a suspicion; a log entry replaces it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from ugv_acceptance.campaign.failure_log import (
    FIELD,
    NON_TERMINAL,
    TERMINAL,
    UNKNOWN,
    Entry,
)
from ugv_acceptance.evaluation.alerts.failure_source import FailureSource
from ugv_acceptance.evaluation.alerts.messages import ALERTS
from ugv_acceptance.type_aliases import Json

# Levels at which an alert counts as a failure; a warning does not.
CRITICAL = frozenset({'ERROR', 'STALE'})
# A measured effort of this share of the limit has reached it: the motor is at its end.
REACHED = 0.999
# Meanings of an effort (of the result's model check) by which it says nothing about a limit.
NO_TORQUE = frozenset({'scaled', 'none', 'constant'})
# Safeguard -> the alerts that show the same failure, and where to look first without one.
SHOWN_BY: dict[str, tuple[tuple[str, ...], FailureSource]] = {
    'tipping': (('TIP_OVER',), FailureSource.INTERACTION),
    'ground': (('TIP_TREND', 'TIP_OVER'), FailureSource.INTERACTION),
    'torque_limit': (('TORQUE_LIMIT',), FailureSource.EFFECTOR),
    'measured_effort': (('EFFORT_LIMIT',), FailureSource.EFFECTOR),
    'chassis_acceleration': (
        ('TIP_OVER', 'TIP_MOVING', 'ACCELERATION', 'TRACK_LIFT'),
        FailureSource.INTERACTION,
    ),
}


@dataclass(frozen=True, slots=True)
class Failure:
    """A failure in a run: when (s since its start), what, and its class in the taxonomy.

    `times` is how often the alert came in this run, about which `subjects`. `origin` is alert, log,
    or both, or verdict. Only `chargeable` failures count.
    """

    run: str
    at_s: float
    what: str
    source: str
    impact: str
    repairability: str
    origin: str
    alert: str | None = None
    subjects: tuple[str, ...] = ()
    times: int = 1
    repair_h: float | None = None
    chargeable: bool = True

    @property
    def path(self) -> str:
        """Its place in the taxonomy, such as "physical / effector"."""
        return FailureSource(self.source).path if self.source != UNKNOWN else UNKNOWN

    def json(self) -> Json:
        """Return the failure for JSON."""
        return {**asdict(self), 'class': self.path}


def from_result(run: str, result: Json) -> list[Failure]:
    """Return the failures that a run's result shows: those of its alerts, then of its verdict.

    Critical alerts are one failure per code, whatever the subjects: a fall passes several edges, a
    fault comes and goes, and that is one cause unless a log says more. So are measured efforts at
    or beyond a limit. A failure still active at the end is terminal. One that ended within the run
    was repaired, or went by itself, in the field; of others nothing is known. A safeguard that
    failed without such an alert is a failure of its own.
    """
    groups: dict[str, list[Json]] = {}
    for alert in result['alerts']:
        if alert['level'] in CRITICAL or _saturates(alert, result):
            groups.setdefault(alert['code'], []).append(alert)
    return [
        *(_from_group(run, code, group) for code, group in groups.items()),
        *_from_safeguards(run, result, groups),
    ]


def _saturates(alert: Json, result: Json) -> bool:
    """Return whether an alert says that a measured effort reached the limit of its joint."""
    limit = result['torque'].get(alert['subject'], {}).get('limit')
    if alert['code'] != 'EFFORT_LIMIT' or limit is None or alert['peak'] is None:
        return False
    joint = result['model_check']['joints'].get(alert['subject'], {})
    reached: bool = alert['peak'] >= REACHED * limit
    return reached and joint.get('meaning') not in NO_TORQUE


def _from_safeguards(run: str, result: Json, shown: Mapping[str, object]) -> Iterator[Failure]:
    for safeguard in result['safeguards']:
        if safeguard['verdict'] != 'FAIL' or safeguard['waived'] is not None:
            continue
        codes, source = SHOWN_BY.get(safeguard['name'], ((), None))
        if not shown.keys() & set(codes):
            near = [a['start_s'] for a in result['alerts'] if a['code'] in codes]
            suspect = UNKNOWN if source is None else source.value
            at, what = min(near, default=0.0), safeguard['reasons'][0]
            yield Failure(run, at, what, suspect, UNKNOWN, UNKNOWN, 'verdict')


def _from_group(run: str, code: str, group: Sequence[Json]) -> Failure:
    lasting = any(alert['end_s'] is None for alert in group)
    text = ALERTS.get(code)
    return Failure(
        run,
        min(alert['start_s'] for alert in group),
        group[0]['message'],
        text.suspect.value if text else UNKNOWN,
        TERMINAL if lasting else NON_TERMINAL,
        UNKNOWN if lasting else FIELD,
        'alert',
        code,
        tuple(sorted({alert['subject'] for alert in group})),
        len(group),
    )


def with_log(
    failures: Sequence[Failure], entries: Sequence[Entry], runs: Mapping[str, str]
) -> list[Failure]:
    """Return the failures completed by a log: an entry that names an alert adds to its failure.

    `runs` maps every name of a run, those of its copies too, to the one in use. Raises BadConfig
    where an entry's run is not one of `runs`, or its alert did not come in that run.
    """
    merged = list(failures)
    for entry in entries:
        run = entry.run_of(runs)
        told = [k for k, f in enumerate(merged) if f.run == run and f.alert == entry.alert]
        if entry.alert is None:
            merged.append(_from_entry(run, entry))
        elif not told:
            raise entry.wrong('alert', f'a critical alert of this run, got {entry.alert}')
        else:
            merged[told[0]] = _told(merged[told[0]], entry)
    return sorted(merged, key=lambda f: (f.run, f.at_s, f.alert or '', f.subjects, f.what))


def _from_entry(run: str, entry: Entry) -> Failure:
    return Failure(
        run,
        entry.at_s or 0.0,
        entry.what,
        entry.source,
        entry.impact,
        entry.repairability,
        'log',
        repair_h=entry.repair_h,
        chargeable=entry.chargeable,
    )


def _told(failure: Failure, entry: Entry) -> Failure:
    """Return an alert's failure with the fields of a log entry; fields left out stay."""
    said = {
        'source': entry.source,
        'impact': entry.impact,
        'repairability': entry.repairability,
    }
    changes: Mapping[str, Any] = {k: v for k, v in said.items() if v != UNKNOWN}
    return replace(
        failure,
        **changes,
        what=entry.what or failure.what,
        at_s=failure.at_s if entry.at_s is None else entry.at_s,
        origin='alert and log',
        repair_h=entry.repair_h,
        chargeable=entry.chargeable,
    )


def counts(failures: Sequence[Failure]) -> Json:
    """Return the numbers of chargeable failures by class, impact and repairability."""
    counted = [f for f in failures if f.chargeable]
    keys = {
        'class': [f.path for f in counted],
        'impact': [f.impact for f in counted],
        'repairability': [f.repairability for f in counted],
        'origin': [f.origin for f in counted],
    }
    return {name: dict(_counted(values)) for name, values in keys.items()}


def _counted(values: Sequence[str]) -> Iterator[tuple[str, int]]:
    for value in sorted(set(values)):
        yield value, values.count(value)
