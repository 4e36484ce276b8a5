"""Random trajectories, asked of `check` and carried out in MuJoCo: what does it let pass wrongly.

Each has its own slope, load, points and way of interpolation, and begins where the robot stands and
holds its arm. MuJoCo's motors are position servos with the configured limits, on a robot with a
free base; they are given the positions of the trajectory, as a controller gives them. It goes wrong
where the robot leaves its stance by more than 2 deg, or a motor is at its limit for 5 ms on end
(contacts make single time steps jump). A joint without end that stands half a turn or more from the
first point may go either way round, as controllers differ: each way is carried out, and the worst
counts. `check` is asked with limits of just that: no tilt left, 100 % of the torque, and is told
the time that these servos take for another rate. Speeds and ranges of joints are left out on both
sides, and so are trajectories that come near the ground; nothing meets anything but the ground.

    nice python -m bench.check_trial [--runs 1000] [--seed 1] [--config packbot] [--workers 1]
"""

import argparse
import itertools
import math
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.planned_motion import (
    PERMITTED,
    CheckedMotion,
    Conditions,
    MotionChecker,
    Trajectory,
)
from ugv_acceptance.evaluation.planned_motion.path import STEP, Knots, path_of, samples_of, steps_of
from ugv_acceptance.evaluation.planned_motion.path import Path as Way
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.clearance import clearance
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.roles import roles_of
from ugv_acceptance.model.stability import margins
from ugv_acceptance.processes import Workers
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.oracle import attitude, turn
from ugv_acceptance.simulation.poses import Poses
from ugv_acceptance.simulation.scenario import LIFTED, TIPPED
from ugv_acceptance.simulation.simulation import BUILD
from ugv_acceptance.simulation.vehicle import (
    Vehicle,
    gravity_on_slope,
    set_brakes,
    vehicle_of,
)
from ugv_acceptance.type_aliases import Floats

# The ground of simulated runs, but of rubber: what slips in MuJoCo hops from contact to contact. Of
# the time steps (s) those of simulated runs are too long: light contacts rock twice as much.
GROUND = replace(BUILD, friction=2.0, timestep=0.001)
# Natural frequency (rad/s) of the servos, on the inertia of the outstretched arm: stiffer ones, as
# in simulated runs, shake a light joint on a free base. The time (s) they take for another rate.
SERVO = 36.0
CORNER = 2.5 / SERVO
KINDS = ('linear', 'cubic', 'quintic')
# Kind of a joint without end, and how near to half a turn (rad) it may go either way.
ENDLESS, NEAR = 'continuous', 0.02
# Steepest slope (rad), heaviest load (kg, of PackBot), slowest and fastest mean speed (rad/s).
STEEPEST, HEAVIEST, SPEEDS = math.radians(28.0), 6.0, (0.15, 0.8)
# Points of a trajectory, the first left out, and its longest time (s).
FEWEST, MOST, LONGEST = 1, 5, 6.0
# Least time (s) from point to point.
SHORTEST = 0.5
# Clearance (m) that the arm keeps, and margins in which a run begins: tilt left (rad), share.
CLEAR, STANDS, HOLDS = 0.08, math.radians(1.0), 0.98
# Time (s) to come to rest before, to watch after a motion. For so many time steps a motor has to be
# at its limit, and so many lie between looks at contacts.
SETTLE, WATCH, LASTS, STRIDE = 0.8, 0.6, 5, 5
# Share of the weight, low-passed (s), on the points off an edge, below which the edge has lifted.
UNLOADED, LOW_PASS = 0.01, 0.01
# Runs after which the table is printed.
PART = 50


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One run: what is asked of the check, and `kind`, how it is interpolated."""

    kind: str
    slope: tuple[float, float]
    trajectory: Trajectory
    conditions: Conditions


@dataclass(frozen=True, slots=True)
class Truth:
    """What MuJoCo did: `lean` (rad) off the stance, `share` of a motor's limit, both the most.

    The share is one that lasts for LASTS time steps. `unloaded`: all weight was on one edge of the
    support polygon for a moment.
    """

    lean: float
    share: float
    unloaded: bool

    @property
    def wrong(self) -> bool:
        """Whether the robot left its stance, or a motor saturated."""
        return self.lean > LIFTED or self.share >= 1.0 - 1e-9

    @property
    def within(self) -> bool:
        """Whether it kept to the limits that the check was asked with."""
        return not self.wrong and not self.unloaded


@dataclass(frozen=True, slots=True)
class Result:
    """A case's number and kind, what was said of it, and what happened."""

    number: int
    kind: str
    said: CheckedMotion
    truth: Truth


