"""What to do in the words of an operator: raise, lower, turn left, face uphill, set down."""

import math

import numpy as np

from ugv_acceptance.evaluation.candidates import Path
from ugv_acceptance.model.blocks import Floats
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.statics import centre_of_gravity

# A motion is up or down where the height is at least this share of the way.
STEEP = 0.35


def joint_words(robot: Robot, path: Path, step: int, payload: Payload) -> str:
    """Return how to move a joint along a path up to a step, such as "raise the elbow by 20 deg"."""
    joint, amount = robot.joint(path.subject), float(path.amount[step])
    name = path.subject.removesuffix('_joint').replace('_', ' ')
    if joint.kind == 'prismatic':
        return f'{"extend" if amount > 0.0 else "retract"} the {name} by {abs(amount) * 100:.0f} cm'
    by = f'by {abs(math.degrees(amount)):.0f} deg'
    if abs(joint.axis[2]) > 0.9:
        left = amount * joint.axis[2] > 0.0
        return f'turn the {name} {by} to the {"left" if left else "right"}'
    start = path.q[step] - (np.array(robot.joint_names) == path.subject) * amount
    before, after = centre_of_gravity(robot, np.stack((start, path.q[step])), payload)
    moved = after - before
    up = -path.gravity[step] / np.linalg.norm(path.gravity[step])
    rise = float(moved @ up)
    if abs(rise) >= STEEP * float(np.linalg.norm(moved)):
        return f'{"raise" if rise > 0.0 else "lower"} the {name} {by}'
    return f'swing the {name} {by} {"forward" if moved[0] > 0.0 else "back"}'


def turn_words(amount: float, gravity: Floats) -> str:
    """Return how to turn the robot, and what it then faces; `gravity` is that after the turn."""
    side = 'left' if amount > 0.0 else 'right'
    downhill = math.degrees(math.atan2(gravity[1], gravity[0]))
    faces = ''
    if abs(downhill) <= 30.0:
        faces = ', to face downhill'
    elif abs(downhill) >= 150.0:
        faces = ', to face uphill'
    return f'turn the robot slowly by {abs(math.degrees(amount)):.0f} deg to the {side}{faces}'


def load_words(mass: float, holds: float | None) -> str:
    """Return that the load is to be set down; `holds` (kg) is what this posture can hold."""
    if holds is None or holds >= mass:
        return f'set the load of {mass:.1f} kg down'
    return f'set the load down: {mass:.1f} kg is {mass - holds:.1f} kg too heavy in this posture'
