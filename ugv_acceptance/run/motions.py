"""Moves the arm and waits for it by the robot's own messages.

On a slow machine a motion goes on while the arm still comes closer, and a hold lasts while joint
states keep coming.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from ugv_acceptance.plan.plan import Posture, Step, radians_of
from ugv_acceptance.run.actuation import OPERATOR, Hands
from ugv_acceptance.run.world import World

# Seconds between two looks, and without any progress of a motion.
LOOK, GRACE = 0.02, 3.0
# A way (rad) that counts as progress.
PROGRESS = 1e-3
REFUSED = 'the operator did not do what was asked'


@dataclass(slots=True)
class Moves:
    """Brings the arm from posture to posture until `asked()` or the brake ends it.

    `trail` are the postures since home. What is returned says what was wrong; empty: nothing.
    """

    world: World
    hands: Hands
    tolerance: float
    asked: Callable[[], bool]
    trail: list[Posture] = field(default_factory=list)

    @property
    def going(self) -> bool:
        """Whether nothing has stopped the step in hand."""
        brake = self.world.brake
        return not (self.asked() or (brake.armed and brake.stopped))

    def go(self, posture: Posture, speed: float, step: Step | None = None) -> str:
        """Move to a posture (deg) at a peak speed (rad/s)."""
        if not self.going:
            return self.world.brake.stopped
        self.trail.append(posture)
        target = radians_of(posture)
        if self.hands.mode == OPERATOR:
            return self._told_to_go(target, step.id if step else 'way')
        seconds = self.hands.move(target, speed)
        if step is not None and not holds(step):
            self.pause(seconds)
            return ''
        self.pause(0.9 * seconds)
        return self._arrive(target)

    def hold(self, step: Step) -> str:
        """Hold for the step's time."""
        target, furthest = radians_of(step.posture_deg), (0.0, '')
        end = self.world.fed() + step.hold_s
        while self.world.fed() < end and self.going:
            self.world.wait(LOOK)
            furthest = max(furthest, self._off(target))
        kept = furthest[0] <= self.tolerance
        return '' if kept else f'the posture was not held: {_told(furthest)}'

    def cycle(self, step: Step) -> str:
        """Go from posture to posture of a step, again and again, for its time."""
        end, before = self.world.fed() + step.hold_s, len(self.trail)
        while self.world.fed() < end and self.going:
            for posture in step.via_deg:
                if wrong := self.go(posture, math.radians(step.speed_degps)):
                    return wrong
                self.pause(min(1.0, max(end - self.world.fed(), 0.0)))
            del self.trail[before + len(step.via_deg) :]
        return ''

    def _told_to_go(self, target: dict[str, float], what: str) -> str:
        """Have a person bring the arm to `target` (rad), again until joint states show it."""
        wanted = ', '.join(f'{n} {math.degrees(a):.0f} deg' for n, a in target.items())
        wrong = ''
        while self.going:
            text = f'{what}: bring the arm to {wanted} and hold it'
            if not self.hands.told(f'{wrong}; {text}' if wrong else text):
                return REFUSED
            wrong = self._arrive(target)
            if not wrong:
                return ''
        return self.world.brake.stopped

    def _arrive(self, target: dict[str, float]) -> str:
        """Wait while the arm comes closer to `target` (rad); return what is off when it stops."""
        best, since = math.inf, self.world.fed()
        while self.going:
            off = self._off(target)
            if off[0] <= self.tolerance:
                return ''
            if off[0] < best - PROGRESS:
                best, since = off[0], self.world.fed()
            if self.world.fed() - since > GRACE:
                return f'the posture was not reached: {_told(off)}'
            self.world.wait(LOOK)
        return self.world.brake.stopped

    def _off(self, target: dict[str, float]) -> tuple[float, str]:
        """Return the joint that is furthest from `target` (rad), its distance first."""
        now = self.world.positions.now
        return max((abs(now.get(n, math.inf) - a), n) for n, a in target.items())

    def until(self, condition: Callable[[], bool], seconds: float) -> bool:
        """Wait for a condition, at most so long; return whether it came true."""
        end = self.world.now() + seconds
        while not condition():
            if self.world.now() > end or self.asked():
                return False
            self.world.wait(LOOK)
        return True

    def pause(self, seconds: float) -> None:
        """Let seconds pass in which joint states come, fewer when something stops the step."""
        end = self.world.fed() + seconds
        while self.world.fed() < end and self.going:
            self.world.wait(LOOK)


def _told(off: tuple[float, str]) -> str:
    return f'{off[1]} is {math.degrees(off[0]):.1f} deg off'


def holds(step: Step) -> bool:
    """Return whether the posture of a step can be held: the robot stands, the motors bear it."""
    return (
        step.action != 'tip'
        and step.expected.get('use', 0.0) < 0.995
        and (step.expected.get('tilt_left_deg', 90.0) > 0.0)
    )
