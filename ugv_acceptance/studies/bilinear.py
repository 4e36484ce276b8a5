"""A static quantity over two joints as an exact 3 x 3 bilinear form, so that maps are cheap.

Every link's position is linear in (1, cos q, sin q) of each joint angle and in (1, x) of each
prismatic joint; so are the centre of gravity, the potential energy and, as its derivative, each
static torque. Over two joints a and b such a quantity is u(a) K v(b), and nine postures determine
K. If K is f(a) + g(a + b), cells of equal a + b share their value of g.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.type_aliases import Floats

TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """A grid over two joints: positions `x` (n,) and `y` (m,), all other joints as in `q` (j,).

    rad, m if prismatic. `first` and `second` are the two joints' indices in `robot.joint_names`. A
    field over the grid has shape (n, m).
    """

    first: int
    second: int
    x: Floats
    y: Floats
    q: Floats

    def postures(self) -> Floats:
        """Return every posture of the grid, shape (n, m, j)."""
        q = np.broadcast_to(self.q, (len(self.x), len(self.y), len(self.q))).copy()
        q[..., self.first] = self.x[:, np.newaxis]
        q[..., self.second] = self.y
        return q


def grid_of(
    robot: Robot, axes: tuple[str, str], ranges: ArrayLike, counts: tuple[int, int], q: ArrayLike
) -> Grid:
    """Return the grid over the two joints named in `axes`; `ranges` (2, 2) are from and to, closed.

    `counts` are the numbers of cells; `q` (j,) gives the other joints' positions (rad, m).
    """
    first, second = (robot.joint_names.index(name) for name in axes)
    (x0, x1), (y0, y1) = np.asarray(ranges, dtype=np.float64)
    return Grid(
        first,
        second,
        np.linspace(x0, x1, counts[0]),
        np.linspace(y0, y1, counts[1]),
        np.array(q, dtype=np.float64),
    )


def _basis(values: Floats, *, prismatic: bool) -> Floats:
    found = np.ones((*values.shape, 3))
    found[..., 1] = values if prismatic else np.cos(values)
    found[..., 2] = 0.0 if prismatic else np.sin(values)
    return found


def _prismatic(robot: Robot, joint: int) -> bool:
    return robot.joint(robot.joint_names[joint]).slides


# Three positions of each joint determine a form; the pseudo-inverse leaves out the third column,
# which is empty for a prismatic joint.
_NODES = np.array([0.0, TURN / 3.0, -TURN / 3.0])
_INVERSE = {kind: np.linalg.pinv(_basis(_NODES, prismatic=kind)) for kind in (False, True)}


def basis(robot: Robot, joint: int, values: Floats) -> Floats:
    """Return (1, cos q, sin q) of positions (...), or (1, x, 0) if prismatic, shape (..., 3)."""
    return _basis(values, prismatic=_prismatic(robot, joint))


def why_not_alone(robot: Robot, joint: str) -> str:
    """Return why torques are no sinusoid of a joint: a spring or followers; empty: they are."""
    follows = [mimic.joint for mimic in robot.mimics if mimic.follows == joint]
    sprung = any(law.joint == joint and law.stiffness for law in robot.laws)
    if sprung:
        return 'a spring acts on it'
    return f'{", ".join(follows)} moves with it' if follows else ''


def check_alone(robot: Robot, joint: str) -> None:
    """Raise BadConfig for a joint of which torques are no sinusoid: with a spring or followers."""
    why = why_not_alone(robot, joint)
    if why:
        raise BadConfig(f'joint {joint}: expected one that moves alone and without a spring: {why}')


def form_of(robot: Robot, grid: Grid, function: Callable[[Floats], Floats]) -> Floats:
    """Return the forms K (k, 3, 3) of the k quantities that `function` returns for postures.

    Raises BadConfig for a joint with a spring, or that others follow: then there is no such form.
    """
    for k in (grid.first, grid.second):
        check_alone(robot, robot.joint_names[k])
    few = Grid(grid.first, grid.second, _NODES, _NODES, grid.q)
    left, right = (_INVERSE[_prismatic(robot, k)] for k in (grid.first, grid.second))
    values = function(few.postures())
    form = np.einsum('an,nmk,bm->kab', left, values, right)
    scale = np.abs(form).max(axis=(1, 2), keepdims=True)
    clean: Floats = np.where(np.abs(form) > 1e-13 * scale, form, 0.0)
    return clean


def evaluate(robot: Robot, grid: Grid, form: Floats, rows: slice = slice(None)) -> Floats:
    """Return the values of `form` (..., 3, 3) over the grid, or rows of it, shape (..., n, m)."""
    left = basis(robot, grid.first, grid.x[rows])
    right = basis(robot, grid.second, grid.y)
    field: Floats = left @ form @ right.T
    return field


def along_rows(robot: Robot, grid: Grid, form: Floats) -> Floats:
    """Return one form's coefficients of (1, cos, sin) of the second joint, shape (n, 3)."""
    coefficients: Floats = basis(robot, grid.first, grid.x) @ form
    return coefficients


def is_sum_form(form: Floats, slack: float = 1e-12) -> bool:
    """Return whether a form (3, 3) is f(a) + g(a + b), as for two parallel joints in series."""
    off = np.array(
        [form[0, 1], form[0, 2], form[1, 1] + form[2, 2], form[1, 2] - form[2, 1]],
    )
    return bool(np.abs(off).max() <= slack * max(np.abs(form).max(), 1e-300))


def level_curves(robot: Robot, grid: Grid, form: Floats, level: float) -> Floats:
    """Return the positions (2, n) of the second joint at which a form (3, 3) equals `level`.

    For each position of the first joint the two roots (rad) of c0 + R cos(b - phase) = level, moved
    by whole turns into the grid's range; NaN if there is none. The second joint must be rotary.
    """
    c0, c1, c2 = along_rows(robot, grid, form).T
    phase, radius = np.arctan2(c2, c1), np.hypot(c1, c2)
    with np.errstate(divide='ignore', invalid='ignore'):
        cosine = np.where(radius > 0.0, (level - c0) / radius, np.nan)
        spread = np.arccos(np.where(np.abs(cosine) <= 1.0, cosine, np.nan))
    roots = np.stack([phase + spread, phase - spread])
    start = float(grid.y[0])
    roots = (roots - start) % TURN + start
    found: Floats = np.where(roots <= grid.y[-1], roots, np.nan)
    return found
