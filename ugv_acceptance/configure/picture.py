"""Gathers what is drawn of a configuration: places of geometry and contacts, margins, IMU."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.config import Config
from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.checks import FAILS, OPEN, Check, imu_place, positions_of
from ugv_acceptance.configure.evidence import Evidence
from ugv_acceptance.configure.outlines import FAR, away_from, outlines_of, reach_of
from ugv_acceptance.configure.sources import MeshFinder
from ugv_acceptance.model.mechanics import mechanics_of, posture_once
from ugv_acceptance.model.robot import ZERO, Robot
from ugv_acceptance.model.stability import NO_CONTACT, stability_of, stances_of, standing
from ugv_acceptance.model.tree import Pose, body_positions, drives_of, point_of, pose_of, tree_of
from ugv_acceptance.report.robot_picture import Mark, Part, RobotPicture


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
    found_parts = outlines_of(scene.urdf, posture, scene.meshes).items()
    parts = tuple(Part(link, points) for link, points in found_parts)
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


def _marks(robot: Robot, pose: Pose, parts: Sequence[Part]) -> Iterator[Mark]:
    """Yield the contact points; one that is far from all geometry of the robot is wrong."""
    tree, most = tree_of(robot), reach_of([part.points for part in parts])
    for contact in robot.contacts:
        _, at = point_of(tree, pose, contact.link, contact.position)
        place = np.array(at, dtype=np.float64)
        xyz = (float(place[0]), float(place[1]), float(place[2]))
        off = away_from(place, most)
        wrong = f'{off * 1e3:.0f} mm from the robot' if off > FAR else ''
        yield Mark(contact.name, xyz, wrong)
