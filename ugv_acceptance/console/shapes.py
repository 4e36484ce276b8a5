"""What a 3D viewer draws of the margins, as plain values: live markers and those of a recording."""

import math
from collections.abc import Sequence

from ugv_acceptance.bag.encode_views import Colour, Shape
from ugv_acceptance.console.skeleton import Skeleton
from ugv_acceptance.evaluation.live import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Vector

FRAME = 'base_link'
# Seconds between drawings; what a dead monitor drew vanishes after LIFETIME.
PERIOD, LIFETIME = 0.1, 0.5
NAMES = ('support', 'worst_edge', 'cog', 'plumb', 'limbs', 'words')
# Kinds as visualization_msgs/Marker numbers them.
LINE_STRIP, LINE_LIST, SPHERE_LIST, TEXT = 4, 5, 7, 9

GREEN, AMBER = (0.1, 0.6, 0.2, 1.0), (1.0, 0.75, 0.0, 1.0)
RED, BLUE = (0.8, 0.0, 0.1, 1.0), (0.0, 0.3, 0.8, 1.0)
# Outward direction in `base_link` of each of SIDES.
_OUTWARD = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))


def shapes_of(skeleton: Skeleton, margins: Margins, settings: Settings) -> tuple[Shape, ...]:
    """Return the shapes of one posture, one a name of NAMES."""
    angles = [float(a) for a in margins.stability.angle]
    colour = _tip_colour(min(angles), settings)
    outline = (*skeleton.polygon, *skeleton.polygon[:1])
    under = () if skeleton.plumb is None else (skeleton.cog, skeleton.plumb)
    limbs = tuple(point for limb in skeleton.limbs for point in (limb.start, limb.end))
    uses = tuple(c for limb in skeleton.limbs for c in [_use(limb.joint, margins, settings)] * 2)
    x, y, z = skeleton.cog
    return (
        Shape('support', LINE_STRIP, BLUE, 0.01, outline),
        Shape('worst_edge', LINE_LIST, colour, 0.03, _edge_towards(skeleton.polygon, angles)),
        Shape('cog', SPHERE_LIST, colour, 0.06, (skeleton.cog,)),
        Shape('plumb', LINE_LIST, colour, 0.01, under),
        Shape('limbs', LINE_LIST, BLUE, 0.03, limbs, uses),
        Shape('words', TEXT, colour, 0.08, text=_words(min(angles)), position=(x, y, z + 0.3)),
    )


def _words(least: float) -> str:
    return f'{math.degrees(least):.1f} deg left' if math.isfinite(least) else 'no tilt margin'


def _edge_towards(polygon: Sequence[Vector], angles: Sequence[float]) -> tuple[Vector, ...]:
    """Return both ends of the edges that lie on the side with the least tilt left."""
    x, y = _OUTWARD[min(range(len(angles)), key=lambda k: angles[k])]
    points: list[Vector] = []
    for a, b in zip(polygon, [*polygon[1:], *polygon[:1]], strict=True):
        outward = (b[1] - a[1], a[0] - b[0])
        if outward[0] * x + outward[1] * y > 0.7 * math.hypot(*outward):
            points += [a, b]
    return tuple(points)


def _tip_colour(least: float, settings: Settings) -> Colour:
    limits = settings.limits
    # NaN is no margin.
    if not least > limits.tip_error:
        return RED
    return AMBER if least <= limits.tip_warn else GREEN


def _use(joint: str, margins: Margins, settings: Settings) -> Colour:
    j, limits = settings.robot.joint_names.index(joint), settings.limits
    use = abs(margins.torque[j]) / limits.torque[j]
    if not use < limits.torque_error:
        return RED
    return AMBER if use >= limits.torque_warn else GREEN
