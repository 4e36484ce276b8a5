"""What is true of a posture, by brute force: tilt left to each edge, torques, lifts of the chassis.

Written for trees of links with plain rotation matrices, all rows of a run at once. It shares no
formula with the package: only the numbers of the robot (masses, places, axes) are the same.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from ugv_acceptance.model.robot import Robot
from ugv_acceptance.type_aliases import Floats

G = 9.81


@dataclass(frozen=True, slots=True)
class Load:
    """What is really carried: mass (kg) and its place (m) in the axes of the payload link."""

    mass: float = 0.0
    com: tuple[float, float, float] = (0.0, 0.0, 0.0)


NONE = Load()


@dataclass(frozen=True, slots=True)
class Bodies:
    """Masses (b,), centres (n, b, 3) in base_link, turned inertias (n, b, 3, 3), and the joints.

    `axis` and `origin` (n, 3) of each measured joint; `moved` (joints, b): which bodies it carries.
    """

    mass: Floats
    centre: Floats
    inertia: Floats
    axis: tuple[Floats, ...]
    origin: tuple[Floats, ...]
    moved: Floats
    feet: Floats

    @property
    def total(self) -> tuple[float, Floats]:
        """Mass (kg) and centre of gravity (n, 3) of all."""
        whole = float(self.mass.sum())
        return whole, np.einsum('b,nbi->ni', self.mass, self.centre) / whole


@dataclass(frozen=True, slots=True)
class _Placed:
    """Rotation and place of links, the joints above them; axis and origin of joints."""

    link: dict[str, tuple[Floats, Floats]]
    above: dict[str, set[str]]
    joint: dict[str, tuple[Floats, Floats]]


def _placed(robot: Robot, q: Floats) -> _Placed:
    held, column = dict(robot.held), {name: k for k, name in enumerate(robot.joint_names)}
    start = (np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3)))
    found = _Placed({robot.root: start}, {robot.root: set()}, {})
    waiting = list(robot.joints)
    while waiting:
        joint = next(j for j in waiting if j.parent in found.link)
        waiting.remove(joint)
        name, axis = joint.name, np.array(joint.axis)
        turn, at = found.link[joint.parent]
        origin, turn = at + turn @ np.array(joint.xyz), turn @ np.array(joint.rotation)
        value = q[:, column[name]] if name in column else np.full(len(q), held.get(name, 0.0))
        found.joint[name] = turn @ axis, origin
        if joint.kind == 'prismatic':
            origin = origin + (turn @ axis) * value[:, None]
        elif joint.kind != 'fixed':
            turn = turn @ Rotation.from_rotvec(value[:, None] * axis).as_matrix()
        found.link[joint.child] = turn, origin
        found.above[joint.child] = found.above[joint.parent] | {name}
    return found


def bodies(robot: Robot, q: Floats, load: Load) -> Bodies:
    """Return where the bodies of a robot are at positions `q` (n, measured joints)."""
    placed, names = _placed(robot, q), robot.joint_names
    parts = [(k.name, k.mass, np.array(k.cog), np.array(k.inertia)) for k in robot.links if k.mass]
    if robot.payload_link is not None and load.mass:
        parts.append((robot.payload_link, load.mass, np.array(load.com), np.zeros((3, 3))))
    turn, at = ({name: pair[k] for name, pair in placed.link.items()} for k in (0, 1))
    own = [turn[name] @ inertia @ np.swapaxes(turn[name], 1, 2) for name, *_, inertia in parts]
    feet = [at[c.link] + turn[c.link] @ np.array(c.position) for c in robot.contacts]
    return Bodies(
        np.array([mass for _, mass, *_ in parts]),
        np.stack([at[name] + turn[name] @ cog for name, _, cog, _ in parts], 1),
        np.stack(own, 1),
        tuple(placed.joint[name][0] for name in names),
        tuple(placed.joint[name][1] for name in names),
        np.array([[n in placed.above[body] for body, *_ in parts] for n in names], np.float64),
        np.stack(feet, 1),
    )


def torques(robot: Robot, q: Floats, up: Floats, load: Load = NONE) -> Floats:
    """Return the torque or force (n, joints) that each joint's motor gives at rest.

    `up` (n, 3) or (3,) is the unit vector against gravity in base_link.
    """
    b = bodies(robot, q, load)
    weight = -G * np.broadcast_to(up, (len(q), 3))
    found = np.zeros(q.shape)
    for j, name in enumerate(robot.joint_names):
        arm = b.centre - b.origin[j][:, None]
        forces = (b.mass * b.moved[j])[:, None] * weight[:, None]
        pull = forces if robot.joint(name).kind == 'prismatic' else np.cross(arm, forces)
        found[:, j] = -np.einsum('nbi,ni->n', pull, b.axis[j])
    return found


def inertia_about(robot: Robot, q: Floats, joint: str, load: Load = NONE) -> Floats:
    """Return the moment of inertia (n,) in kg m2 that a turning joint moves."""
    b, j = bodies(robot, q, load), robot.joint_names.index(joint)
    arm = np.cross(b.centre - b.origin[j][:, None], b.axis[j][:, None])
    own = np.einsum('ni,nbij,nj->nb', b.axis[j], b.inertia, b.axis[j])
    found: Floats = ((b.mass * (arm**2).sum(-1) + own) * b.moved[j]).sum(-1)
    return found


def polygon(robot: Robot, b: Bodies) -> Floats:
    """Return the corners (k, 3) of the support polygon of the first row, anticlockwise."""
    feet = b.feet[0]
    low = feet[np.abs(feet[:, 2] - robot.ground) <= robot.contact_tolerance]
    corners: Floats = low[ConvexHull(low[:, :2]).vertices]
    return corners


def tilts_left(robot: Robot, q: Floats, up: Floats, load: Load = NONE) -> tuple[Floats, Floats]:
    """Return the tilt left (n, edges) in rad to each edge, and the outward directions (edges, 3).

    The chassis stands still on the corners of the first row; see `torques` for `up`.
    """
    b = bodies(robot, q, load)
    _, centre = b.total
    corners, up = polygon(robot, b), np.broadcast_to(up, (len(q), 3))
    left, outward = [], []
    for k, a in enumerate(corners):
        edge = corners[(k + 1) % len(corners)] - a
        if np.linalg.norm(edge) < 1e-9:
            continue
        edge /= np.linalg.norm(edge)
        against = up - (up @ edge)[:, None] * edge
        against /= np.linalg.norm(against, axis=1, keepdims=True)
        inward = np.cross(against, edge)
        arm = centre - a
        rise = np.einsum('ni,ni->n', arm, against)
        left.append(np.arctan2(np.einsum('ni,ni->n', arm, inward), rise))
        outward.append(np.cross(edge, (0.0, 0.0, 1.0)))
    return np.stack(left, 1), np.array(outward)


@dataclass(frozen=True, slots=True)
class Rocking:
    """A chassis that may rock about one of its edges: r (m), mass, inertia about the edge (kg m2).

    `inward` and `height` (m) are where the centre of gravity is from the edge, `width` (m) how far
    the other end of the polygon is: what rises when the robot rocks.
    """

    inward: float
    height: float
    mass: float
    inertia: float
    width: float

    def turned(self, pull: Floats, step: float) -> tuple[Floats, Floats]:
        """Return angle (rad) and rate (rad/s) while the ground decelerates under it.

        `pull` (n,) in m/s2 presses the robot over the edge; `step` (s) between its values. The
        angle ends at 90 deg; on the way back the other end lands without a bounce.
        """
        reach = float(np.hypot(self.inward, self.height))
        start = float(np.arctan2(self.height, self.inward))
        angle = rate = 0.0
        found = np.zeros((2, len(pull)))
        for k, a in enumerate(pull.tolist()):
            now = start + angle
            over = self.mass * reach * (a * np.sin(now) - G * np.cos(now)) / self.inertia
            rate += over * step
            angle += rate * step
            if angle <= 0.0:
                angle, rate = 0.0, max(0.0, rate if over > 0.0 else 0.0)
            elif angle > np.pi / 2.0:
                angle, rate = np.pi / 2.0, 0.0
            found[:, k] = angle, rate
        return found[0], found[1]


def rocking(robot: Robot, q: Floats, outward: Floats, load: Load = NONE) -> Rocking:
    """Return how a robot in posture `q` (joints,) rocks over its edge in a level direction (3,)."""
    b = bodies(robot, q[None], load)
    mass, centre = b.total
    feet = polygon(robot, b)
    far = feet @ outward
    edge, along = float(far.max()), np.cross((0.0, 0.0, 1.0), outward)
    origin = outward * edge + np.array((0.0, 0.0, robot.ground))
    arm = b.centre[0] - origin
    arm = arm - np.outer(arm @ along, along)
    own = np.einsum('i,bij,j->b', along, b.inertia[0], along)
    inertia = float((b.mass * (arm**2).sum(1) + own).sum())
    at = centre[0] - origin
    return Rocking(float(-at @ outward), float(at[2]), mass, inertia, float(edge - far.min()))
