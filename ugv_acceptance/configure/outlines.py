"""Outlines of a robot's geometry, and how far a point is from all of it."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.collision import geometry_of
from ugv_acceptance.configure.posture import posture_of
from ugv_acceptance.configure.sources import MeshFinder
from ugv_acceptance.type_aliases import Floats

# A contact point this far (m) from all geometry of the robot is not on it.
FAR = 0.015
# Directions around each axis, and all over, in which outlines are known.
_TURNS, _ALL_OVER = 72, 200
# Points of one geometry that are used: a mesh has many.
_MOST = 20_000


def outlines_of(urdf: Urdf, posture: Mapping[str, float], meshes: MeshFinder) -> dict[str, Floats]:
    """Return points (n, 3), m in the root link, of every link that has geometry which was read.

    They hold the link's outline as seen along each axis.
    """
    of: dict[str, list[Floats]] = {}
    for solid in posture_of(urdf, posture, geometry_of(urdf, meshes)).solids:
        points = solid.points
        if not len(points):
            points = np.array([solid.lowest(way) for way in _WAYS])
        of.setdefault(solid.link, []).append(points[:: max(1, len(points) // _MOST)])
    return {link: np.concatenate(points) for link, points in of.items()}


def reach_of(parts: Sequence[Floats]) -> Floats:
    """Return how far (parts, ways), m, the convex hull of each part's points reaches each way."""
    found: Floats = np.array([(_WAYS @ part.T).max(axis=1) for part in parts])
    return found.reshape(-1, len(_WAYS))


def away_from(point: Floats, reach: Floats) -> float:
    """Return how far (m) a point (3,) is from the nearest of all parts; 0: on it, or no parts."""
    if not len(reach):
        return 0.0
    return max(0.0, float((_WAYS @ point - reach).max(axis=1).min()))


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


_WAYS = _ways()
