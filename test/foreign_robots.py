"""Robots of other makes for tests, and their files: a rover, an arm on wheels, tracks, legs."""

from collections.abc import Iterable
from math import isfinite, pi
from pathlib import Path
from typing import Any

import yaml
from robots import box

from ugv_acceptance.model.robot import IDENTITY, Contact, Joint, Link, Matrix, Payload, Robot

# Axles across the robot as makers write them: along y, or along z of a link rolled by -90 deg.
ACROSS = (0.0, 1.0, 0.0)
ROLLED: Matrix = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
UP = (0.0, 0.0, 1.0)
# Of the rover: half the wheelbase and track, radius of the wheels, width of a tyre (m).
HALF_BASE, HALF_TRACK, RADIUS, TYRE = 0.26, 0.28, 0.16, 0.1
# Height (m) of the axles above the root link.
AXLE = 0.03
CORNERS = {
    f'{end}_{side}': (x, y)
    for end, x in (('front', HALF_BASE), ('rear', -HALF_BASE))
    for side, y in (('left', HALF_TRACK), ('right', -HALF_TRACK))
}


def disc(mass: float, radius: float) -> Matrix:
    """Return the inertia of a thin disc that turns about y."""
    half = mass * radius**2 / 4.0
    return ((half, 0.0, 0.0), (0.0, 2.0 * half, 0.0), (0.0, 0.0, half))


def rover(*, measured: bool = True, payload_link: str | None = None) -> Robot:
    """Return a rover on four wheels, each with two contact points across its tyre.

    The wheels' joints are measured, or held at 0.
    """
    links = [Link('chassis', 30.0, (0.0, 0.0, 0.1), box(30.0, 0.8, 0.5, 0.3)), Link('imu')]
    joints = [Joint('imu_fixed', 'fixed', 'chassis', 'imu', (0.1, 0.0, 0.2))]
    contacts = []
    for name, (x, y) in CORNERS.items():
        links.append(Link(f'{name}_tyre', 2.5, inertia=disc(2.5, RADIUS)))
        axle = Joint(
            f'{name}_axle', 'continuous', 'chassis', f'{name}_tyre', (x, y, AXLE), axis=ACROSS
        )
        joints.append(axle)
        contacts += [
            Contact(f'{name}_{edge}', 'chassis', (x, y + off, AXLE - RADIUS))
            for edge, off in (('in', -TYRE / 2.0), ('out', TYRE / 2.0))
        ]
    axles = tuple(f'{name}_axle' for name in CORNERS)
    return Robot(
        'rover',
        tuple(links),
        tuple(joints),
        axles if measured else (),
        tuple(contacts),
        () if measured else tuple((name, 0.0) for name in axles),
        payload_link,
        ground=AXLE - RADIUS,
        contact_tolerance=0.003,
    )


def arm_on_wheels(load: float = 2.0) -> Robot:
    """Return the rover, wheels held, with an arm of six joints that no other robot's are named as.

    At zero it points ahead: j1 turns about the vertical, j2, j3 and j5 lift, j4 and j6 roll.
    """
    base = rover(measured=False)
    along = (1.0, 0.0, 0.0)
    # Parent, child, its mass, length of the child (m), where on the parent, axis, torque limit.
    parts = (
        ('chassis', 'pillar', 3.0, 0.0, (0.2, 0.0, 0.25), UP, 120.0),
        ('pillar', 'upper', 4.0, 0.4, (0.0, 0.0, 0.1), ACROSS, 120.0),
        ('upper', 'fore', 2.5, 0.3, (0.4, 0.0, 0.0), ACROSS, 80.0),
        ('fore', 'hand', 0.8, 0.05, (0.3, 0.0, 0.0), along, 20.0),
        ('hand', 'palm', 0.4, 0.05, (0.05, 0.0, 0.0), ACROSS, 20.0),
        ('palm', 'flange', 0.2, 0.02, (0.05, 0.0, 0.0), along, 10.0),
    )
    links = list(base.links)
    joints = list(base.joints)
    for k, (parent, child, mass, length, at, axis, effort) in enumerate(parts, 1):
        inertia = box(mass, length + 0.05, 0.08, 0.08)
        links.append(Link(child, mass, (length / 2.0, 0.0, 0.0), inertia))
        joints.append(
            Joint(f'j{k}', 'revolute', parent, child, at, IDENTITY, axis, -3.0, 3.0, effort, 2.0)
        )
    return Robot(
        'arm_on_wheels',
        tuple(links),
        tuple(joints),
        tuple(f'j{k}' for k in range(1, 7)),
        base.contacts,
        base.held,
        'flange',
        Payload(load, (0.05, 0.0, 0.0)),
        ground=base.ground,
        contact_tolerance=base.contact_tolerance,
    )


def walker() -> Robot:
    """Return a body on four legs of three joints, a foot at the end of each."""
    links = [Link('trunk', 12.0, inertia=box(12.0, 0.4, 0.2, 0.1))]
    joints, contacts = [], []
    for name, (x, y) in CORNERS.items():
        # The segment, what carries it, where on that, its axis.
        parts = (
            ('hip', 'trunk', (x, y / 2.0, 0.0), (1.0, 0.0, 0.0)),
            ('thigh', f'{name}_hip', (0.0, 0.05, 0.0), ACROSS),
            ('shin', f'{name}_thigh', (0.0, 0.0, -0.2), ACROSS),
        )
        for part, parent, at, axis in parts:
            child = f'{name}_{part}'
            links.append(Link(child, 0.5, (0.0, 0.0, -0.1), box(0.5, 0.03, 0.03, 0.2)))
            joints.append(
                Joint(f'{child}_joint', 'revolute', parent, child, at, axis=axis, lower=-pi)
            )
        contacts.append(Contact(name, f'{name}_shin', (0.0, 0.0, -0.2)))
    return Robot(
        'walker',
        tuple(links),
        tuple(joints),
        tuple(j.name for j in joints),
        tuple(contacts),
        ground=-0.4,
    )


