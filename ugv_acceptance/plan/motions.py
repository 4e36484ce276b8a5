"""Steps with motion or force: lifting, pulling, joint speeds, driving, endurance."""

import math
import re
from collections.abc import Iterator

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.roles import WHEELED
from ugv_acceptance.plan.plan import ROBOT, SIMULATION, Alerts, Step
from ugv_acceptance.plan.search import Arm, Found, look, safe, spread_out
from ugv_acceptance.plan.writing import (
    SAFE_STOP,
    Setup,
    hold_step,
    limits_of,
    posture_deg,
    preparation,
    stop_of,
)
from ugv_acceptance.studies.capacity import CAUSES, lift_capacity, pull_capacity
from ugv_acceptance.studies.orientations import grounding_angle
from ugv_acceptance.type_aliases import Floats

# Loads tried, as shares of the largest the model allows.
LIGHTER, HEAVIER = 0.9, 1.12
# Share of the largest pull, friction of rubber on concrete, height (m) of the hitch.
PULL, FRICTION, HITCH = 0.8, 0.8, 0.1
# Rise (rad) of the first link and of what follows when an object is lifted; least load (kg).
REACH, LEAST_LOAD = (math.radians(55.0), math.radians(-20.0)), 1e-3
# What may not stand in the id of a step.
NOT_IN_ID = re.compile('[^A-Za-z0-9_-]')
# Speeds tried, as shares of the rate to which the static model holds.
SLOWER, FASTER = 0.9, 1.2
NO_FAULT = Alerts(must_not=('ERROR', 'STALE'))


def capacity_steps(arm: Arm, home: Floats) -> Iterator[Step]:
    """Yield steps that lift with and without flippers on the ground, and one that pulls."""
    if arm.varied and arm.robot.payload_link is not None:
        yield from _lifts(arm)
    yield from _drag(arm, home)


def _lifts(arm: Arm) -> Iterator[Step]:
    """Yield steps that lift; none where no load is too heavy, or even none is too much."""
    robot, level = arm.robot, (0.0, 0.0, -arm.robot.gravity)
    reach = _reach(arm)
    ways = {', flippers folded': reach, ', flippers on the ground': _down(arm, reach)}
    for words, q in (ways if arm.roles.flippers else {'': reach}).items():
        if q is None:
            continue
        mass, cause = lift_capacity(robot, q, level, np.array(arm.settings.limits.torque))
        why = CAUSES[int(cause)]
        if not LEAST_LOAD < float(mass) < math.inf:
            continue
        for share, where in ((LIGHTER, ROBOT), (HEAVIER, SIMULATION)):
            load = round(float(mass) * share, 2 if mass >= 1.0 else 4)
            found = look(arm, q[None, :], ('level', 0.0), load)
            yield hold_step(
                arm,
                Setup('lift', load, where=where),
                found,
                0,
                f'lift {share:.0%} of the most{words}',
                f'the model allows {float(mass):.2f} kg here, limited by {why}',
            )


def _drag(arm: Arm, home: Floats) -> Iterator[Step]:
    """Yield the step that pulls the robot backwards at its hitch."""
    robot, level = arm.robot, (0.0, 0.0, -arm.robot.gravity)
    under = 'wheel' if arm.roles.kind == WHEELED else 'track'
    hitch = (0.0, 0.0, hitch_of(robot))
    bounds = pull_capacity(robot, home, level, (-1.0, 0.0, 0.0), np.inf, FRICTION, hitch)
    force = float(bounds.force)
    if math.isfinite(force):
        yield Step(
            id='drag',
            group='drag',
            title=f'drag with {PULL:.0%} of the largest pull',
            purpose=f'pulled backwards at the hitch it holds up to {force:.0f} N'
            f' ({CAUSES[int(bounds.cause)]} first at friction {FRICTION:g})',
            action='pull',
            preparation=(*preparation(arm, Setup('drag')), 'force gauge between hitch and anchor'),
            posture_deg=posture_deg(arm, home),
            force_n=round(PULL * force, 1),
            limits=limits_of(arm.settings),
            alerts=NO_FAULT,
            stop=f'stop when a {under} slips or lifts',
        )


def hitch_of(robot: Robot) -> float:
    """Return the height (m) of the hitch in `base_link`: HITCH above the ground."""
    return robot.ground + HITCH


def _reach(arm: Arm) -> Floats:
    """Return the posture (j,) that reaches forward and low, as an operator lifts an object.

    Its first link rises, what follows leads down to the load.
    """
    points = arm.points(arm.grid)
    first, second, load = points[:, 0], points[:, 1], points[:, len(arm.ends)]
    off = _off(second - first, REACH[0]) + _off(load - second, REACH[1])
    best: Floats = arm.grid[int(off.argmin())]
    return best


