"""Contact geometry in MJCF: contact spheres, wheels, the body's hull, obstacles."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from xml.etree import ElementTree as ET

import numpy as np

from ugv_acceptance.model.robot import Contact, Joint, Robot, Vector
from ugv_acceptance.model.roles import place_of
from ugv_acceptance.model.tree import tree_of

# Radius (m) of the sphere about a contact point: small, so that it stands where the point is.
CONTACT_RADIUS = 1e-4
# Half the width (m) of a wheel at its axle.
WHEEL_WIDTH = 0.02
# Radius (m) of the spheres at the joints and the payload, ground clearance (m) of the hull.
BULK_RADIUS, CLEARANCE = 0.03, 0.03
# Half of what a hull measures at least (m): contacts can lie on one line.
THIN = 1e-3
# Time constant (s) in which friction stops a slip, and share of a contact that is stiff. MuJoCo
# lifts what slips by slip speed x friction time / contact time^2: with one time for both, a turning
# robot hops from contact to contact, and its accelerometer feels more than 2 g.
SLIP_TIME, STIFF = 0.1, 0.7
# Wheels between the ends of a track; raised (m) so that on flat ground the ends bear.
BETWEEN, RAISED = 3, 0.001
# Contacts of one track have the same y to this many decimals (m).
SAME_SIDE = 6
# Time constant (s) and damping of a brake.
BRAKE = (0.02, 1.0)


@dataclass(frozen=True, slots=True)
class Block:
    """A box on the ground: centre and half size (m), turned by `pitch` (rad) about y."""

    middle: Vector
    half: Vector
    pitch: float = 0.0


def step(at: float, height: float, length: float = 4.0) -> Block:
    """Return a step of `height` (m) that begins at x = `at` (m) and is `length` (m) deep."""
    return Block((at + length / 2.0, 0.0, 0.0), (length / 2.0, 2.0, height))


def stairs(at: float, rise: float, run: float, count: int) -> tuple[Block, ...]:
    """Return `count` stairs that begin at x = `at` (m), each `rise` high and `run` deep (m)."""
    return tuple(step(at + k * run, (k + 1) * rise) for k in range(count))


def ramp(at: float, angle: float, length: float = 3.0) -> tuple[Block, Block]:
    """Return a ramp from x = `at` (m), `length` (m) long at `angle` (rad), and a level end."""
    s, c = math.sin(angle), math.cos(angle)
    depth = length / 2.0
    # The upper face goes through (at, 0): half a length along it, then `depth` down its normal.
    middle = (at + length / 2.0 * c + depth * s, 0.0, length / 2.0 * s - depth * c)
    return Block(middle, (length / 2.0, 2.0, depth), -angle), step(at + length * c, length * s)


def numbers(values: Iterable[float]) -> str:
    """Return numbers as text for MJCF, with all their digits."""
    return ' '.join(repr(float(x)) for x in values)


def on_root(robot: Robot) -> tuple[Contact, ...]:
    """Return the contacts on what is fixed to the root link, in the axes of the latter."""
    frames = tree_of(robot).frames
    return tuple(_moved(robot, c) for c in robot.contacts if frames[c.link][0] == 0)


def _moved(robot: Robot, contact: Contact) -> Contact:
    if contact.link == robot.root:
        return contact
    x, y, z = place_of(robot, contact.link, contact.position).tolist()
    return Contact(contact.name, robot.root, (x, y, z))


def lowest_contact(robot: Robot) -> float:
    """Return the height (m, `base_link`) of the root link's lowest contact; without: the ground."""
    heights = [c.position[2] for c in on_root(robot)]
    return min(heights, default=robot.ground)


def wheel_contacts(robot: Robot) -> tuple[Contact, ...]:
    """Return the contacts that become wheels: those fixed to the root link, on the ground plane."""
    high = robot.ground + robot.contact_tolerance
    return tuple(c for c in on_root(robot) if c.position[2] <= high)


def track_wheels(robot: Robot, *, whole: bool) -> tuple[Contact, ...]:
    """Return `wheel_contacts`; with `whole`, also wheels between the ends of each track."""
    ends = wheel_contacts(robot)
    between = []
    for side in sorted({round(c.position[1], SAME_SIDE) for c in ends}) if whole else ():
        row = sorted((c for c in ends if round(c.position[1], SAME_SIDE) == side), key=_forward)
        rear, front = row[0], row[-1]
        for k in range(1, BETWEEN + 1) if front is not rear else ():
            x = rear.position[0] + k / (BETWEEN + 1) * (front.position[0] - rear.position[0])
            place = (x, rear.position[1], rear.position[2] + RAISED)
            between.append(Contact(f'{rear.name}:{k}', robot.root, place))
    return (*ends, *between)