def judged(settings: Settings) -> Settings:
    """Return the settings of the comparison: no tilt left, 100 % torque, no speed or range."""
    robot = settings.robot
    joints = tuple(
        replace(joint, velocity=math.inf, effort=_limit(settings, joint.name))
        for joint in robot.joints
    )
    limits = replace(settings.limits, torque_error=1.0, tip_error=0.0)
    return replace(settings, robot=replace(robot, joints=joints), limits=limits)


def _limit(settings: Settings, name: str) -> float:
    names = settings.robot.joint_names
    return settings.limits.torque[names.index(name)] if name in names else math.inf


def case_of(settings: Settings, number: int, seed: int) -> Case:
    """Return a random case; the same numbers give the same one."""
    rng, robot = np.random.default_rng([seed, number]), settings.robot
    poses = Poses(robot, rng)
    moved = _moved(robot)
    while True:
        kind = KINDS[number % len(KINDS)]
        slope = (float(rng.uniform(0.0, STEEPEST)), float(rng.uniform(-math.pi, math.pi)))
        load = poses.load(0.0, HEAVIEST)
        if rng.random() < 0.3:
            load = replace(load, mass=0.0)
        way = _points(poses, rng, int(rng.integers(FEWEST, MOST + 1)))
        gravity = gravity_on_slope(robot.gravity, *slope)
        if not _holds(settings, way[0], gravity, load):
            continue
        trajectory = _timed(settings, rng, kind, way[:, moved], moved)
        x, y, z = gravity.tolist()
        if trajectory.times[-1] < LONGEST and _clear(settings, trajectory, way[0], moved, load):
            start = tuple(way[0].tolist())
            return Case(
                kind, slope, trajectory, Conditions((x, y, z), load, None, start, corner=CORNER)
            )


def _moved(robot: Robot) -> list[int]:
    """Return the joints that move: not wheels, nor what carries the robot."""
    roles = roles_of(robot)
    still = {*roles.wheels, *roles.flippers, *roles.legs}
    return [j for j, name in enumerate(robot.joint_names) if name not in still]


def _points(poses: Poses, rng: np.random.Generator, count: int) -> Floats:
    """Return postures (n, j): some with short ways from one to the next."""
    first = poses.anywhere()
    near = float(rng.uniform(0.15, 1.0)) if rng.random() < 0.4 else 1.0
    found = [first]
    for _ in range(count):
        found.append(found[-1] + near * (poses.anywhere() - found[-1]))
    return np.array(found)


def _holds(settings: Settings, q: Floats, gravity: Floats, load: Payload) -> bool:
    found = margins(settings.robot, q, gravity, load)
    share = np.abs(found.torque) / np.array(settings.limits.torque)
    return bool(found.angle.min() > STANDS and share.max(initial=0.0) < HOLDS)


def _timed(
    settings: Settings, rng: np.random.Generator, kind: str, way: Floats, moved: Sequence[int]
) -> Trajectory:
    """Return a trajectory along postures (n, m), each way at a random speed."""
    speed = rng.uniform(*SPEEDS) * rng.uniform(0.5, 1.0, len(way) - 1)
    length = np.maximum(np.abs(np.diff(way, axis=0)).max(axis=1) / speed, SHORTEST)
    times = np.cumsum(length)
    knots = np.concatenate(([0.0], times))
    rates = np.gradient(way, knots, axis=0, edge_order=1)
    rates[[0, -1]] = 0.0
    more = np.gradient(rates, knots, axis=0, edge_order=1)
    more[[0, -1]] = 0.0
    names = tuple(settings.joints[j].topic_name for j in moved)
    return Trajectory(
        names,
        times,
        way[1:],
        None if kind == 'linear' else rates[1:],
        more[1:] if kind == 'quintic' else None,
    )


def way_of(case: Case, moved: Sequence[int]) -> Way:
    """Return the motion of a case: its trajectory from the start (signs and offsets are none)."""
    of, start = case.trajectory, np.array(case.conditions.posture)[list(moved)]
    still = np.zeros((1, len(moved)))
    none = np.full((1 + len(of.times), len(moved)), np.nan)
    rates = none if of.velocities is None else np.concatenate((still, of.velocities))
    more = none if of.accelerations is None else np.concatenate((still, of.accelerations))
    times, q = np.append(0.0, of.times), np.concatenate((start[None], of.positions))
    return path_of(Knots(times, q, rates, more, 0))


