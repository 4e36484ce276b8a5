"""Seeded runs labelled with the truth: critical events, alerts before them, and false alerts."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, Alert
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.samples import Batch, ImuColumns, JointStateColumns, PayloadColumns
from ugv_acceptance.model.attitude import up_from_orientation
from ugv_acceptance.model.stability import margins
from ugv_acceptance.run.catalogue import Case
from ugv_acceptance.run.messages import EPOCH
from ugv_acceptance.run.record import SATURATED_FOR, lasting, play
from ugv_acceptance.simulation.corruption import DELAY, JITTER, Corruption, overload
from ugv_acceptance.simulation.faults import PHYSICAL, fault_of
from ugv_acceptance.simulation.repertoire import KINDS, SECONDS
from ugv_acceptance.simulation.scenario import ImuLog, JointLog, Recording
from ugv_acceptance.type_aliases import Floats

TIP, SATURATION = 'tip-over', 'saturation'
# Alerts that announce each kind of event: the level is near, or is predicted.
TELL = {
    TIP: ('TIP_OVER', 'TIP_AHEAD'),
    SATURATION: ('TORQUE_LIMIT', 'TORQUE_AHEAD', 'EFFORT_LIMIT', 'MOTOR_WEAK'),
}
AHEAD = ('TIP_AHEAD', 'TORQUE_AHEAD')
# Alerts, beside STALE ones, that say that margins are not known or wrong.
UNKNOWN = ('INPUT_INVALID', 'IMU_INCONSISTENT', 'IMU_GRAVITY', 'POSITION_LEAP', 'ENCODER_FROZEN')
# A warning counts up to this long (s) after the event: the alert's own delay is part of it.
TOO_LATE = 0.5
# An impact: within so long (s) before the event the base was accelerated by more than m/s2 (mean of
# so many s), or a load cost more than rad of tilt between two samples.
BEFORE, SHOVE, MEAN, JOLT = 0.5, 1.0, 0.1, 0.0175
# Kinds of events with how many runs of each hundred; what is faulty is a kind of its own.
MIX = {'tilt': 18, 'swing': 18, 'reach': 14, 'grasp': 12, 'snatch': 4, 'dash': 10, 'climb': 6}
FAULTY = (
    ('tilt', 'dead', 'imu'),
    ('swing', 'frozen-encoder', 'shoulder_joint'),
    ('reach', 'nan', 'joint_states'),
    ('grasp', 'heavy-payload', ''),
    ('reach', 'weak-motor', 'shoulder_joint'),
    ('tilt', 'identity-orientation', ''),
    ('tilt', 'dropped', ''),
    ('swing', 'late', ''),
    ('swing', 'second-publisher', 'joint_states'),
)
# Rates (Hz) of joints and IMU in quiet work: those of the live simulator.
JOINTS, IMU = 100.0, 200.0


@dataclass(frozen=True, slots=True)
class Event:
    """A critical event that really happened at `time` (s), and the alerts about it.

    `warned`, `alarmed` and `predicted` (s) are when the first alert, the critical one and the
    prediction came that were there when it happened; infinite where none was. `impact` says that
    something hit it: see BEFORE.
    """

    kind: str
    subject: str
    time: float
    warned: float = np.inf
    alarmed: float = np.inf
    predicted: float = np.inf
    impact: bool = False


@dataclass(frozen=True, slots=True)
class Labelled:
    """A run with its true `events`, in order, and its false alerts.

    `for_nothing` lists (level, code, subject) of critical alerts with which no event came,
    `warnings` those of level WARN.
    """

    kind: str
    seed: int
    seconds: float
    events: tuple[Event, ...]
    for_nothing: tuple[tuple[str, str, str], ...]
    warnings: tuple[tuple[str, str, str], ...]

    @property
    def predictions_for_nothing(self) -> int:
        """The number of predictions after which no event came."""
        return sum(code in AHEAD for _, code, _ in self.warnings)


def cases(config: Config, count: int, seed: int) -> Iterator[tuple[str, int, Case]]:
    """Yield about `count` cases (kind, seed, case) in which an event may happen."""
    robot = config.settings.robot
    shares = [(kind, '', '', n) for kind, n in MIX.items()]
    shares += [(k, f, s, (100 - sum(MIX.values())) // len(FAULTY)) for k, f, s in FAULTY]
    number = seed
    for kind, fault, subject, share in shares:
        for _ in range(max(1, round(share * count / 100)) if count else 0):
            number += 1
            scenario = KINDS[kind](robot, np.random.default_rng(number), SECONDS[kind])
            start = 0.0 if fault in PHYSICAL else 3.0
            faults = (fault_of(fault, subject, start),) if fault else ()
            yield f'{kind}+{fault}' if fault else kind, number, Case(scenario, faults)


def work_cases(config: Config, hours: float, seed: int) -> Iterator[tuple[str, int, Case]]:
    """Yield quiet work, `hours` in all, in runs of ten minutes."""
    for k in range(round(hours * 6)):
        number = 1_000_000 + seed + k
        made = KINDS['work'](config.settings.robot, np.random.default_rng(number), 600.0)
        yield 'work', number, Case(replace(made, joint_rate=JOINTS, imu_rate=IMU))


def label(config: Config, kind: str, seed: int, case: Case) -> Labelled:
    """Simulate and evaluate a case; return its events and its alerts."""
    (recording,) = play(config, case, seed, length=np.inf)
    evaluator = RecordedEvaluator(config.settings)
    evaluator.start(EPOCH)
    evaluator.batch(batch_of(config, recording, case, seed))
    evaluator.finish(EPOCH + round(case.scenario.duration * 1e9))
    log = evaluator.watch.log
    events = tuple(_said(event, log) for event in events_of(config, recording))
    for_nothing, warnings = _for_nothing(log, events)
    return Labelled(kind, seed, case.scenario.duration, events, for_nothing, warnings)


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
        yield Event(TIP, 'robot', tipped, impact=hit(config, recording, tipped))


def hit(config: Config, recording: Recording, time: float) -> bool:
    """Return whether an impact came shortly before a time (s), by the truth: see BEFORE."""
    truth, joints, imu = recording.truth, recording.joints, recording.imu
    rows = np.flatnonzero((truth.stamp >= time - BEFORE - MEAN) & (truth.stamp <= time))
    half = round(MEAN / 2.0 * recording.scenario.joint_rate)
    place = truth.position[rows]
    if len(rows) > 2 * half:
        shove = place[2 * half :] - 2.0 * place[half:-half] + place[: -2 * half]
        if (np.linalg.norm(shove, axis=1) > SHOVE * (MEAN / 2.0) ** 2).any():
            return True
    # Only the load differs between the two margins of a pair of samples.
    robot, load = config.settings.robot, truth.load[rows]
    jumps = rows[1:][np.diff(load) != 0.0]
    for k in jumps.tolist():
        told = np.searchsorted(imu.stamp, truth.stamp[k])
        x, y, z, w = imu.orientation[min(int(told), len(imu.stamp) - 1)].tolist()
        up = up_from_orientation(x, y, z, w, config.settings.imu.mounting)
        down = -robot.gravity * np.array(up)
        least = [
            min(margins(robot, joints.position[k], down, replace(robot.payload, mass=m)).angle)
            for m in (truth.load[k - 1], truth.load[k])
        ]
        if least[0] - least[1] > JOLT:
            return True
    return False


def batch_of(config: Config, recording: Recording, case: Case, seed: int) -> Batch:
    """Return a recording's messages as the evaluation takes them: columns in order of arrival."""
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


