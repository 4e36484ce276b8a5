"""Positions beyond a full turn of joints that have no range: turns that were counted, or degrees.

A joint without a range may stand at any angle, so 60 (degrees) could be 60 rad. Within a turn
nothing can be told. Beyond it a position is a posture only if the joint turned there while messages
told of it, no faster than it can, or if it is upright (a turret) and another joint stands at an
angle that is one in radians but hardly one in degrees. Where turning moves nothing, as of a wheel,
nothing depends on the angle and all are believed.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import Signal
from ugv_acceptance.model.robot import Joint, Robot
from ugv_acceptance.model.row_selection import Values
from ugv_acceptance.model.tree import Body, Tree, in_body, tree_of
from ugv_acceptance.type_aliases import Floats, Times

# Angles (rad) up to FULL are within a turn; another joint beyond SOME tells that it is in radians.
FULL, SOME = math.tau + 0.1, 0.1
# Larger than any angle (rad) a joint can have reached: the number is not an angle.
ABSURD = 1e5
# Between two messages a joint may turn by STEP (rad), and at its greatest rate times QUICK; without
# a known rate at FASTEST (rad/s).
STEP, QUICK, FASTEST = 0.2, 1.5, math.tau
# Moment (kg m) of mass about a joint's axis below which turning it moves nothing, and the share of
# an axis (of 1) that must be vertical in an upright joint.
BALANCED, VERTICAL = 0.01, 0.95


@dataclass(frozen=True, slots=True)
class Turning:
    """How a joint may come to stand beyond a full turn: `fastest` (rad/s), and if it is `upright`.

    `limited` says whether its positions have to be judged at all, `moves` whether it moves more
    than itself, as no wheel does.
    """

    limited: bool
    moves: bool
    upright: bool
    fastest: float


def turning_of(robot: Robot) -> list[Turning]:
    """Return for each joint of `robot.joint_names` how it may come to stand beyond a turn."""
    tree = tree_of(robot)
    number = {body.joint: k for k, body in enumerate(tree.bodies)}
    return [_turning(robot, tree, robot.joint(name), number[name]) for name in robot.joint_names]


def _turning(robot: Robot, tree: Tree, joint: Joint, k: int) -> Turning:
    endless = not joint.slides and math.isinf(joint.lower) and math.isinf(joint.upper)
    fastest = QUICK * joint.velocity if math.isfinite(joint.velocity) else FASTEST
    moves = _moves(robot, tree, k)
    return Turning(endless and moves, moves, _upright(tree, k), fastest)


def _moves(robot: Robot, tree: Tree, k: int) -> bool:
    """Return whether turning body number k moves anything: mass, a contact, the payload."""
    held = [contact.link for contact in robot.contacts]
    held += [] if robot.payload_link is None else [robot.payload_link]
    if any(in_body(tree, link, (0.0, 0.0, 0.0))[0] == k for link in held):
        return True
    return any(b.parent == k for b in tree.bodies[1:]) or _moment(tree.bodies[k]) > BALANCED


def _moment(body: Body) -> float:
    """Return the moment (kg m) of a body's mass about its axis."""
    along = sum(a * c for a, c in zip(body.axis, body.cog, strict=True))
    square = sum(c * c for c in body.cog) - along * along
    return body.mass * math.sqrt(max(square, 0.0))


def _upright(tree: Tree, k: int) -> bool:
    while k:
        body = tree.bodies[k]
        if not body.prismatic and abs(body.axis[2]) < VERTICAL:
            return False
        k = body.parent
    return True


@dataclass(slots=True)
class Turns:
    """Judges positions beyond a full turn of `joints` (j).

    `told` (j,) holds the newest position of each joint as it was told, believed or not.
    """

    joints: list[Turning]
    told: list[float] = field(init=False)

    def __post_init__(self) -> None:
        self.told = [math.nan] * len(self.joints)

    def judge(self, j: int, before: float, apart: int, slope: float) -> bool:
        """Return whether the position beyond a turn that joint j was told last is believed.

        `before` (rad) is the one before if that was, `apart` (ns) the time between, and `slope`
        (rad/s) how fast it turns.
        """
        of, q = self.joints[j], self.told[j]
        if not of.limited or not abs(q) <= ABSURD:
            return False
        linked = abs(q - before) <= _step(of, apart) and not abs(slope) > of.fastest
        return linked or (of.upright and self._radians(j))

    def _radians(self, j: int) -> bool:
        """Return whether the other joints tell that angles are in radians."""
        others = [k for k in range(len(self.joints)) if k != j]
        if any(self.joints[k].limited and abs(self.told[k]) > FULL for k in others):
            return False
        return any(SOME < abs(self.told[k]) <= FULL for k in others)

    def columns(
        self, j: int, told: Floats, q: Floats, before: float, apart: Times, slope: Floats
    ) -> Floats:
        """Take all messages that name joint j (n,); return its positions, NaN if not believed.

        `told` (j, n) are the newest positions of all joints, `q` (n,) those of joint j in its
        range, `before` the last believed one before, `apart` (n,) the times (ns) since the message
        before and `slope` (n,) as in `judge`.
        """
        of, own = self.joints[j], told[j]
        far = of.limited & (np.abs(own) <= ABSURD) & np.isnan(q)
        if not far.any():
            return q
        previous = np.concatenate(([before], own[:-1]))
        linked = np.abs(own - previous) <= _step(of, apart)
        linked &= ~(np.abs(slope) > of.fastest)
        sure = np.isfinite(q) | (far & of.upright & self._radians_columns(j, told))
        n = len(own)
        rows = np.arange(1, n + 1)
        seed = np.maximum.accumulate(np.where(sure, rows, 0))
        gap = np.maximum.accumulate(np.where(~sure & ~(far & linked), rows, -1))
        gap = np.where(gap < 0, -1 if before == before else 0, gap)  # noqa: PLR0124 - not NaN
        return np.where(far & (seed > gap), own, q)

    def _radians_columns(self, j: int, told: Floats) -> NDArray[np.bool_]:
        size = np.abs(np.delete(told, j, axis=0))
        limited = np.array([of.limited for k, of in enumerate(self.joints) if k != j])
        degrees = (size[limited] > FULL).any(axis=0)
        radians: NDArray[np.bool_] = ((size > SOME) & (size <= FULL)).any(axis=0) & ~degrees
        return radians


def _step(of: Turning, apart: Values) -> Values:
    """Return the most (rad) a joint can turn between two messages `apart` (ns)."""
    return STEP + of.fastest * apart / 1e9


def beyond(alert: Signal, rate: float, of: Turning, q: float) -> float:
    """Return a rate (rad/s) for the leap signal `alert`: at its limit if q is beyond a turn.

    So it is if the joint turned there faster than it can.
    """
    if of.limited and abs(q) > FULL and rate > of.fastest:
        return max(rate, alert.on)
    return rate
