"""Robots for tests, and where their parts are by plain 4 x 4 matrices: an oracle for the model."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ugv_acceptance.model.robot import IDENTITY, Contact, Joint, Link, Matrix, Payload, Robot
from ugv_acceptance.type_aliases import Floats

DOWN = (0.0, 0.0, -9.81)
LIFT = (0.0, -1.0, 0.0)  # a positive angle lifts what points forward


def box(mass: float, x: float, y: float, z: float) -> Matrix:
    """Return the inertia of a box of these sizes about its centre."""
    a, b, c = (mass / 12.0 * s for s in (y * y + z * z, x * x + z * z, x * x + y * y))
    return ((a, 0.0, 0.0), (0.0, b, 0.0), (0.0, 0.0, c))


def paper_arm(load: float = 4.0) -> Robot:
    """Return the paper's two-link arm on a base that cannot move."""
    links = (
        Link('base_link', 10.0),
        Link('link1', 2.5, (0.275, 0.0, 0.0), box(2.5, 0.55, 0.05, 0.05)),
        Link('link2', 2.5, (0.32, 0.0, 0.0), box(2.5, 0.64, 0.05, 0.05)),
        Link('gripper'),
    )
    joints = (
        Joint('shoulder', 'revolute', 'base_link', 'link1', axis=LIFT),
        Joint('elbow', 'revolute', 'link1', 'link2', (0.55, 0.0, 0.0), axis=LIFT),
        Joint('wrist', 'fixed', 'link2', 'gripper', (0.64, 0.0, 0.0)),
    )
    names = ('shoulder', 'elbow')
    return Robot(
        'paper',
        links,
        joints,
        names,
        payload_link='gripper',
        payload=Payload(load, (0.0, 0.0, 0.0)),
    )


def tracked(tolerance: float = 0.005) -> Robot:
    """Return a tracked robot with a turret, a two-link arm and a pair of flippers."""
    links = (
        Link('base_link', 24.0, (0.02, 0.0, 0.09), box(24.0, 0.7, 0.4, 0.18)),
        Link('turret', 1.5, (0.0, 0.0, 0.03)),
        Link('link1', 2.5, (0.275, 0.0, 0.0), box(2.5, 0.55, 0.05, 0.05)),
        Link('link2', 2.5, (0.32, 0.0, 0.0), box(2.5, 0.64, 0.05, 0.05)),
        Link('gripper'),
        Link('flippers', 2.0, (0.1, 0.0, 0.0), box(2.0, 0.3, 0.5, 0.07)),
    )
    joints = (
        Joint(
            'turret', 'continuous', 'base_link', 'turret', (0.0, 0.0, 0.19), axis=(0.0, 0.0, 1.0)
        ),
        Joint('shoulder', 'revolute', 'turret', 'link1', (0.0, 0.0, 0.06), axis=LIFT),
        Joint('elbow', 'revolute', 'link1', 'link2', (0.55, 0.0, 0.0), axis=LIFT),
        Joint('wrist', 'fixed', 'link2', 'gripper', (0.64, 0.0, 0.0)),
        Joint('flippers', 'continuous', 'base_link', 'flippers', (0.239, 0.0, 0.095), axis=LIFT),
    )
    feet = {'front_left': (0.24, 0.2), 'front_right': (0.24, -0.2)}
    feet |= {'rear_left': (-0.26, 0.2), 'rear_right': (-0.26, -0.2)}
    contacts = [Contact(name, 'base_link', (x, y, 0.0)) for name, (x, y) in feet.items()]
    contacts += [
        Contact(f'flipper_{side}', 'flippers', (0.233, y, -0.035))
        for side, y in (('left', 0.25), ('right', -0.25))
    ]
    return Robot(
        'tracked',
        links,
        joints,
        ('turret', 'shoulder', 'elbow', 'flippers'),
        tuple(contacts),
        payload_link='gripper',
        payload=Payload(4.0, (0.05, 0.01, -0.02)),
        contact_tolerance=tolerance,
    )


