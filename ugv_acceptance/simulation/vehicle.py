"""A robot as a MuJoCo model: its bodies, joints and motors on a ground it can tip over on.

The model is made from the links and joints of the Robot, not from the compiled mechanics, so that
MuJoCo checks those. The constant part of a joint's law is left out. Every link is a body with
the link's own axes; a point-like link gets the least
inertia MuJoCo takes. Ground slopes come from the direction of gravity: see `gravity_on_slope`.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import IDENTITY, Joint, Law, Link, Payload, Robot, Vector
from ugv_acceptance.model.roles import direction_of, place_of
from ugv_acceptance.simulation import shape
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.inertia import LEAST, full_inertia
from ugv_acceptance.simulation.rolling import (
    CASTER_FRICTION,
    Roller,
    casters_of,
    rollers_of,
)
from ugv_acceptance.simulation.shape import numbers
from ugv_acceptance.type_aliases import Floats

# Natural frequency (rad/s) of the position servos on the inertia of the zero posture, or on
# this (kg m2, kg) if that is more: a flipper's drive also lifts the robot. That of a motor below
# 10 N m is WEAK times its limit squared, or a light joint's servo rattles from limit to limit.
SERVO, SERVO_INERTIA, WEAK = 50.0, 2.0, 0.02
# Names of bodies in MuJoCo that a link of a URDF may have as well.
TAKEN = ('world', 'payload')
# A hull between wheels is this share of their radius above the ground, at least.
BELLY = 0.5


@dataclass(frozen=True, slots=True)
class Build:
    """The choices in making a MuJoCo model of a robot: base, wheels, motors, contacts, obstacles.

    `base` is free or fixed (no ground then). `wheels` lets the robot drive: its own wheels turn,
    or, where it has none, a wheel of `wheel_radius` (m) at most stands at every contact of the root
    link. Else a small sphere stands at each contact point, as it does at other contacts. `motors`
    drive the joints, limited to the joint's effort, with `armature` (kg m2) as the rotor's share of
    inertia. `bulk` adds what touches the ground only after a tip-over. `contact_time` (s) is the
    time constant of a contact: short is hard; `impratio` is how much harder friction is than
    contact: more creeps less. `blocks` lie on the ground. The IMU is on `imu_link` ('': the root
    link), in whose axes its place is.
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
    are the driven wheels, each with its index of ctrl. `payload` is the load's body, -1 without;
    `casters` are the contact pairs of what rolls along.
    """

    robot: Robot
    build: Build
    model: mujoco.MjModel
    position: NDArray[np.intp]
    rate: NDArray[np.intp]
    motor: NDArray[np.intp]
    wheels: tuple[tuple[int, Roller], ...]
    root: int
    payload: int
    casters: tuple[int, ...] = ()


PLAIN = Build()


def vehicle_of(robot: Robot, build: Build = PLAIN) -> Vehicle:
    """Return the MuJoCo model of a robot, standing level on the lowest of its contacts."""
    model = mujoco.MjModel.from_xml_string(mjcf_of(robot, build))
    joints = [model.joint(name) for name in robot.joint_names]
    casters = casters_of(robot) if build.wheels else ()
    motors = [model.actuator(name).id for name in robot.joint_names] if build.motors else []
    vehicle = Vehicle(
        robot,
        build,
        model,
        np.array([int(j.qposadr[0]) for j in joints], dtype=np.intp),
        np.array([int(j.dofadr[0]) for j in joints], dtype=np.intp),
        np.array(motors, dtype=np.intp),
        tuple((model.actuator(r.name).id, r) for r in _rollers(robot, build)),
        model.body(body_name(robot.root)).id,
        -1 if robot.payload_link is None else model.body('payload').id,
        tuple(model.pair(f'contact:{c.name}:{g}').id for c in casters for g in _grounds(build)),
    )
    if build.motors:
        tune(vehicle, SERVO)
    return vehicle


def tune(vehicle: Vehicle, frequency: float) -> None:
    """Make the motors critically damped servos with this natural frequency (rad/s)."""
    model, driven = vehicle.model, [k for k, _ in vehicle.wheels]
    holds = ~np.isin(vehicle.motor, driven)
    motor = vehicle.motor[holds]
    names = [n for n, held in zip(vehicle.robot.joint_names, holds, strict=True) if held]
    limits = np.array([vehicle.robot.joint(name).effort for name in names])
    least = np.minimum(SERVO_INERTIA, WEAK * limits**2)
    inertia = np.maximum(model.dof_M0[vehicle.rate[holds]], least)
    model.actuator_gainprm[motor, 0] = inertia * frequency**2
    model.actuator_biasprm[motor, 1] = -inertia * frequency**2
    model.actuator_biasprm[motor, 2] = -2.0 * inertia * frequency


def body_name(link: str) -> str:
    """Return the name in MuJoCo of the body of a link."""
    return f'{link}:link' if link in TAKEN else link


def _rollers(robot: Robot, build: Build) -> tuple[Roller, ...]:
    """Return the driven wheels; with obstacles, also wheels along the tracks."""
    if not build.wheels:
        return ()
    return rollers_of(robot, build.wheel_radius, whole=bool(build.blocks))


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
        shape.add_pairs(root, _friction(robot, build), _grounds(build), build.contact_time)
    _add_mimics(root, robot)
    _add_motors(root, robot, build)
    _add_sensors(root, robot)
    return ET.tostring(root, encoding='unicode')


def _grounds(build: Build) -> tuple[str, ...]:
    """Return the names of the geometries that a robot stands and drives on."""
    return ('ground', *(f'block:{k}' for k in range(len(build.blocks))))


def _friction(robot: Robot, build: Build) -> dict[str, float]:
    """Return the friction of every geometry that stands or drives on the ground."""
    under = {c.name: c for roller in _rollers(robot, build) for c in roller.contacts}
    casters = {c.name for c in casters_of(robot)}
    found = {}
    for name in dict.fromkeys((*(c.name for c in robot.contacts), *under)):
        rolls = name in casters
        geometry = f'{"wheel" if name in under else "contact"}:{name}'
        found[geometry] = CASTER_FRICTION if rolls else build.friction
    return found


def _add_bodies(world: ET.Element, robot: Robot, build: Build) -> None:
    bodies = {}
    start = (0.0, 0.0, shape.CONTACT_RADIUS - shape.lowest_contact(robot))
    top = ET.SubElement(world, 'body', name=body_name(robot.root), pos=numbers(start))
    if build.base == 'free':
        ET.SubElement(top, 'freejoint', name='free:base')
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
        _add_feet(bodies, robot, build)


def _add_feet(bodies: dict[str, ET.Element], robot: Robot, build: Build) -> None:
    """Add what stands on the ground: spheres at the contacts, wheels, the hull."""
    rollers = _rollers(robot, build)
    under = {c.name for roller in rollers for c in roller.contacts}
    shape.add_spheres(bodies, (c for c in robot.contacts if c.name not in under))
    lift = shape.CLEARANCE
    for roller in rollers:
        if roller.joint is None:
            (contact,) = roller.contacts
            shape.add_track_wheel(bodies[contact.link], contact, roller.radius, roller.rotor)
        else:
            lift = max(lift, BELLY * roller.radius)
            for disc in _discs(robot, roller):
                shape.add_disc(bodies[disc.link], disc)
    if build.bulk:
        shape.add_bulk(bodies, robot, lift)


def _discs(robot: Robot, roller: Roller) -> Iterator[shape.Disc]:
    """Yield a disc for every contact that a wheel of the robot stands on."""
    joint = robot.joint(str(roller.joint))
    axle = place_of(robot, joint.child, (0.0, 0.0, 0.0))
    direction = np.array(direction_of(robot, joint))
    for contact in roller.contacts:
        away = place_of(robot, contact.link, contact.position) - axle
        along = float(away @ direction)
        radius = float(np.linalg.norm(away - along * direction)) + shape.CONTACT_RADIUS
        x, y, z = (along * np.array(joint.axis)).tolist()
        yield shape.Disc(contact.name, joint.child, (x, y, z), joint.axis, radius)


def _add_body(parent: ET.Element, robot: Robot, joint: Joint, build: Build) -> ET.Element:
    """Add the child link of `joint`; one neither measured nor a follower nor a wheel is held."""
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
        parent, 'body', name=body_name(joint.child), pos=numbers(shift), xyaxes=numbers(x_and_y)
    )
    ET.SubElement(body, 'site', name=f'joint:{joint.name}')
    roller = next((r for r in _rollers(robot, build) if r.joint == joint.name), None)
    if roller is not None:
        shape.axle_joint(body, joint.name, joint.axis, roller.rotor)
    elif moving:
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
    ET.SubElement(
        body,
        'inertial',
        pos=numbers(link.cog),
        mass=numbers([max(link.mass, LEAST)]),
        fullinertia=numbers(full_inertia(link.inertia)),
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
    rollers = _rollers(robot, build)
    wheels = {roller.joint for roller in rollers}
    for name in robot.joint_names if build.motors else ():
        limit = robot.joint(name).effort
        clip = {'forcerange': numbers((-limit, limit))} if np.isfinite(limit) else {}
        if name not in wheels:
            ET.SubElement(actuators, 'position', clip, name=name, joint=name, kp='1', kv='1')
    for roller in rollers:
        ET.SubElement(
            actuators,
            'velocity',
            name=roller.name,
            joint=roller.name,
            kv=repr(roller.gain),
            forcerange=numbers((-roller.torque, roller.torque)),
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
    """Apply the wheels' brakes or release them; casters hold as if chocked, or roll again."""
    model = vehicle.model
    for pair in vehicle.casters:
        model.pair_friction[pair, :2] = vehicle.build.friction if on else CASTER_FRICTION
    for k, roller in vehicle.wheels:
        joint = model.actuator_trnid[k, 0]
        model.dof_frictionloss[model.jnt_dofadr[joint]] = roller.brake if on else 0.0


