"""Moves the arm and waits until the robot's own joint states show that it has arrived.

Waiting depends on messages, not on a clock, so that a slow machine changes nothing: a motion goes
on while the arm comes closer, and a hold lasts while joint states keep coming.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from ugv_acceptance.model.robot import Robot
from ugv_acceptance.plan.plan import Posture, Step, radians_of
from ugv_acceptance.run.actuation import OPERATOR, Hands
from ugv_acceptance.run.world import World

# Seconds between two checks; seconds without progress after which a motion has ended.
LOOK, GRACE = 0.02, 3.0
# Least motion (rad) that counts as progress.
PROGRESS = 1e-3
REFUSED = 'the operator did not do what was asked'


@dataclass(slots=True)
class Moves:
    """Moves the arm from posture to posture until `asked()` or the brake ends it.

    `trail` are the postures since home. Methods return what was wrong as text; empty: nothing.
    """

    world: World
    hands: Hands
    tolerance: float
    asked: Callable[[], bool]
    trail: list[Posture] = field(default_factory=list)

    @property
    def going(self) -> bool:
        """Whether the step may go on: neither the user nor the brake has stopped it."""
        brake = self.world.brake
        return not (self.asked() or (brake.armed and brake.stopped))

    @property
    def _robot(self) -> Robot:
        return self.world.positions.config.settings.robot

    def go(self, posture: Posture, speed: float, step: Step | None = None) -> str:
        """Move to a posture (deg) at a peak speed (rad/s); return what was wrong."""
        if not self.going:
            return self.world.brake.stopped
        self.trail.append(posture)
        target = radians_of(self._robot, posture)
        if self.hands.mode == OPERATOR:
            return self._told_to_go(target, step.id if step else 'way')
        seconds = self.hands.move(target, speed)
        if step is not None and not holds(step):
            self.pause(seconds)
            return ''
        self.pause(0.9 * seconds)
        return self._arrive(target)

    def hold(self, step: Step) -> str:
        """Hold the posture for the step's time; return what was wrong."""
        target, furthest = radians_of(self._robot, step.posture_deg), (0.0, '')
        end = self.world.fed() + step.hold_s
        while self.world.fed() < end and self.going:
            self.world.wait(LOOK)
            furthest = max(furthest, self._off(target))
        kept = furthest[0] <= self.tolerance
        return '' if kept else f'the posture was not held: {self._told(furthest)}'

    def cycle(self, step: Step) -> str:
        """Repeat the postures of a step for its time; return what was wrong."""
        end, before = self.world.fed() + step.hold_s, len(self.trail)
        while self.world.fed() < end and self.going:
            for posture in step.via_deg:
                if wrong := self.go(posture, math.radians(step.speed_degps)):
                    return wrong
                self.pause(min(1.0, max(end - self.world.fed(), 0.0)))
            del self.trail[before + len(step.via_deg) :]
        return ''

    def _told_to_go(self, target: dict[str, float], what: str) -> str:
        """Ask a person to bring the arm to `target` (rad) until joint states show it is there."""
        wanted = ', '.join(f'{n} {self._shown(n, a)}' for n, a in target.items())
        wrong = ''
        if not target:
            return wrong
        while self.going:
            text = f'{what}: bring the arm to {wanted} and hold it'
            if not self.hands.told(f'{wrong}; {text}' if wrong else text):
                return REFUSED
            wrong = self._arrive(target)
            if not wrong:
                return ''
        return self.world.brake.stopped

    def _arrive(self, target: dict[str, float]) -> str:
        """Wait while the arm comes closer to `target` (rad); return which joint missed it."""
        best, since = math.inf, self.world.fed()
        while self.going:
            off = self._off(target)
            if off[0] <= self.tolerance:
                return ''
            if off[0] < best - PROGRESS:
                best, since = off[0], self.world.fed()
            if self.world.fed() - since > GRACE:
                return f'the posture was not reached: {self._told(off)}'
            self.world.wait(LOOK)
        return self.world.brake.stopped

    def _off(self, target: dict[str, float]) -> tuple[float, str]:
        """Return the largest distance (rad) of a joint from `target` (rad), and that joint."""
        now = self.world.positions.now
        away = ((abs(now.get(n, math.inf) - a), n) for n, a in target.items())
        return max(away, default=(0.0, ''))

    def _told(self, off: tuple[float, str]) -> str:
        return f'{off[1]} is {self._shown(off[1], off[0], digits=1)} off'

    def _shown(self, joint: str, at: float, digits: int = 0) -> str:
        """Return a position (rad, m) of a joint in the unit that people read."""
        if self._robot.joint(joint).slides:
            return f'{at:.{digits + 2}f} m'
        return f'{math.degrees(at):.{digits}f} deg'

    def until(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Wait for a condition, for `seconds` at most; return whether it came true."""
        end = self.world.now() + seconds
        while not condition():
            if self.world.now() > end or self.asked():
                return False
            self.world.wait(LOOK)
        return True

    def pause(self, seconds: float) -> None:
        """Wait until joint states came for `seconds`, less if something stops the step."""
        end = self.world.fed() + seconds
        while self.world.fed() < end and self.going:
            self.world.wait(LOOK)


def holds(step: Step) -> bool:
    """Return whether the robot can hold a step's posture: it does not tip, no motor gives way."""
    return (
        step.action != 'tip'
        and step.expected.get('use', 0.0) < 0.995
        and (step.expected.get('tilt_left_deg', 90.0) > 0.0)
    )
