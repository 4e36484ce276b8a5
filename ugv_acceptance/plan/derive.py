"""Derives a test plan from the model: worst postures, boundaries, loads, speeds, endurance.

A step in which the robot would fail is done in simulation only, as the paper proposes. The steps
for the real robot are reached by paths on which no limit is passed either.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config
from ugv_acceptance.plan.arm_paths import Routes
from ugv_acceptance.plan.boundaries import tip_boundary, torque_boundary
from ugv_acceptance.plan.motions import capacity_steps, drive_steps, endurance_steps, speed_steps
from ugv_acceptance.plan.order import ordered, seconds_of
from ugv_acceptance.plan.plan import ROBOT, SIMULATION, Plan, Posture, Step, radians_of
from ugv_acceptance.plan.rover import ramp_steps
from ugv_acceptance.plan.search import Arm, look, safe
from ugv_acceptance.plan.writing import Setup, hold_step, posture_deg
from ugv_acceptance.studies.axes import check_drives
from ugv_acceptance.studies.orientations import ORIENTATIONS
from ugv_acceptance.type_aliases import Floats

# Share of a limit (and 20 deg of tilt) by which tests on a robot stay inside, by default.
SPARE = 0.05
# The steps of a demonstration by group, place and action, and what is different in them: as fast
# as the static model holds, or as the simulated arm can.
QUICK = {'hold_s': 1.0, 'speed_degps': 35.0}
SHORT: dict[tuple[str, str, str], dict[str, float]] = {
    ('torque boundary', ROBOT, 'hold'): QUICK,
    ('rollover boundary', ROBOT, 'hold'): QUICK,
    ('speed', ROBOT, 'sweep'): {},
    ('rollover boundary', SIMULATION, 'tip'): {**QUICK, 'speed_degps': 57.0},
}
# The same where there is no arm to move.
SHORT_ROVER: dict[tuple[str, str, str], dict[str, float]] = {
    ('orientations', ROBOT, 'hold'): QUICK,
    ('rollover boundary', ROBOT, 'hold'): QUICK,
    ('driving', ROBOT, 'drive'): {},
    ('rollover boundary', SIMULATION, 'tip'): QUICK,
}


@dataclass(frozen=True, slots=True)
class Wanted:
    """The options of a plan: angles of its ramps (rad), tests per boundary, endurance (s).

    `steep` is used where no posture at `tilt` comes near a tilt limit. `short` asks for a
    demonstration of minutes: one step of each kind.
    """

    tilt: float = math.radians(10.0)
    steep: float = math.radians(25.0)
    points: int = 1
    endurance: float = 6.0 * 3600.0
    short: bool = False


# What a plan is where nobody asks for anything else.
FULL = Wanted()


def derive(config: Config, wanted: Wanted = FULL) -> Plan:
    """Return the plan for a robot on wheels or tracks; without an arm, of ramps and driving.

    Raises BadConfig for a robot that stands on legs or on nothing.
    """
    check_drives(config.settings.robot, 'plan')
    arm = Arm(config.settings)
    if not len(arm.grid):
        raise BadConfig(
            f'{config.name}: expected a posture of {" and ".join(arm.varied)} in which the arm '
            'touches neither ground nor deck, with the other joints at rest, found none'
        )
    full = config.settings.robot.payload.mass
    loads = (0.0, full / 2.0, full) if full else (0.0,)
    home = home_of(arm, wanted, loads[-1])
    place = posture_deg(arm, home)
    routes = Routes(arm, home)
    steps = [_refused(arm, step) for step in _steps(routes, wanted, loads)]
    if wanted.short:
        steps = _few(routes, steps)
    routed = _routed(routes, ordered(steps, place))
    final = ordered(routed, place)
    return Plan(
        plan=f'{config.name}{"-short" if wanted.short else ""}',
        robot=config.name,
        config_sha256=config.sha256,
        home_deg=place,
        steps=tuple(_numbered(_routed(routes, final))),
    )


def _steps(routes: Routes, wanted: Wanted, loads: Sequence[float]) -> Iterator[Step]:
    """Yield all steps, not yet in order; of a robot without an arm those of its chassis."""
    arm, home = routes.arm, routes.home
    ramps = (wanted.tilt, wanted.steep)
    if arm.varied:
        yield from _worst_postures(routes, loads)
        yield from torque_boundary(routes, wanted.points, loads)
        yield from _orientations(routes, wanted.tilt, loads)
        yield from tip_boundary(routes, wanted.points, loads, ramps)
    else:
        yield from ramp_steps(arm, home, loads, ramps)
    yield from capacity_steps(arm, home)
    if arm.varied:
        yield from speed_steps(arm, home)
    yield from drive_steps(arm, home)
    if arm.varied:
        yield from endurance_steps(arm, home, wanted.endurance)


def notes_of(config: Config) -> list[str]:
    """Return what a robot's plan leaves out for want of an entry, each with what to set."""
    arm = Arm(config.settings)
    robot = config.settings.robot
    if arm.roles.arm and not arm.varied:
        joints = ', '.join(arm.roles.arm)
        return [f'the arm ({joints}) has fewer than two joints that turn: the plan moves none']
    found = []
    untold = [name for name in arm.roles.axes if name not in arm.judged]
    if untold:
        found.append(
            f'no torque steps for {", ".join(untold)}: no limit is known; set '
            f'joints.{untold[0]}.limit_nm (of each) in the configuration'
        )
    if arm.varied and arm.on_column:
        found.append(
            f'the body below {arm.varied[0]} is not known to the plan: look where the arm goes '
            'before each posture'
        )
    if arm.varied and robot.payload_link is None:
        found.append(
            'no steps with a load: payload.link is missing; set it to the link that carries it'
        )
    return found