def drive(vehicle: Vehicle, control: Floats, forward: float, yaw: float) -> None:
    """Set the wheels' speeds in `control` (MuJoCo's ctrl): ahead (m/s) and to the left (rad/s)."""
    for wheel, roller in vehicle.wheels:
        control[wheel] = roller.forward * (forward - yaw * roller.y) / roller.radius


def set_payload(vehicle: Vehicle, payload: Payload) -> None:
    """Replace the payload in the gripper now: the masses of the MuJoCo model change at once.

    Raises BadConfig for a load where the configuration names no payload link.
    """
    model, robot = vehicle.model, vehicle.robot
    if vehicle.payload < 0:
        if payload.mass > 0.0:
            raise BadConfig(f'{robot.name}: expected payload.link to carry a load, got none')
        return
    model.body_mass[vehicle.payload] = payload.mass
    model.body_pos[vehicle.payload] = payload.cog
    mujoco.mj_setConst(model, mujoco.MjData(model))


def gravity_on_slope(gravity: float, tilt: float, heading: float) -> Floats:
    """Return gravity (m/s2) in the axes of a ground tilted by `tilt` (rad), down towards `heading`.

    `heading` (rad) counts from x (forward) to y (left): right tilt is -pi/2.
    """
    s, c = math.sin(tilt), math.cos(tilt)
    return gravity * np.array([s * math.cos(heading), s * math.sin(heading), -c])
