"""The face on which a rigid body rests: the plane below all of it, under its centre of gravity.

The body may be given by points or by anything that tells its lowest point along a direction, such
as cylinders: the face is then exact, without a hull of many corners.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ugv_acceptance.model.robot import Vector

# The lowest point (m) along an upward unit vector.
Lowest = Callable[[Vector], Vector]
# A point this far (m) below a plane is on it; corners this far (m) away are no part of the body.
ON, FAR, HIGH = 1e-9, 1e3, 1e6
# The centre of gravity is moved by this (m) against ties: bodies are often symmetric.
_TIES = (1.7e-8, 1.1e-8)
_MOST = 2000


@dataclass(frozen=True, slots=True)
class Face:
    """Three points (m) of a body's resting face, and the upward unit normal of its plane."""

    points: tuple[Vector, Vector, Vector]
    normal: Vector

    @property
    def tilt(self) -> float:
        """Angle (rad) of the plane off the xy-plane."""
        return math.atan2(math.hypot(*self.normal[:2]), self.normal[2])

    @property
    def heading(self) -> float:
        """Direction (rad from x towards y) in which the plane falls; 0 if it is level."""
        return math.atan2(self.normal[1], self.normal[0]) if self.tilt > 0.0 else 0.0

    def height(self, point: Sequence[float]) -> float:
        """Return how far (m) a point is above the plane, square to it."""
        return sum(n * (x - o) for n, x, o in zip(self.normal, point, self.points[0], strict=True))


def resting_face(lowest: Lowest, at: Sequence[float]) -> Face | None:
    """Return the face below `at`, the centre of gravity (x, y in m); None if it is not above one.

    The simplex method: of the three points of a plane one is exchanged for the lowest point below
    it, as long as there is one.
    """
    x, y = at[0] + _TIES[0], at[1] + _TIES[1]
    corners = [(x + FAR * c, y + FAR * s, HIGH) for c, s in ((1.0, 0.1), (-0.6, 0.8), (-0.5, -0.9))]
    for _ in range(_MOST):
        normal = _normal(corners)
        low, on = lowest(normal), min(corners, key=lambda p: p[2])
        fall = sum(n * (p - q) for n, p, q in zip(normal, low, on, strict=True))
        if fall >= -ON * max(1.0, on[2] * 1e-3):
            break
        shares, parts = _shares(corners, (x, y)), _shares(corners, low)
        ratios = [s / p if p > 0.0 else math.inf for s, p in zip(shares, parts, strict=True)]
        corners[ratios.index(min(ratios))] = low
    if any(corner[2] >= HIGH for corner in corners):
        return None
    return Face((corners[0], corners[1], corners[2]), normal)


def lowest_of(points: Sequence[Vector]) -> Lowest:
    """Return what tells the lowest of some points (m) along an upward direction."""

    def lowest(up: Vector) -> Vector:
        return min(points, key=lambda p: up[0] * p[0] + up[1] * p[1] + up[2] * p[2])

    return lowest


def _normal(corners: Sequence[Vector]) -> Vector:
    """Return the upward unit normal of the plane of three points."""
    a, b, c = corners
    u, v = [p - q for p, q in zip(b, a, strict=True)], [p - q for p, q in zip(c, a, strict=True)]
    n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    size = math.copysign(math.hypot(*n), n[2])
    return (n[0] / size, n[1] / size, n[2] / size)


def _shares(corners: Sequence[Vector], at: Sequence[float]) -> list[float]:
    """Return the weights of three points whose weighted mean is `at`, seen from above."""
    areas = [
        (p[0] - at[0]) * (q[1] - at[1]) - (p[1] - at[1]) * (q[0] - at[0])
        for p, q in ((corners[1], corners[2]), (corners[2], corners[0]), (corners[0], corners[1]))
    ]
    whole = sum(areas) or 1e-300
    return [area / whole for area in areas]
