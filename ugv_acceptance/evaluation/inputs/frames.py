"""Frames that messages name: which link of the robot one is, and where it is on the robot."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.expressions import Mat, add, matmul, rotate, subtract, transpose
from ugv_acceptance.model.robot import IDENTITY, ZERO, Matrix, Robot, Vector
from ugv_acceptance.model.tree import plain, tree_of
from ugv_acceptance.type_aliases import Floats

# A transform as /tf_static tells it: parent, child, origin (m) and axes of the child in the parent.
Transform: TypeAlias = tuple[str, str, Vector, Matrix]


def same_frame(named: str, expected: str) -> bool:
    """Return whether a frame is the one expected; a namespace (tf prefix) may precede its name.

    `/gripper_link` and `ra/gripper_link` are both the frame `gripper_link`; '' is no frame's name.
    """
    bare = named.lstrip('/')
    return bare == expected or bare.endswith(f'/{expected}')


@dataclass(slots=True)
class FrameCheck:
    """Whether messages name the frame expected; `prefix` is that with which they first did.

    Two prefixes are two robots. A message without a frame or prefix contradicts nothing.
    """

    prefix: str = ''

    def foreign(self, named: str, expected: str) -> float:
        """Return 1 if a message names another frame, or the one of another robot; else 0."""
        bare = named.lstrip('/')
        if not expected or not bare:
            return 0.0
        if not same_frame(bare, expected):
            return 1.0
        prefix = bare.removesuffix(expected)
        self.prefix = self.prefix or prefix
        return float(prefix not in {'', self.prefix})

    def rows(self, named: NDArray[np.str_], expected: str) -> Floats:
        """Return `foreign` of many messages (n,), in order of receipt."""
        names, first, of = np.unique(named, return_index=True, return_inverse=True)
        found = np.zeros(len(names))
        for k in np.argsort(first).tolist():
            found[k] = self.foreign(str(names[k]), expected)
        rows: Floats = found[of]
        return rows


def without_prefix(frame: str, prefix: str) -> str:
    """Return a frame's name without a leading slash, and without the robot's `prefix`."""
    return frame.lstrip('/').removeprefix(prefix.lstrip('/'))


def link_of(robot: Robot, frame: str) -> str | None:
    """Return the link that a frame names, with or without slash and namespace; None: no link."""
    bare = frame.lstrip('/')
    links = {link.name for link in robot.links}
    parts = bare.split('/')
    tails = ('/'.join(parts[k:]) for k in range(len(parts)))
    return next((tail for tail in tails if tail in links), None)


@dataclass(frozen=True, slots=True)
class Place:
    """Where a frame is: its origin (m) and axes in the axes of `link`, a link of the robot.

    `steps` are the names on the way from the frame to that link; those of /tf_static come first.
    """

    link: str
    xyz: Vector = ZERO
    rotation: Matrix = IDENTITY
    steps: tuple[str, ...] = ()

    def within(self, xyz: Vector, rotation: Matrix, link: str) -> 'Place':
        """Return the same place in `link`, where the present link is at `xyz` with `rotation`."""
        at = plain(add(xyz, rotate(rotation, self.xyz)))
        turned = _plain(matmul(rotation, self.rotation))
        return Place(link, at, turned, (*self.steps, link))


def place_of(robot: Robot, frame: str, transforms: Sequence[Transform] = ()) -> Place | None:
    """Return where a frame is on the robot: by its own links, else by transforms; None: unknown.

    In the axes of the root link, unless a joint moves it: then in those of the link it is on.
    """
    found = _on_link(robot, frame, transforms)
    if found is None:
        return None
    body, rotation, xyz = tree_of(robot).frames[found.link]
    if body or found.link == robot.root:
        return found
    return found.within(xyz, rotation, robot.root)


def _on_link(robot: Robot, frame: str, transforms: Sequence[Transform]) -> Place | None:
    """Return where a frame is on the first link of the robot that its transforms lead to."""
    link = link_of(robot, frame)
    if link is not None:
        return Place(link, steps=(link,))
    place = Place(frame.lstrip('/'), steps=(frame.lstrip('/'),))
    above = list(_climb(place, transforms))
    for one in above:
        link = link_of(robot, one.link)
        if link is not None:
            return Place(link, one.xyz, one.rotation, (*one.steps[:-1], link))
    # Transforms may lead both to a frame above the robot's root, which is then on the way.
    root = Place(robot.root)
    for common in _climb(root, transforms):
        for one in above:
            if one.link == common.link:
                return _down(one, common, robot.root)
    return None


def _climb(place: Place, transforms: Iterable[Transform]) -> Iterable[Place]:
    """Yield the place in each frame above it, the nearest first; a circle ends it."""
    above = {child.lstrip('/'): (parent, xyz, turn) for parent, child, xyz, turn in transforms}
    seen = {place.link}
    while place.link in above:
        parent, xyz, turn = above[place.link]
        place = place.within(xyz, turn, parent.lstrip('/'))
        if place.link in seen:
            return
        seen.add(place.link)
        yield place


def _down(place: Place, root: Place, name: str) -> Place:
    """Return a place in the axes of the robot's root, where both are known in one frame."""
    back = _plain(transpose(root.rotation))
    at = plain(rotate(back, subtract(place.xyz, root.xyz)))
    return Place(name, at, _plain(matmul(back, place.rotation)), (*place.steps, name))


def _plain(m: Mat) -> Matrix:
    a, b, c = (plain(row) for row in m)
    return a, b, c
