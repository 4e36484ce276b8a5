"""Steps of a robot without an arm: only the ground's tilt and the load change its margins."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ugv_acceptance.plan.boundaries import SIDES, STEEPER, TILT
from ugv_acceptance.plan.plan import ROBOT, SIMULATION, Step
from ugv_acceptance.plan.search import Arm, Found, look, safe
from ugv_acceptance.plan.writing import Setup, hold_step
from ugv_acceptance.studies.orientations import ORIENTATIONS
from ugv_acceptance.type_aliases import Floats

# Steps (deg) of the ramps tried.
STEP = 1.0


def ramp_steps(
    arm: Arm, home: Floats, loads: Sequence[float], ramps: tuple[float, float]
) -> Iterator[Step]:
    """Yield the steps on ramps: every orientation, and both sides of each tilt limit.

    `ramps` are the usual and the steepest tilt (rad) on the robot, `loads` in kg.
    """
    tilt, steep = ramps
    for name in ORIENTATIONS:
        if name != 'level':
            yield _step(arm, home, Setup('orientations', loads[len(loads) // 2], (name, tilt)))
    for side in SIDES:
        held = [
            step
            for title, band, where, action in TILT
            for step in _within(arm, home, loads, steep, (side, title, band, where, action))
        ]
        if not any(step.where == ROBOT for step in held):
            setup = Setup('steep ramps', loads[-1], (side, steep))
            held.append(_step(arm, home, setup))
        yield from held


def _step(arm: Arm, home: Floats, setup: Setup) -> Step:
    """Return a step on a ramp; in simulation only where the robot is not safe on it."""
    name, tilt = setup.ground
    found = look(arm, home[None, :], setup.ground, setup.load)
    words = f'{ORIENTATIONS[name].words} of {math.degrees(tilt):.0f} deg'
    purpose = f'the tilt left on this ramp, {ORIENTATIONS[name].words}: do IMU and model agree?'
    return hold_step(arm, setup, found, 0, words, purpose)


def _within(
    arm: Arm,
    home: Floats,
    loads: Sequence[float],
    steep: float,
    wanted: tuple[str, str, tuple[float, float], str, str],
) -> Iterator[Step]:
    """Yield a step on the least ramp and load that leave a tilt within a band (deg), if any do."""
    side, title, band, where, action = wanted
    most = steep if where == ROBOT else STEEPER[-1]
    for tilt in np.radians(np.arange(STEP, math.degrees(most) + STEP / 2.0, STEP)).tolist():
        for load in loads:
            found: Found = look(arm, home[None, :], (side, tilt), load)
            left = math.degrees(float(found.tilt[0]))
            if band[0] < left < band[1] and (where == SIMULATION or safe(arm, found).all()):
                setup = Setup('rollover boundary', load, (side, tilt), where, action)
                text = f'rollover {title}, {ORIENTATIONS[side].words}'
                purpose = f'the model says "{title}" on this ramp: check it'
                yield hold_step(arm, setup, found, 0, text, purpose)
                return
