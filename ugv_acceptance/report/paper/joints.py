"""The robot's joints in the roles of the paper: shoulder, elbow, turret, flippers."""

import math
from dataclasses import dataclass

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Robot

# Flippers folded back along the tracks (rad).
STOWED = math.pi


@dataclass(frozen=True, slots=True)
class Parts:
    """The names of the joints that take the roles of the paper's robot."""

    shoulder: str = 'shoulder_joint'
    elbow: str = 'elbow_joint'
    turret: str = 'turret_joint'
    flipper: str = 'flipper_joint'


PARTS = Parts()


def check_parts(robot: Robot, parts: Parts = PARTS) -> None:
    """Raise BadConfig for another robot than the paper's, which has these joints."""
    for name in (parts.shoulder, parts.elbow, parts.turret, parts.flipper):
        if name not in robot.joint_names:
            raise BadConfig(
                f'paper: its numbers and figures are those of its own robot, a PackBot with two '
                f'links: expected the configuration packbot, got {robot.name} without {name}; '
                'model, map, speed and risk are for every robot'
            )


def posture(robot: Robot, parts: Parts = PARTS, **angles: float) -> np.ndarray:
    """Return the posture (j,) with angles (rad) by role; flippers stowed unless given."""
    q = np.zeros(len(robot.joint_names))
    for part, angle in {'flipper': STOWED, **angles}.items():
        q[robot.joint_names.index(getattr(parts, part))] = angle
    return q
