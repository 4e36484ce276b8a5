"""Orders the steps of a plan: few changes of ground and load, short moves of the arm."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ugv_acceptance.plan.plan import SIMULATION, Plan, Posture, Step


def ordered(steps: Sequence[Step], home: Posture) -> list[Step]:
    """Return the steps sorted: first the robot's, then the simulation's, by set-up and nearness.

    Steps that end with the robot on its side, and cycles, come last of their kind.
    """
    found: list[Step] = []
    at = home
    for setup in _setups(steps):
        waiting = [s for s in steps if _setup(s) == setup]
        while waiting:
            nearest = min(waiting, key=lambda s: distance(at, s.posture_deg))
            waiting.remove(nearest)
            found.append(nearest)
            at = {**home, **nearest.posture_deg}
    return found


def _setup(step: Step) -> tuple[object, ...]:
    late = step.action in {'tip', 'cycle', 'pull'}
    return (
        step.where == SIMULATION,
        late,
        step.ground.orientation,
        step.ground.tilt_deg,
        step.payload_kg,
    )


def _setups(steps: Sequence[Step]) -> list[tuple[object, ...]]:
    """Return the different set-ups of the steps: level ground first, then in the steps' order."""
    seen = list(dict.fromkeys(_setup(s) for s in steps))
    return sorted(seen, key=lambda s: (s[0], s[1], s[2] != 'level', s[3], str(s[2]), s[4]))


def distance(start: Posture, end: Posture) -> float:
    """Return the largest change of any joint (deg) between two postures."""
    return max((abs(angle - start.get(name, angle)) for name, angle in end.items()), default=0.0)


def way(steps: Sequence[Step], home: Posture) -> float:
    """Return the sum over all steps of the largest joint change (deg) each one needs."""
    places = [home, *({**home, **s.posture_deg} for s in steps)]
    return float(np.sum([distance(a, b) for a, b in pairwise(places)]))


def seconds_of(step: Step, start: Posture, home: Posture) -> float:
    """Return how long (s) a step's motions from `start` and its hold take."""
    seconds, at = step.hold_s, start
    for stop in (*step.via_deg, step.posture_deg):
        seconds += distance(at, stop) * np.pi / (2.0 * step.speed_degps)
        at = {**home, **stop}
    return float(seconds)


def durations(plan: Plan) -> list[float]:
    """Return how long (s) motions and hold of each step take, without what a person does."""
    home = plan.home_deg
    starts = [home, *({**home, **step.posture_deg} for step in plan.steps)]
    return [seconds_of(s, at, home) for s, at in zip(plan.steps, starts, strict=False)]


def duration(plan: Plan) -> float:
    """Return how long (s) the motions and holds of a plan take, without what a person does."""
    return sum(durations(plan))
