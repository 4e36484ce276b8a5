"""Moves and sets up the robot: by a simulator, by an arm controller, or by asking a person."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ugv_acceptance.model.roles import WHEELED, roles_of
from ugv_acceptance.plan.plan import Step
from ugv_acceptance.run.world import World
from ugv_acceptance.studies.orientations import ORIENTATIONS

SIM, ROBOT, OPERATOR = 'sim', 'robot', 'operator'
# Peak rate (rad/s) at which the simulated ground tilts; seconds to come to rest after it.
TILT_RATE, REST = 0.9, 0.5
# Seconds between two drive commands.
DRIVE_PERIOD = 0.1

# Shows a person what to do; False: it will not be done. It gives up when the second says so.
Ask = Callable[[str, Callable[[], bool]], bool]


@dataclass(slots=True)
class Hands:
    """Moves and sets up the robot in one of three modes: sim, robot or operator.

    `going()` says whether the step may still go on; `refused` is set once a person declines a task.
    """

    world: World
    mode: str
    ask: Ask
    going: Callable[[], bool] = lambda: True
    refused: bool = False
    _tilt: float = 0.0

    def told(self, text: str) -> bool:
        """Ask a person to do something and return whether it was done."""
        done = self.ask(text, self.going)
        self.refused = self.refused or (not done and self.going())
        return done

    def set_up(self, step: Step) -> bool:
        """Set up ground and load for a step and declare the load; False: a person declined."""
        commands, wait = self.world.commands, self.world.wait
        if self.mode == SIM:
            heading = ORIENTATIONS[step.ground.orientation].heading
            tilt = math.radians(step.ground.tilt_deg)
            # Back to level first: the direction of a slope cannot turn under the robot.
            for target, towards in ((0.0, 0.0), (tilt, heading or 0.0)):
                way = abs(target - self._tilt)
                if way > 0.0:
                    commands.tilt(target, towards, TILT_RATE)
                    wait(way * math.pi / (2.0 * TILT_RATE) + 0.2)
                self._tilt = target
            commands.load(step.payload_kg)
            wait(REST)
        elif not self.told(f'{step.id}: set up: {"; ".join(step.preparation)}'):
            return False
        commands.declare(step.payload_kg)
        commands.tell_ground(step.ground.kind)
        return True

    def move(self, posture: Mapping[str, float], speed: float) -> float:
        """Start a motion to `posture` (rad) at a peak `speed` (rad/s); return its duration (s)."""
        now = self.world.positions.now
        way = max((abs(a - now.get(n, a)) for n, a in posture.items()), default=0.0)
        seconds = max(way * math.pi / (2.0 * speed), 0.05)
        self.world.commands.move(posture, seconds)
        return seconds

    def drive(self, step: Step, forward: float, yaw: float, seconds: float) -> None:
        """Drive at m/s and rad/s for `seconds`, or until stopped, then stand still."""
        if self.mode == OPERATOR:
            turn = f'turn at {math.degrees(yaw):g} deg/s' if yaw else f'drive at {forward:g} m/s'
            self.told(f'{step.id}: {turn} for {seconds:g} s, then stand still')
            return
        end = self.world.fed() + seconds
        while self.world.fed() < end and self.going():
            self.world.commands.drive(forward, yaw)
            self.world.wait(DRIVE_PERIOD)
        self.world.commands.drive(0.0, 0.0)

    def pull(self, step: Step) -> None:
        """Pull with the step's force (N) for its hold time, then let go."""
        force = step.force_n or 0.0
        if self.mode != SIM:
            self.told(f'{step.id}: pull with {force:g} N for {step.hold_s:g} s, then let go')
            return
        end = self.world.fed() + step.hold_s
        self.world.commands.pull(force)
        while self.world.fed() < end and self.going():
            self.world.wait(DRIVE_PERIOD)
        self.world.commands.pull(0.0)

    def _upright(self) -> str:
        """Return what a person is asked for before the first step and after a fall."""
        roles = roles_of(self.world.positions.config.settings.robot)
        under = 'wheels' if roles.kind == WHEELED else 'tracks'
        arm = ', arm folded, hand empty' if roles.arm else ''
        return f'stand the robot on its {under} on level ground{arm}'

    def stand_up(self) -> bool:
        """Return a robot that tipped over, or whose arm gave way, to its start; False: declined."""
        if self.mode == SIM:
            self.world.commands.stand_up()
            self.world.commands.load(0.0)
            self._tilt = 0.0
        elif not self.told(self._upright()):
            return False
        self.world.commands.declare(0.0)
        self.world.wait(REST)
        return True
