"""Advice in words: what a motion does to the robot as its operator sees it, in the base frame.

A joint is named with what it does to the mass that it moves (all links it carries, with the load),
forward, left and up being those of `base_link`. How a description writes the joint, its axis or its
frame does not matter, nor how the robot stands:

- turn ... to the left or right: a joint about an upright axis with no joint that turns before it,
  such as a turret: to the left is counter-clockwise, seen from above;
- raise, lower: the mass goes up or down by more than a third of its way (STEEP);
- extend, fold (of what slides: retract): it goes, mainly, away from or towards the axis on which
  the whole arm swings;
- swing (of what slides: slide) ... forward, back, to the left or right: what remains.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.evaluation.advice.paths import Path
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.tree import (
    Pose,
    Tree,
    body_positions,
    drives_of,
    in_body,
    pose_of,
    tree_of,
)
from ugv_acceptance.type_aliases import Floats

# A turn goes up or down if its height is at least this share of its way.
STEEP = 0.35
# A motion goes mainly in a direction that it has this share of its way in: within 45 degrees of it.
MAINLY = math.sqrt(0.5)
# A joint is upright if the height of its axis, a unit vector, is more than this.
UPRIGHT = 0.9
# A shorter way (m) is rounding, as of a mass on the joint's axis.
_NOTHING = 1e-6

# Mass (kg), body, and place in the axes of that body (m).
_Part = tuple[float, int, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """What a joint does: the `way` (3,) of what it moves, and how much further it then `reaches`.

    In m and `base_link`. `reaches` is the distance from the axis on which the whole arm swings, NaN
    if no joint before it turns. `upright` is the height of its axis, a unit vector, `slung` says
    whether a joint that is not upright comes before it.
    """

    way: Floats
    reaches: float
    upright: float
    slung: bool

    @property
    def length(self) -> float:
        """Length of the way (m)."""
        return float(np.linalg.norm(self.way))

    def rises(self, share: float) -> bool:
        """Return whether it goes up or down by at least this share of its way."""
        return abs(float(self.way[2])) >= share * self.length

    @property
    def stretches(self) -> bool:
        """Whether it goes mainly along the reach of the arm, outwards or inwards."""
        return abs(self.reaches) >= MAINLY * self.length

    @property
    def up(self) -> str:
        """The word for up or down."""
        return 'raise' if self.way[2] > 0.0 else 'lower'

    @property
    def level(self) -> str:
        """The words for its larger level direction."""
        x, y, _ = self.way
        if abs(x) >= abs(y) - _NOTHING:
            return 'forward' if x > 0.0 else 'back'
        return 'to the left' if y > 0.0 else 'to the right'


def joint_words(robot: Robot, path: Path, step: int, payload: Payload) -> str:
    """Return how to move a joint along a path up to a step, such as "raise the elbow by 20 deg"."""
    amount, slides = float(path.amount[step]), robot.joint(path.subject).slides
    motion = _motion(robot, path, step, payload)
    verb, way = _slide(motion) if slides else _turn(motion, amount)
    by = f'{abs(amount) * 100:.0f} cm' if slides else f'{abs(math.degrees(amount)):.0f} deg'
    name = path.subject.removesuffix('_joint').replace('_', ' ')
    return f'{verb} the {name} by {by} {way}'.rstrip()


def _turn(motion: _Motion, amount: float) -> tuple[str, str]:
    """Return verb and direction of a joint that turns by `amount` (rad)."""
    if motion.length <= _NOTHING or (abs(motion.upright) > UPRIGHT and math.isnan(motion.reaches)):
        around = amount * motion.upright
        side = 'to the left' if around > 0.0 else 'to the right'
        return 'turn', side if abs(motion.upright) > UPRIGHT else ''
    if motion.rises(STEEP):
        return motion.up, ''
    if motion.stretches and (motion.slung or abs(motion.upright) > UPRIGHT):
        return 'extend' if motion.reaches > 0.0 else 'fold', ''
    return 'swing', motion.level


def _slide(motion: _Motion) -> tuple[str, str]:
    """Return verb and direction of a joint that slides."""
    rises = motion.rises(MAINLY)
    if motion.stretches and (motion.slung or not rises):
        return 'extend' if motion.reaches > 0.0 else 'retract', ''
    return (motion.up, '') if rises else ('slide', motion.level)


def _motion(robot: Robot, path: Path, step: int, payload: Payload) -> _Motion:
    tree = tree_of(robot)
    drives, j = drives_of(robot, tree), robot.joint_names.index(path.subject)
    end, start = path.q[step], path.q[step].copy()
    start[j] -= path.amount[step]
    before, after = (pose_of(tree, body_positions(drives, q.tolist())) for q in (start, end))
    driven = {k for k, drive in enumerate(drives, 1) if drive.joint == j}
    moved = {k for k in range(1, len(tree.bodies)) if driven.intersection(_up_from(tree, k))}
    ways = (
        (_centre(parts, before), _centre(parts, after))
        for parts in _parts(robot, tree, moved, payload)
    )
    still = np.zeros(3), np.zeros(3)
    a, b = next((w for w in ways if np.linalg.norm(w[1] - w[0]) > _NOTHING), still)
    own = next(k for k, body in enumerate(tree.bodies) if body.joint == path.subject)
    hangs = [k for k in reversed(_up_from(tree, own)) if k != own and not tree.bodies[k].prismatic]
    tilted = [k for k in hangs if abs(_number(before.axis[k][2])) <= UPRIGHT]
    upright = _number(before.axis[own][2])
    # An upright joint swings on the first that turns, any other on the first that is not upright.
    about = hangs if abs(upright) > UPRIGHT or not tilted else tilted
    reaches = _reach(before, about[0], b) - _reach(before, about[0], a) if about else math.nan
    return _Motion(b - a, reaches, upright, bool(tilted))


def _up_from(tree: Tree, body: int) -> list[int]:
    """Return a body and those that carry it, down to the one on the base."""
    found: list[int] = []
    while body:
        found.append(body)
        body = tree.bodies[body].parent
    return found


def _parts(robot: Robot, tree: Tree, moved: set[int], payload: Payload) -> Iterator[list[_Part]]:
    """Yield what stands for the bodies moved: their masses, the hand, feet, else their links."""
    bodies = [(k, tree.bodies[k]) for k in sorted(moved)]
    masses = [(b.mass, k, np.array(b.cog)) for k, b in bodies if b.mass > 0.0]
    link = robot.payload_link
    if link is not None and tree.frames[link][0] in moved:
        yield [*masses, _part(tree, payload.mass, link, payload.cog)]
        yield [_part(tree, 1.0, link, robot.payload.cog)]
    else:
        yield masses
    yield [_part(tree, 1.0, c.link, c.position) for c in robot.contacts
           if tree.frames[c.link][0] in moved]  # fmt: skip
    yield [(1.0, k, np.array(xyz)) for k, _, xyz in tree.frames.values() if k in moved]


def _part(tree: Tree, mass: float, link: str, point: Sequence[float]) -> _Part:
    x, y, z = point
    body, place = in_body(tree, link, (x, y, z))
    return mass, body, np.array(place, dtype=np.float64)


def _centre(parts: Iterable[_Part], pose: Pose) -> Floats:
    """Return the centre (3,) of masses in a pose; NaN without a mass."""
    total, sum_ = 0.0, np.zeros(3)
    for mass, body, place in parts:
        turned = np.array(pose.rotation[body], dtype=np.float64) @ place
        sum_ += mass * (np.array(pose.origin[body], dtype=np.float64) + turned)
        total += mass
    return sum_ / total if total > 0.0 else np.full(3, np.nan)


def _reach(pose: Pose, body: int, point: Floats) -> float:
    """Return how far (m) a point is from the axis of a body's joint."""
    axis, origin = (np.array(v[body], dtype=np.float64) for v in (pose.axis, pose.origin))
    return float(np.linalg.norm(np.cross(axis, point - origin)))


def _number(value: object) -> float:
    """Return a coordinate as a float: given floats, the model's formulas return floats."""
    return float(value)  # type: ignore[arg-type]


def turn_words(amount: float, gravity: Floats) -> str:
    """Return how to turn the robot by `amount` (rad), and if it then faces up- or downhill.

    `gravity` (3,) is that after the turn, in `base_link`.
    """
    side = 'left' if amount > 0.0 else 'right'
    downhill = math.degrees(math.atan2(gravity[1], gravity[0]))
    faces = ''
    if abs(downhill) <= 30.0:
        faces = ', to face downhill'
    elif abs(downhill) >= 150.0:
        faces = ', to face uphill'
    return f'turn the robot slowly by {abs(math.degrees(amount)):.0f} deg to the {side}{faces}'


def load_words(mass: float, holds: float | None) -> str:
    """Return the sentence that the load be set down; `holds` (kg) is what this posture can hold."""
    if holds is None or holds >= mass:
        return f'set the load of {mass:.1f} kg down'
    return f'set the load down: {mass:.1f} kg is {mass - holds:.1f} kg too heavy in this posture'
