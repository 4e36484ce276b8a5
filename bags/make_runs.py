"""Simulate the runs of this folder and record each as a rosbag2 folder: `python bags/make_runs.py`.

The same seed gives the same messages on the same version of MuJoCo.
"""

import argparse
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import Config, load
from ugv_acceptance.simulation.scenario import Noise, Recording
from ugv_acceptance.simulation.scenarios import SCENARIOS
from ugv_acceptance.simulation.simulation import BUILD
from ugv_acceptance.simulation.stretches import run

# 2025-06-02 09:00:00 UTC: stamps look like those of a real clock.
EPOCH_NS = 1_748_854_800_000_000_000
# Messages reach the recorder this much (s) after their stamp.
DELAY, JITTER = 0.0003, 0.0004
# The payload is told again every second.
PAYLOAD_PERIOD = 1.0

Message = tuple[str, int, bytes]


@dataclass(frozen=True, slots=True)
class Run:
    """A folder to make: its scenario, how long (s) of it, and when (s) the IMU is silent."""

    folder: str
    scenario: str
    seed: int
    duration: float
    silent: tuple[float, float] = (0.0, 0.0)


RUNS = (
    Run('packbot_pass', 'gentle', seed=1, duration=28.0),
    Run('packbot_fail', 'overreach', seed=2, duration=29.0),
    Run('packbot_gap', 'gentle', seed=3, duration=18.0, silent=(8.0, 11.0)),
)


def main() -> None:
    """Make the runs named on the command line, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('names', nargs='*', help='folders to make; all if none is named')
    parser.add_argument('--out', type=Path, default=Path(__file__).parent, help='where to')
    arguments = parser.parse_args()
    for made in RUNS:
        if not arguments.names or made.folder in arguments.names:
            make(made, arguments.out / made.folder)


def make(made: Run, folder: Path) -> None:
    """Simulate one run and record it in `folder`, in place of what is there."""
    config = load()
    imu = config.settings.imu
    build = replace(BUILD, imu_position=imu.position, imu_rotation=imu.mounting)
    scenario = replace(SCENARIOS[made.scenario](), duration=made.duration)
    recording = run(config.settings.robot, scenario, made.seed, build)
    shutil.rmtree(folder, ignore_errors=True)
    with BagWriter(folder, simulated=True) as bag:
        sensor = Qos(reliability='best_effort')
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState', sensor)
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu', sensor)
        bag.add_topic('/payload', 'geometry_msgs/msg/InertiaStamped')
        for topic, log_time, cdr in late(messages(config, recording, made), made.seed):
            bag.write(topic, log_time, cdr)
    tipped = recording.truth.tipped_at
    size = sum(path.stat().st_size for path in folder.iterdir()) / 1e6
    end = f'tips at {tipped:.1f} s' if np.isfinite(tipped) else 'does not tip'
    print(f'{folder.name}: {made.duration:.0f} s, {size:.2f} MB, {end}')


def late(sent: Iterator[Message], seed: int) -> list[Message]:
    """Return the messages with the times at which they reach the recorder, in that order.

    The payload is told ahead, so that no sample is judged with the payload of the configuration.
    """
    rng = np.random.default_rng(seed)
    arrived = [
        (topic, stamp + int(1e9 * (topic != '/payload') * (DELAY + JITTER * rng.random())), cdr)
        for topic, stamp, cdr in sent
    ]
    return sorted(arrived, key=lambda message: message[1])


def messages(config: Config, recording: Recording, made: Run) -> Iterator[Message]:
    """Yield topic, stamp (ns) and content of every message of a run."""
    yield from joint_messages(config, recording)
    yield from imu_messages(config, recording, made.silent)
    yield from payload_messages(config, recording)


def joint_messages(config: Config, recording: Recording) -> Iterator[Message]:
    """Yield the joint states as this robot's driver counts them: sign, offset and scale undone."""
    joints, log = config.settings.joints, recording.joints
    sign, offset = np.array([(j.sign, j.offset) for j in joints]).T
    scale = np.array([j.effort_sign * j.effort_scale for j in joints])
    names = [j.topic_name for j in joints]
    position, velocity, effort = (log.position - offset) / sign, log.velocity / sign, log.effort
    for k, time in enumerate(log.stamp):
        stamp = nanoseconds(time)
        values = (position[k].tolist(), velocity[k].tolist(), (effort[k] / scale).tolist())
        yield '/joint_states', stamp, joint_state_cdr(stamp, '', names, *values)


def imu_messages(
    config: Config, recording: Recording, silent: tuple[float, float]
) -> Iterator[Message]:
    """Yield the IMU's messages but those of the silent time."""
    log, frame = recording.imu, config.topics.imu.frame_id or 'imu_link'
    covariances = imu_covariances(recording.scenario.noise)
    for k, time in enumerate(log.stamp):
        if not silent[0] <= time < silent[1]:
            stamp = nanoseconds(time)
            vectors = (log.orientation[k], log.angular_velocity[k], log.linear_acceleration[k])
            values = [v.tolist() for v in vectors]
            cdr = imu_cdr(stamp, frame, values[0], values[1], values[2], covariances)
            yield '/imu/data', stamp, cdr


def imu_covariances(noise: Noise) -> tuple[list[float], list[float], list[float]]:
    """Return the covariances (row by row) that a sensor of this noise states."""
    orientation, gyro, acceleration = (
        np.diag([deviation**2] * 3).ravel().tolist()
        for deviation in (noise.orientation, noise.gyro, noise.acceleration)
    )
    return orientation, gyro, acceleration


def payload_messages(config: Config, recording: Recording) -> Iterator[Message]:
    """Yield the payload whenever it changes and once a period."""
    frame = config.topics.payload.frame_id or ''
    changes = recording.payload
    ends = [time for time, _ in changes[1:]] + [recording.scenario.duration]
    for (start, payload), end in zip(changes, ends, strict=True):
        for time in np.arange(start, end, PAYLOAD_PERIOD):
            stamp = nanoseconds(time)
            yield '/payload', stamp, inertia_cdr(stamp, frame, payload.mass, payload.cog)


def nanoseconds(time: float) -> int:
    """Return the stamp (ns) of a simulated time (s)."""
    return EPOCH_NS + round(time * 1e9)


if __name__ == '__main__':
    main()
