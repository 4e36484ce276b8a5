"""Joints that carry the robot: the model's torques beside MuJoCo's, for four robots at rest.

PackBot on its raised flippers, and Go2, B1 and ANYmal C on their legs: on three feet, on four, and
on four with friction that may brace them. The three legged robots' URDFs are read from a folder.

    python -m bench.bench_reactions [folder of robots, by default ../shared/robots]
"""

import math
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ugv_acceptance.config import load
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.reactions import Reactions, reactions_of
from ugv_acceptance.model.robot import Matrix, Payload, Robot
from ugv_acceptance.simulation.vehicle import Build, Vehicle, vehicle_of
from ugv_acceptance.type_aliases import Floats

ROBOTS = Path(__file__).resolve().parents[2] / 'shared' / 'robots'
# Time (s) to come to rest on dampers (N s/m, N m s/rad), and then without.
CALM, SETTLE, DAMPER = 1.5, 1.0, 300.0
# Friction of feet that slip without force, and of rubber.
SLIPPERY, RUBBER = 1e-5, 0.6
# Joints are held stiffly (N m/rad) on heavy rotors (kg m2), so that the posture asked for stands.
SERVO, ROTOR = 2e4, 0.5
# Postures a little off the usual one, lines shown of each case, lean (rad) on three feet.
SWAYED, SHOWN, LEAN = 4, 2, 0.07
# Inertia (m2, times a link's mass): at rest it does not matter, and public files have wrong ones.
ROUND = ((0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01))


@dataclass(frozen=True)
class Legged:
    """How a legged robot stands: its feet by link and place (m), and each leg's joints (rad)."""

    urdf: str
    feet: tuple[tuple[str, tuple[float, float, float]], ...]
    stand: Mapping[str, float]


def _unitree(name: str, height: float, thigh: float, calf: float) -> Legged:
    feet = [(f'{leg}_calf', (0.0, 0.0, -height)) for leg in ('FL', 'FR', 'RL', 'RR')]
    legs = {f'{leg}_{joint}_joint': x for leg in ('FL', 'FR', 'RL', 'RR')
            for joint, x in (('hip', 0.0), ('thigh', thigh), ('calf', calf))}  # fmt: skip
    return Legged(f'{name}/{name}.urdf', tuple(feet), legs)


def _anymal() -> Legged:
    """Return ANYmal C with all knees inwards."""
    names = ('LF', 'RF', 'LH', 'RH')
    feet = tuple((f'{leg}_FOOT', (0.0, 0.0, 0.0)) for leg in names)
    legs: dict[str, float] = {}
    for leg in names:
        bent = 1.0 if leg.endswith('F') else -1.0
        legs |= {f'{leg}_HAA': 0.0, f'{leg}_HFE': 0.4 * bent, f'{leg}_KFE': -0.8 * bent}
    return Legged('anymal_c/anymal_c.urdf', feet, legs)


LEGGED = {
    'go2': _unitree('go2', 0.213, 0.9, -1.8),
    'b1': _unitree('b1', 0.35, 0.8, -1.5),
    'anymal_c': _anymal(),
}


def yaml_of(legged: Legged, folder: Path = ROBOTS, extra: str = '') -> str:
    """Return the configuration of a legged robot: its joints and feet."""
    joints = '\n'.join(f'  {name}: {{}}' for name in legged.stand)
    feet = '\n'.join(
        f'  foot{k}: {{link: {link}, position_m: {list(place)}}}'
        for k, (link, place) in enumerate(legged.feet)
    )
    return (
        f'robot: {{name: r}}\nurdf: {folder / legged.urdf}\n'
        f'joints:\n{joints}\ncontacts:\n{feet}\n{extra}'
    )


def legged_robot(name: str, folder: Path = ROBOTS) -> tuple[Robot, Floats]:
    """Return a legged robot from its URDF, and the joint positions in which it stands."""
    legged = LEGGED[name]
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / 'robot.yaml'
        path.write_text(yaml_of(legged, folder), encoding='utf-8')
        robot = load(path).settings.robot
    return robot, np.array([legged.stand[joint] for joint in robot.joint_names])


@dataclass(frozen=True)
class Truth:
    """A robot at rest in MuJoCo: joint positions and torques (j,), gravity in its base's axes.

    `points` are the contact points that touch, `loads` (kg) what they carry, `sideways` the largest
    share of a contact's force that is not vertical.
    """

    q: Floats
    torque: Floats
    gravity: tuple[float, float, float]
    points: tuple[int, ...]
    loads: Floats
    sideways: float