def tracks_and_flippers() -> Robot:
    """Return a tracked robot half as long as PackBot, with a crane of two axes and four flippers.

    The flippers in front and those behind have a joint each; zero points them outwards.
    """
    links = [
        Link('hull', 12.0, (0.0, 0.0, 0.06), box(12.0, 0.4, 0.25, 0.1)),
        Link('post', 0.8, (0.0, 0.0, 0.02), box(0.8, 0.06, 0.06, 0.04)),
        Link('boom', 0.9, (0.15, 0.0, 0.0), box(0.9, 0.3, 0.04, 0.04)),
        Link('jib', 0.6, (0.12, 0.0, 0.0), box(0.6, 0.25, 0.03, 0.03)),
        Link('hook'),
        Link('bow', 0.6, (0.06, 0.0, 0.0), box(0.6, 0.15, 0.3, 0.04)),
        Link('stern', 0.6, (-0.06, 0.0, 0.0), box(0.6, 0.15, 0.3, 0.04)),
    ]
    up = (0.0, -1.0, 0.0)
    joints = [
        Joint('slew', 'continuous', 'hull', 'post', (0.0, 0.0, 0.12), axis=UP),
        Joint(
            'luff',
            'revolute',
            'post',
            'boom',
            (0.0, 0.0, 0.04),
            axis=up,
            lower=-2.8,
            upper=2.8,
            effort=16.0,
        ),
        Joint(
            'fold',
            'revolute',
            'boom',
            'jib',
            (0.3, 0.0, 0.0),
            axis=up,
            lower=-2.8,
            upper=2.8,
            effort=8.0,
        ),
        Joint('hang', 'fixed', 'jib', 'hook', (0.25, 0.0, 0.0)),
        Joint('bow_drive', 'continuous', 'hull', 'bow', (0.13, 0.0, 0.05), axis=up),
        Joint('stern_drive', 'continuous', 'hull', 'stern', (-0.13, 0.0, 0.05), axis=ACROSS),
    ]
    contacts = [
        Contact(f'{end}_{side}', 'hull', (x, y, 0.0))
        for end, x in (('front', 0.13), ('rear', -0.13))
        for side, y in (('left', 0.12), ('right', -0.12))
    ]
    contacts += [
        Contact(f'{link}_{side}', link, (x, y, -0.02))
        for link, x in (('bow', 0.14), ('stern', -0.14))
        for side, y in (('left', 0.15), ('right', -0.15))
    ]
    return Robot(
        'tracks_and_flippers',
        tuple(links),
        tuple(joints),
        ('slew', 'luff', 'fold', 'bow_drive', 'stern_drive'),
        tuple(contacts),
        payload_link='hook',
        payload=Payload(0.5),
        contact_tolerance=0.002,
    )


def write_robot(folder: Path, robot: Robot) -> Path:
    """Write a robot as a URDF and a configuration that a stranger could have written."""
    parts = [f'<robot name="{robot.name}">']
    for link in robot.links:
        (a, b, c), (_, d, e), (_, _, f) = link.inertia
        parts.append(
            f'<link name="{link.name}"><inertial><origin xyz="{_text(link.cog)}"/>'
            f'<mass value="{link.mass}"/>'
            f'<inertia ixx="{a}" ixy="{b}" ixz="{c}" iyy="{d}" iyz="{e}" izz="{f}"/>'
            '</inertial></link>'
            if link.mass
            else f'<link name="{link.name}"/>'
        )
    parts += [
        f'<joint name="{joint.name}" type="{joint.kind}"><parent link="{joint.parent}"/>'
        f'<child link="{joint.child}"/><origin xyz="{_text(joint.xyz)}"/>'
        f'<axis xyz="{_text(joint.axis)}"/>{_limit(joint)}</joint>'
        for joint in robot.joints
    ]
    (folder / f'{robot.name}.urdf').write_text('\n'.join([*parts, '</robot>']), encoding='utf-8')
    document: dict[str, Any] = {
        'robot': {'name': robot.name},
        'urdf': f'{robot.name}.urdf',
        'joints': {name: {} for name in robot.joint_names},
        'contacts': {
            c.name: {'link': c.link, 'position_m': list(c.position)} for c in robot.contacts
        },
        'ground': {'height_m': robot.ground, 'tolerance_m': robot.contact_tolerance},
        'topics': {'joint_states': {'name': 'drives/state'}, 'imu': {'name': 'sensors/imu'}},
        'imu': {'position_m': [0.0, 0.0, 0.1]},
    }
    if robot.held:
        document['held'] = dict(robot.held)
    if not robot.joint_names:
        document['topics']['joint_states'] = None
    if robot.payload_link is not None:
        load = {'mass_kg': robot.payload.mass, 'cog_m': list(robot.payload.cog)}
        document['payload'] = {'link': robot.payload_link, **load}
        document['topics']['payload'] = {'name': 'load', 'frame_id': robot.payload_link}
    path = folder / f'{robot.name}.yaml'
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding='utf-8')
    return path


def _text(values: Iterable[float]) -> str:
    return ' '.join(map(repr, values))


def _limit(joint: Joint) -> str:
    numbers = {
        'lower': joint.lower,
        'upper': joint.upper,
        'effort': joint.effort,
        'velocity': joint.velocity,
    }
    told = ' '.join(f'{key}="{value}"' for key, value in numbers.items() if isfinite(value))
    return f'<limit {told}/>' if told else ''