def ways_round(settings: Settings, case: Case) -> Iterator[Case]:
    """Yield the case with each way round to the first point: from the same place, turns away.

    All joints of the robot turn without end, or none.
    """
    moved = _moved(settings.robot)
    start = np.array(case.conditions.posture)
    far = np.zeros(len(start))
    if all(settings.robot.joint(settings.robot.joint_names[j]).kind == ENDLESS for j in moved):
        far[moved] = case.trajectory.positions[0] - start[moved]
    ways = [
        (0.0, math.copysign(math.tau, way)) if abs(way) > math.pi - NEAR else (0.0,)
        for way in far.tolist()
    ]
    for turned in itertools.product(*ways):
        posture = tuple((start + turned).tolist())
        yield replace(case, conditions=replace(case.conditions, posture=posture))


def _clear(
    settings: Settings, trajectory: Trajectory, start: Floats, moved: Sequence[int], load: Payload
) -> bool:
    told = Conditions(None, None, None, tuple(start.tolist()))
    cases = ways_round(settings, Case('', (0.0, 0.0), trajectory, told))
    return all(_one_clear(settings, case, moved, load) for case in cases)


def _one_clear(settings: Settings, case: Case, moved: Sequence[int], load: Payload) -> bool:
    way, start = way_of(case, moved), np.array(case.conditions.posture)
    seen = samples_of(way, steps_of(way, np.full(len(moved), STEP)))
    q = np.tile(start, (len(seen.time), 1))
    q[:, moved] = seen.position
    height = clearance(mechanics_of(settings.robot), None, list(q.T), load.cog)
    return bool(np.min(height) > CLEAR)


def truth_of(settings: Settings, case: Case) -> Truth:
    """Carry out a case in MuJoCo, each way round to the first point, and return the worst."""
    found = [_carried_out(settings, way) for way in ways_round(settings, case)]
    lean, share = max(of.lean for of in found), max(of.share for of in found)
    return Truth(lean, share, any(of.unloaded for of in found))


def _carried_out(settings: Settings, case: Case) -> Truth:
    load = case.conditions.payload or Payload()
    vehicle = vehicle_of(replace(settings.robot, payload=load), GROUND)
    _soften(vehicle)
    moved, model = _moved(settings.robot), vehicle.model
    data = mujoco.MjData(model)
    gravity = gravity_on_slope(settings.robot.gravity, *case.slope)
    model.opt.gravity[:] = gravity
    posture = np.array(case.conditions.posture)
    # A servo holds its load a little beside its target: it begins where it has come to rest.
    held = margins(settings.robot, posture, gravity, load).torque
    data.qpos[vehicle.position] = posture - held / model.actuator_gainprm[vehicle.motor, 0]
    data.ctrl[vehicle.motor] = posture
    set_brakes(vehicle, on=True)
    mujoco.mj_step(model, data, nstep=round(SETTLE / model.opt.timestep))
    rest, motor = attitude(vehicle, data), vehicle.motor[moved]
    weight, limit = _Weight(vehicle), np.array(settings.limits.torque)
    lean, share, used = 0.0, 0.0, np.zeros((LASTS, len(limit)))
    for k, target in enumerate(_targets(case, moved, model.opt.timestep)):
        data.ctrl[motor] = target
        mujoco.mj_step(model, data)
        used[k % LASTS] = np.abs(data.actuator_force[vehicle.motor]) / limit
        share = max(share, float(used.min(axis=0).max(initial=0.0)))
        if k % STRIDE:
            continue
        weight.take(data)
        lean = max(lean, turn(attitude(vehicle, data), rest))
        if lean > TIPPED:
            break
    return Truth(lean, share, weight.least < UNLOADED)


def _soften(vehicle: Vehicle) -> None:
    """Make the motors critically damped servos of SERVO on the inertia of the zero posture."""
    model, motor = vehicle.model, vehicle.motor
    inertia = model.dof_M0[vehicle.rate]
    model.actuator_gainprm[motor, 0] = inertia * SERVO**2
    model.actuator_biasprm[motor, 1] = -inertia * SERVO**2
    model.actuator_biasprm[motor, 2] = -2.0 * inertia * SERVO


def _targets(case: Case, moved: Sequence[int], step: float) -> Iterator[Floats]:
    """Yield where the joints (m,) are to be, every `step` (s)."""
    way = way_of(case, moved)
    time = np.arange(0.0, way.knots.time[-1] + WATCH, step)
    of = np.clip(np.searchsorted(way.knots.time, time, side='right') - 1, 0, len(way.length) - 1)
    share = np.minimum((time - way.knots.time[of]) / way.length[of], 1.0)
    powers = share[:, None] ** np.arange(6)
    yield from np.einsum('sk,skm->sm', powers, way.powers[of])


