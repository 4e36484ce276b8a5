"""A million PackBot postures: all torques and tip edges, beside Pinocchio and MuJoCo loops.

Ours gives torques and the tilt left to every edge, or also the edges' moments, energies and ZMP;
the loops give torques and the centre of mass alone. CPU seconds, best of rounds; ratios count.

    python -m bench.bench_kernels [postures]
    python -m bench.bench_kernels --chains      # how the live cost grows with an arm's joints
"""

import math
import sys
import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from bench.kernel_chains import print_chains
from ugv_acceptance.config import load
from ugv_acceptance.model.blocks import in_blocks
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.stability import many_stances, many_standing, margins, stability_of
from ugv_acceptance.model.statics import torque_of
from ugv_acceptance.studies.planar import PAPER, planar_dynamics

ROUNDS = 3
LOOPS = 20_000  # postures a loop is timed with; its cost a posture does not depend on their number


def gravities(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return gravity (count, 3) of random tilts up to 40 degrees."""
    tilt, heading = rng.uniform(0.0, math.radians(40.0), count), rng.uniform(0, 2 * math.pi, count)
    down = [-np.sin(tilt) * np.cos(heading), -np.sin(tilt) * np.sin(heading), -np.cos(tilt)]
    return 9.81 * np.stack(down, axis=-1)


def seconds(run: Callable[[], object]) -> tuple[float, float]:
    """Return CPU and wall seconds of one run."""
    cpu, wall = time.process_time(), time.perf_counter()
    run()
    return time.process_time() - cpu, time.perf_counter() - wall


def pinocchio_loop(path: str, robot: Robot, q: np.ndarray, g: np.ndarray) -> Callable[[], object]:
    """Return a loop of gravity torques and the centre of mass, load of 4 kg at the gripper."""
    model = pin.buildModelFromUrdf(path)
    frame = model.frames[model.getFrameId('gripper_link')]
    load = pin.Inertia(robot.payload.mass, np.zeros(3), np.zeros((3, 3)))
    model.appendBodyToJoint(frame.parentJoint, load, frame.placement)
    data = model.createData()
    order = [robot.joint_names.index(name) for name in list(model.names)[1:]]
    angles = q[:LOOPS, order]
    # A continuous joint of Pinocchio is given by cosine and sine.
    points = np.stack([np.cos(angles), np.sin(angles)], axis=-1).reshape(len(angles), -1)
    direction = g[:LOOPS]

    def run() -> None:
        for point, down in zip(points, direction, strict=True):
            model.gravity.linear = down
            pin.computeGeneralizedGravity(model, data, point)
            pin.centerOfMass(model, data, point)

    return run


def mujoco_loop(path: str, q: np.ndarray, g: np.ndarray) -> Callable[[], object]:
    """Return a loop of mj_inverse at rest (torques; the centre of mass comes with it)."""
    spec = mujoco.MjSpec.from_file(path)
    spec.compiler.discardvisual = True
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
    model = spec.compile()
    data = mujoco.MjData(model)

    def run() -> None:
        for point, down in zip(q[:LOOPS], g[:LOOPS], strict=True):
            model.opt.gravity[:] = down
            data.qpos[:] = point
            mujoco.mj_inverse(model, data)

    return run


def all_margins(robot: Robot, q: np.ndarray, g: np.ndarray, workers: int) -> np.ndarray:
    """Return every torque and every side's margins, (..., j + 13)."""
    mechanics, load, n = mechanics_of(robot), robot.payload, q.shape[-1]

    def margins(*columns: Any) -> list[Any]:  # noqa: ANN401 - floats or arrays
        posture = posture_of(mechanics, columns[:n], load.mass, load.cog)
        table = np.empty((13, len(columns[0])))
        gravity, count = columns[n:], len(columns[0])
        stances = many_stances(mechanics, posture, count)
        for rows, stance in many_standing(stances, count, np.arange(count), gravity):
            gx, gy, gz = (x[rows] for x in gravity)
            found = stability_of(stance, (gx, gy, gz))
            values = (*found.angle, *found.moment, *found.energy, found.zmp)
            for line, value in zip(table, values, strict=True):
                line[rows] = value
        return [*torque_of(posture, columns[n:]), *table]

    return in_blocks(margins, n + 13, q, g, workers=workers)


def main(count: int = 1_000_000) -> None:
    """Print the table."""
    config = load()
    robot, path = config.settings.robot, str(config.urdf_path)
    rng = np.random.default_rng(1)
    q, g = rng.uniform(-math.pi, math.pi, (count, 4)), gravities(rng, count)
    stowed = q.copy()
    stowed[:, robot.joint_names.index('flipper_joint')] = math.pi
    arm = rng.uniform(-math.pi, math.pi, (3, count, 2))

    def ours(postures: np.ndarray, workers: int) -> Callable[[], object]:
        return lambda: all_margins(robot, postures, g, workers)

    ways: dict[str, tuple[int, Callable[[], object]]] = {
        'ours, torques + tilt, 2 threads': (count, lambda: margins(robot, q, g, workers=2)),
        'ours, torques + tilt, 1 thread': (count, lambda: margins(robot, q, g)),
        'ours, the same, flippers stowed': (count, lambda: margins(robot, stowed, g)),
        'ours, all margins of all edges, 2 threads': (count, ours(q, 2)),
        'ours, all margins of all edges, 1 thread': (count, ours(q, 1)),
        'ours, all margins, flippers stowed': (count, ours(stowed, 1)),
        'Pinocchio loop, torques + CoM': (LOOPS, pinocchio_loop(path, robot, q, g)),
        'MuJoCo mj_inverse loop': (LOOPS, mujoco_loop(path, q, g)),
        'closed two-link dynamics': (count, lambda: planar_dynamics(PAPER, *arm)),
    }
    best = dict.fromkeys(ways, (math.inf, math.inf))
    for _ in range(ROUNDS):
        for name, (n, run) in ways.items():
            cpu, wall = seconds(run)
            best[name] = min(best[name][0], cpu / n), min(best[name][1], wall / n)
    loop = best['Pinocchio loop, torques + CoM']
    print(f'{count} postures; loops timed on {LOOPS}')
    print(
        f'{"way":36}{"cpu ns":>9}{"wall ns":>9}{"cpu x":>8}{"wall x":>8}   (x: against Pinocchio)'
    )
    for name, (cpu, wall) in best.items():
        ratios = f'{loop[0] / cpu:8.2f}{loop[1] / wall:8.2f}'
        print(f'{name:36}{cpu * 1e9:9.0f}{wall * 1e9:9.0f}{ratios}')


if __name__ == '__main__':
    if sys.argv[1:] == ['--chains']:
        print_chains()
    else:
        main(*(int(a) for a in sys.argv[1:]))
