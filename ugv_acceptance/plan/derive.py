"""A test plan derived from the model: worst postures, both sides of every boundary, loads, speeds.

What would fail is left to the simulation, as the paper proposes; what is run on the robot is
reached by ways that pass no limit either.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.config import Config
from ugv_acceptance.model.blocks import Floats
from ugv_acceptance.plan.motions import capacity_steps, drive_steps, endurance_steps, speed_steps
from ugv_acceptance.plan.order import distance, ordered
from ugv_acceptance.plan.plan import ROBOT, SIMULATION, Plan, Posture, Step
from ugv_acceptance.plan.search import Arm, Found, Mask, look, roles_of, safe, safe_way, spread_out
from ugv_acceptance.plan.writing import Setup, hold_step, posture_deg
from ugv_acceptance.studies.orientations import ORIENTATIONS

# Share of a limit (and 20 deg of tilt) by which tests on a robot stay inside, by default.
SPARE = 0.05
# Use of the torque limit just inside and just outside; tilt left (deg) inside, beyond, tipping.
INSIDE, OUTSIDE = (0.90, 0.97), (1.04, 1.15)
TILT_INSIDE, TILT_BEYOND, TILT_OVER = (6.0, 9.0), (1.0, 4.0), (-8.0, -2.5)

# Speed (deg/s) of a demonstration: just below the rate to which the static model holds.
QUICK = 35.0
# And of a motion that ends in a tip-over, in simulation.
TIPPING = 50.0


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a plan is asked for: tilt of the ramp (rad), loads (kg), points a boundary."""

    tilt: float = math.radians(10.0)
    steep: float = math.radians(25.0)
    points: int = 3
    endurance: float = 6.0 * 3600.0
    short: bool = False


def derive(config: Config, wanted: Wanted = Wanted()) -> Plan:
    """Return the plan for a robot. Raises BadConfig unless two arm joints have a torque limit."""
    arm = Arm(config.settings, roles_of(config.settings))
    full = config.settings.robot.payload.mass
    loads = (0.0, full / 2.0, full) if full else (0.0,)
    home = home_of(arm, wanted, loads[-1])
    place = posture_deg(arm, home)
    steps: list[Step] = [
        *_worst_postures(arm, loads),
        *_torque_boundary(arm, wanted, loads),
        *_orientations(arm, wanted, loads),
        *_tip_boundary(arm, wanted, loads),
        *capacity_steps(arm, home),
        *speed_steps(arm, home),
        *drive_steps(arm, home),
        *endurance_steps(arm, home, wanted.endurance),
    ]
    if wanted.short:
        steps = _few(steps, place)
    routed = _routed(arm, ordered([_refused(arm, s) for s in steps], place), home)
    final = ordered(routed, place)
    return Plan(
        plan=f'{config.name}{"-short" if wanted.short else ""}',
        robot=config.name,
        config_sha256=config.sha256,
        home_deg=place,
        steps=tuple(_numbered(_routed(arm, final, home))),
    )


def home_of(arm: Arm, wanted: Wanted, load: float) -> Floats:
    """Return the posture (j,) from which all starts: most tilt left with torques below half."""
    worst = np.full(len(arm.grid), np.inf)
    for name in ORIENTATIONS:
        found = look(arm, arm.grid, (name, 0.0 if name == 'level' else wanted.tilt), load)
        worst = np.minimum(worst, np.where(found.most < 0.5, found.tilt, -np.inf))
    home: Floats = arm.grid[int(worst.argmax())]
    return home


def _worst_postures(arm: Arm, loads: Sequence[float]) -> Iterator[Step]:
    """Table 1 of the paper for this robot: the posture that asks most of each joint."""
    names, load = arm.robot.joint_names, loads[-1]
    found = look(arm, arm.grid, ('level', 0.0), load)
    for joint in arm.roles.axes:
        use = found.use[:, names.index(joint)]
        for title, rows in (
            ('worst posture of all', np.ones(len(use), bool)),
            ('worst posture within limits', safe(arm, found, SPARE)),
        ):
            if rows.any():
                k = int(np.where(rows, use, -1.0).argmax())
                purpose = f'{joint} carries as much as it ever does ({title}, {load:g} kg)'
                yield hold_step(
                    arm, Setup('worst postures', load), found, k, f'{joint}: {title}', purpose
                )