def _said(event: Event, log: Sequence[Alert]) -> Event:
    """Return the event with the times (s) of the alerts that were active when it happened."""
    at = EPOCH + round(event.time * 1e9)
    there = [
        a
        for a in log
        if (_tells(a, event) or LEVELS[a.rule.level] == 'STALE' or a.rule.code in UNKNOWN)
        and a.start <= at + TOO_LATE * 1e9
        and (a.end is None or a.end >= at)
    ]
    alarms = [a for a in there if LEVELS[a.rule.level] != 'WARN']
    ahead = [a for a in there if a.rule.code in AHEAD]
    warned, alarmed, predicted = map(_first, (there, alarms, ahead))
    return replace(event, warned=warned, alarmed=alarmed, predicted=predicted)


def _tells(alert: Alert, event: Event) -> bool:
    about = alert.rule.code in TELL[event.kind]
    return about and (event.kind == TIP or alert.rule.subject == event.subject)


def _first(alerts: Sequence[Alert]) -> float:
    return min(((a.start - EPOCH) / 1e9 for a in alerts), default=np.inf)


Said = tuple[tuple[str, str, str], ...]


def _for_nothing(log: Sequence[Alert], events: Sequence[Event]) -> tuple[Said, Said]:
    """Return the critical alerts and the warnings of a run that belong to no event."""
    said = [] if events else [(LEVELS[a.rule.level], a.rule.code, a.rule.subject) for a in log]
    critical = tuple(one for one in said if one[0] != 'WARN')
    return critical, tuple(one for one in said if one[0] == 'WARN')