def random_robot(rng: np.random.Generator, feet: int, *, moving: int = 0, arm: int = 0) -> Robot:
    """Return a random tree of up to four joints that stands on the plane z = 0 with `feet` points.

    One point more hangs above the ground; `moving` further points, anywhere, are on random links.
    With `arm` it is a chain of that many joints instead.
    """
    links = [Link('base_link', float(rng.uniform(5.0, 30.0)), _point(rng, 0.2, 0.1, 0.5))]
    joints = []
    for k in range(arm or int(rng.integers(1, 5))):
        kind = 'prismatic' if rng.random() < 0.2 else 'revolute'
        parent = links[-1 if arm else int(rng.integers(len(links)))].name
        turn = _matrix(Rotation.random(random_state=int(rng.integers(2**31))))
        axis = rng.normal(size=3)
        x, y, z = (axis / np.linalg.norm(axis)).tolist()
        place = _point(rng, 0.3, 0.0, 0.3)
        joints.append(Joint(f'joint{k}', kind, parent, f'link{k}', place, turn, (x, y, z)))
        inertia = box(1.0, *rng.uniform(0.1, 0.5, 3).tolist())
        links.append(
            Link(f'link{k}', float(rng.uniform(0.5, 4.0)), _point(rng, 0.3, -0.3, 0.3), inertia)
        )
    contacts = [Contact(f'foot{k}', 'base_link', _point(rng, 0.4, 0.0, 0.0)) for k in range(feet)]
    contacts.append(Contact('high', 'base_link', (0.6, 0.6, 0.5)))
    for k in range(moving):
        link = f'link{int(rng.integers(len(joints)))}'
        contacts.append(Contact(f'moving{k}', link, _point(rng, 0.4, -0.4, 0.4)))
    return Robot(
        'random',
        tuple(links),
        tuple(joints),
        tuple(rng.permutation([j.name for j in joints]).tolist()),
        tuple(contacts),
        payload_link=links[-1].name,
        payload=Payload(float(rng.uniform(0.0, 5.0)), _point(rng, 0.2, -0.2, 0.2)),
        contact_tolerance=0.001,
    )


def _point(
    rng: np.random.Generator, wide: float, low: float, high: float
) -> tuple[float, float, float]:
    x, y = rng.uniform(-wide, wide, 2).tolist()
    return (x, y, float(rng.uniform(low, high)) if high > low else low)


def _matrix(rotation: Rotation) -> Matrix:
    a, b, c = rotation.as_matrix().tolist()
    return (tuple(a), tuple(b), tuple(c))


def _transform(xyz: ArrayLike, rotation: ArrayLike = IDENTITY) -> Floats:
    t = np.eye(4)
    t[:3, :3], t[:3, 3] = np.asarray(rotation), np.asarray(xyz)
    return t


def places(robot: Robot, q: Sequence[float]) -> dict[str, Floats]:
    """Return the 4 x 4 matrix of every link in `base_link`."""
    position = dict(zip(robot.joint_names, q, strict=True))
    found = {robot.root: np.eye(4)}
    waiting = list(robot.joints)
    while waiting:
        joint = next(j for j in waiting if j.parent in found)
        waiting.remove(joint)
        t = found[joint.parent] @ _transform(joint.xyz, joint.rotation)
        move = np.array(joint.axis) * position.get(joint.name, 0.0)
        if joint.kind == 'prismatic':
            t = t @ _transform(move)
        elif joint.kind != 'fixed':
            t = t @ _transform((0.0, 0.0, 0.0), Rotation.from_rotvec(move).as_matrix())
        found[joint.child] = t
    return found


def at(place: Floats, point: Sequence[float]) -> Floats:
    """Return a point of a link in `base_link`."""
    moved: Floats = place[:3, :3] @ np.asarray(point) + place[:3, 3]
    return moved


def masses(robot: Robot, q: Sequence[float], payload: Payload) -> tuple[Floats, Floats]:
    """Return mass (n,) and centre of gravity (n, 3) of links and payload, in `base_link`."""
    found = places(robot, q)
    parts = [(link.mass, at(found[link.name], link.cog)) for link in robot.links]
    if robot.payload_link is not None:
        parts.append((payload.mass, at(found[robot.payload_link], payload.cog)))
    return np.array([m for m, _ in parts]), np.array([c for _, c in parts])


def centre(robot: Robot, q: Sequence[float], payload: Payload) -> tuple[float, Floats]:
    """Return total mass and centre of gravity (3,)."""
    mass, points = masses(robot, q, payload)
    return float(mass.sum()), mass @ points / mass.sum()


def feet(robot: Robot, q: Sequence[float]) -> Floats:
    """Return the contact points (n, 3) in `base_link`."""
    found = places(robot, q)
    return np.array([at(found[c.link], c.position) for c in robot.contacts])