def at_rest(robot: Robot, q: Floats, friction: float) -> Truth:
    """Let a robot stand on its contact points, its joints held stiffly, and read its torques."""
    build = Build(friction=friction, contact_time=0.01, impratio=100.0, armature=ROTOR)
    joints = tuple(replace(joint, effort=math.inf) for joint in robot.joints)
    links = tuple(replace(k, inertia=_times(max(k.mass, 1e-3))) for k in robot.links)
    vehicle = vehicle_of(replace(robot, joints=joints, links=links), build)
    model, data = vehicle.model, mujoco.MjData(vehicle.model)
    data.qpos[vehicle.position] = q
    model.actuator_gainprm[vehicle.motor, 0] = SERVO
    model.actuator_biasprm[vehicle.motor, 1] = -SERVO
    model.actuator_biasprm[vehicle.motor, 2] = -2.0 * math.sqrt(SERVO * ROTOR)
    data.ctrl[vehicle.motor] = q
    _put_down(model, data)
    model.dof_damping[:6] = DAMPER
    mujoco.mj_step(model, data, nstep=round(CALM / model.opt.timestep))
    model.dof_damping[:6] = 0.0
    mujoco.mj_step(model, data, nstep=round(SETTLE / model.opt.timestep))
    mujoco.mj_forward(model, data)
    return _read(vehicle, data)


def _times(mass: float) -> Matrix:
    a, b, c = (tuple(mass * x for x in row) for row in ROUND)
    return (a, b, c)  # type: ignore[return-value]  # three rows of three


