"""Uneven ground in MuJoCo for a tracked robot: stairs, crossing ramps, a stepfield, a hurdle.

A track is a long box with a round end each, a flipper a tapered plate; their belts move over what
they touch. Nothing of the arm collides, so that every fall goes on until the robot lies.
"""

import math
from dataclasses import dataclass, replace
from xml.etree import ElementTree as ET

import numpy as np

from ugv_acceptance.model.robot import Robot
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.shape import Block, add_blocks, numbers, ramp, stairs, step
from ugv_acceptance.simulation.vehicle import SERVO, Build, Vehicle, mjcf_of, tune
from ugv_acceptance.type_aliases import Floats

BUILD = Build(
    motors=True, friction=1.2, armature=0.01, timestep=0.0025, contact_time=0.006, impratio=10.0
)
# PackBot (m): radius and half the length of a track's flat part, its y; half its thickness, thin
# as the line of contact points that the configuration has.
RADIUS, REACH, TRACK_Y, THIN = 0.095, 0.25, 0.202, 0.002
# The hull between the tracks: half sizes and middle.
HULL, HULL_AT = (0.32, 0.127, 0.0795), (0.0, 0.0, 0.1105)
# A flipper: y, length between its rollers, their radii.
FLIPPER_Y, FLIPPER, ROLLERS = 0.228, 0.233, (0.085, 0.035)
# Stairs: rise (m) and angle (rad); their pitch (m) is the distance from nose to nose.
RISE, ANGLE, COUNT = 0.2, math.radians(40.0), 12
RUN = RISE / math.tan(ANGLE)
PITCH = math.hypot(RISE, RUN)
RAMP, CELL = math.radians(15.0), 1.2
# Side (m) of a post of the stepfield, and the number along x and y.
POST, ALONG, ACROSS = 0.3, 13, 9
# Rate (1/s) at which friction brings a contact to the speed of the belt, as if it slipped no faster
# than SLIP (m/s), on flat ground SLIP_FLAT: MuJoCo lifts what slips fast, and a turning robot would
# hop. Climbing needs the faster one.
GRIP, SLIP, SLIP_FLAT = 100.0, 0.1, 0.02
# Gap (m) between robot and ground below which they touch.
NEAR = 0.002


@dataclass(frozen=True, slots=True)
class Scene:
    """A place to drive: obstacles, the ends (m) along x of where it is, and what it is called."""

    name: str
    blocks: tuple[Block, ...]
    ends: tuple[float, float]


def scene(name: str, seed: int) -> Scene:
    """Return a scene by its name; `seed` draws the heights of a stepfield, a hurdle or a drop."""
    rng = np.random.default_rng([seed, 7])
    if name in {'stairs_up', 'stairs_down', 'stair_top'}:
        flight = stairs(0.0, RISE, RUN, COUNT - 1)
        landing = step((COUNT - 1) * RUN, COUNT * RISE, 3.0)
        return Scene(name, (*flight, landing), (-2.0, (COUNT - 1) * RUN + 2.8))
    if name == 'ramps':
        return Scene(name, _ramps(), (-1.0, 4 * CELL + 1.0))
    if name == 'stepfield':
        return Scene(name, _posts(rng), (-1.0, POST * ALONG + 1.0))
    if name == 'hurdle':
        some = [Block((1.2 * k, 0.0, 0.0), (_bar(rng), 2.0, 0.15)) for k in range(2)]
        return Scene(name, tuple(some), (-2.0, 3.5))
    if name == 'drop':
        height = float(rng.uniform(0.15, 0.35))
        return Scene(name, (step(-3.0, height, 3.0),), (-2.8, 2.0))
    return Scene(name, (), (-20.0, 20.0))


def _bar(rng: np.random.Generator) -> float:
    return float(rng.uniform(0.03, 0.15))


def _ramps() -> tuple[Block, ...]:
    """Return ramps that rise on one side while they fall on the other."""
    blocks = []
    for k in range(4):
        for side in (1.0, -1.0):
            up = (side > 0.0) == (k % 2 == 0)
            block, _ = ramp(0.0, RAMP, CELL / math.cos(RAMP))
            x, _, z = block.middle
            x = x if up else CELL - x
            half = (block.half[0], 1.0, block.half[2])
            pitch = block.pitch if up else -block.pitch
            blocks.append(Block((k * CELL + x, side, z), half, pitch))
    return tuple(blocks)


def _posts(rng: np.random.Generator) -> tuple[Block, ...]:
    blocks = []
    for i in range(ALONG):
        for j in range(ACROSS):
            height = 0.05 * int(rng.integers(0, 5))
            if height > 0.0:
                at = (POST * (i + 0.5), POST * (j - (ACROSS - 1) / 2.0), 0.0)
                blocks.append(Block(at, (POST / 2.0, POST / 2.0, height)))
    return tuple(blocks)


