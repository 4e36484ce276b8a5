"""The collision geometry of a URDF, meshes among it, as shapes that tell their lowest point.

Every shape keeps its kind, so that the lowest point of a wheel is exact and not that of a polygon.
Where a link has no collision geometry, what it is drawn with stands in its place.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ugv_acceptance import pip_install
from ugv_acceptance.config.units import LARGEST as FURTHEST
from ugv_acceptance.config.units import shown
from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.model.robot import Shape
from ugv_acceptance.type_aliases import Floats

# Finds the file of a mesh by its name in the URDF; None: not found.
Meshes = Callable[[str], Path | None]
# A larger mesh (bytes) is not collision geometry.
LARGEST = 200_000_000
FORMATS = ('.stl', '.obj', '.dae')
# Points (m) so close are one; a rim that is not round is told by so many points.
SAME, RIM = 1e-7, 16
# Odd numbers of 64 bits, by which three whole numbers are mixed into one.
_MIXED = (1, 0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F)


@dataclass(frozen=True, eq=False)
class Solid:
    """One geometry of a link that was read: in the axes of its link, m.

    `kind` is box, cylinder, sphere or mesh; `size` (3,) the half extents of the first three along
    the axes `turn` (3, 3; columns) about `centre` (3,); `points` (n, 3) the corners of a mesh, and
    of a box. `drawn`: it is visual geometry, as the link has none for collisions.
    """

    link: str
    kind: str
    centre: Floats
    turn: Floats
    size: Floats
    points: Floats
    drawn: bool = False
    file: str = ''

    @property
    def words(self) -> str:
        """What it is, with its measures in mm, for people."""
        mm = [f'{1e3 * x:.4g}' for x in self.size]
        if self.kind == 'sphere':
            return f'sphere of radius {mm[0]} mm'
        if self.kind == 'cylinder':
            return f'cylinder of radius {mm[0]} mm, {2e3 * self.size[2]:.4g} mm long'
        if self.kind == 'box':
            return 'box of ' + ' x '.join(f'{2e3 * x:.4g}' for x in self.size) + ' mm'
        return f'mesh {Path(self.file).name}'

    @property
    def middle(self) -> Floats:
        """Its middle (3,), m: of a mesh the mean of its corners."""
        middle: Floats = self.points.mean(axis=0) if len(self.points) else self.centre
        return middle

    @cached_property
    def reach(self) -> float:
        """Half its largest extent (m)."""
        if len(self.points):
            return float(np.linalg.norm(np.ptp(self.points, axis=0))) / 2.0
        return float(
            self.size[0] if self.kind == 'sphere' else np.hypot(self.size[0], self.size[2])
        )

    def placed(self, rotation: Floats, origin: Floats) -> 'Solid':
        """Return it in the axes in which its link's are `rotation` (3, 3) and `origin` (3,), m."""
        return Solid(
            self.link,
            self.kind,
            origin + rotation @ self.centre,
            rotation @ self.turn,
            self.size,
            origin + self.points @ rotation.T,
            self.drawn,
            self.file,
        )

    def lowest(self, up: Floats) -> Floats:
        """Return its exact lowest point (3,), m, along an upward unit vector (3,)."""
        if len(self.points):
            found: Floats = self.points[int(np.argmin(self.points @ up))]
            return found
        if self.kind == 'sphere':
            bottom: Floats = self.centre - self.size[0] * up
            return bottom
        x, y, z = up @ self.turn
        across, rim = math.hypot(x, y), np.zeros(3)
        if across > 1e-12:
            rim = -self.size[0] / across * (x * self.turn[:, 0] + y * self.turn[:, 1])
        point: Floats = self.centre - math.copysign(self.size[2], z) * self.turn[:, 2] + rim
        return point

    def patch(self, up: Floats, slack: float) -> Floats:
        """Return the corners (n, 3), m, of it within `slack` (m) of its lowest point.

        Of a cylinder on its side the two ends of its line, of one on its face points of the rim.
        """
        if len(self.points):
            heights = self.points @ up
            near: Floats = self.points[heights <= heights.min() + slack]
            return near
        if self.kind == 'sphere':
            return self.lowest(up)[None]
        ends = np.vstack([self._end(up, 1.0), self._end(up, -1.0)])
        found: Floats = ends[ends @ up <= (ends @ up).min() + slack]
        return found

    def _end(self, up: Floats, side: float) -> Floats:
        """Return the lowest point of one end of a cylinder; points of its rim if it lies on it."""
        x, y, z = up @ self.turn
        middle = self.centre + side * self.size[2] * self.turn[:, 2]
        if abs(z) > math.cos(math.radians(10.0)):
            angles = np.arange(RIM) * 2.0 * np.pi / RIM
            ring = np.outer(np.cos(angles), self.turn[:, 0])
            ring += np.outer(np.sin(angles), self.turn[:, 1])
            rim: Floats = middle + self.size[0] * ring
            return rim
        away = x * self.turn[:, 0] + y * self.turn[:, 1]
        end: Floats = middle - self.size[0] * away / np.linalg.norm(away)
        return end[None]


@dataclass(frozen=True, slots=True)
class Unread:
    """A geometry of a link that was not read, and why; `drawn`: it is visual geometry."""

    link: str
    what: str
    why: str
    drawn: bool = False


