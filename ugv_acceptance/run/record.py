"""Records a simulated run as a rosbag2 folder."""

from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from heapq import merge
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.inputs.imu_mount import mounted
from ugv_acceptance.run.catalogue import Case
from ugv_acceptance.run.messages import EPOCH, Message, imu_frame, messages
from ugv_acceptance.run.own_description import tell_robot
from ugv_acceptance.simulation.corruption import Corruption, overload, overloaded, weakened
from ugv_acceptance.simulation.scenario import TIPPED, Recording
from ugv_acceptance.simulation.simulation import BUILD
from ugv_acceptance.simulation.stretches import stretches
from ugv_acceptance.simulation.vehicle import Build
from ugv_acceptance.type_aliases import Floats

# Simulated seconds held in memory at a time.
STRETCH = 5.0
# A motor at its limit for this long (s) is saturated; shorter is a jolt.
SATURATED_FOR = 0.1
TOPICS = (
    ('/joint_states', 'sensor_msgs/msg/JointState', Qos(reliability='best_effort')),
    ('/imu/data', 'sensor_msgs/msg/Imu', Qos(reliability='best_effort')),
    ('/payload', 'geometry_msgs/msg/InertiaStamped', Qos()),
)


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


def play(config: Config, case: Case, seed: int, length: float = STRETCH) -> Iterator[Recording]:
    """Yield a simulated run in parts of `length` (s), with weak motors and overloads applied."""
    scenario = overloaded(case.scenario, overload(case.faults))
    robot = weakened(config.settings.robot, case.faults)
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
        for topic, kind, qos in TOPICS:
            bag.add_topic(topic, kind, qos)
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
            _note(outcome, part, config.settings.robot.joint_names)
            progress(end)
        _write(bag, waiting, outcome)
    return outcome


def _due(message: Message) -> int:
    return message[1]


def _write(bag: BagWriter, due: list[Message], outcome: Outcome) -> None:
    for topic, time, cdr in due:
        bag.write(topic, time, cdr)
    outcome.messages += len(due)


def _note(outcome: Outcome, part: Recording, names: tuple[str, ...]) -> None:
    """Add what really happened in a part; a saturation across two parts counts from the second."""
    truth = part.truth
    outcome.seconds = float(part.imu.stamp[-1])
    over = truth.lean > TIPPED
    if over.any() and outcome.tipped_at == float('inf'):
        outcome.tipped_at = float(truth.stamp[over.argmax()])
    for name, row in zip(names, truth.saturated.T, strict=True):
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
