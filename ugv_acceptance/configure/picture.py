"""Gathers what is drawn of a configuration: places of geometry and contacts, margins, IMU."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.config import Config
from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.checks import FAILS, OPEN, Check, imu_place, positions_of
from ugv_acceptance.configure.collision import geometry_of
from ugv_acceptance.configure.evidence import Evidence
from ugv_acceptance.configure.posture import posture_of
from ugv_acceptance.configure.sources import MeshFinder
from ugv_acceptance.model.mechanics import mechanics_of, posture_once
from ugv_acceptance.model.robot import ZERO, Robot
from ugv_acceptance.model.stability import NO_CONTACT, stability_of, stances_of, standing
from ugv_acceptance.model.tree import Pose, body_positions, drives_of, point_of, pose_of, tree_of
from ugv_acceptance.report.robot_picture import Mark, Part, RobotPicture
from ugv_acceptance.type_aliases import Floats

# A contact point this far (m) from all geometry of the robot is drawn as wrong.
FAR = 0.015
# Directions around each axis, and all over, in which outlines are known.
_TURNS, _ALL_OVER = 72, 200
# Points of one link that are drawn: a mesh has many.
_MOST = 20_000


@dataclass(frozen=True, slots=True)
class Scene:
    """A configuration in a posture (rad, m), what was found of it, and where meshes are found."""

    config: Config
    urdf: Urdf
    posture: Mapping[str, float]
    meshes: MeshFinder
    checks: tuple[Check, ...] = ()
    evidence: Evidence | None = None


def picture_of(scene: Scene) -> RobotPicture:
    """Return what is drawn of a configuration, with what is wrong with it."""
    config, posture = scene.config, scene.posture
    robot = config.settings.robot
    q = positions_of(robot, posture)
    tree = tree_of(robot)
    pose = pose_of(tree, body_positions(drives_of(robot, tree), q))
    parts = tuple(_parts(scene.urdf, posture, scene.meshes))
    mechanics = mechanics_of(robot)
    found = posture_once(robot, q, 0.0, ZERO)
    gravity = (0.0, 0.0, -robot.gravity)
    stance = standing(stances_of(mechanics, found), gravity)
    margins = stability_of(stance, gravity)
    stands = int(margins.state) < NO_CONTACT
    angles = [math.degrees(a) if stands and math.isfinite(a) else math.nan for a in margins.angle]
    cog = tuple(map(float, found.cog))
    return RobotPicture(
        config.name,
        parts,
        tuple(_marks(robot, pose, parts)),
        stance.footing.polygon if stance.footing is not None else (),
        (cog[0], cog[1], cog[2]),
        robot.ground if robot.contacts else math.nan,
        tuple(angles),
        imu_place(config, posture, scene.evidence) if config.settings.hears_imu else None,
        robot.root,
        tuple(f'{c.state}: {c.what}: {c.text}' for c in scene.checks if c.state in {FAILS, OPEN}),
    )


def _parts(urdf: Urdf, posture: Mapping[str, float], meshes: MeshFinder) -> Iterator[Part]:
    """Yield every link's geometry as points that hold its outline in each view."""
    solids = posture_of(urdf, posture, geometry_of(urdf, meshes)).solids
    of: dict[str, list[Floats]] = {}
    for solid in solids:
        points = solid.points
        if not len(points):
            points = np.array([solid.lowest(way) for way in _WAYS])
        of.setdefault(solid.link, []).append(points[:: max(1, len(points) // _MOST)])
    for link, points_of_link in of.items():
        yield Part(link, np.concatenate(points_of_link))


def _ways() -> Floats:
    """Return unit vectors (n, 3): around each axis, as the views look, and all over the sphere."""
    angle = np.arange(_TURNS) * (2.0 * math.pi / _TURNS)
    c, s, o = np.cos(angle), np.sin(angle), np.zeros(_TURNS)
    k = np.arange(_ALL_OVER) + 0.5
    z, turn = 1.0 - 2.0 * k / _ALL_OVER, math.pi * (1.0 + math.sqrt(5.0)) * k
    r = np.sqrt(1.0 - z * z)
    rings = [np.c_[c, s, o], np.c_[c, o, s], np.c_[o, c, s]]
    found: Floats = np.vstack([*rings, np.c_[r * np.cos(turn), r * np.sin(turn), z]])
    return found


def _marks(robot: Robot, pose: Pose, parts: Sequence[Part]) -> Iterator[Mark]:
    """Yield the contact points; one that is far from all geometry of the robot is wrong."""
    tree = tree_of(robot)
    heights = [_WAYS @ part.points.T for part in parts]
    most = np.array([height.max(axis=1) for height in heights]).reshape(-1, len(_WAYS))
    for contact in robot.contacts:
        _, at = point_of(tree, pose, contact.link, contact.position)
        place = np.array(at, dtype=np.float64)
        xyz = (float(place[0]), float(place[1]), float(place[2]))
        yield Mark(contact.name, xyz, _wrong(place, most))


def _wrong(at: Floats, most: Floats) -> str:
    """Return what is wrong with a contact point (3,); '': nothing.

    `most` (parts, ways) is how far each part's convex hull reaches along each of _WAYS.
    """
    if not len(most):
        return ''
    off = float((_WAYS @ at - most).max(axis=1).min())
    return f'{off * 1e3:.0f} mm from the robot' if off > FAR else ''


_WAYS = _ways()
