"""A URDF in one posture: where every link and its geometry is, and the centre of gravity."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.collision import Geometry, Solid, Unread
from ugv_acceptance.model.robot import Joint, Mimic, Robot
from ugv_acceptance.model.tree import tree_of
from ugv_acceptance.type_aliases import Floats


@dataclass(frozen=True, eq=False)
class Posture:
    """A robot in one posture, in the axes of its root link (m).

    `frames` gives each link's rotation (3, 3) and origin (3,), `above` the joint over each link,
    `below` the joints under it. `solids` are placed; `cog` (3,) is that of `mass` (kg), or the
    middle of the geometry where the URDF gives no masses.
    """

    urdf: Urdf
    positions: dict[str, float]
    frames: dict[str, tuple[Floats, Floats]]
    above: dict[str, Joint]
    below: dict[str, tuple[Joint, ...]]
    solids: tuple[Solid, ...]
    unread: tuple[Unread, ...]
    cog: Floats
    mass: float

    @property
    def root(self) -> str:
        """Name of the root link."""
        return next(link for link in self.frames if link not in self.above)

    def chain(self, link: str) -> tuple[Joint, ...]:
        """Return the movable joints from the root link to `link`, those at the root first."""
        found = []
        while (joint := self.above.get(link)) is not None:
            if joint.kind != 'fixed':
                found.append(joint)
            link = joint.parent
        return tuple(reversed(found))

    def rigid(self, link: str) -> tuple[str, ...]:
        """Return `link` and all links that fixed joints hang on it."""
        found = [link]
        for name in found:
            found += [joint.child for joint in self.below.get(name, ()) if joint.kind == 'fixed']
        return tuple(found)

    def inner(self, link: str) -> tuple[Joint, ...]:
        """Return all movable joints below `link`."""
        links, found = [link], []
        for name in links:
            for joint in self.below.get(name, ()):
                links.append(joint.child)
                if joint.kind != 'fixed':
                    found.append(joint)
        return tuple(found)

    def body_cog(self) -> Floats:
        """Return the centre of gravity (3,), m, of what only wheels and casters move: no arm.

        That of all where nothing else has a mass.
        """
        mass, total = 0.0, np.zeros(3)
        for link in self.urdf.links:
            if all(joint.kind == 'continuous' for joint in self.chain(link.name)):
                rotation, origin = self.frames[link.name]
                mass += link.mass
                total += link.mass * (origin + rotation @ np.array(link.cog))
        return total / mass if mass > 0.0 else self.cog

    def axis(self, joint: Joint) -> Floats:
        """Return the unit vector (3,) of a joint's axis in the root link's axes."""
        found: Floats = self.frames[joint.child][0] @ np.array(joint.axis)
        return found

    def in_link(self, link: str, point: Floats) -> tuple[float, float, float]:
        """Return a point (3,) of the root link's axes in those of `link`, m."""
        rotation, origin = self.frames[link]
        x, y, z = (float(v) + 0.0 for v in np.round(rotation.T @ (point - origin), 9))
        return x, y, z


def posture_of(urdf: Urdf, positions: Mapping[str, float], geometry: Geometry) -> Posture:
    """Return a URDF at joint positions (rad, m); those not given follow another joint or are 0."""
    held = dict(positions)
    mimics = {mimic.joint: mimic for mimic in urdf.mimics if mimic.joint not in held}
    for name in mimics:
        held[name] = _followed(name, mimics, positions)
    robot = Robot(urdf.name, urdf.links, urdf.joints, (), held=tuple(held.items()))
    tree = tree_of(robot)
    frames = {n: (np.array(turn), np.array(xyz)) for n, (_, turn, xyz) in tree.frames.items()}
    solids = tuple(s.placed(*frames[s.link]) for s in geometry.solids)
    below: dict[str, tuple[Joint, ...]] = {}
    for joint in urdf.joints:
        below[joint.parent] = (*below.get(joint.parent, ()), joint)
    base = tree.bodies[0]
    cog = np.array(base.cog)
    if base.mass == 0.0 and solids:
        cog = np.mean(
            [s.points.mean(axis=0) if len(s.points) else s.centre for s in solids], axis=0
        )
    above = {joint.child: joint for joint in urdf.joints}
    return Posture(urdf, held, frames, above, below, solids, geometry.unread, cog, base.mass)


def _followed(name: str, mimics: Mapping[str, Mimic], positions: Mapping[str, float]) -> float:
    """Return where a joint is that follows another, which may follow one too."""
    if name not in mimics:
        return positions.get(name, 0.0)
    law = mimics[name]
    return law.multiplier * _followed(law.follows, mimics, positions) + law.offset
