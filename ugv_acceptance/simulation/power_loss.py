"""If the power goes: do limp joints tip the robot? MuJoCo, the robot free on its ground.

Statics and energy do not say it: an arm that falls slowly is only a load that moves, one that falls
fast kicks the robot. So the joints are let go in MuJoCo, at three dampings, as nobody measured how
hard a motor without power is to turn. The wheels or tracks hold, the load stays in the gripper.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance import AcceptanceError
from ugv_acceptance.model.robot import Payload, Robot, Vector
from ugv_acceptance.model.roles import roles_of
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.oracle import OVER, TIPPED, attitude, settled, turn
from ugv_acceptance.simulation.vehicle import Build, Vehicle, body_name, vehicle_of
from ugv_acceptance.type_aliases import Floats

TIPS, MAY_TIP, NOT_SEEN_TO_TIP = 'TIPS', 'MAY TIP', 'NOT SEEN TO TIP'
# Damping of a limp joint, as the damping ratio of what it carries swinging about it: a direct drive
# swings many times, a gear with a high ratio lets it sink.
DAMPINGS = (0.05, 0.5, 2.0)
# Turn (rad) from which a fall may be one that tips at another damping, friction or posture: of 79
# simulated tips 78 % turned one of the three falls by more than 30 deg, 96 % by more than 5 deg.
NEARLY = math.radians(5.0)
# Friction of the ground. With more it tips sooner, with less it slides.
FRICTION = 0.8
# Time (s) that is simulated after the power went: even the slow arm has come down.
SECONDS = 4.0
# Time (s) for which the joints are first held on the slope: who turns by TIPPED does not stand.
HOLD = 1.0
# Damping (N m s/rad, N s/m) of a joint that is held: 100 N m turn it by 0.02 deg in that time.
HELD = 1e6
# Inertia of a rotor (kg m2) and length (m) in the period of what slides, where nothing is given.
ROTOR, SLIDE = 1e-3, 1.0
# Time steps between two looks at the attitude.
STRIDE = 10
# Places at which the height of a turning centre of gravity is looked at.
PLACES = 361


@dataclass(frozen=True, slots=True)
class Released:
    """A robot whose power goes: joints at `q` (rad, m), `gravity` (m/s2) in `base_link`.

    `braked` joints are held by brakes that close without power.
    """

    robot: Robot
    q: tuple[float, ...]
    payload: Payload
    gravity: Vector
    braked: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Fall:
    """What happens at damping ratios (j,): the base's largest `turn` (rad), `tips` over 30 deg."""

    damping: tuple[float, ...]
    turn: float
    tips: bool


@dataclass(frozen=True, slots=True)
class Brake:
    """What a joint's brake spares: torque (N m, N), fall (m) and energy (J).

    `torque` holds the joint in this posture, hanging free: `carries` says that contacts are on it,
    whose load is not in the torque. `fall` is how far the centre of gravity of all it carries may
    sink: to the lowest place of the joint's travel or to the ground, other joints as they are.
    """

    joint: str
    torque: float
    fall: float
    energy: float
    carries: bool


@dataclass(frozen=True, slots=True)
class PowerLoss:
    """The answer, the falls it rests on, and the brakes; `stood`: with power it stands."""

    answer: str
    stood: bool
    falls: tuple[Fall, ...]
    brakes: tuple[Brake, ...]


def power_loss(released: Released) -> PowerLoss:
    """Return whether the robot tips when its power goes.

    Raises AcceptanceError where the simulation becomes unstable.
    """
    released = without_wheels(released)
    vehicle, data, stood = standing(released)
    names = released.robot.joint_names
    falls = [_fall(released, vehicle, data, (d,) * len(names), stood=stood) for d in DAMPINGS]
    # Only what tips at all of them can be TIPS: then each joint may have a damping of its own.
    if stood and all(fall.tips for fall in falls):
        falls += [_fall(released, vehicle, data, d, stood=stood) for d in mixed(len(names))]
    return PowerLoss(answer_of(falls), stood, tuple(falls), brakes_of(released))


