"""Postures of a robot's arm found by a search: folded, lifted, reaching out and down.

The arm is varied in its first two axes that lift and turned by its turret; flippers are folded and
all other joints stay at zero, or at the end of their travel that is nearest to it.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.clearance import CLEARANCE, clearance
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Payload, Robot, Vector
from ugv_acceptance.model.roles import Roles, chain_to, direction_of, place_of, roles_of
from ugv_acceptance.model.stability import margins
from ugv_acceptance.model.statics import payload_capacity
from ugv_acceptance.model.tree import body_positions, drives_of, point_of, pose_of, tree_of
from ugv_acceptance.simulation.vehicle import gravity_on_slope
from ugv_acceptance.type_aliases import Floats

Mask = NDArray[np.bool_]

# Step (rad) of the grid, fewest positions of a joint on it, and postures that have to be clear.
STEP, FEWEST, ENOUGH = math.radians(15.0), 5, 12
# The body's width (m) beyond its contacts.
AROUND = 0.12
# Tilt (rad) of the slopes to every side, and share of a torque limit, for the folded posture.
SLOPE, EASY = math.radians(10.0), 0.5
# Tilt (rad) that is left with the heaviest usual load held out, and that load as a share of the
# robot's mass where neither a torque nor the tilt tells one.
LEFT, LIGHT = math.radians(10.0), 0.02
# Loads that are tried, as shares of the robot's mass.
LOADS = np.geomspace(0.002, 1.0, 40)
# Positions (rad) of a flipper that are tried, and its height (m) above the ground when folded.
FLIPPED, OFF_GROUND = np.radians(np.arange(-180.0, 181.0, 15.0)), 0.02
# A moderate change of an axis (rad), and how many postures are tried for a motion.
NEAR, TRIED = 1.6, 15
HEADINGS = np.linspace(-math.pi, math.pi, 8, endpoint=False)


@dataclass(frozen=True, eq=False)
class ArmGrid:
    """The arm's postures on a grid: `rows` (n, j) that touch neither ground nor body, rad or m.

    `rest` (j,) has the arm at zero. Without an arm it is the only row.
    """

    robot: Robot
    roles: Roles
    rest: Floats
    rows: Floats

    @cached_property
    def grip(self) -> Floats:
        """The load's place (n, 3) for every row, m, `base_link`."""
        return grip_of(self.robot, self.roles, self.rows)

    @cached_property
    def reach(self) -> Floats:
        """How far (n,) the load is from the arm's pillar, m."""
        away = self.grip[:, :2] - self.pillar[:2]
        distance: Floats = np.hypot(away[:, 0], away[:, 1])
        return distance

    @cached_property
    def pillar(self) -> Floats:
        """The place (3,) of the turret, or of the first axis, m, `base_link`."""
        name = self.roles.turret or next(iter(self.roles.axes), None)
        child = self.robot.root if name is None else self.robot.joint(name).child
        return place_of(self.robot, child, (0.0, 0.0, 0.0))

    @cached_property
    def outstretched(self) -> Floats:
        """The row (j,) that reaches farthest."""
        row: Floats = self.rows[int(self.reach.argmax())]
        return row

    @cached_property
    def capacity(self) -> float:
        """The load (kg) that the outstretched arm just holds, to every side without a near fall."""
        robot, down = self.robot, (0.0, 0.0, -self.robot.gravity)
        if robot.payload_link is None or not self.roles.axes:
            return robot.payload.mass
        holds = float(payload_capacity(robot, self.outstretched, down, limits_of(robot)))
        around = np.array([self.turned(self.outstretched[None], h)[0] for h in HEADINGS])
        stands = 0.0
        for share in LOADS:
            load = Payload(float(share) * robot.mass, robot.payload.cog)
            if least_tilt(margins(robot, around, down, load).angle).min() < LEFT:
                break
            stands = load.mass
        found = min(holds, stands)
        return found if found > 0.0 else LIGHT * robot.mass

    @cached_property
    def stowed(self) -> Floats:
        """The posture (j,) with most tilt left on slopes to every side at low torques."""
        if len(self.rows) == 1:
            return self.rest
        load = Payload(self.capacity / 2.0, self.robot.payload.cog)
        tilt, share = self.looked(self.rows[:, None, :], SLOPE, load)
        score = np.where(share < EASY, tilt, -math.pi - share)
        row: Floats = self.rows[int(score.argmax())]
        return row

    def looked(self, q: Floats, tilt: float, load: Payload) -> tuple[Floats, Floats]:
        """Return tilt left (rad) and share of the torque limits, the worst of slopes to all sides.

        `q` (n, 1, j); both have the shape (n,). `tilt` (rad) is that of the slopes.
        """
        heads = np.array([gravity_on_slope(self.robot.gravity, tilt, h) for h in HEADINGS])
        found = margins(self.robot, q, heads, load)
        share = np.abs(found.torque) / limits_of(self.robot)
        least: Floats = least_tilt(found.angle).min(axis=-1)
        most: Floats = share.max(axis=(-1, -2), initial=0.0)
        return least, most

    def turned(self, q: Floats, heading: float) -> Floats:
        """Return postures (n, j) with the arm towards `heading` (rad) as far as its turret goes."""
        turret = self.roles.turret
        if turret is None:
            return q
        k, joint = self.robot.joint_names.index(turret), self.robot.joint(turret)
        away = grip_of(self.robot, self.roles, q)[:, :2] - self.pillar[:2]
        missing = heading - np.arctan2(away[:, 1], away[:, 0])
        missing = (missing + math.pi) % (2.0 * math.pi) - math.pi
        target = q[:, k] + math.copysign(1.0, direction_of(self.robot, joint)[2]) * missing
        low, high = joint.travel()
        target = np.where(target > high, target - 2.0 * math.pi, target)
        target = np.where(target < low, target + 2.0 * math.pi, target)
        turned = q.copy()
        turned[:, k] = np.clip(target, joint.lower, joint.upper)
        return turned

    def clear(self, q: Floats) -> Mask:
        """Return which postures (n, j) touch neither the ground nor the body, (n,)."""
        return clear_of(self.robot, self.roles, q)

    def near(self, q: Floats) -> Mask:
        """Return the rows (n,) within a moderate motion of posture `q` (j,)."""
        near: Mask = np.all(np.abs(self.rows - q) < NEAR, axis=-1)
        return near


