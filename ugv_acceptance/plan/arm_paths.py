"""Safe paths of the arm: which postures it can reach from home without passing a limit, and how."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order

from ugv_acceptance.plan.search import PATH, STEP_DEG, Arm, Mask, look, safe
from ugv_acceptance.type_aliases import Floats

# Predecessor of a posture that has none: the start, or not reached.
_NOWHERE = -9999


@dataclass(frozen=True)
class ArmPaths:
    """The safe postures `q` (n, j) of a grid, linked by safe motions, starting from `home` (j,).

    `ground` is orientation and tilt (rad), `load` in kg. `home` need not be in the grid.
    """

    arm: Arm
    q: Floats
    home: Floats
    ground: tuple[str, float]
    load: float

    @cached_property
    def _tree(self) -> NDArray[np.intp]:
        """Return the row before each posture on the shortest safe path from home (n,)."""
        good = safe(self.arm, look(self.arm, self.q, self.ground, self.load))
        names = self.arm.columns
        if not names or not len(self.q):  # one posture, or none
            return np.where(good, 0, _NOWHERE)
        degrees = np.degrees(self.q[:, names])
        cell = np.round((degrees - degrees.min(axis=0)) / STEP_DEG).astype(int) + 1
        number = np.full(cell.max(axis=0) + 2, -1)
        number[tuple(cell[good].T)] = np.flatnonzero(good)
        edges = []
        for step in ((1, 0), (0, 1), (1, 1), (1, -1)):
            other = number[tuple((cell[good] + step).T)]
            there = other >= 0
            edges.append(np.stack([np.flatnonzero(good)[there], other[there]]))
        rows, columns = np.concatenate(edges, axis=1)
        graph = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(good),) * 2)
        start = int(np.abs(self.q - self.home)[:, names].max(axis=1).argmin())
        before: Any = breadth_first_order(graph, start, directed=False)[1]
        before[start] = start
        found: NDArray[np.intp] = before
        return found

    @property
    def reachable(self) -> Mask:
        """Return which postures (n,) can be reached from home without passing a limit."""
        found: Mask = self._tree != _NOWHERE
        return found

    def to(self, end: Floats) -> list[Floats]:
        """Return the few postures (j,) between home and `end`; empty if there is no safe path."""
        if not len(self.q) or not self.arm.varied:
            return []
        k = int(np.abs(self.q - end).max(axis=1).argmin())
        if np.abs(self.q[k] - end).max() > 1e-6 or not self.reachable[k]:
            return []
        trail = [k]
        while self._tree[trail[-1]] != trail[-1]:
            trail.append(int(self._tree[trail[-1]]))
        return self._shortened([self.home, *(self.q[i] for i in reversed(trail))])

    def _shortened(self, way: list[Floats]) -> list[Floats]:
        """Leave out what a straight motion can skip; empty where the first motion is not safe."""
        kept, at = [], 0
        while at < len(way) - 1:
            farthest = next(
                (k for k in range(len(way) - 1, at, -1) if self._straight(way[at], way[k])), None
            )
            if farthest is None:
                return []
            kept.append(way[farthest])
            at = farthest
        return kept[:-1]

    def _straight(self, start: Floats, end: Floats) -> bool:
        return safe_path(self.arm, (start, end), self.ground, self.load)


def safe_path(arm: Arm, paths: Sequence[Floats], ground: tuple[str, float], load: float) -> bool:
    """Return whether straight motions through the postures pass no ERROR limit and hit nothing."""
    for start, end in pairwise(paths):
        path = start + np.linspace(0.0, 1.0, PATH)[:, None] * (end - start)
        if not (safe(arm, look(arm, path, ground, load)).all() and arm.clear(path).all()):
            return False
    return True


def detours(arm: Arm, start: Floats, home: Floats, end: Floats) -> Iterator[list[Floats]]:
    """Yield postures to try between two: none; home; the start with one joint as at the end."""
    yield []
    yield [home]
    for k in arm.moved:
        for before in (start, home):
            between = before.copy()
            between[k] = end[k]
            yield [between] if before is start else [home, between]


@dataclass(slots=True)
class Routes:
    """Finds safe paths from `home` (j,); keeps those of each ground, load and turret angle."""

    arm: Arm
    home: Floats
    _known: dict[tuple[tuple[str, float], float, float], ArmPaths] = field(default_factory=dict)

    def paths(
        self, ground: tuple[str, float], load: float, turret: float | None = None
    ) -> ArmPaths:
        """Return the safe paths on a ground with a load (kg), the turret at an angle (rad).

        Without an angle the arm is ahead.
        """
        turret = self.arm.turret(self.arm.folded) if turret is None else turret
        key = (ground, load, turret)
        if key not in self._known:
            q, home = (self.arm.turned(x, turret) for x in (self.arm.grid, self.home))
            self._known[key] = ArmPaths(self.arm, q[self.arm.clear(q)], home, ground, load)
        return self._known[key]

    def between(
        self, start: Floats, end: Floats, ground: tuple[str, float], load: float
    ) -> list[Floats] | None:
        """Return few postures on a safe path from `start` to `end` (j,); None if none is found."""
        for middle in detours(self.arm, start, self.home, end):
            if safe_path(self.arm, [start, *middle, end], ground, load):
                return middle
        paths = self.paths(ground, load, self.arm.turret(end))
        found = paths.to(end)
        for middle in ([self.home, paths.home, *found], [paths.home, *found]):
            if found and safe_path(self.arm, [start, *middle, end], ground, load):
                return middle
        return None