def without_wheels(released: Released) -> Released:
    """Return the same with measured wheels held where they are, as they do not roll."""
    robot, wheels = released.robot, roles_of(released.robot).wheels
    at = dict(zip(robot.joint_names, released.q, strict=True))
    names = tuple(name for name in robot.joint_names if name not in wheels)
    held = (*robot.held, *((name, at[name]) for name in robot.joint_names if name in wheels))
    still = replace(robot, joint_names=names, held=held)
    return replace(released, robot=still, q=tuple(at[name] for name in names))


def answer_of(falls: Sequence[Fall]) -> str:
    """Return TIPS if all falls tip, MAY TIP if one comes as far as NEARLY, else NOT SEEN TO TIP."""
    if all(fall.tips for fall in falls):
        return TIPS
    return MAY_TIP if any(fall.turn > NEARLY for fall in falls) else NOT_SEEN_TO_TIP


def mixed(count: int) -> tuple[tuple[float, ...], ...]:
    """Return dampings of joints that differ: each second one is slow, and each half of them."""
    fast, slow = DAMPINGS[0], DAMPINGS[-1]
    if count < 2:
        return ()
    half = (count + 1) // 2
    second = tuple((fast, slow)[k % 2] for k in range(count))
    outer = (fast,) * half + (slow,) * (count - half)
    swapped = {fast: slow, slow: fast}
    return tuple(
        row for first in (second, outer) for row in (first, tuple(swapped[d] for d in first))
    )


def let_go(released: Released, damping: Sequence[float], friction: float) -> tuple[float, bool]:
    """Return the largest turn (rad) of the base after the power went, and whether it stood before.

    `damping` (j,) are the damping ratios of the joints.
    """
    vehicle, data, stood = standing(released, friction)
    return _fall(released, vehicle, data, damping, stood=stood).turn, stood


def _fall(
    released: Released,
    vehicle: Vehicle,
    start: mujoco.MjData,
    damping: Sequence[float],
    *,
    stood: bool,
) -> Fall:
    """Let the joints go at these damping ratios (j,), from a state that is kept as it is."""
    ratios = tuple(damping)
    if not stood:
        return Fall(ratios, math.inf, tips=True)
    model, data = vehicle.model, mujoco.MjData(vehicle.model)
    mujoco.mj_copyData(data, model, start)
    for k, name in enumerate(released.robot.joint_names):
        limp = HELD if name in released.braked else _damping(vehicle, start, k, ratios[k])
        model.dof_damping[vehicle.rate[k]] = limp
    rest, largest = attitude(vehicle, start), 0.0
    for _ in range(round(SECONDS / (STRIDE * model.opt.timestep))):
        mujoco.mj_step(model, data, nstep=STRIDE)
        largest = max(largest, turn(attitude(vehicle, data), rest))
        if largest > OVER:
            break
    if any(data.warning[kind].number for kind in _BROKEN):
        raise AcceptanceError(
            f'power loss: the simulation became unstable at damping ratios {ratios};'
            ' expected masses and inertias of all moving links in the URDF'
        )
    return Fall(ratios, largest, bool(largest > OVER))


_BROKEN = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)


def standing(released: Released, friction: float = FRICTION) -> tuple[Vehicle, mujoco.MjData, bool]:
    """Return the simulated robot on its ground, all joints held, and whether it stands there."""
    vehicle, data = placed(released, friction)
    rest = attitude(vehicle, data)
    mujoco.mj_step(vehicle.model, data, nstep=round(HOLD / vehicle.model.opt.timestep))
    fell = turn(rest, np.eye(3)) > OVER or turn(attitude(vehicle, data), rest) > TIPPED
    return vehicle, data, not fell


def placed(released: Released, friction: float = FRICTION) -> tuple[Vehicle, mujoco.MjData]:
    """Return the simulated robot just put on its ground, all joints held.

    The ground is then tilted so that gravity in `base_link` is that of `released`, whatever the
    robot stands on.
    """
    robot = replace(released.robot, payload=released.payload)
    build = Build(motors=False, bulk=True, friction=friction, armature=ROTOR)
    vehicle = vehicle_of(robot, build)
    _limit(vehicle, released.q)
    vehicle.model.dof_damping[vehicle.rate] = HELD
    data = settled(vehicle, np.eye(3), released.q)
    vehicle.model.opt.gravity[:] = attitude(vehicle, data) @ np.array(released.gravity)
    return vehicle, data