@lru_cache(maxsize=16)
def grid_of(robot: Robot) -> ArmGrid:
    """Return the postures of a robot's arm."""
    roles = roles_of(robot)
    rest = _rest(robot, roles)
    axes = roles.axes[:2]
    if not axes:
        return ArmGrid(robot, roles, rest, rest[None])
    columns = [_positions(robot, name) for name in axes]
    grid = [x.ravel() for x in np.meshgrid(*columns, indexing='ij')]
    rows = np.tile(rest, (len(grid[0]), 1))
    for name, column in zip(axes, grid, strict=True):
        rows[:, robot.joint_names.index(name)] = column
    kept = rows[clear_of(robot, roles, rows)]
    if len(kept) < ENOUGH:  # a low arm: above the ground at least
        kept = rows[_above_ground(robot, rows)]
    return ArmGrid(robot, roles, rest, kept if len(kept) else rows)


def _positions(robot: Robot, name: str) -> Floats:
    low, high = robot.joint(name).travel()
    low, high = max(low, -math.pi), min(high, math.pi)
    if not low < high:  # a travel beyond half a turn: its end that is nearest to zero
        return np.array([low if abs(low) < abs(high) else high])
    return np.linspace(low, high, max(FEWEST, math.ceil((high - low) / STEP) + 1))


def _rest(robot: Robot, roles: Roles) -> Floats:
    """Return the posture (j,) with the arm at zero and the flippers folded."""
    joints = [robot.joint(name) for name in robot.joint_names]
    rest = np.array([min(max(0.0, j.lower), j.upper) for j in joints], dtype=np.float64)
    for name in roles.flippers:
        rest[robot.joint_names.index(name)] = _folded(robot, rest, name)
    return rest