@dataclass(frozen=True, slots=True)
class Geometry:
    """What was read of the geometry of all links, in the axes of each, and what was not."""

    solids: tuple[Solid, ...]
    unread: tuple[Unread, ...]


def geometry_of(urdf: Urdf, meshes: Meshes) -> Geometry:
    """Return the collision geometry of every link; of a link without any, that it is drawn with.

    A mesh that `meshes` does not find, or that cannot be read, is among the unread.
    """
    known = {shape.link for shape in urdf.shapes}
    solids: list[Solid] = []
    unread: list[Unread] = []
    drawn = [shape for shape in urdf.visuals if shape.link not in known]
    read: dict[str, Floats | str] = {}
    for shapes, visual in ((urdf.shapes, False), (drawn, True)):
        for shape in shapes:
            found = _solid(shape, meshes, read, drawn=visual)
            if isinstance(found, Solid):
                solids.append(found)
            else:
                unread.append(found)
    return Geometry(tuple(solids), tuple(unread))


def _solid(
    shape: Shape, meshes: Meshes, read: dict[str, Floats | str], *, drawn: bool
) -> Solid | Unread:
    """Return a shape as a solid, or why it is not read; `read` keeps the corners of each mesh."""
    centre, turn = np.array(shape.xyz), np.array(shape.rotation)
    none = np.empty((0, 3))
    if shape.mesh is not None:
        if shape.mesh not in read:
            read[shape.mesh] = _corners(shape.mesh, meshes)
        corners = read[shape.mesh]
        if isinstance(corners, str):
            return Unread(shape.link, f'mesh {shown(shape.mesh)}', corners, drawn)
        points = centre + (corners * np.array(shape.scale)) @ turn.T
        half = np.ptp(points, axis=0) / 2.0
        return Solid(shape.link, 'mesh', centre, turn, half, points, drawn, shape.mesh)
    if shape.size is None or shape.kind not in ('box', 'cylinder', 'sphere'):
        return Unread(shape.link, shown(shape.kind), 'expected numbers of a known shape', drawn)
    size = np.array(shape.size)
    if size.min() < 0.0 or size.max() <= 0.0:
        return Unread(shape.link, shown(shape.kind), 'expected a size above 0', drawn)
    if shape.kind == 'box':
        signs = np.array([(x, y, z) for x in (1, -1) for y in (1, -1) for z in (1, -1)])
        none = centre + (signs * size) @ turn.T
    return Solid(shape.link, shape.kind, centre, turn, size, none, drawn)


def _corners(name: str, meshes: Meshes) -> Floats | str:
    """Return the corners of a mesh (n, 3) in m, without its URDF's scale; else why there are none.

    The lowest of them is the lowest of their convex hull.
    """
    path = meshes(name)
    if path is None:
        return 'file not found'
    if path.suffix.lower() not in FORMATS:
        return f'expected a mesh in STL, OBJ or DAE, got {shown(path.suffix)}'
    try:
        if path.stat().st_size > LARGEST:
            return 'expected a mesh below 200 MB'
        return _loaded(path)
    except ImportError as error:
        return f'expected the package {error.name or error} ({pip_install("init")})'
    except Exception as error:  # noqa: BLE001 - a damaged mesh may raise anything
        return f'expected a mesh, got: {shown(str(error) or type(error).__name__)}'


def _loaded(path: Path) -> Floats | str:
    import trimesh  # noqa: PLC0415 - an extra that only meshes need

    scene: Any = trimesh.load(str(path), force='scene', process=False)
    return _merged([_part(scene, node) for node in scene.graph.nodes_geometry])


def _part(scene: Any, node: str) -> Floats:  # noqa: ANN401 - trimesh's own types vary by version
    """Return the corners of one part of a scene, in m: COLLADA files tell their unit."""
    transform, name = scene.graph[node]
    part = scene.geometry[name]
    faces = np.asarray(getattr(part, 'faces', ()), dtype=np.int64)
    corners = np.asarray(part.vertices, dtype=np.float64)[np.unique(faces)]
    placed: Floats = corners @ transform[:3, :3].T + transform[:3, 3]
    unit, _, of = str(part.units or '').partition(' * ')
    return placed * float(unit) if of.startswith('meter') else placed


def _merged(parts: Sequence[Floats]) -> Floats | str:
    corners = np.concatenate(parts) if parts else np.empty((0, 3))
    if not len(corners):
        return 'expected a mesh with faces, got none'
    if not np.abs(corners).max() <= FURTHEST:
        return f'expected finite corners up to {FURTHEST:g}'
    return _once(corners)


def _once(corners: Floats) -> Floats:
    """Return corners (n, 3) without repetition: triangles of an STL file repeat each six times.

    One number a corner is sorted, as rows take ten times as long; if two corners share one, rows.
    """
    whole = np.round(corners / SAME).astype(np.int64)
    keys = whole.astype(np.uint64) @ np.array(_MIXED, dtype=np.uint64)
    _, first, back = np.unique(keys, return_index=True, return_inverse=True)
    if (whole[first[back]] != whole).any():
        _, first = np.unique(whole, axis=0, return_index=True)
    found: Floats = corners[first]
    return found
