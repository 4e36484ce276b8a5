"""Which joints may be left untold: what the margins can be off by where one is taken as held.

Only of joints that the URDF implies: one that stands under `joints` is told, or margins are not
known.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.evaluation.settings import AUTO, GIVEN, LEVEL, ImuInput, Untold
from ugv_acceptance.model.robot import Joint, Robot
from ugv_acceptance.model.tree import Tree, tree_of
from ugv_acceptance.type_aliases import Floats

# All that are taken as held may turn the line from the ground to the centre of gravity so far
# (rad), and change no torque by more than this share of its limit. From DOUBTED_TILT on nothing is
# shown; what is shown between the two is in doubt.
MOST_TILT, MOST_SHARE = math.radians(0.25), 0.01
DOUBTED_TILT = math.radians(1.0)
# A contact point, and a part of the arm, may be this far (m) from where it is taken to be.
CONTACT_OFF, ARM_OFF = 0.001, 0.01
# The least height (m) of a centre of gravity above the ground that is reckoned with.
LEAST_HEIGHT = 0.05


@dataclass(frozen=True, slots=True)
class _Reach:
    """How far a joint can move what hangs on it, from where it would be taken to be held.

    `shift` (m) of the robot's centre of gravity, `weight` (N m; N) on any joint, `contact` and
    `arm` (m) of a contact point and of a part that might touch the ground.
    """

    at: float
    shift: float
    weight: float
    contact: float
    arm: float


def untold_of(robot: Robot, limits: Sequence[float], imu: ImuInput) -> tuple[Untold | None, ...]:
    """Return for each measured joint how it is held if no message tells it; None: it must be told.

    `limits` (j,) are those of the torques (N m; N). A joint that may carry the IMU must be told.
    Joints are taken in the order of what they can do, as long as all of them together can turn the
    line to the centre of gravity by less than DOUBTED_TILT; MOST_TILT if they are harmless.
    """
    bodies = _Bodies(robot, tree_of(robot))
    reach = [bodies.reach(k) for k in range(len(robot.joint_names))]
    found: list[Untold | None] = [None] * len(reach)
    most, used = math.tan(DOUBTED_TILT) * bodies.height, 0.0
    for k in sorted(range(len(reach)), key=lambda k: reach[k].shift):
        light = used + reach[k].shift <= most and not bodies.strains(k, reach, limits)
        if light and not bodies.carries_payload(k) and not bodies.carries_imu(k, imu):
            used += reach[k].shift
            sure = used <= math.tan(MOST_TILT) * bodies.height
            near = reach[k].contact <= CONTACT_OFF and reach[k].arm <= ARM_OFF
            found[k] = Untold(reach[k].at, harmless=sure and near)
    return tuple(found)


class _Bodies:
    """The moving bodies of a robot in the zero posture: where they are, and what hangs on each."""

    def __init__(self, robot: Robot, tree: Tree) -> None:
        self.robot, self.tree = robot, tree
        self.origin = [np.zeros(3)]
        for body in tree.bodies[1:]:
            self.origin.append(self.origin[body.parent] + np.array(body.offset))
        self.number = {body.joint: b for b, body in enumerate(tree.bodies) if b}
        mass, self.cog = self._lumped(range(len(tree.bodies)))
        self.mass = max(mass, 1e-9)
        lowest = min((self.place(c.link, c.position)[2] for c in robot.contacts), default=0.0)
        self.height = max(float(self.cog[2]) - lowest, LEAST_HEIGHT)

    def place(self, link: str, point: Sequence[float] = (0.0, 0.0, 0.0)) -> Floats:
        """Return where a point of a link is (m) in base axes."""
        body, rotation, xyz = self.tree.frames[link]
        found: Floats = self.origin[body] + np.array(xyz) + np.array(rotation) @ np.array(point)
        return found

    def below(self, body: int) -> list[int]:
        """Return a body and all that hang on it."""
        inside = {body}
        for b, other in enumerate(self.tree.bodies):
            if b and other.parent in inside:
                inside.add(b)
        return sorted(inside)

    def _lumped(self, bodies: Sequence[int]) -> tuple[float, Floats]:
        parts = [
            (self.tree.bodies[b].mass, self.origin[b] + self.tree.bodies[b].cog) for b in bodies
        ]
        mass = math.fsum(m for m, _ in parts)
        return mass, sum((m * c for m, c in parts), np.zeros(3)) / (mass or 1.0)

    def driven(self, k: int) -> Iterator[tuple[int, Joint, float]]:
        """Yield the bodies that joint number k moves, by which joint, by how much of its way."""
        name = self.robot.joint_names[k]
        yield self.number[name], self.robot.joint(name), 1.0
        for mimic in self.robot.mimics:
            if mimic.follows == name:
                yield self.number[mimic.joint], self.robot.joint(mimic.joint), abs(mimic.multiplier)

    def reach(self, k: int) -> _Reach:
        """Return how far joint number k can move what hangs on it."""
        joint = self.robot.joint(self.robot.joint_names[k])
        at = joint.nearest(0.0)
        way = max(joint.upper - at, at - joint.lower)
        shift = weight = contact = arm = 0.0
        carrying = {self.tree.frames[c.link][0] for c in self.robot.contacts}
        for body, moves, factor in self.driven(k):
            inside = self.below(body)
            mass, cog = self._lumped(inside)
            off = self._way(body, moves, cog, way * factor) if mass else 0.0
            shift += mass * off / self.mass
            weight += mass * self.robot.gravity * off
            ends = [self.place(c.link, c.position) for c in self.robot.contacts]
            held = [self.tree.frames[c.link][0] in inside for c in self.robot.contacts]
            far = [
                self._way(body, moves, e, way * factor)
                for e, h in zip(ends, held, strict=True)
                if h
            ]
            contact = max([contact, *far])
            if not carrying & {*inside}:
                arm = max(arm, self._arm(body, moves, inside, way * factor))
        return _Reach(at, shift, weight, contact, arm)

    def _way(self, body: int, joint: Joint, point: Floats, way: float) -> float:
        """Return how far (m) a joint moves a point of its body by `way` (rad, m)."""
        if joint.slides:
            return way
        out = point - self.origin[body]
        axis = np.array(self.tree.bodies[body].axis)
        radius = float(np.linalg.norm(out - axis * (out @ axis)))
        return 0.0 if radius < 1e-6 else 2.0 * radius * math.sin(min(way, math.pi) / 2.0)

    def _arm(self, body: int, joint: Joint, inside: Sequence[int], way: float) -> float:
        """Return how far (m) parts move that might touch the ground; 0 if none can come near it."""
        links = [name for name, frame in self.tree.frames.items() if frame[0] in inside]
        points = [self.place(name) for name in links]
        points += [self.place(s.link, s.xyz) for s in self.robot.shapes if s.link in links]
        far = max(self._way(body, joint, point, way) for point in points)
        fixed = self.tree.bodies[body].parent == 0
        low = min(float(point[2]) for point in points) - far - self.robot.ground
        return 0.0 if fixed and low > LEAST_HEIGHT else far

    def strains(self, k: int, reach: Sequence[_Reach], limits: Sequence[float]) -> bool:
        """Return whether joint number k changes a torque by more than MOST_SHARE of its limit."""
        mine = {b for body, _, _ in self.driven(k) for b in self.below(body)}
        above = {b for body, _, _ in self.driven(k) for b in self._above(body)}
        for other, limit in enumerate(limits):
            joint = self.robot.joint(self.robot.joint_names[other])
            its = self.number[joint.name]
            change = 0.0
            if its in mine and other != k:  # it is turned: what hangs on it pulls another way
                mass, cog = self._lumped(self.below(its))
                arm = 1.0 if joint.slides else self._way(its, joint, cog, math.pi) / 2.0
                change = 2.0 * mass * self.robot.gravity * arm
            elif its in above or (other == k and not joint.slides):
                change = reach[k].weight  # the force on a slide does not depend on where it is
            if change > MOST_SHARE * limit:
                return True
        return False

    def _above(self, body: int) -> Iterator[int]:
        """Yield the moving bodies on which a body hangs."""
        while body := self.tree.bodies[body].parent:
            yield body

    def carries_imu(self, k: int, imu: ImuInput) -> bool:
        """Return whether the IMU is on joint number k, or may be where only its messages tell."""
        joint = self.robot.joint(self.robot.joint_names[k])
        below = {b for body, _, _ in self.driven(k) for b in self.below(body)}
        name = imu.link if imu.placed == GIVEN else imu.frame
        if name in self.tree.frames or imu.placed == GIVEN:
            return self.tree.frames[name or self.robot.root][0] in below
        if imu.placed != AUTO or imu.attitude == LEVEL:
            return False
        # Wheels, and what stands on the ground, carry none.
        links = [link for link in self.robot.links if self.tree.frames[link.name][0] in below]
        wheel = joint.kind == 'continuous' and all(link.mass for link in links)
        stands = any(self.tree.frames[c.link][0] in below for c in self.robot.contacts)
        return not stands and not (wheel and self.reach(k).shift == 0.0)

    def carries_payload(self, k: int) -> bool:
        """Return whether the payload hangs on joint number k."""
        link = self.robot.payload_link
        if link is None:
            return False
        body = self.tree.frames[link][0]
        return any(body in self.below(driven) for driven, _, _ in self.driven(k))