def _folded(robot: Robot, rest: Floats, name: str) -> float:
    """Return the position (rad, m) of a flipper that is off the ground and sticks out least."""
    joint, k = robot.joint(name), robot.joint_names.index(name)
    low, high = joint.travel(half_slide=0.5)
    places = np.linspace(low, high, FLIPPED.size) if joint.slides else FLIPPED
    places = places[(places >= low - 1e-9) & (places <= high + 1e-9)]
    q = np.tile(rest, (len(places), 1))
    q[:, k] = places
    still = [c for c in robot.contacts if not {*chain_to(robot, c.link)} & {*robot.joint_names}]
    moved = [c for c in robot.contacts if name in chain_to(robot, c.link)]
    if not len(places) or not still or not moved:
        return float(rest[k])
    tips = np.stack([_points(robot, q, c.link, c.position) for c in moved], axis=1)
    ends = np.array([place_of(robot, c.link, c.position)[0] for c in still])
    out = np.maximum(tips[..., 0] - ends.max(), ends.min() - tips[..., 0]).max(axis=1)
    high_up = tips[..., 2].min(axis=1) - robot.ground
    score = np.maximum(out, 0.0) + 0.1 * high_up + np.where(high_up < OFF_GROUND, math.inf, 0.0)
    return float(places[int(score.argmin())]) if np.isfinite(score).any() else float(rest[k])


def limits_of(robot: Robot) -> Floats:
    """Return the torque limits (j,) of the joints in the URDF: N m, N; infinite: none."""
    return np.array([robot.joint(name).effort for name in robot.joint_names], dtype=np.float64)


def least_tilt(angle: Floats) -> Floats:
    """Return the least (...) of the tilt left to every side (..., 4), rad; falling: minus pi."""
    least: Floats = np.nan_to_num(np.asarray(angle).min(axis=-1), nan=-math.pi)
    return least


def grip_of(robot: Robot, roles: Roles, q: Floats) -> Floats:
    """Return the place of the load (n, 3) for postures (n, j), m, `base_link`."""
    if robot.payload_link is not None:
        return _points(robot, q, robot.payload_link, robot.payload.cog)
    link = robot.joint(roles.arm[-1]).child if roles.arm else robot.root
    return _points(robot, q, link, (0.0, 0.0, 0.0))


def _points(robot: Robot, q: Floats, link: str, point: Vector) -> Floats:
    """Return where a point of a link is (n, 3) for postures (n, j), m, `base_link`."""
    tree = tree_of(robot)
    columns: list[Any] = [np.asarray(x) for x in np.moveaxis(q, -1, 0)]
    pose = pose_of(tree, body_positions(drives_of(robot, tree), columns))
    at = point_of(tree, pose, link, point)[1]
    found: Floats = np.stack([np.broadcast_to(np.asarray(x), len(q)) for x in at], axis=-1)
    return found


def clear_of(robot: Robot, roles: Roles, q: Floats) -> Mask:
    """Return which postures (n, j) touch neither the ground nor the body, (n,).

    What is over the body is to be above the arm's first axis.
    """
    links = [robot.joint(name).child for name in roles.axes]
    ends = [_points(robot, q, link, (0.0, 0.0, 0.0)) for link in links]
    chain = np.stack([*ends, grip_of(robot, roles, q)], axis=1)
    points = np.concatenate([chain[:, 1:], (chain[:, 1:] + chain[:, :-1]) / 2.0], axis=1)
    feet = np.array([place_of(robot, c.link, c.position) for c in robot.contacts])
    low, high = feet.min(axis=0) - AROUND, feet.max(axis=0) + AROUND
    over = (points[..., :2] > low[:2]).all(axis=-1) & (points[..., :2] < high[:2]).all(axis=-1)
    bad = over & (points[..., 2] < chain[:, :1, 2] + CLEARANCE)
    good: Mask = ~bad.any(axis=-1) & _above_ground(robot, q)
    return good


def _above_ground(robot: Robot, q: Floats) -> Mask:
    columns = [np.asarray(x) for x in np.moveaxis(q, -1, 0)]
    height = clearance(mechanics_of(robot), None, columns, robot.payload.cog)
    above: Mask = np.broadcast_to(np.asarray(height) >= CLEARANCE, len(q))
    return above
