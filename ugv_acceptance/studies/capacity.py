"""The largest force a robot can pull or lift with before it tips, slips or saturates a joint.

Torque and tipping moments are linear in the force, friction is quadratic, so each bound is exact.
A lift is a pull along gravity at the gripper.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ugv_acceptance.model.blocks import in_blocks
from ugv_acceptance.model.expressions import Number
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Payload, Robot, Vector
from ugv_acceptance.model.row_selection import Rows
from ugv_acceptance.model.stability import many_stances, many_standing
from ugv_acceptance.model.statics import LEAST_LEVER, gripper_point, static_torque
from ugv_acceptance.model.support import pairs
from ugv_acceptance.type_aliases import Floats

# What limits the force first; NOTHING if no finite force is too large.
SATURATION, TIP, SLIP, NOTHING = range(4)
CAUSES = ('saturation', 'tip', 'slip', 'nothing')


@dataclass(frozen=True, slots=True, eq=False)
class Capacity:
    """The largest force before each cause of failure: `bounds` (..., 3) in N, in order of CAUSES.

    Zero where the limit is passed without any force; infinite where no force reaches it.
    """

    bounds: Floats

    @property
    def force(self) -> Floats:
        """Largest force (N) before any of the causes, shape (...)."""
        least: Floats = self.bounds.min(axis=-1)
        return least

    @property
    def cause(self) -> NDArray[np.int8]:
        """Index in CAUSES of the cause that limits the force, shape (...)."""
        first = self.bounds.argmin(axis=-1)
        return np.where(np.isinf(self.force), NOTHING, first).astype(np.int8)


def pull_capacity(  # noqa: PLR0913, PLR0917 - two optional places of the pull
    robot: Robot,
    q: ArrayLike,
    gravity: ArrayLike,
    direction: ArrayLike,
    limits: ArrayLike,
    friction: float = np.inf,
    hitch: Vector | None = None,
    payload: Payload | None = None,
) -> Capacity:
    """Return the largest force along the unit vector `direction` that may act on the robot.

    `q` (..., j), `gravity` (..., 3) in m/s2, `direction` (..., 3) in `base_link`, `limits` (j,) in
    N m. The force acts at the gripper and loads the arm, or at `hitch` (m, `base_link`), a point of
    the chassis. `friction` is that of tracks on a ground parallel to the tracks' plane.
    """
    q, g, d = (np.asarray(x, dtype=np.float64) for x in (q, gravity, direction))
    load = payload or robot.payload
    saturation = (
        np.full(np.broadcast_shapes(q.shape[:-1], g.shape[:-1], d.shape[:-1]), np.inf)
        if hitch is not None
        else _saturation(robot, q, g, d, np.asarray(limits, dtype=np.float64), load)
    )
    point = gripper_point(robot, q) if hitch is None else np.asarray(hitch)
    tip = _tip(robot, q, g, d, point, load)
    slip = np.broadcast_to(_slip(_weight(robot, load) * g, d, friction), tip.shape)
    return Capacity(np.stack(np.broadcast_arrays(saturation, tip, slip), axis=-1))


def lift_capacity(
    robot: Robot, q: ArrayLike, gravity: ArrayLike, limits: ArrayLike
) -> tuple[Floats, NDArray[np.int8]]:
    """Return the largest payload (kg), shape (...), and its cause: SATURATION, TIP or NOTHING.

    The payload's centre of gravity is that of `robot.payload`; zero where even without any payload
    the robot tips or saturates.
    """
    g = np.asarray(gravity, dtype=np.float64)
    size = np.linalg.norm(g, axis=-1)
    empty = Payload(0.0, robot.payload.cog)
    found = pull_capacity(robot, q, g, g / size[..., np.newaxis], limits, payload=empty)
    mass: Floats = found.force / size
    return mass, found.cause


def _weight(robot: Robot, load: Payload) -> float:
    return robot.mass + load.mass


def _rise(start: Floats, slope: Floats, end: Floats) -> Floats:
    """Return the smallest f >= 0 at which start + slope f leaves |value| <= end."""
    with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
        room = (end - np.sign(slope) * start) / np.abs(slope)
    room = np.where(np.abs(slope) <= LEAST_LEVER, np.inf, room)
    found: Floats = np.where(np.abs(start) > end, 0.0, np.maximum(room, 0.0))
    return found


def _saturation(
    robot: Robot, q: Floats, g: Floats, d: Floats, limits: Floats, load: Payload
) -> Floats:
    """Return the force (...) in N at which the first joint saturates."""
    cog = robot.payload.cog
    torque = static_torque(robot, q, g, load)
    # The torque that holds 1 kg against an acceleration d holds 1 N along d.
    of_force = static_torque(robot, q, d, Payload(1.0, cog))
    of_force = of_force - static_torque(robot, q, d, Payload(0.0, cog))
    of_force = np.where(np.abs(of_force) < 1e-12, 0.0, of_force)
    least: Floats = _rise(torque, of_force, limits).min(axis=-1)
    return least


def _tip(robot: Robot, q: Floats, g: Floats, d: Floats, point: Floats, load: Payload) -> Floats:
    """Return the force (...) in N at which the robot tips about any edge; 0 if it tips already."""
    mechanics, n = mechanics_of(robot), len(robot.joint_names)

    def bound(*columns: Floats) -> tuple[Floats]:
        count = len(columns[0])
        posture = posture_of(mechanics, columns[:n], load.mass, load.cog)
        gravity = (columns[n], columns[n + 1], columns[n + 2])
        weight = [posture.mass * x for x in gravity]
        force, at = columns[n + 3 : n + 6], columns[n + 6 : n + 9]
        contacts = [[np.broadcast_to(x, count) for x in p] for p in posture.contacts]
        found = np.zeros(count)
        stances = many_stances(mechanics, posture, count)
        for rows, stance in many_standing(stances, count, np.arange(count), gravity):
            polygon = stance.footing.polygon if stance.footing else ()
            edges = [
                _edge_bound(
                    _rows(contacts[i], rows),
                    _rows(contacts[j], rows),
                    (_rows(posture.cog, rows), _rows(weight, rows)),
                    (_rows(at, rows), _rows(force, rows)),
                )
                for i, j in pairs(polygon)
            ]
            found[rows] = np.min(edges, axis=0) if edges else 0.0
        return (found,)

    found: Floats = in_blocks(bound, 1, q, g, d, point)[..., 0]
    return found


def _rows(vector: Sequence[Number], rows: Rows) -> Floats:
    """Return the rows of a vector of columns, shape (n, 3)."""
    parts = np.broadcast_arrays(*vector)
    stacked: Floats = np.stack(parts, axis=-1)
    return stacked[rows] if stacked.ndim == 2 else stacked


def _edge_bound(
    start: Floats, end: Floats, weight: tuple[Floats, Floats], pull: tuple[Floats, Floats]
) -> Floats:
    """Return the factor (n,) of the pull at which the moment about an edge vanishes.

    `weight` and `pull` are each a point (n, 3) in m and the force (n, 3) that acts there.
    """
    along = end - start
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    holds, pulls = (
        (np.cross(force, point - start) * along).sum(axis=-1) for point, force in (weight, pull)
    )
    with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
        room = np.where(pulls < 0.0, -holds / pulls, np.inf)
    found: Floats = np.where(holds <= 0.0, 0.0, room)
    return found


def _slip(weight: Floats, d: Floats, friction: float) -> Floats:
    """Return the force at which the tracks slip: f of |T + f t|^2 = mu^2 (N + f n)^2.

    T and N are the weight along and across the ground, t and n the parts of direction `d`.
    """
    if np.isinf(friction):
        return np.full(np.broadcast_shapes(weight.shape, d.shape)[:-1], np.inf)
    mu = friction**2
    a = d[..., 0] ** 2 + d[..., 1] ** 2 - mu * d[..., 2] ** 2
    b = weight[..., 0] * d[..., 0] + weight[..., 1] * d[..., 1] - mu * weight[..., 2] * d[..., 2]
    c = weight[..., 0] ** 2 + weight[..., 1] ** 2 - mu * weight[..., 2] ** 2
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
        # Inside the cone c < 0: the positive root, written so that nothing cancels.
        force = np.where(root + b > 0.0, -c / (root + b), np.inf)
    inside = (c < 0.0) & (weight[..., 2] < 0.0)
    found: Floats = np.where(inside, force, 0.0)
    return found
