"""Gathers what is drawn of a configuration: places of geometry and contacts, margins, IMU."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ugv_acceptance.config import Config
from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.checks import FAILS, OPEN, Check, posture_of_robot
from ugv_acceptance.configure.collision import points_of
from ugv_acceptance.configure.sources import MeshFinder
from ugv_acceptance.model.mechanics import mechanics_of, posture_once
from ugv_acceptance.model.robot import ZERO, Robot, Vector
from ugv_acceptance.model.stability import NO_CONTACT, stability_of, stances_of, standing
from ugv_acceptance.model.tree import Pose, body_positions, drives_of, point_of, pose_of, tree_of
from ugv_acceptance.report.robot_picture import Mark, Part, RobotPicture
from ugv_acceptance.type_aliases import Floats

# A contact point this far (m) from all geometry of the robot is drawn as wrong.
FAR = 0.02
# Points of one link that are drawn: a mesh has many.
_MOST = 20_000


def picture_of(
    config: Config,
    urdf: Urdf,
    posture: Mapping[str, float],
    meshes: MeshFinder,
    checks: Sequence[Check] = (),
) -> RobotPicture:
    """Return what is drawn of a configuration in a posture (rad, m), with what is wrong with it."""
    robot = config.settings.robot
    q = posture_of_robot(robot, posture)
    tree = tree_of(robot)
    pose = pose_of(tree, body_positions(drives_of(robot, tree), q))
    parts = tuple(_parts(robot, urdf, pose, meshes))
    mechanics = mechanics_of(robot)
    found = posture_once(robot, q, 0.0, ZERO)
    gravity = (0.0, 0.0, -robot.gravity)
    stance = standing(stances_of(mechanics, found), gravity)
    margins = stability_of(stance, gravity)
    stands = int(margins.state) < NO_CONTACT
    angles = [math.degrees(a) if stands and math.isfinite(a) else math.nan for a in margins.angle]
    imu = config.settings.imu
    cog = tuple(map(float, found.cog))
    return RobotPicture(
        config.name,
        parts,
        tuple(_marks(robot, pose, parts)),
        stance.footing.polygon if stance.footing is not None else (),
        (cog[0], cog[1], cog[2]),
        robot.ground if robot.contacts else math.nan,
        tuple(angles),
        (imu.position, imu.mounting) if config.settings.hears_imu else None,
        robot.root,
        tuple(f'{c.state}: {c.what}: {c.text}' for c in checks if c.state in {FAILS, OPEN}),
    )


def _parts(robot: Robot, urdf: Urdf, pose: Pose, meshes: MeshFinder) -> Iterator[Part]:
    tree = tree_of(robot)
    for link in urdf.links:
        shapes = [shape for shape in urdf.shapes if shape.link == link.name]
        points = [found for shape in shapes if (found := points_of(shape, meshes)) is not None]
        if not points:
            continue
        own = np.concatenate(points)
        own = own[:: max(1, len(own) // _MOST)]
        body, turn, xyz = tree.frames[link.name]
        outer = np.array(pose.rotation[body], dtype=np.float64)
        placed: Floats = (own @ np.array(turn).T + np.array(xyz)) @ outer.T
        yield Part(link.name, placed + np.array(pose.origin[body], dtype=np.float64))


def _marks(robot: Robot, pose: Pose, parts: Sequence[Part]) -> Iterator[Mark]:
    """Yield the contact points; one that hangs in the air, or is far from the robot, is wrong."""
    tree = tree_of(robot)
    for contact in robot.contacts:
        _, at = point_of(tree, pose, contact.link, contact.position)
        x, y, z = map(float, at)
        yield Mark(contact.name, (x, y, z), _wrong((x, y, z), parts))


def _wrong(at: Vector, parts: Sequence[Part]) -> str:
    """Return what is wrong with a contact point: it is outside of every part's extent."""
    if not parts:
        return ''
    point = np.array(at)
    off = min(
        float(
            np.linalg.norm(
                np.maximum(np.maximum(p.points.min(0) - point, point - p.points.max(0)), 0.0)
            )
        )
        for p in parts
    )
    return f'{off * 1e3:.0f} mm from the robot' if off > FAR else ''
