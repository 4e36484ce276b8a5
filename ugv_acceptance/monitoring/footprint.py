"""What the margins of one message rest on: support polygon and centre of gravity, and the names.

The four sides have no names of joints: a tool that takes every JointState for a robot's joints must
not take a margin for the position of one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.expressions import rotate, subtract, transpose
from ugv_acceptance.model.robot import IDENTITY, ZERO, Vector
from ugv_acceptance.model.stability import NO_CONTACT, SIDES
from ugv_acceptance.model.tree import tree_of

# The names of SIDES in a JointState: tilt_front, tilt_left, tilt_rear, tilt_right.
TILTS = tuple(f'tilt_{side}' for side in SIDES)
# Where the root link is on its body: at the origin.
_ROOT = (0, IDENTITY, ZERO)


@dataclass(frozen=True, slots=True)
class Footprint:
    """The support polygon of a stability margin, counter-clockwise from above, and the centre.

    In m, in the axes of `Settings.frame`. `polygon` is empty where there is no tip-over margin;
    `center` is the centre of gravity of the robot with its payload.
    """

    polygon: tuple[Vector, ...]
    center: Vector


def footprint_of(evaluator: LiveEvaluator) -> Footprint | None:
    """Return what the newest margins rest on; None while no margin is known."""
    margins, posture = evaluator.margins, evaluator.posture
    if margins is None or posture is None:
        return None
    stance = evaluator.chassis.stance
    footing = stance.footing if stance is not None else None
    stands = footing is not None and margins.state < NO_CONTACT
    corners = footing.polygon if footing is not None and stands else ()
    contacts: Any = posture.contacts
    center: Any = posture.cog
    return in_frame(evaluator.settings, [contacts[k] for k in corners], center)


def in_frame(settings: Settings, polygon: Sequence[Vector], center: Vector) -> Footprint:
    """Return a footprint of points in the axes of the root link (m), in those of its frame."""
    seen = seen_from(settings) or _numbers
    return Footprint(tuple(map(seen, polygon)), seen(center))


def seen_from(settings: Settings) -> Callable[[Vector], Vector] | None:
    """Return how points in root axes (m) are seen from the frame of `settings`; None: as they are.

    The frame is that of viewers, `robot.base_frame`.
    """
    _, rotation, xyz = tree_of(settings.robot).frames.get(settings.base_frame, _ROOT)
    if (rotation, xyz) == _ROOT[1:]:
        return None
    back = transpose(rotation)

    def seen(point: Vector) -> Vector:
        return _numbers(rotate(back, subtract(point, xyz)))

    return seen


def _numbers(v: Sequence[Any]) -> Vector:
    """Return a vector as floats; given floats, the model's formulas return floats."""
    x, y, z = v
    return float(x), float(y), float(z)
