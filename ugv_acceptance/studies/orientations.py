"""The orientations of the chassis in the paper's Figure 6."""

import math
from dataclasses import dataclass

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Robot, Vector


@dataclass(frozen=True, slots=True)
class Orientation:
    """A direction of tilt: `heading` (rad) is the low side, 0 the front, pi/2 the left.

    None on level ground; `words` is its name for people.
    """

    words: str
    heading: float | None


# A right tilt rolls the robot to its right: its right side is low.
ORIENTATIONS: dict[str, Orientation] = {
    'level': Orientation('level ground', None),
    'right': Orientation('right tilt', -math.pi / 2.0),
    'left': Orientation('left tilt', math.pi / 2.0),
    'nose-up': Orientation('nose-up', math.pi),
    'nose-down': Orientation('nose-down', 0.0),
    'nose-up-right': Orientation('nose-up and right', -0.75 * math.pi),
    'nose-up-left': Orientation('nose-up and left', 0.75 * math.pi),
    'nose-down-right': Orientation('nose-down and right', -0.25 * math.pi),
    'nose-down-left': Orientation('nose-down and left', 0.25 * math.pi),
}


def gravity_of(orientation: str, tilt: float, size: float = 9.81) -> Vector:
    """Return gravity (m/s2) in `base_link` for a named orientation tilted by `tilt` (rad)."""
    heading = ORIENTATIONS[orientation].heading
    if heading is None:
        return (0.0, 0.0, -size)
    low = size * math.sin(tilt)
    return (low * math.cos(heading), low * math.sin(heading), -size * math.cos(tilt))


def grounding_angle(robot: Robot, joint: str) -> float:
    """Return the position of `joint` (rad, nearest 0) at which its contacts touch the ground.

    The ground is the tracks' plane; this is how flippers are laid forward on it. Raises BadConfig
    if no contact reaches it.
    """
    mechanics, k = mechanics_of(robot), robot.joint_names.index(joint)
    nodes = np.array([0.0, 1.0, -1.0]) * 2.0 * math.pi / 3.0
    heights = []
    for node in nodes:
        q = [0.0] * len(robot.joint_names)
        q[k] = float(node)
        posture = posture_of(mechanics, q, 0.0, (0.0, 0.0, 0.0))
        heights.append([float(point[2]) for point in posture.contacts])
    # z = c0 + c1 cos q + c2 sin q, determined by three angles.
    c0, c1, c2 = np.linalg.solve(
        np.stack([np.ones(3), np.cos(nodes), np.sin(nodes)], axis=1), np.array(heights)
    )
    radius, phase = np.hypot(c1, c2), np.arctan2(c2, c1)
    with np.errstate(divide='ignore', invalid='ignore'):
        spread = np.arccos((robot.ground - c0) / np.where(radius > 1e-9, radius, np.nan))
    roots = np.concatenate([phase + spread, phase - spread])
    roots = (roots + math.pi) % (2.0 * math.pi) - math.pi
    roots = roots[np.isfinite(roots)]
    if roots.size == 0:
        raise BadConfig(
            f'joint {joint}: expected it to bring a contact to the ground, none reaches it'
        )
    return float(roots[np.abs(roots).argmin()])
