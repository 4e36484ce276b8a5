"""Applies faults to a robot, to its sensors' readings and to the arrival of its messages.

The functions on logs take any number of rows, so that a live simulator can pass one at a time.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.simulation.faults import Fault
from ugv_acceptance.simulation.scenario import ImuLog, JointLog, Scenario
from ugv_acceptance.type_aliases import Floats

# Messages reach a subscriber this much (s) after their stamp.
DELAY, JITTER = 0.0003, 0.0004
# A message that is overtaken comes this much (s) later: after a few of the next ones.
OVERTAKEN = 0.02
# Another publisher's message comes this much (s) after ours.
BEHIND = 0.001


def weakened(robot: Robot, faults: Sequence[Fault]) -> Robot:
    """Return the robot with its motors' effort limits reduced by the faults."""
    share = {f.subject: f.amount for f in faults if f.kind == 'weak-motor'}
    joints = tuple(
        replace(joint, effort=joint.effort * share.get(joint.name, 1.0)) for joint in robot.joints
    )
    return replace(robot, joints=joints)


def overload(faults: Sequence[Fault]) -> float:
    """Return the factor by which real loads exceed the declared ones."""
    return float(np.prod([f.amount for f in faults if f.kind == 'heavy-payload']))


def overloaded(scenario: Scenario, factor: float) -> Scenario:
    """Return the scenario with every load `factor` times as heavy."""

    def heavier(payload: Payload) -> Payload:
        return replace(payload, mass=payload.mass * factor)

    commands = tuple(
        c if c.payload is None else replace(c, payload=heavier(c.payload))
        for c in scenario.commands
    )
    return replace(scenario, payload=heavier(scenario.payload), commands=commands)


@dataclass(slots=True)
class Corruption:
    """The faults of one run; keeps the frozen encoders' last values and other robots' positions."""

    faults: tuple[Fault, ...]
    joint_names: tuple[str, ...]
    _frozen: dict[Fault, float] = field(default_factory=dict)
    _others: dict[tuple[Fault, str], tuple[Floats, ...]] = field(default_factory=dict)

    def joints(self, log: JointLog) -> JointLog:
        """Return the log as faulty encoders report it, with a second publisher's messages."""
        position, velocity = log.position.copy(), log.velocity.copy()
        for fault in self.faults:
            rows = _during(fault, log.stamp)
            if fault.kind == 'frozen-encoder' and rows.any():
                j = self.joint_names.index(fault.subject)
                last = self._frozen.setdefault(fault, float(position[rows.argmax(), j]))
                position[rows, j], velocity[rows, j] = last, 0.0
            elif fault.kind == 'nan' and fault.hits('joint_states'):
                position[rows] = np.nan
        told = self._joined('joint_states', log.stamp, (position, velocity, log.effort))
        return JointLog(*told)

    def imu(self, log: ImuLog) -> ImuLog:
        """Return the log as a faulty IMU reports it, with a second publisher's messages."""
        orientation, rate = log.orientation.copy(), log.angular_velocity.copy()
        force = log.linear_acceleration.copy()
        for fault in self.faults:
            rows = _during(fault, log.stamp)
            if fault.kind == 'imu-bias':
                force[rows, 0] += fault.amount
            elif fault.kind == 'identity-orientation':
                orientation[rows] = (0.0, 0.0, 0.0, 1.0)
            elif fault.kind == 'nan' and fault.hits('imu'):
                orientation[rows] = force[rows] = np.nan
            elif fault.kind == 'wrong-mounting':
                orientation[rows] = _turned(orientation[rows], np.radians(fault.amount))
                rate[rows] = _seen_turned(rate[rows], np.radians(fault.amount))
                force[rows] = _seen_turned(force[rows], np.radians(fault.amount))
        return ImuLog(*self._joined('imu', log.stamp, (orientation, rate, force)))

    def _joined(
        self, source: str, stamp: Floats, columns: tuple[Floats, ...]
    ) -> tuple[Floats, ...]:
        """Return stamps and columns with a second publisher's messages just after ours."""
        for fault in self.faults:
            rows = _during(fault, stamp)
            if fault.kind != 'second-publisher' or not fault.hits(source) or not rows.any():
                continue
            first = tuple(column[rows.argmax()] for column in columns)
            others = self._others.setdefault((fault, source), first)
            order = np.argsort(np.concatenate((stamp, stamp[rows] + BEHIND)), kind='stable')
            count = int(rows.sum())
            columns = tuple(
                np.concatenate((ours, np.tile(theirs, (count, 1))))[order]
                for ours, theirs in zip(columns, others, strict=True)
            )
            stamp = np.concatenate((stamp, stamp[rows] + BEHIND))[order]
        return (stamp, *columns)

    def missing(self, time: float) -> tuple[tuple[str, ...], bool]:
        """Return the joints left out of a message at `time` (s), and whether efforts are absent."""
        now = [f for f in self.faults if f.start <= time < f.end]
        joints = tuple(f.subject for f in now if f.kind == 'dead-encoder')
        return joints, any(f.kind == 'effort-missing' for f in now)

    def shift(self, source: str, time: float) -> float:
        """Return the error (s) of an input's header stamps at `time` (s)."""
        return sum(f.amount for f in self._of('clock-jump', source, time))

    def arrivals(self, source: str, time: float, rng: np.random.Generator) -> list[float]:
        """Return when (s) a message sent at `time` arrives: empty if lost, twice if duplicated."""
        if not self.faults:
            return [time + DELAY + JITTER * rng.random()]
        if self._of('dead', source, time):
            return []
        if any(rng.random() < f.amount for f in self._of('dropped', source, time)):
            return []
        due = time + DELAY + JITTER * rng.random()
        due += sum(f.amount for f in self._of('late', source, time))
        if any(rng.random() < f.amount for f in self._of('reordered', source, time)):
            due += OVERTAKEN
        twice = any(rng.random() < f.amount for f in self._of('duplicated', source, time))
        return [due, due + JITTER] if twice else [due]

    def _of(self, kind: str, source: str, time: float) -> list[Fault]:
        if not self.faults:
            return []
        return [
            f for f in self.faults if f.kind == kind and f.hits(source) and f.start <= time < f.end
        ]


def _during(fault: Fault, stamp: Floats) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    rows: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    rows = (stamp >= fault.start) & (stamp < fault.end)
    return rows


def _seen_turned(vectors: Floats, angle: float) -> Floats:
    """Return vectors (n, 3) as seen in axes turned by `angle` (rad) about z."""
    c, s = np.cos(angle), np.sin(angle)
    turned: Floats = vectors @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return turned


def _turned(quaternion: Floats, angle: float) -> Floats:
    """Return quaternions (n, 4) x y z w of axes turned by `angle` (rad) about their own z."""
    c, s = np.cos(angle / 2.0), np.sin(angle / 2.0)
    x, y, z, w = quaternion.T
    return np.stack([x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s], axis=-1)
