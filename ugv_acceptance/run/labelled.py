"""Seeded runs with known truth: what happened, what was said before it, and what for nothing."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.alerts import LEVELS, Alert
from ugv_acceptance.evaluation.prediction import margins_ahead, time_to_saturation, time_to_tip
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.rows import MarginRows
from ugv_acceptance.evaluation.samples import Batch, ImuColumns, JointStateColumns, PayloadColumns
from ugv_acceptance.model.blocks import Floats
from ugv_acceptance.run.catalogue import Case
from ugv_acceptance.run.messages import EPOCH
from ugv_acceptance.run.record import SATURATED_FOR, lasting, play
from ugv_acceptance.simulation.corruption import DELAY, JITTER, Corruption, overload
from ugv_acceptance.simulation.faults import fault_of
from ugv_acceptance.simulation.repertoire import KINDS, SECONDS
from ugv_acceptance.simulation.scenario import ImuLog, JointLog, Recording

TIP, SATURATION = 'tip-over', 'saturation'
# A warning counts up to this long (s) after the event: the alert's own delay is part of it.
TOO_LATE = 0.3
# Prediction: how far ahead (s), from how short a time left (s), held how long (s).
AHEAD, SOON, HELD = 0.5, 1.0, 0.1
# Kinds of events with how many runs of each hundred; what is faulty is a kind of its own.
MIX = {'tilt': 20, 'swing': 20, 'reach': 16, 'grasp': 16, 'dash': 12}
FAULTY = (
    ('tilt', 'dead', 'imu'),
    ('swing', 'frozen-encoder', 'shoulder_joint'),
    ('reach', 'nan', 'joint_states'),
    ('grasp', 'heavy-payload', ''),
    ('reach', 'weak-motor', 'shoulder_joint'),
    ('tilt', 'identity-orientation', ''),
    ('tilt', 'dropped', ''),
    ('swing', 'late', ''),
)


@dataclass(frozen=True, slots=True)
class Event:
    """Something critical that really happened at `time` (s), and what was said of it.

    `warned`, `alarmed` and `predicted` (s) are when the WARN, the critical alert and the prediction
    came that were there when it happened; infinite where none was.
    """

    kind: str
    subject: str
    time: float
    warned: float = np.inf
    alarmed: float = np.inf
    predicted: float = np.inf


@dataclass(frozen=True, slots=True)
class Labelled:
    """A run with its truth: `events` in order, and critical alerts and predictions without one.

    `for_nothing` lists (level, code, subject) of critical alerts with which no event came.
    """

    kind: str
    seed: int
    seconds: float
    events: tuple[Event, ...]
    for_nothing: tuple[tuple[str, str, str], ...]
    predictions_for_nothing: int


def cases(config: Config, count: int, seed: int) -> Iterator[tuple[str, int, Case]]:
    """Yield about `count` cases (kind, seed, case) in which something may happen."""
    robot = config.settings.robot
    shares = [(kind, '', '', n) for kind, n in MIX.items()]
    shares += [(k, f, s, (100 - sum(MIX.values())) // len(FAULTY)) for k, f, s in FAULTY]
    number = seed
    for kind, fault, subject, share in shares:
        for _ in range(max(1, round(share * count / 100))):
            number += 1
            scenario = KINDS[kind](robot, np.random.default_rng(number), SECONDS[kind])
            start = 0.0 if fault in {'heavy-payload', 'weak-motor'} else 3.0
            faults = (fault_of(fault, subject, start),) if fault else ()
            yield f'{kind}+{fault}' if fault else kind, number, Case(scenario, faults)


def work_cases(config: Config, hours: float, seed: int) -> Iterator[tuple[str, int, Case]]:
    """Yield quiet work, `hours` in all, in runs of ten minutes."""
    for k in range(max(1, round(hours * 6))):
        number = 1_000_000 + seed + k
        made = KINDS['work'](config.settings.robot, np.random.default_rng(number), 600.0)
        yield 'work', number, Case(made)


def label(config: Config, kind: str, seed: int, case: Case) -> Labelled:
    """Simulate and evaluate a case; return what happened and what was said."""
    (recording,) = play(config, case, seed, length=np.inf)
    evaluator = RecordedEvaluator(config.settings)
    evaluator.start(EPOCH)
    rows = evaluator.batch(batch_of(config, recording, case, seed))
    evaluator.finish(EPOCH + round(case.scenario.duration * 1e9))
    log = evaluator.watch.log
    ahead = predicted(config, recording, rows, case)
    events = tuple(_said(event, log, ahead) for event in events_of(config, recording))
    return Labelled(
        kind,
        seed,
        case.scenario.duration,
        events,
        tuple(_for_nothing(log, events)),
        0 if events else _count(ahead),
    )


def events_of(config: Config, recording: Recording) -> Iterator[Event]:
    """Yield what really happened: the tip-over, and the first saturation of each judged joint."""
    truth, settings = recording.truth, config.settings
    pairs = zip(settings.robot.joint_names, settings.limits.torque, strict=True)
    tipped = truth.tipped_at
    for j, (name, limit) in enumerate(pairs):
        at = lasting(truth.saturated[:, j], truth.stamp, SATURATED_FOR)
        # Once it lies on its side, anything may saturate.
        if np.isfinite(limit) and at < tipped:
            yield Event(SATURATION, name, at)
    if np.isfinite(tipped):
        yield Event(TIP, 'robot', tipped)


def batch_of(config: Config, recording: Recording, case: Case, seed: int) -> Batch:
    """Return what the evaluation takes of a recording: its messages as they arrive, as columns."""
    rng = np.random.default_rng(seed)
    corruption = Corruption(case.faults, config.settings.robot.joint_names)
    joints, imu = corruption.joints(recording.joints), corruption.imu(recording.imu)
    names = tuple(j.topic_name for j in config.settings.joints)
    sign, offset = np.array([(j.sign, j.offset) for j in config.settings.joints]).T
    k, due = _arrivals(corruption, 'joint_states', joints, rng)
    raw = (joints.position[k] - offset) / sign
    states = JointStateColumns(
        names, due, _ns(joints.stamp[k]), raw, joints.velocity[k] / sign, joints.effort[k]
    )
    k, due = _arrivals(corruption, 'imu', imu, rng)
    zeros = np.zeros(len(k))
    vectors = imu.orientation[k], imu.angular_velocity[k], imu.linear_acceleration[k]
    measured = ImuColumns('imu_link', due, _ns(imu.stamp[k]), *vectors, zeros, zeros, zeros)
    return Batch([states], [measured], [_payloads(config, recording, case)])


def _arrivals(
    corruption: Corruption, source: str, log: JointLog | ImuLog, rng: np.random.Generator
) -> tuple[
    np.ndarray[tuple[int, ...], np.dtype[np.intp]], np.ndarray[tuple[int, ...], np.dtype[np.int64]]
]:
    """Return the rows of a log in the order in which they arrive, and when (ns)."""
    if not corruption.faults:
        rows = np.arange(len(log.stamp), dtype=np.intp)
        return rows, _ns(log.stamp + DELAY + JITTER * rng.random(len(rows)))
    came = sorted(
        (due, k)
        for k, time in enumerate(log.stamp.tolist())
        for due in corruption.arrivals(source, time, rng)
    )
    rows = np.array([k for _, k in came], dtype=np.intp)
    return rows, _ns(np.array([due for due, _ in came]))


def _ns(time: Floats) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    return EPOCH + np.round(time * 1e9).astype(np.int64)


def _payloads(config: Config, recording: Recording, case: Case) -> PayloadColumns:
    factor = overload(case.faults)
    times = np.array([time for time, _ in recording.payload])
    mass = np.array([p.mass / factor for _, p in recording.payload])
    com = np.array([p.cog for _, p in recording.payload], dtype=np.float64)
    frame = config.topics.payload.frame_id or ''
    return PayloadColumns(frame, _ns(times), _ns(times), mass, com)


def predicted(
    config: Config, recording: Recording, rows: MarginRows, case: Case
) -> dict[tuple[str, str], list[tuple[float, float]]]:
    """Return when (from, to in s) each event was predicted: (kind, subject) -> spans."""
    known = np.flatnonzero(rows.known)[::4]
    time = (rows.time[known] - EPOCH) / 1e9
    if not len(time):
        return {}
    settings, log = config.settings, recording.imu
    gyro = log.angular_velocity[np.clip(np.searchsorted(log.stamp, time), 0, len(log.stamp) - 1)]
    omega = gyro @ np.array(settings.imu.mounting).T
    spans: dict[tuple[str, str], list[tuple[float, float]]] = {}
    load = np.searchsorted([t for t, _ in recording.payload], time, side='right') - 1
    soon = np.zeros((len(time), 1 + len(settings.robot.joint_names)), dtype=np.bool_)
    for number, (_, payload) in enumerate(recording.payload):
        k = np.flatnonzero(load == number)
        if not len(k):
            continue
        at = known[k]
        carried = replace(payload, mass=payload.mass / overload(case.faults))
        then = margins_ahead(
            settings.robot, rows.q[at], rows.qd[at], rows.gravity[at], omega[k], AHEAD, carried
        )
        limits = settings.limits
        soon[k, 0] = time_to_tip(rows.angle[at], then.angle, 0.0, AHEAD) < SOON
        left = time_to_saturation(rows.torque[at], then.torque, np.array(limits.torque), AHEAD)
        soon[k, 1:] = left < SOON
    subjects = [(TIP, 'robot'), *((SATURATION, n) for n in settings.robot.joint_names)]
    for column, subject in zip(soon.T, subjects, strict=True):
        spans[subject] = _spans(column, time)
    return spans


def _spans(
    on: np.ndarray[tuple[int, ...], np.dtype[np.bool_]], time: Floats
) -> list[tuple[float, float]]:
    """Return the spans in which `on` held for HELD at least; dated when that was known."""
    edges = np.flatnonzero(np.diff(on.astype(np.int8), prepend=0, append=0))
    pairs = zip(edges[::2], edges[1::2] - 1, strict=True)
    return [(float(time[a] + HELD), float(time[b])) for a, b in pairs if time[b] - time[a] >= HELD]


def _said(
    event: Event, log: Sequence[Alert], ahead: dict[tuple[str, str], list[tuple[float, float]]]
) -> Event:
    code = 'TIP_OVER' if event.kind == TIP else 'TORQUE_LIMIT'
    about = [
        alert
        for alert in log
        if (alert.rule.code == code and (event.kind == TIP or alert.rule.subject == event.subject))
        or LEVELS[alert.rule.level] == 'STALE'
        or alert.rule.code in {'INPUT_INVALID', 'IMU_INCONSISTENT'}
    ]
    at = EPOCH + round(event.time * 1e9)
    there = [a for a in about if a.start <= at + TOO_LATE * 1e9 and (a.end is None or a.end >= at)]
    first = {
        critical: min(
            (
                (a.start - EPOCH) / 1e9
                for a in there
                if (LEVELS[a.rule.level] != 'WARN') is critical
            ),
            default=np.inf,
        )
        for critical in (False, True)
    }
    spans = ahead.get((event.kind, event.subject), [])
    told = min((a for a, b in spans if a <= event.time and b >= event.time - 0.5), default=np.inf)
    return replace(event, warned=min(first.values()), alarmed=first[True], predicted=told)


def _for_nothing(log: Sequence[Alert], events: Sequence[Event]) -> Iterator[tuple[str, str, str]]:
    """Yield the critical alerts of a run in which nothing critical happened."""
    if events:
        return
    for alert in log:
        level = LEVELS[alert.rule.level]
        if level != 'WARN':
            yield level, alert.rule.code, alert.rule.subject


def _count(ahead: dict[tuple[str, str], list[tuple[float, float]]]) -> int:
    return sum(len(spans) for spans in ahead.values())