def _forward(contact: Contact) -> float:
    return contact.position[0]


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc with its lowest point at a contact: half its height is `radius` (m).

    `link` carries its axle, in whose axes its centre (m) and the axle's direction are.
    """

    contact: str
    link: str
    centre: Vector
    axis: Vector
    radius: float


def add_spheres(bodies: Mapping[str, ET.Element], contacts: Iterable[Contact]) -> None:
    """Add a small sphere at every contact."""
    for contact in contacts:
        ET.SubElement(
            bodies[contact.link],
            'geom',
            name=f'contact:{contact.name}',
            type='sphere',
            size=repr(CONTACT_RADIUS),
            pos=numbers(contact.position),
        )


def add_disc(body: ET.Element, disc: Disc) -> None:
    """Add a disc to the body that turns with the wheel, about the disc's axis."""
    ET.SubElement(
        body,
        'geom',
        name=f'wheel:{disc.contact}',
        type='ellipsoid',
        pos=numbers(disc.centre),
        zaxis=numbers(disc.axis),
        size=numbers((disc.radius, disc.radius, WHEEL_WIDTH)),
    )


def add_blocks(world: ET.Element, blocks: Iterable[Block]) -> None:
    """Add the obstacles on the ground."""
    for k, block in enumerate(blocks):
        ET.SubElement(
            world,
            'geom',
            name=f'block:{k}',
            type='box',
            contype='1',
            pos=numbers(block.middle),
            size=numbers(block.half),
            euler=numbers((0.0, block.pitch, 0.0)),
        )


def add_pairs(
    root: ET.Element, friction: Mapping[str, float], grounds: Iterable[str], contact_time: float
) -> None:
    """Let geometries, each with its friction, slip on ground and obstacles without bouncing."""
    contact = ET.SubElement(root, 'contact')
    for name, slides in friction.items():
        for ground in grounds:
            ET.SubElement(
                contact,
                'pair',
                name=f'{name}:{ground}',
                geom1=name,
                geom2=ground,
                condim='3',
                friction=numbers((slides, slides, 0.005, 0.0001, 0.0001)),
                solref=numbers((contact_time, 1.0)),
                solreffriction=numbers((SLIP_TIME, 1.0)),
                solimp=numbers((STIFF, STIFF, 0.001)),
            )


def axle_joint(wheel: ET.Element, name: str, axis: Vector, armature: float) -> None:
    """Add the joint of a wheel's axle, with a rotor of `armature` (kg m2).

    Its brake is friction of the joint, stiff so that it does not creep.
    """
    stiff = {'solreffriction': numbers(BRAKE), 'solimpfriction': numbers((0.9999, 0.9999, 0.001))}
    ET.SubElement(
        wheel, 'joint', stiff, name=name, type='hinge', axis=numbers(axis), armature=repr(armature)
    )


def add_track_wheel(body: ET.Element, contact: Contact, radius: float, armature: float) -> None:
    """Add a wheel below `contact`; it has almost no mass, for the link's mass includes it."""
    x, y, z = contact.position
    name = f'wheel:{contact.name}'
    axle = numbers((x, y, z - CONTACT_RADIUS + radius))
    wheel = ET.SubElement(body, 'body', name=name, pos=axle)
    axle_joint(wheel, name, (0.0, 1.0, 0.0), armature)
    ET.SubElement(wheel, 'inertial', pos='0 0 0', mass='1e-6', diaginertia='1e-6 1e-6 1e-6')
    size = numbers((radius, WHEEL_WIDTH, radius))
    ET.SubElement(wheel, 'geom', name=name, type='ellipsoid', size=size)


def add_bulk(bodies: Mapping[str, ET.Element], robot: Robot, lift: float = CLEARANCE) -> None:
    """Add shapes that touch the ground after a tip-over: a hull, spheres at joints and payload.

    The hull's lower face is `lift` (m) above the lowest contact.
    """
    frames = tree_of(robot).frames
    still = [j for j in robot.joints if frames[j.parent][0] == 0]
    on_body = [c.position for c in on_root(robot)]
    decks = [_height(robot, joint) for joint in still]
    if on_body and decks:
        low, high = np.min(on_body, axis=0), np.max(on_body, axis=0)
        low[2], high[2] = low[2] + lift, max(*decks, low[2] + 2 * lift)
        half, middle = np.maximum((high - low) / 2, THIN), numbers((high + low) / 2)
        hull = {'type': 'box', 'size': numbers(half), 'pos': middle}
        ET.SubElement(bodies[robot.root], 'geom', hull, name='hull')
    places = [(j.parent, j.xyz) for j in robot.joints if j not in still]
    if robot.payload_link is not None:
        places.append((robot.payload_link, robot.payload.cog))
    for link, place in places:
        ET.SubElement(
            bodies[link], 'geom', type='sphere', size=repr(BULK_RADIUS), pos=numbers(place)
        )


def _height(robot: Robot, joint: Joint) -> float:
    """Return the height (m, `base_link`) of the place of a joint on the body."""
    if joint.parent == robot.root:
        return joint.xyz[2]
    return float(place_of(robot, joint.parent, joint.xyz)[2])
