"""Records a simulated run as a rosbag2 folder."""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from heapq import merge
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.inputs.imu_mount import mounted
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.roles import roles_of
from ugv_acceptance.run.catalogue import Case
from ugv_acceptance.run.messages import EPOCH, TYPES, Message, imu_frame, messages, topics_of
from ugv_acceptance.run.own_description import tell_robot
from ugv_acceptance.simulation.corruption import Corruption, overload, overloaded, weakened
from ugv_acceptance.simulation.faults import Fault
from ugv_acceptance.simulation.scenario import TIPPED, Recording
from ugv_acceptance.simulation.simulation import BUILD
from ugv_acceptance.simulation.stretches import stretches
from ugv_acceptance.simulation.vehicle import Build
from ugv_acceptance.type_aliases import Floats

# Simulated seconds held in memory at a time.
STRETCH = 5.0
# A motor at its limit for this long (s) is saturated; shorter is a jolt.
SATURATED_FOR = 0.1
SENSOR = Qos(reliability='best_effort')
QOS = {'joint_states': SENSOR, 'imu': SENSOR, 'payload': Qos()}


@dataclass(slots=True)
class Outcome:
    """The result of recording a simulated run: its messages, and when it tipped or saturated.

    `tipped_at` (s) is when it had leant too far (infinite: never); `saturated_at` (s) is when a
    joint's motor was first at its limit, for joints where that happened. No sensor measures these.
    """

    messages: int = 0
    seconds: float = 0.0
    tipped_at: float = float('inf')
    saturated_at: dict[str, float] = field(default_factory=dict)


def build_of(config: Config) -> Build:
    """Return how to build the simulated robot, with its IMU placed as the configuration says."""
    place = mounted(config.settings, imu_frame(config))
    if place is None:  # nobody knows where it is: at the base's origin
        return BUILD
    at, turned = place.xyz, place.rotation
    return replace(BUILD, imu_position=at, imu_rotation=turned, imu_link=place.link)


def real_robot(config: Config, faults: Sequence[Fault] = ()) -> Robot:
    """Return the robot that is simulated: with motors as strong as configured, less their faults.

    A motor without a limit in the configuration has that of the URDF.
    """
    settings = config.settings
    rated = dict(zip(settings.robot.joint_names, settings.limits.rated, strict=True))
    joints = tuple(
        replace(j, effort=rated[j.name]) if math.isfinite(rated.get(j.name, math.inf)) else j
        for j in settings.robot.joints
    )
    return weakened(replace(settings.robot, joints=joints), faults)


def play(config: Config, case: Case, seed: int, length: float = STRETCH) -> Iterator[Recording]:
    """Yield a simulated run in parts of `length` (s), with weak motors and overloads applied."""
    scenario = overloaded(case.scenario, overload(case.faults))
    robot = real_robot(config, case.faults)
    return stretches(robot, scenario, seed, length, build_of(config))


def record(
    config: Config,
    case: Case,
    seed: int,
    folder: Path,
    progress: Callable[[float], None] = lambda _: None,
) -> Outcome:
    """Simulate a case and record it; `progress` is called with the simulated time (s) reached.

    Raises BadBag where the folder holds something already.
    """
    outcome = Outcome()
    waiting: list[Message] = []
    corruption = Corruption(case.faults, config.settings.robot.joint_names)
    factor = overload(case.faults)
    with BagWriter(folder, simulated=True) as bag:
        for source, topic in topics_of(config).items():
            bag.add_topic(topic, TYPES[source], QOS[source])
        for k, part in enumerate(play(config, case, seed)):
            waiting = list(
                merge(waiting, messages(config, part, corruption, seed + k, factor), key=_due)
            )
            if k == 0:
                tell_robot(bag, config, waiting[0][1] if waiting else EPOCH)
            end = float(part.imu.stamp[-1])
            reached = bisect_right(waiting, EPOCH + round(end * 1e9), key=_due)
            _write(bag, waiting[:reached], outcome)
            del waiting[:reached]
            _note(outcome, part, config.settings.robot)
            progress(end)
        _write(bag, waiting, outcome)
    return outcome


def _due(message: Message) -> int:
    return message[1]


def _write(bag: BagWriter, due: list[Message], outcome: Outcome) -> None:
    for topic, time, cdr in due:
        bag.write(topic, time, cdr)
    outcome.messages += len(due)


def _note(outcome: Outcome, part: Recording, robot: Robot) -> None:
    """Add what really happened in a part; a saturation across two parts counts from the second.

    The motor of a wheel that spins or brakes is none of the arm's.
    """
    truth, wheels = part.truth, roles_of(robot).wheels
    outcome.seconds = float(part.imu.stamp[-1])
    over = truth.lean > TIPPED
    if over.any() and outcome.tipped_at == float('inf'):
        outcome.tipped_at = float(truth.stamp[over.argmax()])
    for name, row in zip(robot.joint_names, truth.saturated.T, strict=True):
        if name in wheels:
            continue
        at = lasting(row, truth.stamp, SATURATED_FOR)
        if at < float('inf'):
            outcome.saturated_at.setdefault(name, at)


def lasting(rows: NDArray[np.bool_], stamp: Floats, least: float) -> float:
    """Return the time (s) from which `rows` (n,) hold for `least` (s) on end; infinite: never."""
    edges = np.flatnonzero(np.diff(rows.astype(np.int8), prepend=0, append=0))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if stamp[last - 1] - stamp[first] >= least:
            return float(stamp[first])
    return float('inf')
