"""Steps with motion or force: lifting, pulling, joint speeds, driving, endurance."""

import math
from collections.abc import Iterator

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.plan.plan import ROBOT, SIMULATION, Alerts, Step
from ugv_acceptance.plan.search import Arm, Found, look, safe, spread_out
from ugv_acceptance.plan.writing import (
    SAFE_STOP,
    Setup,
    hold_step,
    limits_of,
    posture_deg,
    preparation,
)
from ugv_acceptance.studies.capacity import CAUSES, lift_capacity, pull_capacity
from ugv_acceptance.studies.orientations import grounding_angle
from ugv_acceptance.type_aliases import Floats

# Loads tried, as shares of the largest the model allows.
LIGHTER, HEAVIER = 0.9, 1.12
# Share of the largest pull, friction of rubber on concrete, height (m) of the hitch.
PULL, FRICTION, HITCH = 0.8, 0.8, 0.1
# Speeds tried, as shares of the rate to which the static model holds.
SLOWER, FASTER = 0.9, 1.2
NO_FAULT = Alerts(must_not=('ERROR', 'STALE'))


def capacity_steps(arm: Arm, home: Floats) -> Iterator[Step]:
    """Yield steps that lift with and without flippers on the ground, and one that pulls."""
    robot, level = arm.robot, (0.0, 0.0, -arm.robot.gravity)
    reach = _reach(arm)
    for words, q in (('flippers folded', reach), ('flippers on the ground', _down(arm, reach))):
        if q is None:
            continue
        mass, cause = lift_capacity(robot, q, level, np.array(arm.settings.limits.torque))
        why = CAUSES[int(cause)]
        for share, where in ((LIGHTER, ROBOT), (HEAVIER, SIMULATION)):
            load = round(float(mass) * share, 2)
            found = look(arm, q[None, :], ('level', 0.0), load)
            yield hold_step(
                arm,
                Setup('lift', load, where=where),
                found,
                0,
                f'lift {share:.0%} of the most, {words}',
                f'the model allows {float(mass):.2f} kg here, limited by {why}',
            )
    hitch = (0.0, 0.0, HITCH)
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
            preparation=(*preparation(Setup('drag')), 'force gauge between hitch and anchor'),
            posture_deg=posture_deg(arm, home),
            force_n=round(PULL * force, 1),
            limits=limits_of(arm.settings),
            alerts=NO_FAULT,
            stop='stop when a track slips or lifts',
        )


def _reach(arm: Arm) -> Floats:
    """Return the posture (j,) that reaches forward and low, as an operator lifts an object."""
    q = arm.folded.copy()
    names = arm.robot.joint_names
    q[names.index(arm.roles.axes[0])] = math.radians(55.0)
    q[names.index(arm.roles.axes[1])] = math.radians(-75.0)
    return q


def _down(arm: Arm, q: Floats) -> Floats | None:
    if arm.roles.flipper is None:
        return None
    try:
        angle = grounding_angle(arm.robot, arm.roles.flipper)
    except BadConfig:
        return None
    down = q.copy()
    down[arm.robot.joint_names.index(arm.roles.flipper)] = angle
    return down


def speed_steps(arm: Arm, home: Floats) -> Iterator[Step]:
    """Yield motions slower and faster than the joint speed up to which the static model holds."""
    limits, names = arm.settings.limits, arm.robot.joint_names
    for joint in arm.roles.axes:
        k = names.index(joint)
        speed = math.degrees(limits.speed[k]) if limits.speed else math.inf
        if not math.isfinite(speed):
            continue
        start, end = _swing(arm, home, k)
        for share, words in ((SLOWER, 'slower'), (FASTER, 'faster')):
            if math.radians(share * speed) > arm.robot.joint(joint).velocity:
                continue
            fast = share > 1.0
            yield Step(
                id=f'{joint}-{words}',
                group='speed',
                title=f'{joint} at {share * speed:.0f} deg/s, {words} than the static limit',
                purpose=f'the static model is valid up to {speed:g} deg/s: above that the monitor'
                ' must warn',
                action='sweep',
                preparation=preparation(Setup('speed')),
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


def _swing(arm: Arm, home: Floats, k: int) -> tuple[Floats, Floats]:
    """Return two postures between which joint `k` moves by up to 60 deg within all limits."""
    level = ('level', 0.0)
    for start in (home, *arm.grid[safe(arm, look(arm, arm.grid, level, 0.0), 0.3)]):
        for turn in (60.0, -60.0, 45.0, -45.0, 30.0, -30.0):
            path = np.tile(start, (25, 1))
            path[:, k] += np.linspace(0.0, math.radians(turn), 25)
            if safe(arm, look(arm, path, level, 0.0), 0.1).all() and arm.clear(path).all():
                return path[0], path[-1]
    raise BadConfig(f'{arm.robot.name}: expected a safe motion of joint {k} by 30 deg, found none')


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
            preparation=(*preparation(Setup('driving')), '3 m free ahead and behind'),
            posture_deg=posture_deg(arm, home),
            drive=drive,
            hold_s=3.0,
            limits=limits_of(arm.settings),
            alerts=NO_FAULT,
            stop=SAFE_STOP,
        )


def endurance_steps(arm: Arm, home: Floats, seconds: float) -> Iterator[Step]:
    """Yield the endurance test (s): safe postures repeated, as in the paper's reference [6]."""
    load = arm.robot.payload.mass / 2.0
    found: Found = look(arm, arm.grid, ('level', 0.0), load)
    rows = np.flatnonzero(safe(arm, found, 0.25))
    names = [arm.robot.joint_names.index(n) for n in arm.roles.axes]
    chosen = [rows[k] for k in spread_out(found.q[rows], 4, names)]
    yield Step(
        id='endurance',
        group='endurance',
        title=f'{seconds / 3600.0:g} hours of work',
        purpose='what wears out: motors, gears, encoders, battery; alerts that come too often',
        action='cycle',
        preparation=(*preparation(Setup('endurance', load)), 'battery charged, spare at hand'),
        payload_kg=round(load, 3),
        posture_deg=posture_deg(arm, home),
        via_deg=tuple(posture_deg(arm, found.q[k]) for k in chosen),
        hold_s=seconds,
        limits=limits_of(arm.settings),
        alerts=NO_FAULT,
        stop=SAFE_STOP,
    )