def tracked(robot: Robot, place: Scene) -> Vehicle:
    """Return the MuJoCo model of PackBot (or one of its measures) with tracks, on a scene."""
    joints = tuple(replace(joint, effort=math.inf) for joint in robot.joints)
    robot = replace(robot, joints=joints)
    root = ET.fromstring(mjcf_of(robot, BUILD))  # noqa: S314 - written by mjcf_of
    for body in root.iter('body'):
        for geom in list(body.findall('geom')):
            body.remove(geom)
        if body.get('name') == robot.root:
            _add_tracks(body)
        if body.get('name') == 'flipper_link':
            _add_flippers(root, body)
        for geom in body.findall('geom'):
            # Contacts are found from NEAR on; they push from 0 on.
            geom.set('gap', repr(NEAR))
    world = root.find('worldbody')
    if world is None:
        raise ValueError('expected a worldbody in MJCF')
    add_blocks(world, place.blocks)
    model = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding='unicode'))
    joint = [model.joint(name) for name in robot.joint_names]
    vehicle = Vehicle(
        robot,
        BUILD,
        model,
        np.array([int(j.qposadr[0]) for j in joint], dtype=np.intp),
        np.array([int(j.dofadr[0]) for j in joint], dtype=np.intp),
        np.array([model.actuator(name).id for name in robot.joint_names], dtype=np.intp),
        (),
        model.body(robot.root).id,
        model.body('payload').id,
    )
    tune(vehicle, SERVO)
    return vehicle


def _add_tracks(body: ET.Element) -> None:
    ET.SubElement(body, 'geom', name='hull', type='box', size=numbers(HULL), pos=numbers(HULL_AT))
    for side in (1.0, -1.0):
        name = f'belt:{"left" if side > 0.0 else "right"}'
        middle, half = (0.0, side * TRACK_Y, RADIUS), (REACH, THIN, RADIUS)
        ET.SubElement(body, 'geom', name=name, type='box', size=numbers(half), pos=numbers(middle))
        for x in (REACH, -REACH):
            end, size = (x, side * TRACK_Y, RADIUS), (RADIUS, THIN * 5.0, RADIUS)
            ET.SubElement(
                body,
                'geom',
                name=f'{name}:{"front" if x > 0.0 else "rear"}',
                type='ellipsoid',
                size=numbers(size),
                pos=numbers(end),
            )


def _add_flippers(root: ET.Element, body: ET.Element) -> None:
    asset = ET.SubElement(root, 'asset')
    turn = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
    circle = np.stack([np.cos(turn), np.zeros_like(turn), np.sin(turn)], axis=1)
    along = [np.array([x, 0.0, 0.0]) for x in (0.0, FLIPPER)]
    rims = np.concatenate([r * circle + x for r, x in zip(ROLLERS, along, strict=True)])
    sides = [rims + np.array([0.0, y, 0.0]) for y in (THIN, -THIN)]
    ET.SubElement(asset, 'mesh', name='flipper', vertex=numbers(np.concatenate(sides).reshape(-1)))
    for side in (1.0, -1.0):
        ET.SubElement(
            body,
            'geom',
            name=f'belt:{"left" if side > 0.0 else "right"}:flipper',
            type='mesh',
            mesh='flipper',
            pos=numbers((0.0, side * FLIPPER_Y, 0.0)),
        )


@dataclass(frozen=True, slots=True)
class Belts:
    """Which geometries of a model have a belt: its y (m) at each, NaN at the others.

    `slip` (m/s) is the fastest slip that friction is told of.
    """

    y: Floats
    slip: float

    @classmethod
    def of(cls, model: mujoco.MjModel, slip: float = SLIP) -> 'Belts':
        """Return the belts of a model of `tracked`."""
        names = [model.geom(k).name for k in range(model.ngeom)]
        side = {'left': TRACK_Y, 'right': -TRACK_Y}
        y = [side[n.split(':')[1]] if n.startswith('belt:') else math.nan for n in names]
        return cls(np.array(y), slip)


def drive_step(
    vehicle: Vehicle, data: mujoco.MjData, belts: Belts, drive: tuple[float, float]
) -> None:
    """Simulate a time step while the belts run at forward speed (m/s) and yaw rate (rad/s).

    Friction aims at the belt's speed at each contact, where MuJoCo's own aims at none.
    """
    model = vehicle.model
    mujoco.mj_step1(model, data)
    touch = data.contact
    rows = touch.efc_address
    if len(rows):
        some = rows >= 0
        geom, frame, rows = touch.geom[some], touch.frame[some].reshape(-1, 3, 3), rows[some]
        second = np.where(np.isnan(belts.y[geom]), -math.inf, 1.0).argmax(axis=1)
        y = belts.y[geom[np.arange(len(rows)), second]]
        out = frame[:, 0] * np.where(second == 1, -1.0, 1.0)[:, None]
        axle = data.xmat[vehicle.root].reshape(3, 3)[:, 1]
        speed = np.where(np.isnan(y), 0.0, drive[0] - drive[1] * np.nan_to_num(y))
        belt = np.cross(axle, out) * (speed * np.where(second == 1, 1.0, -1.0))[:, None]
        for k in (1, 2):
            relative = data.efc_vel[rows + k] + np.einsum('nk,nk->n', frame[:, k], belt)
            data.efc_aref[rows + k] = -GRIP * np.clip(relative, -belts.slip, belts.slip)
    mujoco.mj_step2(model, data)


def touching(data: mujoco.MjData) -> Floats:
    """Return the points (n, 3) in the world where the robot is NEAR enough to the ground to bear.

    A corner that a rigid robot happens not to load at this moment would bear at once if it tilted.
    """
    return np.array(data.contact.pos[data.contact.dist < NEAR])