def _limit(vehicle: Vehicle, q: Sequence[float]) -> None:
    """Give the joints their ends of travel, widened to where they are now."""
    for name, position in zip(vehicle.robot.joint_names, q, strict=True):
        joint = vehicle.robot.joint(name)
        if math.isfinite(joint.lower) and math.isfinite(joint.upper):
            k = vehicle.model.joint(name).id
            vehicle.model.jnt_limited[k] = 1
            vehicle.model.jnt_range[k] = (min(joint.lower, position), max(joint.upper, position))


def _carried(vehicle: Vehicle, data: mujoco.MjData, k: int) -> tuple[int, float, Floats, Floats]:
    """Return a joint's body, the mass on it, its axis and the way from it to their centre (m)."""
    joint = vehicle.model.joint(vehicle.robot.joint_names[k]).id
    body = int(vehicle.model.jnt_bodyid[joint])
    away = data.subtree_com[body] - data.xanchor[joint]
    return body, float(vehicle.model.body_subtreemass[body]), data.xaxis[joint].copy(), away


def _damping(vehicle: Vehicle, data: mujoco.MjData, k: int, ratio: float) -> float:
    """Return the damping (N m s/rad, N s/m) of a joint for a damping ratio of what it carries."""
    _, mass, axis, away = _carried(vehicle, data, k)
    gravity = float(np.linalg.norm(vehicle.model.opt.gravity))
    if vehicle.robot.joint(vehicle.robot.joint_names[k]).slides:
        return 2.0 * ratio * mass * math.sqrt(gravity / SLIDE)
    lever = float(np.linalg.norm(np.cross(axis, away)))
    # Of a mass at the end of the lever: more than that has what is spread about it.
    inertia = mass * lever**2 + ROTOR
    return 2.0 * ratio * math.sqrt(inertia * (mass * gravity * lever + ROTOR))


def brakes_of(released: Released) -> tuple[Brake, ...]:
    """Return what the brake of each joint would hold, and how far it would else let fall."""
    vehicle, data = placed(released)
    down = vehicle.model.opt.gravity / np.linalg.norm(vehicle.model.opt.gravity)
    names = released.robot.joint_names
    return tuple(_brake(vehicle, data, down, k, name) for k, name in enumerate(names))


def _brake(vehicle: Vehicle, data: mujoco.MjData, down: Floats, k: int, name: str) -> Brake:
    body, mass, axis, away = _carried(vehicle, data, k)
    weight = mass * float(np.linalg.norm(vehicle.model.opt.gravity))
    joint = vehicle.robot.joint(name)
    at = float(data.qpos[vehicle.position[k]])
    carries = any(_is_below(vehicle.model, c.link, body) for c in vehicle.robot.contacts)
    # The ground, a plane through 0, ends the fall of a centre of gravity.
    ground = -float(data.subtree_com[body][2] / down[2]) if down[2] < 0.0 else math.inf
    low, high = joint.travel(half_slide=0.0)
    low, high = min(low, at), max(high, at)
    if joint.slides:
        torque, ways = weight * abs(float(axis @ down)), np.array([low - at, high - at])
        sunk = ways * float(axis @ down)
    else:
        torque = weight * abs(float(np.cross(axis, away) @ down))
        turned = np.linspace(low - at, high - at, PLACES)
        along = axis * (axis @ away)
        across, side = away - along, np.cross(axis, away)
        sunk = (np.cos(turned) - 1.0) * (across @ down) + np.sin(turned) * (side @ down)
    fall = max(0.0, min(float(sunk.max()), ground))
    return Brake(name, torque, fall, weight * fall, carries)


def _is_below(model: mujoco.MjModel, link: str, body: int) -> bool:
    """Return whether a link is this body or hangs on it."""
    k = int(model.body(body_name(link)).id)
    while k and k != body:
        k = int(model.body_parentid[k])
    return k == body
