"""A robot as a MuJoCo model: its bodies, joints and motors on a ground it can tip over on.

The model is made from the links and joints of the Robot, not from the compiled mechanics, so that
MuJoCo checks those. The constant part of a joint's law is left out. Every link is a body with
the link's own axes; a point-like link gets the least
inertia MuJoCo takes. Ground slopes come from the direction of gravity: see `gravity_on_slope`.
"""

import math
from dataclasses import dataclass
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.robot import (
    IDENTITY,
    Contact,
    Joint,
    Law,
    Link,
    Payload,
    Robot,
    Vector,
)
from ugv_acceptance.simulation import shape
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.shape import numbers
from ugv_acceptance.type_aliases import Floats

# Mass (kg) and inertia (kg m2) of links without any: MuJoCo needs some of moving bodies.
LEAST = 1e-12
# Natural frequency (rad/s) of the position servos on the inertia of the zero posture, or on
# this (kg m2, kg) if that is more: a flipper's drive also lifts the robot.
SERVO, SERVO_INERTIA = 50.0, 2.0
# One wheel's velocity servo: gain (N m s/rad) and most torque (N m); its brake holds as much.
WHEEL_GAIN, WHEEL_TORQUE = 20.0, 40.0


@dataclass(frozen=True, slots=True)
class Build:
    """The choices in making a MuJoCo model of a robot: base, wheels, motors, contacts, obstacles.

    `base` is free or fixed (no ground then). `wheels` puts a wheel of `wheel_radius` (m) at every
    contact of the root link, else a small sphere stands at each contact point, as it does at the
    contacts of other links. `motors` drive the joints, limited to the joint's effort, with
    `armature` (kg m2) as the rotor's share of inertia. `bulk` adds what touches the ground only
    after a tip-over. `contact_time` (s) is the time constant of a contact: short is hard;
    `impratio` is how much harder friction is than contact: more creeps less. `blocks` lie on the
    ground. The IMU is on `imu_link` ('': the root link), in whose axes its place is.
    """

    base: str = 'free'
    wheels: bool = False
    wheel_radius: float = 0.09
    motors: bool = True
    bulk: bool = False
    friction: float = 0.8
    armature: float = 0.0
    timestep: float = 0.001
    contact_time: float = 0.004
    impratio: float = 10.0
    blocks: tuple[shape.Block, ...] = ()
    imu_position: Vector = (0.0, 0.0, 0.0)
    imu_rotation: tuple[Vector, Vector, Vector] = IDENTITY
    imu_link: str = ''


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A compiled MuJoCo model with the indices of its parts; joints as in `robot.joint_names`.

    `model` is an mujoco.MjModel. `position`, `rate` and `motor` index qpos, qvel and ctrl; `wheels`
    pairs the control index of each wheel with the wheel's y (m, `base_link`).
    """

    robot: Robot
    build: Build
    model: mujoco.MjModel
    position: NDArray[np.intp]
    rate: NDArray[np.intp]
    motor: NDArray[np.intp]
    wheels: tuple[tuple[int, float], ...]
    root: int
    payload: int


def vehicle_of(robot: Robot, build: Build = Build()) -> Vehicle:
    """Return the MuJoCo model of a robot, standing level on the lowest of its contacts."""
    model = mujoco.MjModel.from_xml_string(mjcf_of(robot, build))
    joints = [model.joint(name) for name in robot.joint_names]
    motors = [model.actuator(name).id for name in robot.joint_names] if build.motors else []
    wheels = _wheels(robot, build)
    vehicle = Vehicle(
        robot,
        build,
        model,
        np.array([int(j.qposadr[0]) for j in joints], dtype=np.intp),
        np.array([int(j.dofadr[0]) for j in joints], dtype=np.intp),
        np.array(motors, dtype=np.intp),
        tuple((model.actuator(f'wheel:{c.name}').id, c.position[1]) for c in wheels),
        model.body(robot.root).id,
        -1 if robot.payload_link is None else model.body('payload').id,
    )
    if build.motors:
        tune(vehicle, SERVO)
    return vehicle


def tune(vehicle: Vehicle, frequency: float) -> None:
    """Make the motors critically damped servos with this natural frequency (rad/s)."""
    model = vehicle.model
    inertia = np.maximum(model.dof_M0[vehicle.rate], SERVO_INERTIA)
    model.actuator_gainprm[vehicle.motor, 0] = inertia * frequency**2
    model.actuator_biasprm[vehicle.motor, 1] = -inertia * frequency**2
    model.actuator_biasprm[vehicle.motor, 2] = -2.0 * inertia * frequency


def _wheels(robot: Robot, build: Build) -> tuple[Contact, ...]:
    """Return the contacts that get a wheel; with obstacles, also wheels along the tracks."""
    return shape.track_wheels(robot, whole=bool(build.blocks)) if build.wheels else ()


def mjcf_of(robot: Robot, build: Build) -> str:
    """Return the MJCF text of `robot`."""
    root = ET.Element('mujoco', model=robot.name)
    ET.SubElement(root, 'compiler', angle='radian', autolimits='true', inertiafromgeom='false')
    ET.SubElement(
        root,
        'option',
        timestep=repr(build.timestep),
        gravity=numbers((0.0, 0.0, -robot.gravity)),
        integrator='implicitfast',
        cone='elliptic',
        impratio=repr(build.impratio),
    )
    default = ET.SubElement(root, 'default')
    contact = {'friction': numbers((build.friction, 0.005, 0.0001)), 'condim': '3'}
    hard = numbers((build.contact_time, 1.0))
    ET.SubElement(default, 'geom', contact, solref=hard, contype='0', conaffinity='1')
    world = ET.SubElement(root, 'worldbody')
    if build.base == 'free':
        ET.SubElement(world, 'geom', name='ground', type='plane', size='0 0 1', contype='1')
        shape.add_blocks(world, build.blocks)
    _add_bodies(world, robot, build)
    if build.wheels:
        wheels, blocks = _wheels(robot, build), len(build.blocks)
        shape.add_pairs(root, robot, wheels, blocks, build.friction, build.contact_time)
    _add_mimics(root, robot)
    _add_motors(root, robot, build)
    _add_sensors(root, robot)
    return ET.tostring(root, encoding='unicode')


def _add_bodies(world: ET.Element, robot: Robot, build: Build) -> None:
    bodies = {}
    start = (0.0, 0.0, shape.CONTACT_RADIUS - shape.lowest_contact(robot))
    top = ET.SubElement(world, 'body', name=robot.root, pos=numbers(start))
    if build.base == 'free':
        ET.SubElement(top, 'freejoint', name='base')
    bodies[robot.root] = top
    waiting = [joint for joint in robot.joints if joint.parent == robot.root]
    while waiting:
        joint = waiting.pop(0)
        bodies[joint.child] = _add_body(bodies[joint.parent], robot, joint, build)
        waiting += [j for j in robot.joints if j.parent == joint.child]
    for link in robot.links:
        _add_mass(bodies[link.name], link)
    if robot.payload_link is not None:
        load = ET.SubElement(
            bodies[robot.payload_link], 'body', name='payload', pos=numbers(robot.payload.cog)
        )
        _add_mass(load, Link('payload', max(robot.payload.mass, LEAST)))
    x, y = (tuple(row[k] for row in build.imu_rotation) for k in (0, 1))
    sensor = {'pos': numbers(build.imu_position), 'xyaxes': numbers(x + y)}
    ET.SubElement(bodies.get(build.imu_link, top), 'site', sensor, name='imu')
    if build.base == 'free':
        shape.add_contacts(bodies, robot, _wheels(robot, build), build.wheel_radius)
        if build.bulk:
            shape.add_bulk(bodies, robot)


def _add_body(parent: ET.Element, robot: Robot, joint: Joint, build: Build) -> ET.Element:
    """Add the child link of `joint`; one neither measured nor a follower is held."""
    moving = joint.name in robot.joint_names or joint.name in {m.joint for m in robot.mimics}
    held = 0.0 if moving else dict(robot.held).get(joint.name, 0.0)
    rotation, shift = np.array(joint.rotation), np.array(joint.xyz)
    axis = np.array(joint.axis)
    if joint.slides:
        shift = shift + rotation @ axis * held
    elif joint.kind != 'fixed':
        rotation = rotation @ _rotation(axis, held)
    x_and_y = np.concatenate([rotation[:, 0], rotation[:, 1]])
    body = ET.SubElement(
        parent, 'body', name=joint.child, pos=numbers(shift), xyaxes=numbers(x_and_y)
    )
    ET.SubElement(body, 'site', name=f'joint:{joint.name}')
    if moving:
        kind = 'slide' if joint.slides else 'hinge'
        law = next((law for law in robot.laws if law.joint == joint.name), Law(joint.name))
        ET.SubElement(
            body,
            'joint',
            name=joint.name,
            type=kind,
            axis=numbers(joint.axis),
            armature=repr(build.armature),
            stiffness=repr(law.stiffness),
            springref=repr(law.rest),
        )
    return body


def _rotation(axis: Floats, angle: float) -> Floats:
    quaternion, matrix = np.empty(4), np.empty(9)
    mujoco.mju_axisAngle2Quat(quaternion, axis, angle)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _add_mass(body: ET.Element, link: Link) -> None:
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
    diagonal = (xx + LEAST, yy + LEAST, zz + LEAST)
    ET.SubElement(
        body,
        'inertial',
        pos=numbers(link.cog),
        mass=numbers([max(link.mass, LEAST)]),
        fullinertia=numbers((*diagonal, xy, xz, yz)),
    )


def _add_mimics(root: ET.Element, robot: Robot) -> None:
    """Tie each joint that follows another to it."""
    if not robot.mimics:
        return
    ties = ET.SubElement(root, 'equality')
    for mimic in robot.mimics:
        law = numbers((mimic.offset, mimic.multiplier, 0.0, 0.0, 0.0))
        ET.SubElement(ties, 'joint', joint1=mimic.joint, joint2=mimic.follows, polycoef=law)


def _add_motors(root: ET.Element, robot: Robot, build: Build) -> None:
    actuators = ET.SubElement(root, 'actuator')
    for name in robot.joint_names if build.motors else ():
        limit = robot.joint(name).effort
        clip = {'forcerange': numbers((-limit, limit))} if np.isfinite(limit) else {}
        ET.SubElement(actuators, 'position', clip, name=name, joint=name, kp='1', kv='1')
    for contact in _wheels(robot, build):
        name = f'wheel:{contact.name}'
        ET.SubElement(
            actuators,
            'velocity',
            name=name,
            joint=name,
            kv=repr(WHEEL_GAIN),
            forcerange=numbers((-WHEEL_TORQUE, WHEEL_TORQUE)),
        )


def _add_sensors(root: ET.Element, robot: Robot) -> None:
    sensors = ET.SubElement(root, 'sensor')
    for kind in ('gyro', 'accelerometer'):
        ET.SubElement(sensors, kind, name=kind, site='imu')
    ET.SubElement(sensors, 'framequat', name='orientation', objtype='site', objname='imu')
    for name in robot.joint_names:
        for kind in ('force', 'torque'):
            ET.SubElement(sensors, kind, name=f'{kind}:{name}', site=f'joint:{name}')


def set_brakes(vehicle: Vehicle, *, on: bool) -> None:
    """Apply the wheels' brakes or release them."""
    model = vehicle.model
    joints = model.actuator_trnid[[k for k, _ in vehicle.wheels], 0]
    model.dof_frictionloss[model.jnt_dofadr[joints]] = WHEEL_TORQUE if on else 0.0


def set_payload(vehicle: Vehicle, payload: Payload) -> None:
    """Replace the payload in the gripper now: the masses of the MuJoCo model change at once."""
    model = vehicle.model
    model.body_mass[vehicle.payload] = payload.mass
    model.body_pos[vehicle.payload] = payload.cog
    mujoco.mj_setConst(model, mujoco.MjData(model))


def gravity_on_slope(gravity: float, tilt: float, heading: float) -> Floats:
    """Return gravity (m/s2) in the axes of a ground tilted by `tilt` (rad), down towards `heading`.

    `heading` (rad) counts from x (forward) to y (left): right tilt is -pi/2.
    """
    s, c = math.sin(tilt), math.cos(tilt)
    return gravity * np.array([s * math.cos(heading), s * math.sin(heading), -c])