def _off(along: Floats, rise: float) -> Floats:
    """Return how far (n,) directions (n, 3) are from one ahead that rises by `rise` (rad)."""
    wanted = np.array((math.cos(rise), 0.0, math.sin(rise)))
    size = np.linalg.norm(along, axis=-1, keepdims=True)
    away: Floats = np.linalg.norm(along / np.maximum(size, 1e-9) - wanted, axis=-1)
    return away


def _down(arm: Arm, q: Floats) -> Floats | None:
    """Return the posture with all flippers laid on the ground; None where they do not reach it."""
    down = q.copy()
    for name in arm.roles.flippers:
        try:
            angle = grounding_angle(arm.robot, name)
        except BadConfig:
            return None
        down[arm.robot.joint_names.index(name)] = angle
    return down


def speed_steps(arm: Arm, home: Floats) -> Iterator[Step]:
    """Yield motions slower and faster than the joint speed up to which the static model holds."""
    limits, names = arm.settings.limits, arm.robot.joint_names
    for joint in arm.varied:
        k = names.index(joint)
        speed = math.degrees(limits.speed[k]) if limits.speed else math.inf
        if not math.isfinite(speed):
            continue
        swing = _swing(arm, home, k)
        if swing is None:
            continue
        start, end = swing
        for share, words in ((SLOWER, 'slower'), (FASTER, 'faster')):
            if math.radians(share * speed) > arm.robot.joint(joint).velocity:
                continue
            fast = share > 1.0
            yield Step(
                id=f'{NOT_IN_ID.sub("-", joint)}-{words}',
                group='speed',
                title=f'{joint} at {share * speed:.0f} deg/s, {words} than the static limit',
                purpose=f'the static model is valid up to {speed:g} deg/s: above that the monitor'
                ' must warn',
                action='sweep',
                preparation=preparation(arm, Setup('speed')),
                posture_deg=posture_deg(arm, end),
                via_deg=(posture_deg(arm, start),),
                speed_degps=round(share * speed, 2),
                hold_s=1.5,
                limits={f'{joint}_degps': round(speed, 2)},
                alerts=Alerts(
                    must=(f'WARN STATIC_MODEL {joint}',) if fast else (),
                    must_not=('ERROR', 'STALE', *(() if fast else (f'WARN STATIC_MODEL {joint}',))),
                ),
                stop=SAFE_STOP,
            )


def _swing(arm: Arm, home: Floats, k: int) -> tuple[Floats, Floats] | None:
    """Return two postures between which joint `k` moves by up to 60 deg within all limits.

    None where it cannot move by 30 deg.
    """
    joint = arm.robot.joint(arm.robot.joint_names[k])
    level = ('level', 0.0)
    for start in (home, *arm.grid[safe(arm, look(arm, arm.grid, level, 0.0), 0.3)]):
        for turn in (60.0, -60.0, 45.0, -45.0, 30.0, -30.0):
            path = np.tile(start, (25, 1))
            path[:, k] += np.linspace(0.0, math.radians(turn), 25)
            if not joint.lower <= path[-1, k] <= joint.upper:
                continue
            if safe(arm, look(arm, path, level, 0.0), 0.1).all() and arm.clear(path).all():
                return path[0], path[-1]
    return None


def drive_steps(arm: Arm, home: Floats) -> Iterator[Step]:
    """Yield the steps that drive with the arm folded, during which no alert may come."""
    for title, drive in (
        ('drive forward', (0.25, 0.0)),
        ('drive backward', (-0.25, 0.0)),
        ('turn on the spot', (0.0, 30.0)),
    ):
        yield Step(
            id=title.replace(' ', '-'),
            group='driving',
            title=title,
            purpose='jolts of normal driving raise no critical alert',
            action='drive',
            preparation=(*preparation(arm, Setup('driving')), '3 m free ahead and behind'),
            posture_deg=posture_deg(arm, home),
            drive=drive,
            hold_s=3.0,
            limits=limits_of(arm.settings),
            alerts=NO_FAULT,
            stop=stop_of(arm),
        )


def endurance_steps(arm: Arm, home: Floats, seconds: float) -> Iterator[Step]:
    """Yield the endurance test (s): safe postures repeated, as in the paper's reference [6]."""
    load = arm.robot.payload.mass / 2.0
    found: Found = look(arm, arm.grid, ('level', 0.0), load)
    rows = np.flatnonzero(safe(arm, found, 0.25))
    chosen = [rows[k] for k in spread_out(found.q[rows], 4, arm.columns)]
    if not chosen:
        return
    yield Step(
        id='endurance',
        group='endurance',
        title=f'{seconds / 3600.0:g} hours of work',
        purpose='what wears out: motors, gears, encoders, battery; alerts that come too often',
        action='cycle',
        preparation=(*preparation(arm, Setup('endurance', load)), 'battery charged, spare at hand'),
        payload_kg=round(load, 3),
        posture_deg=posture_deg(arm, home),
        via_deg=tuple(posture_deg(arm, found.q[k]) for k in chosen),
        hold_s=seconds,
        limits=limits_of(arm.settings),
        alerts=NO_FAULT,
        stop=SAFE_STOP,
    )