def home_of(arm: Arm, wanted: Wanted, load: float) -> Floats:
    """Return the posture (j,) where every step begins: most tilt left with torques below half."""
    worst = np.full(len(arm.grid), np.inf)
    for name in ORIENTATIONS:
        found = look(arm, arm.grid, (name, 0.0 if name == 'level' else wanted.tilt), load)
        worst = np.minimum(worst, np.where(found.most < 0.5, found.tilt, -np.inf))
    home: Floats = arm.grid[int(worst.argmax())]
    return home


def _worst_postures(routes: Routes, loads: Sequence[float]) -> Iterator[Step]:
    """Yield the steps of the paper's Table 1 for this robot: each joint at its largest torque."""
    arm, load, level = routes.arm, loads[-1], ('level', 0.0)
    found = look(arm, arm.grid, level, load)
    for joint in arm.judged:
        use = np.abs(found.share[:, arm.robot.joint_names.index(joint)])
        within = safe(arm, found, SPARE) & routes.paths(level, load).reachable
        for title, rows in (
            ('worst posture of all', np.ones(len(use), bool)),
            ('worst posture within limits', within),
        ):
            if rows.any():
                k = int(np.where(rows, use, -1.0).argmax())
                purpose = f'the highest torque of {joint} ({title}, {load:g} kg)'
                yield hold_step(
                    arm, Setup('worst postures', load), found, k, f'{joint}: {title}', purpose
                )


def _orientations(routes: Routes, tilt: float, loads: Sequence[float]) -> Iterator[Step]:
    """Yield a step for each orientation of Figure 6: the least margin within the limits."""
    arm, load = routes.arm, loads[len(loads) // 2]
    for name, orientation in ORIENTATIONS.items():
        if name == 'level':
            continue
        found = look(arm, arm.grid, (name, tilt), load)
        rows = safe(arm, found, SPARE) & routes.paths((name, tilt), load).reachable
        if not rows.any():
            continue
        k = int(np.where(rows, found.tilt, np.inf).argmin())
        setup = Setup('orientations', load, (name, tilt))
        purpose = f'least tilt left within limits, {orientation.words}: do IMU and map agree?'
        yield hold_step(arm, setup, found, k, orientation.words, purpose)


def _refused(arm: Arm, step: Step) -> Step:
    """Return the step, marked for simulation only if it would pass a limit on the robot."""
    if step.where == SIMULATION or step.action in {'drive', 'pull', 'cycle'}:
        return step
    limits = arm.settings.limits
    use = step.expected.get('use', 0.0)
    tilt = math.radians(step.expected.get('tilt_left_deg', 90.0))
    fails = use >= limits.torque_error or tilt <= limits.tip_error
    return step.model_copy(update={'where': SIMULATION}) if fails else step


def _routed(routes: Routes, steps: Sequence[Step]) -> list[Step]:
    """Return the steps with the postures on the way; without a safe path: for simulation only."""
    found: list[Step] = []
    home = routes.home
    before, setup = home, None
    for step in steps:
        now = (step.ground, step.payload_kg)
        start = before if now == setup else home
        found.append(_with_way(routes, step, start))
        before, setup = _vector(routes.arm, home, step.posture_deg), now
    return found


def _with_way(routes: Routes, step: Step, start: Floats) -> Step:
    if step.action not in {'hold', 'tip', 'pull'}:
        return step  # the postures on the way are its purpose
    if step.where == SIMULATION:
        return step.model_copy(update={'via_deg': ()})
    arm = routes.arm
    end = _vector(arm, routes.home, step.posture_deg)
    ground = step.ground.orientation, math.radians(step.ground.tilt_deg)
    middle = routes.between(start, end, ground, step.payload_kg)
    if middle is not None:
        return step.model_copy(update={'via_deg': tuple(posture_deg(arm, m) for m in middle)})
    told = f'{step.purpose} (no safe way to it)'
    return step.model_copy(update={'where': SIMULATION, 'via_deg': (), 'purpose': told})


def _vector(arm: Arm, home: Floats, posture: Posture) -> Floats:
    q = home.copy()
    for name, angle in radians_of(arm.robot, posture).items():
        q[arm.robot.joint_names.index(name)] = angle
    return q


def _few(routes: Routes, steps: Sequence[Step]) -> list[Step]:
    """Return one step of each kind, the quickest from home: enough for a demonstration."""
    found = _of_kinds(routes, steps, SHORT) if routes.arm.varied else []
    return found or _of_kinds(routes, steps, SHORT_ROVER)


def _of_kinds(
    routes: Routes,
    steps: Sequence[Step],
    kinds: Mapping[tuple[str, str, str], Mapping[str, float]],
) -> list[Step]:
    home = posture_deg(routes.arm, routes.home)
    found = []
    for kind, change in kinds.items():
        of = [s for s in steps if (s.group, s.where, s.action) == kind]
        with_ways = [_with_way(routes, s.model_copy(update=change), routes.home) for s in of]
        same = [s for s in with_ways if s.where == kind[1]]
        if same:
            found.append(min(same, key=lambda s: (not s.alerts.must, seconds_of(s, home, home))))
    return found


def _numbered(steps: Sequence[Step]) -> list[Step]:
    return [s.model_copy(update={'id': f'{k:02d}-{s.id}'}) for k, s in enumerate(steps, 1)]
