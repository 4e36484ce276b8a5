"""The runner's `World` without ROS: simulated robot, evaluation and recording in one process.

It runs as fast as the machine allows, yet nothing depends on its speed: the same seed gives the
same recordings, bit for bit, and the same verdicts. Steps are judged as over ROS.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import (
    Decoder,
    ImuSample,
    JointStateSample,
    imu_decoder,
    joint_state_decoder,
)
from ugv_acceptance.bag.encode import inertia_cdr
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.alerts.messages import describe
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, Alert
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.settings import ALWAYS
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.plan.motions import hitch_of
from ugv_acceptance.run.messages import TYPES, topics_of
from ugv_acceptance.run.own_description import tell_robot
from ugv_acceptance.run.record import QOS
from ugv_acceptance.run.simulated_robot import VirtualRobot
from ugv_acceptance.run.world import Brake, Commands, Positions


@dataclass(slots=True)
class Offline:
    """A runner's world in simulated time; `progress` is called with the time (s) reached.

    `asked()` ends a wait early, so that Ctrl-C ends a run of hours.
    """

    virtual: VirtualRobot
    on_stop: Callable[[str], None]
    progress: Callable[[float], None] = lambda _: None
    asked: Callable[[], bool] = lambda: False
    brake: Brake = field(init=False)
    commands: Commands = field(init=False)
    positions: Positions = field(init=False)
    evaluator: LiveEvaluator = field(init=False)
    bag: BagWriter | None = None
    _joints: Decoder[JointStateSample] = field(default_factory=joint_state_decoder)
    _imu: Decoder[ImuSample] = field(default_factory=imu_decoder)
    _open: list[Alert] = field(default_factory=list)
    _seen: int = 0
    _ticked: int = 0

    def __post_init__(self) -> None:
        config = self.virtual.config
        self.positions = Positions(config)
        self.evaluator = LiveEvaluator(config.settings)
        self.evaluator.start(self.stamp())
        self.commands = OfflineCommands(self)
        self.brake = Brake(self.commands.freeze, self.on_stop)

    @property
    def config(self) -> Config:
        """The configuration of robot and monitor."""
        return self.virtual.config

    # The world of a runner

    def missing(self) -> str:
        """Return what is not yet connected: always empty, all is in this process."""
        return ''

    def dead(self) -> bool:
        """Return whether the monitor is silent: never, it is in this process."""
        return False

    def now(self) -> float:
        """Return the simulated time (s)."""
        return self.virtual.elapsed

    def fed(self) -> float:
        """Return for how long (s) joint states came: the simulated time, they never pause."""
        return self.virtual.elapsed

    def stamp(self) -> int:
        """Return the simulated time as recordings carry it (ns)."""
        return self.virtual.epoch + round(self.virtual.elapsed * 1e9)

    def wait(self, seconds: float) -> None:
        """Simulate `seconds`, or less when asked to end."""
        end = self.virtual.elapsed + seconds - self.virtual.tick / 2.0
        while self.virtual.elapsed < end and not self.asked():
            self.virtual.step()
            for source, data in self.virtual.due(self.virtual.elapsed):
                self._receive(source, data)
            if (now := self.stamp()) - self._ticked >= self.config.settings.delays.tick * 1e9:
                self._ticked = now
                self.evaluator.tick(now)
                self._look()
        self.progress(self.virtual.elapsed)

    def record(self, folder: Path) -> None:
        """Begin to record all messages into a new folder."""
        self.bag = BagWriter(folder, simulated=True)
        for source, topic in self._topics().items():
            self.bag.add_topic(topic, TYPES[source], QOS[source])
        tell_robot(self.bag, self.config, self.stamp())
        self.bag.flush()  # from now on it can be read, whatever happens

    def stop_recording(self) -> None:
        """Close the recording, if there is one."""
        bag, self.bag = self.bag, None
        if bag is not None:
            bag.close()

    def _topics(self) -> dict[str, str]:
        return topics_of(self.config)

    # The monitor

    def _receive(self, source: str, data: bytes) -> None:
        now, evaluator = self.stamp(), self.evaluator
        topic = self._topics().get(source)
        if self.bag is not None and topic is not None:
            self.bag.write(topic, now, data)
        try:
            if source == 'joint_states':
                stamp, _, names, position, velocity, effort = self._joints.one(data)
                self.positions.take(names, position)
                evaluator.joint_state(now, stamp, names, position, velocity, effort)
            else:
                stamp, _, turned, omega, force, covariance, gyro, _ = self._imu.one(data)
                evaluator.imu(now, stamp, turned, covariance, omega, force, '', gyro)
        except BadSample:
            return  # as the monitor does; the evaluation of the recording counts it
        self._look()

    def _look(self) -> None:
        """Pass alerts raised or cleared since the last call to the brake."""
        log = self.evaluator.watch.log
        for alert in log[self._seen :]:
            self._open.append(alert)
            self.brake.raised(_key(alert), describe(alert, self.config.settings))
        self._seen = len(log)
        for alert in [a for a in self._open if a.end is not None]:
            self._open.remove(alert)
            self.brake.active.discard(_key(alert))

    def declare(self, mass: float) -> None:
        """Declare a load (kg) to the evaluation, as to the monitor, and record it."""
        topics, cog = self.config.topics, self.config.settings.robot.payload.cog
        frame, now = topics.payload.frame_id or '', self.stamp()
        if self.bag is not None and (topic := self._topics().get('payload')) is not None:
            self.bag.write(topic, now, inertia_cdr(now, frame, mass, cog))
        self.evaluator.carry(now, mass, cog, frame)

    def stand_on(self, kind: str | None) -> None:
        """Take the kind of ground from now on; None: that of the configuration."""
        settings = self.config.settings
        ground = replace(settings.ground, kind=kind or settings.ground.kind)
        payload = self.evaluator.payload
        robot = replace(settings.robot, payload=payload)
        self.evaluator.adopt(replace(settings, robot=robot, ground=ground))


@dataclass(frozen=True, slots=True)
class OfflineCommands:
    """The `Commands` of a runner, obeyed at once by the simulated robot."""

    world: Offline

    def move(self, posture: Mapping[str, float], seconds: float) -> None:
        """Start a motion to `posture` (rad) that takes `seconds`."""
        point = (seconds, list(posture.values()))
        self.world.virtual.remote.follow(list(posture), [point])

    def freeze(self) -> None:
        """Stop arm and tracks and hold them still."""
        self.world.virtual.remote.freeze()

    def drive(self, forward: float, yaw: float) -> None:
        """Drive at `forward` (m/s) and `yaw` (rad/s)."""
        self.world.virtual.remote.drive(forward, yaw)

    def declare(self, mass: float) -> None:
        """Declare to the evaluation what is carried (kg)."""
        self.world.declare(mass)

    def tell_ground(self, kind: str | None) -> None:
        """Tell the evaluation the kind of ground; None: that of the configuration."""
        self.world.stand_on(kind)

    def may_touch(self, *, allowed: bool) -> None:
        """Say to the evaluation whether the arm may touch the ground from now on."""
        evaluator = self.world.evaluator
        evaluator.adopt(replace(evaluator.settings, hand_may_touch=ALWAYS if allowed else ()))

    def tilt(self, tilt: float, heading: float, rate: float) -> None:
        """Tilt the ground: rad, down towards `heading` (rad), at a peak `rate` (rad/s)."""
        self.world.virtual.tilt(tilt, heading, rate)

    def load(self, mass: float) -> None:
        """Put a load (kg) into the gripper."""
        cog = self.world.config.settings.robot.payload.cog
        self.world.virtual.remote.take(Payload(mass, cog))

    def pull(self, force: float) -> None:
        """Pull backwards at the hitch (N) until told otherwise."""
        self.world.virtual.pull(force, hitch_of(self.world.config.settings.robot))

    def stand_up(self) -> None:
        """Reset the robot to its start: on level ground, the gripper empty."""
        self.world.virtual.remote.reset()


def _key(alert: Alert) -> tuple[str, str, str]:
    return LEVELS[alert.rule.level], alert.rule.code, alert.rule.subject