def _put_down(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Put the robot on its three lowest points, so that it need not fall."""
    mujoco.mj_forward(model, data)
    feet = [g for g in range(model.ngeom) if model.geom(g).name.startswith('contact:')]
    data.qpos[2] -= data.geom_xpos[feet, 2].min() - model.geom_size[feet[0], 0]


def _read(vehicle: Vehicle, data: mujoco.MjData) -> Truth:
    model, robot = vehicle.model, vehicle.robot
    up = data.xmat[vehicle.root].reshape(3, 3)[2]
    loads, sideways = np.zeros(len(robot.contacts)), 0.0
    number = {f'contact:{c.name}': k for k, c in enumerate(robot.contacts)}
    force = np.zeros(6)
    for k in range(data.ncon):
        mujoco.mj_contactForce(model, data, k, force)
        geom = data.contact[k].geom
        foot = next(number[name] for g in geom if (name := model.geom(int(g)).name) in number)
        loads[foot] += force[0] / robot.gravity
        sideways = max(sideways, math.hypot(force[1], force[2]) / max(force[0], 1.0))
    x, y, z = (-robot.gravity * up).tolist()
    points = tuple(np.flatnonzero(loads > 1e-3 * loads.sum()).tolist())
    torque = data.qfrc_actuator[vehicle.rate].copy()
    return Truth(data.qpos[vehicle.position].copy(), torque, (x, y, z), points, loads, sideways)


def model_of(robot: Robot, truth: Truth, points: tuple[int, ...] = ()) -> Reactions:
    """Return the model's torques in the same posture and attitude, on the points that touch."""
    mechanics = mechanics_of(robot)
    posture = posture_of(mechanics, truth.q.tolist(), robot.payload.mass, robot.payload.cog)
    return reactions_of(mechanics, posture, points or truth.points, truth.gravity)


def friction_of(robot: Robot, truth: Truth, friction: float) -> Floats:
    """Return the most (j,) that friction can add to each joint: N m (N), of the loads measured.

    Every point pushes sideways as hard as it may, against the joint's longest arm to it.
    """
    mechanics = mechanics_of(robot)
    posture = posture_of(mechanics, truth.q.tolist(), robot.payload.mass, robot.payload.cog)
    found = np.zeros(len(robot.joint_names))
    for (joint, point), gradient in zip(mechanics.carried, posture.loads, strict=True):
        # The torque per newton across gravity is at most the gradient's length.
        size = float(np.linalg.norm(np.array(gradient, dtype=float)))
        found[joint] += friction * truth.loads[point] * robot.gravity * size
    return found


@dataclass(frozen=True)
class Case:
    """One line of the table: a robot, how it stands, and the friction of its feet."""

    name: str
    robot: Robot
    q: Floats
    friction: float


def packbot(mass: float) -> tuple[Robot, Floats]:
    """Return PackBot with its flippers at -40 deg, and the arm with a load at full reach ahead."""
    robot = load('packbot').settings.robot
    posture = {'flipper_joint': math.radians(-40.0)}
    q = np.array([posture.get(name, 0.0) for name in robot.joint_names])
    return replace(robot, payload=Payload(mass, robot.payload.cog)), q


def lifted(robot: Robot, q: Floats, foot: int) -> tuple[Robot, Floats]:
    """Return a legged robot without one of its feet: it stands on three, if its weight is there.

    The hips lean by LEAN, which moves the body away from the foot in the air.
    """
    contacts = tuple(c for k, c in enumerate(robot.contacts) if k != foot)
    axles = [k for k, name in enumerate(robot.joint_names) if 'hip' in name or 'HAA' in name]
    leaning, (y, *_) = q.copy(), np.sign([robot_foot(robot, q, foot)[1]])
    leaning[axles] += LEAN * y
    return replace(robot, contacts=contacts), leaning


def robot_foot(robot: Robot, q: Floats, foot: int) -> Floats:
    """Return where a foot is in `base_link` (m)."""
    posture = posture_of(mechanics_of(robot), q.tolist(), 0.0, (0.0, 0.0, 0.0))
    return np.array(posture.contacts[foot], dtype=np.float64)


def swayed(q: Floats, seed: int) -> Floats:
    """Return a posture in which every leg stands a little otherwise (0.1 rad)."""
    return q + np.random.default_rng(seed).uniform(-0.1, 0.1, len(q))


def cases(folder: Path = ROBOTS) -> Iterator[Case]:
    """Yield what the table shows."""
    for friction in (SLIPPERY, RUBBER):
        robot, q = packbot(4.0)
        yield Case('packbot flippers -40 deg', robot, q, friction)
    for name in LEGGED:
        robot, q = legged_robot(name, folder)
        for friction in (SLIPPERY, RUBBER):
            yield Case(f'{name} on four feet', robot, q, friction)
        for foot in range(2):
            three, at = lifted(robot, q, foot)
            yield Case(f'{name} without foot {foot}', three, at, SLIPPERY)
        for seed in range(SWAYED):
            yield Case(f'{name} swayed {seed}', robot, swayed(q, seed), RUBBER)


@dataclass(frozen=True)
class Compared:
    """One joint's torques (N m): the model's, and MuJoCo's beside what friction may add to it."""

    joint: str
    hanging: float
    even: float
    least: float
    most: float
    friction: float
    truth: float

    @property
    def inside(self) -> bool:
        """Whether MuJoCo's lies in the interval widened by friction and 1 %."""
        slack = 0.01 * abs(self.truth) + 0.05 + self.friction
        return self.least - slack <= self.truth <= self.most + slack


def compared(case: Case) -> tuple[Truth, list[Compared]]:
    """Return the robot at rest in MuJoCo and each joint that carries, the most loaded first."""
    truth = at_rest(case.robot, case.q, case.friction)
    found = model_of(case.robot, truth)
    more = friction_of(case.robot, truth, case.friction)
    of: Any = found
    rows = [
        Compared(
            case.robot.joint_names[j],
            float(of.hanging[j]),
            float(of.even[j]),
            float(of.least[j]),
            float(of.most[j]),
            float(more[j]) if case.friction > SLIPPERY else 0.0,
            float(truth.torque[j]),
        )
        for j in found.carrying
    ]
    return truth, sorted(rows, key=lambda row: -abs(row.truth))


def lines(case: Case) -> Iterator[str]:
    """Yield a case's lines of the table: the joints that carry most, and whether all are inside."""
    truth, rows = compared(case)
    outside = sum(not row.inside for row in rows)
    for row in rows[:SHOWN]:
        yield (
            f'{case.name:26} {case.friction:5.1f} {len(truth.points)} {row.joint:16} '
            f'{row.hanging:8.2f} {row.even:8.2f} [{row.least:7.2f}, {row.most:7.2f}] '
            f'{row.truth:8.2f} {"inside" if row.inside else "OUTSIDE"}'
        )
    if not rows:
        yield f'{case.name:26} {case.friction:5.1f} {len(truth.points)} does not stand'
    elif outside:
        yield f'{case.name:26} {outside} of {len(rows)} joints outside'


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    folder = Path(arguments[0]) if arguments else ROBOTS
    head = ('robot', 'fric.', 'n', 'joint', 'hanging', 'even', '[least, most]', 'MuJoCo')
    print('{:26} {:>5} {} {:16} {:>8} {:>8} {:>18} {:>8}'.format(*head))
    for case in cases(folder):
        for line in lines(case):
            print(line)


if __name__ == '__main__':
    main(sys.argv[1:])