def _torque_boundary(arm: Arm, wanted: Wanted, loads: Sequence[float]) -> Iterator[Step]:
    for load in loads[1:] or loads:
        found = look(arm, arm.grid, ('level', 0.0), load)
        for title, (low, high), where in (
            ('just inside', INSIDE, ROBOT),
            ('just outside', OUTSIDE, SIMULATION),
        ):
            rows = (found.most > low) & (found.most < high) & (found.tilt > math.radians(8.0))
            purpose = f'the torque map says {title} at {load:g} kg: is the boundary where it says?'
            setup = Setup('torque boundary', load, where=where)
            yield from _spread(arm, found, rows, wanted.points, setup, f'torque {title}', purpose)


def _orientations(arm: Arm, wanted: Wanted, loads: Sequence[float]) -> Iterator[Step]:
    """Each orientation of Figure 6: the posture that leaves least of any margin, within limits."""
    load = loads[len(loads) // 2]
    for name, orientation in ORIENTATIONS.items():
        if name == 'level':
            continue
        found = look(arm, arm.grid, (name, wanted.tilt), load)
        rows = safe(arm, found, SPARE)
        if not rows.any():
            continue
        k = int(np.where(rows, found.tilt, np.inf).argmin())
        setup = Setup('orientations', load, (name, wanted.tilt))
        purpose = f'least tilt left within limits, {orientation.words}: do IMU and map agree?'
        yield hold_step(arm, setup, found, k, orientation.words, purpose)


def _tip_boundary(arm: Arm, wanted: Wanted, loads: Sequence[float]) -> Iterator[Step]:
    """Both sides of the rollover map's boundaries, the arm turned to the low side."""
    for name in ('nose-down', 'nose-up', 'right', 'left'):
        turret = ORIENTATIONS[name].heading or 0.0
        grid = arm.turned(arm.grid, turret)
        grid = grid[arm.clear(grid)]
        for title, (low, high), where in (
            ('just inside', TILT_INSIDE, ROBOT),
            ('beyond the limit', TILT_BEYOND, SIMULATION),
            ('tips over', TILT_OVER, SIMULATION),
        ):
            best = _richest(arm, grid, name, wanted, loads, (low, high))
            if best is None:
                continue
            load, tilt, found, rows = best
            action = 'tip' if title == 'tips over' else 'hold'
            setup = Setup('rollover boundary', load, (name, tilt), where, action)
            text = f'rollover {title}, {ORIENTATIONS[name].words}'
            purpose = f'the rollover map says "{title}": is the boundary where it says?'
            count = max(1, wanted.points - 2)
            yield from _spread(arm, found, rows, count, setup, text, purpose)


def _richest(
    arm: Arm,
    grid: Floats,
    name: str,
    wanted: Wanted,
    loads: Sequence[float],
    band: tuple[float, float],
) -> tuple[float, float, Found, Mask] | None:
    """Return load, tilt, margins and rows for which most postures lie in the band (deg left)."""
    found: list[tuple[int, float, float, Found, Mask]] = []
    for load in loads:
        for tilt in (wanted.tilt, (wanted.tilt + wanted.steep) / 2.0, wanted.steep):
            seen = look(arm, grid, (name, tilt), load)
            left = np.degrees(seen.tilt)
            rows = (left > band[0]) & (left < band[1]) & (seen.most < 0.75)
            if rows.any():
                found.append((int(rows.sum()), load, tilt, seen, rows))
    if not found:
        return None
    _, load, tilt, seen, rows = max(found, key=lambda f: f[0])
    return load, tilt, seen, rows


def _spread(
    arm: Arm, found: Found, rows: Mask, count: int, setup: Setup, title: str, purpose: str
) -> Iterator[Step]:
    places = np.flatnonzero(rows)
    names = [arm.robot.joint_names.index(n) for n in arm.roles.axes]
    for number, k in enumerate(spread_out(found.q[places], count, names), 1):
        yield hold_step(arm, setup, found, int(places[k]), f'{title} {number}', purpose)


def _refused(arm: Arm, step: Step) -> Step:
    """Return the step, left to the simulation if it would pass a limit on the robot."""
    if step.where == SIMULATION or step.action in {'drive', 'pull', 'cycle'}:
        return step
    limits = arm.settings.limits
    use = step.expected.get('use', 0.0)
    tilt = math.radians(step.expected.get('tilt_left_deg', 90.0))
    fails = use >= limits.torque_error or tilt <= limits.tip_error
    return step.model_copy(update={'where': SIMULATION}) if fails else step


def _routed(arm: Arm, steps: Sequence[Step], home: Floats) -> list[Step]:
    """Return the steps with the postures on the way; unreachable ones go to the simulation."""
    found: list[Step] = []
    before, setup = home, None
    for step in steps:
        now = (step.ground, step.payload_kg)
        start = before if now == setup else home
        if step.action in {'hold', 'tip', 'sweep', 'pull'}:
            step = _with_way(arm, step, start, home)  # noqa: PLW2901 - the same step, its way known
        before, setup = _vector(arm, home, step.posture_deg), now
        found.append(step)
    return found


def _with_way(arm: Arm, step: Step, start: Floats, home: Floats) -> Step:
    if step.action == 'sweep':
        return step
    end = _vector(arm, home, step.posture_deg)
    ground = step.ground.orientation, math.radians(step.ground.tilt_deg)
    if step.where == SIMULATION:
        return step.model_copy(update={'via_deg': ()})
    for middle in ((), (home,), *(((m,)) for m in _detours(arm, home, end))):
        if safe_way(arm, [start, *middle, end], ground, step.payload_kg):
            return step.model_copy(update={'via_deg': tuple(posture_deg(arm, m) for m in middle)})
    return step.model_copy(
        update={
            'where': SIMULATION,
            'via_deg': (),
            'purpose': f'{step.purpose} (no safe way to it)',
        }
    )


def _detours(arm: Arm, home: Floats, end: Floats) -> Iterator[Floats]:
    """Yield postures between: one joint first, then the other."""
    for name in (*arm.roles.axes, *([arm.roles.turret] if arm.roles.turret else [])):
        k = arm.robot.joint_names.index(name)
        between = home.copy()
        between[k] = end[k]
        yield between


def _vector(arm: Arm, home: Floats, posture: Posture) -> Floats:
    q = home.copy()
    for name, angle in posture.items():
        q[arm.robot.joint_names.index(name)] = math.radians(angle)
    return q


def _few(steps: Sequence[Step], home: Posture) -> list[Step]:
    """Return one step of each kind, near home and quick, as a demonstration wants it."""
    wanted = (
        ('torque boundary', ROBOT, 'hold'),
        ('rollover boundary', ROBOT, 'hold'),
        ('speed', ROBOT, 'sweep'),
        ('rollover boundary', SIMULATION, 'tip'),
    )
    quick = {'hold_s': 1.5, 'speed_degps': QUICK}
    found = []
    for kind in wanted:
        of = [s for s in steps if (s.group, s.where, s.action) == kind]
        if of:
            nearest = min(of, key=lambda s: (not s.alerts.must, distance(home, s.posture_deg)))
            sweeps = nearest.action == 'sweep'
            speed = {'speed_degps': TIPPING} if nearest.action == 'tip' else {}
            found.append(nearest if sweeps else nearest.model_copy(update=quick | speed))
    return found


def _numbered(steps: Sequence[Step]) -> list[Step]:
    return [s.model_copy(update={'id': f'{k:02d}-{s.id}'}) for k, s in enumerate(steps, 1)]
