"""Fills in the texts and numbers of a step: preparation, limits, expected margins and alerts."""

import math
from dataclasses import dataclass

from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.plan.plan import ROBOT, Alerts, Ground, Posture, Step
from ugv_acceptance.plan.search import Arm, Found
from ugv_acceptance.studies.orientations import ORIENTATIONS
from ugv_acceptance.type_aliases import Floats

# The stop rule of a step that a robot survives; of a robot without an arm.
ROVER_STOP = 'stop at any DANGER or NO DATA alert that is not expected, or when anybody says stop'
SAFE_STOP = (
    'stop and freeze the arm at any DANGER or NO DATA alert that is not expected, when the posture'
    ' is not reached, or when anybody says stop'
)
# Closer to a limit than this (share; deg), which side of it a measurement falls on is chance.
NEAR_USE, NEAR_TILT = 0.03, 0.7


@dataclass(frozen=True, slots=True)
class Setup:
    """The set-up of a step: group, load (kg), ground (orientation, tilt in rad), where, action."""

    group: str
    load: float = 0.0
    ground: tuple[str, float] = ('level', 0.0)
    where: str = ROBOT
    action: str = 'hold'


def posture_deg(arm: Arm, q: Floats) -> Posture:
    """Return a posture (j,) in degrees by joint name; of joints that slide in m."""
    pairs = zip(arm.robot.joint_names, q.tolist(), strict=True)
    return {
        name: round(at, 4) if arm.robot.joint(name).slides else round(math.degrees(at), 2)
        for name, at in pairs
    }


def hold_step(arm: Arm, setup: Setup, found: Found, k: int, title: str, purpose: str) -> Step:
    """Return the step that holds the posture in row `k` of `found`."""
    tilt = math.degrees(float(found.tilt[k]))
    use = float(found.most[k])
    tips = setup.action == 'tip'
    return Step(
        id=_slug(title, setup),
        group=setup.group,
        title=title,
        purpose=purpose,
        where=setup.where,  # type: ignore[arg-type]  # one of the two
        action=setup.action,  # type: ignore[arg-type]  # one of them
        preparation=preparation(arm, setup),
        ground=Ground(
            orientation=setup.ground[0], tilt_deg=round(math.degrees(setup.ground[1]), 2)
        ),
        payload_kg=round(setup.load, 3),
        posture_deg=posture_deg(arm, found.q[k]),
        hold_s=4.0 if tips else 3.0,
        limits=limits_of(arm.settings),
        expected={'tilt_left_deg': round(tilt, 2), 'use': round(use, 3)},
        alerts=alerts_of(arm.settings, use, tilt, tips=tips),
        stop=stop_of(arm) if not tips else 'the robot tips over: let it, then stand it up again',
    )


def _slug(title: str, setup: Setup) -> str:
    return slug(f'{title} {setup.load:g}kg'.lower())


def slug(text: str) -> str:
    """Return a text as part of a step's id: letters and digits of ASCII, joined by hyphens."""
    return '-'.join(''.join(c if c.isascii() and c.isalnum() else ' ' for c in text).split())


def stop_of(arm: Arm) -> str:
    """Return the stop rule of a step that the robot survives."""
    return SAFE_STOP if arm.varied else ROVER_STOP


def preparation(arm: Arm, setup: Setup) -> tuple[str, ...]:
    """Return the operator's tasks before a step, one sentence each."""
    name, tilt = setup.ground
    words = ORIENTATIONS[name].words
    ground = (
        'robot on level, hard ground'
        if name == 'level'
        else f'robot on the ramp, {words}, {math.degrees(tilt):.0f} deg'
    )
    place, empty = ('in the gripper', 'gripper empty') if arm.varied else ('on it', 'no load')
    load = f'{setup.load:g} kg {place}, declared' if setup.load else empty
    guard = 'belay the robot against tipping; nobody within 2 m'
    return ground, load, guard


def limits_of(settings: Settings) -> dict[str, float]:
    """Return the limits a step is judged by, with names and units for the reader."""
    limits = settings.limits
    robot = settings.robot
    pairs = zip(robot.joint_names, limits.torque, strict=True)
    found = {
        f'{name}_{"n" if robot.joint(name).slides else "nm"}': limit
        for name, limit in pairs
        if math.isfinite(limit)
    }
    return found | {'tilt_left_deg': round(math.degrees(limits.tip_error), 3)}


def alerts_of(settings: Settings, use: float, tilt: float, *, tips: bool = False) -> Alerts:
    """Return the alerts a posture must and must not raise, by its torque use and tilt left (deg).

    Where it is so near a limit that an alert may come or not, neither is demanded.
    """
    limits = settings.limits
    must: list[str] = []
    must_not: list[str] = ['STALE', 'ERROR INPUT_INVALID', 'ERROR IMU_INCONSISTENT']
    bounds = (
        ('WARN TORQUE_LIMIT', use - limits.torque_warn, NEAR_USE),
        ('ERROR TORQUE_LIMIT', use - limits.torque_error, NEAR_USE),
        ('WARN TIP_OVER', math.degrees(limits.tip_warn) - tilt, NEAR_TILT),
        ('ERROR TIP_OVER', math.degrees(limits.tip_error) - tilt, NEAR_TILT),
    )
    for pattern, beyond, near in bounds:
        if beyond > near:
            must.append(pattern)
        elif beyond < -near and not (tips and 'TORQUE' in pattern):
            must_not.append(pattern)
    if use > limits.torque_error:
        # The motor gives way at its limit, so the posture that asks for more is never held.
        must.remove('ERROR TORQUE_LIMIT') if 'ERROR TORQUE_LIMIT' in must else None
        must_not = [p for p in must_not if not p.endswith('TIP_OVER')]
    if tips:
        must_not = ['ERROR INPUT_INVALID']
    return Alerts(must=tuple(must), must_not=tuple(must_not))


def side_text(index: int) -> str:
    """Return the name of a side the robot can tip to."""
    return SIDES[index]
