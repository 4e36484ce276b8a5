"""What can be done in a drill: by the operator, by others, by the course of a situation."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from ugv_acceptance.drill.robot import DrillRobot
from ugv_acceptance.drill.situation import Act
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.simulation.faults import Fault
from ugv_acceptance.simulation.scenario import Command

# How the operator brakes (m/s2): gently, and as hard as the tracks can.
GENTLY, HARD = 1.0, 15.0
# Joint speed (rad/s) of an operator who takes care, and of turning on the spot.
CAREFUL, TURN = 0.4, 0.4


@dataclass(slots=True)
class Scene:
    """A robot and what is around it: is somebody `near`, is it switched `off`, is it `silenced`.

    `sensor` are the faults that `fail` brings. `busy` (s, the robot's time) is until when a motion
    that was asked for goes on.
    """

    robot: DrillRobot
    sensor: tuple[Fault, ...] = ()
    near: bool = False
    off: bool = False
    silenced: bool = False
    busy: float = 0.0

    def do(self, act: Act) -> None:
        """Carry out an act now. A robot that is switched off obeys no command."""
        if not (self.off and act.kind in COMMANDS):
            ACTS[act.kind](self, act)

    def occupied(self, seconds: float) -> None:
        """Take note that a motion goes on for so long (s)."""
        self.busy = max(self.busy, self.robot.time + seconds)

    def command(self, **parts: object) -> None:
        """Give the simulated robot or its ground a command now; see Command."""
        simulation = self.robot.simulation
        simulation.apply(Command(simulation.time, **parts))  # type: ignore[arg-type]


def stop(scene: Scene, act: Act) -> None:
    """Stop arm and tracks at `rate` (m/s2; 0: gently); ground that gets steeper no longer does."""
    scene.robot.virtual.remote.freeze()
    scene.command(drive=(0.0, 0.0), drive_rate=act.rate or GENTLY)
    scene.command(slope=scene.robot.simulation.slope(), slope_rate=1.0)
    scene.occupied(1.0)


def joint(scene: Scene, act: Act) -> None:
    """Move the joint `subject` by `amount` (rad) at a peak `rate` (rad/s; 0: carefully)."""
    names, at = scene.robot.config.settings.robot.joint_names, scene.robot.simulation.joints()[0]
    target = float(at[names.index(act.subject)]) + act.amount
    _to(scene, act.subject, target, act.rate or CAREFUL)


def joint_to(scene: Scene, act: Act) -> None:
    """Move the joint `subject` to `amount` (rad) at a peak `rate` (rad/s; 0: carefully)."""
    _to(scene, act.subject, act.amount, act.rate or CAREFUL)


def _to(scene: Scene, name: str, target: float, rate: float) -> None:
    names, at = scene.robot.config.settings.robot.joint_names, scene.robot.simulation.joints()[0]
    scene.command(joints=((name, target),), speed=rate)
    scene.occupied(abs(target - float(at[names.index(name)])) * math.pi / (2.0 * rate))


def drive(scene: Scene, act: Act) -> None:
    """Drive at `amount` (m/s) and turn at `other` (rad/s), reached at `rate` (m/s2; 0: gently)."""
    scene.command(drive=(act.amount, act.other), drive_rate=act.rate or GENTLY)
    scene.occupied(1.0)


def slope(scene: Scene, act: Act) -> None:
    """Let the ground tilt to `amount` (rad) down towards `other` (rad), at `rate` (rad/s)."""
    scene.command(slope=(act.amount, act.other), slope_rate=act.rate)


def set_down(scene: Scene, _: Act) -> None:
    """Set the load down, and tell the monitor so."""
    empty = Payload(0.0, scene.robot.config.settings.robot.payload.cog)
    scene.robot.virtual.remote.take(empty)
    scene.robot.declare(0.0)


def declare(scene: Scene, act: Act) -> None:
    """Tell the monitor that the gripper holds `amount` (kg); negative: what it really holds."""
    real = scene.robot.simulation.load
    scene.robot.declare(real if act.amount < 0.0 else act.amount)


def ground(scene: Scene, act: Act) -> None:
    """Tell the monitor that the robot drives on `subject`: flat, uneven or stairs."""
    scene.robot.take_ground(act.subject)


def acknowledge(scene: Scene, _: Act) -> None:
    """Acknowledge all alarms."""
    session = scene.robot.session
    alarms, now = session.alarm_tracker.alarms, scene.robot.clock.now()
    scene.robot.tell(alarms.acknowledge(now, 'operator'))


def silence(scene: Scene, _: Act) -> None:
    """Stop listening to the monitor."""
    scene.silenced = True


def fail(scene: Scene, _: Act) -> None:
    """Let the sensor of the situation fail."""
    scene.robot.virtual.suffer(scene.sensor)


def mend(scene: Scene, _: Act) -> None:
    """Make the sensor work again: its driver is started anew, its cable plugged in."""
    scene.robot.virtual.suffer(())


def near(scene: Scene, _: Act) -> None:
    """Let somebody step up to the robot."""
    scene.near = True


def pull(scene: Scene, act: Act) -> None:
    """Let somebody pull the robot backwards with `amount` (N), `other` (m) above its base."""
    scene.robot.virtual.pull(act.amount, act.other)


def switch_off(scene: Scene, _: Act) -> None:
    """Switch the robot off: its brakes hold, it obeys no command."""
    scene.off = True


ACTS: dict[str, Callable[[Scene, Act], None]] = {
    function.__name__: function
    for function in (
        stop,
        joint,
        joint_to,
        drive,
        slope,
        set_down,
        declare,
        ground,
        acknowledge,
        silence,
        fail,
        mend,
        near,
        pull,
        switch_off,
    )
}
# What a robot that is switched off does not do.
COMMANDS = frozenset({'stop', 'joint', 'joint_to', 'drive', 'set_down'})