class _Weight:
    """Which share of the weight is off each edge of the ground contacts, low-passed: the least."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.least = self._share = 1.0
        self._keep = math.exp(-STRIDE * vehicle.model.opt.timestep / LOW_PASS)

    def take(self, data: mujoco.MjData) -> None:
        """Take the contacts after some time steps."""
        touching = data.contact.efc_address >= 0
        place = data.contact.pos[touching]
        # Of a contact's forces the first presses.
        force = data.efc_force[data.contact.efc_address[touching]]
        now = _off_edge(place[:, 0], place[:, 1], force)
        self._share = self._keep * self._share + (1.0 - self._keep) * now
        self.least = min(self.least, self._share)


def _off_edge(x: Floats, y: Floats, force: Floats) -> float:
    """Return the least share of forces that is not on one edge of the points' hull."""
    total = force.sum()
    if len(x) < 3 or not total > 0.0:
        return 0.0
    around = np.argsort(np.arctan2(y - y.mean(), x - x.mean()))
    force = force[around]
    edges = force + np.roll(force, 1)
    return float(1.0 - edges.max() / total)


def run_of(settings: Settings, number: int, seed: int) -> Result:
    """Ask and carry out one case."""
    case = case_of(settings, number, seed)
    said = MotionChecker(settings).check(case.trajectory, case.conditions)
    return Result(number, case.kind, said, truth_of(settings, case))


def runs_of(settings: Settings, count: int, seed: int, workers: int = 1) -> Iterator[Result]:
    """Yield the results of so many cases, in their order."""
    if workers == 1:
        yield from (run_of(settings, k, seed) for k in range(count))
        return
    with Workers(workers, mp_context=get_context('spawn')) as pool:
        waiting = [pool.submit(run_of, settings, k, seed) for k in range(count)]
        yield from (one.result() for one in waiting)


def print_table(results: Sequence[Result]) -> None:
    """Print how often the check was right, and each case that it let pass wrongly."""
    refused = [of for of in results if of.said.verdict != PERMITTED]
    wrong = [of for of in results if of.truth.wrong]
    missed = [of for of in wrong if of.said.verdict == PERMITTED]
    print(f'{"":32}{"refused":>9}{"permitted":>11}')
    print(f'{"tips or saturates in MuJoCo":32}{len(wrong) - len(missed):9}{len(missed):11}')
    fine = [of for of in results if not of.truth.wrong]
    needless = [of for of in fine if of.said.verdict != PERMITTED]
    print(f'{"neither":32}{len(needless):9}{len(fine) - len(needless):11}')
    kept = [of for of in needless if of.truth.within]
    print(f'tips {sum(of.truth.lean > LIFTED for of in results)}, ', end='')
    print(f'saturates {sum(of.truth.share >= 1.0 - 1e-9 for of in results)}')
    for name, some in (('nothing happened', needless), ('nothing lifted either', kept)):
        of_all, of_fine = len(some) / len(results), len(some) / max(len(fine), 1)
        kinds = ', '.join(
            f'{kind} {n}' for kind, n in sorted(Counter(r.kind for r in some).items())
        )
        print(f'needlessly refused, {name}: {of_all:.1%} of all, {of_fine:.1%} of those ({kinds})')
    print(f'refused {len(refused)} of {len(results)}', flush=True)
    for of in missed:
        print(f'MISSED {_line(of)}')


def _line(of: Result) -> str:
    tilt = math.degrees(of.said.tilt.angle) if of.said.tilt else math.nan
    used = of.said.joint.share if of.said.joint else math.nan
    return (
        f'{of.number} {of.kind}: lean {math.degrees(of.truth.lean):.1f} deg, share '
        f'{of.truth.share:.3f}, unloaded {of.truth.unloaded}; said {of.said.verdict}, tilt left '
        f'{tilt:.2f} deg, share {used:.3f}'
    )


def main() -> None:
    """Run the trial, and print its table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--runs', type=int, default=1000)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--config', type=Path, default=None)
    parser.add_argument('--workers', type=int, default=1)
    parser.add_argument('--verbose', action='store_true', help='a line for every case')
    asked = parser.parse_args()
    settings = judged(load(asked.config).settings)
    begin = time.perf_counter()
    results = []
    for result in runs_of(settings, asked.runs, asked.seed, asked.workers):
        results.append(result)
        if not len(results) % PART or len(results) == asked.runs:
            took = time.perf_counter() - begin
            name = settings.robot.name
            print(f'{name}: {len(results)} trajectories, seed {asked.seed}, {took:.0f} s')
            print_table(results)
            for of in results[-PART:] if asked.verbose else ():
                print(_line(of), *of.said.reasons[:1], flush=True)


if __name__ == '__main__':
    main()
