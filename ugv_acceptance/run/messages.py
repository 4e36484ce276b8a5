"""Converts a simulated run to the messages a robot's driver would publish, with sensor faults."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.inputs.frames import link_of
from ugv_acceptance.evaluation.settings import AUTO
from ugv_acceptance.simulation.corruption import Corruption
from ugv_acceptance.simulation.scenario import ImuLog, JointLog, Noise, Recording

# 2025-06-02 09:00:00 UTC: stamps look like those of a real clock.
EPOCH = 1_748_854_800_000_000_000
# Seconds after which a payload is declared again.
PAYLOAD_PERIOD = 1.0

# Topic, time of receipt (ns) and content.
Message = tuple[str, int, bytes]
# The types of the inputs, in the order in which they are recorded.
TYPES = {
    'joint_states': 'sensor_msgs/msg/JointState',
    'imu': 'sensor_msgs/msg/Imu',
    'payload': 'geometry_msgs/msg/InertiaStamped',
}


def topics_of(config: Config) -> dict[str, str]:
    """Return the topics of the inputs that the robot has, by the name of the input."""
    used = config.topics.used
    if config.settings.robot.payload_link is None:
        used = {name: topic for name, topic in used.items() if name != 'payload'}
    return {name: f'/{used[name].name.lstrip("/")}' for name in TYPES if name in used}


@dataclass(frozen=True, slots=True)
class Driver:
    """Converts model values to messages with the names, signs and offsets of the driver."""

    config: Config
    corruption: Corruption
    noise: Noise
    epoch: int = EPOCH

    def joint_states(self, log: JointLog) -> Iterator[tuple[float, bytes]]:
        """Yield time (s) and CDR bytes of a JointState for every row of a log."""
        log = self.corruption.joints(log)
        joints = self.config.settings.joints
        if not joints:
            return
        sign, offset = np.array([(j.sign, j.offset) for j in joints]).T
        scale = np.array([j.effort_sign * j.effort_scale for j in joints])
        position = ((log.position - offset) / sign).tolist()
        velocity, effort = (log.velocity / sign).tolist(), (log.effort / scale).tolist()
        names = [j.topic_name for j in joints]
        for k, time in enumerate(log.stamp.tolist()):
            stamp = self.nanoseconds(time + self.corruption.shift('joint_states', time))
            dead, mute = self.corruption.missing(time)
            told = [names, position[k], velocity[k], [] if mute else effort[k]]
            if dead:
                alive = [n not in dead for n in self.config.settings.robot.joint_names]
                told = [[x for x, keep in zip(part, alive) if keep] for part in told]  # noqa: B905 - efforts may be none
            yield time, joint_state_cdr(stamp, '', *told)

    def imu(self, log: ImuLog) -> Iterator[tuple[float, bytes]]:
        """Yield time (s) and CDR bytes of an Imu for every row of a log."""
        log = self.corruption.imu(log)
        frame = imu_frame(self.config)
        covariances = imu_covariances(self.noise)
        orientation, rate = log.orientation.tolist(), log.angular_velocity.tolist()
        force = log.linear_acceleration.tolist()
        for k, time in enumerate(log.stamp.tolist()):
            stamp = self.nanoseconds(time + self.corruption.shift('imu', time))
            yield time, imu_cdr(stamp, frame, orientation[k], rate[k], force[k], covariances)

    def nanoseconds(self, time: float) -> int:
        """Return the header stamp (ns) of a simulated time (s)."""
        return self.epoch + round(time * 1e9)


def imu_frame(config: Config) -> str:
    """Return the frame that the simulated IMU names: where its mounting is found, if it can be."""
    named, settings = config.topics.imu.frame_id, config.settings
    if named:
        return named
    alone = settings.imu.placed == AUTO and link_of(settings.robot, 'imu_link') is None
    return settings.robot.root if alone else 'imu_link'


def imu_covariances(noise: Noise) -> tuple[list[float], list[float], list[float]]:
    """Return the covariances (row by row) that a sensor with this noise reports."""
    orientation, gyro, acceleration = (
        np.diag([deviation**2] * 3).ravel().tolist()
        for deviation in (noise.orientation, noise.gyro, noise.acceleration)
    )
    return orientation, gyro, acceleration


def messages(
    config: Config, recording: Recording, corruption: Corruption, seed: int, factor: float = 1.0
) -> list[Message]:
    """Return all messages of a run in the order in which a recorder receives them.

    Declared payloads are lighter than the real ones by `factor`.
    """
    driver = Driver(config, corruption, recording.scenario.noise)
    rng = np.random.default_rng(seed)
    found: list[Message] = []
    sources = {
        'joint_states': driver.joint_states(recording.joints),
        'imu': driver.imu(recording.imu),
        'payload': payload_messages(driver, recording, factor),
    }
    for source, topic in topics_of(config).items():
        for time, cdr in sources[source]:
            # A load is declared before anything is measured with it.
            arrivals = [time] if source == 'payload' else corruption.arrivals(source, time, rng)
            found += [(topic, driver.nanoseconds(due), cdr) for due in arrivals]
    return sorted(found, key=lambda message: message[1])


def payload_messages(
    driver: Driver, recording: Recording, factor: float
) -> Iterator[tuple[float, bytes]]:
    """Yield time (s) and CDR bytes of each payload declaration: at a change, and once a period."""
    frame = driver.config.topics.payload.frame_id or ''
    changes = recording.payload
    ends = [time for time, _ in changes[1:]] + [recording.scenario.duration]
    for (start, payload), end in zip(changes, ends, strict=True):
        for time in np.arange(start, end, PAYLOAD_PERIOD).tolist():
            stamp = driver.nanoseconds(time)
            yield time, inertia_cdr(stamp, frame, payload.mass / factor, payload.cog)
