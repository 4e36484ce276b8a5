"""Postures of the arm's two main joints, and the margins that the model gives for them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.clearance import CLEARANCE, clearance
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Payload, Robot
from ugv_acceptance.model.roles import Roles, chain_to, place_of, roles_of
from ugv_acceptance.model.stability import STANDING, margins, stability
from ugv_acceptance.studies.axes import arm_axes
from ugv_acceptance.studies.orientations import gravity_of
from ugv_acceptance.studies.postures import rest_posture
from ugv_acceptance.type_aliases import Floats

Mask = NDArray[np.bool_]

# Step (deg) of the search; hull's width (m) beyond its contacts.
STEP_DEG, AROUND = 5.0, 0.12
# Points between two postures at which a motion is checked.
PATH = 25
# A posture reaches as far as the furthest if it does to this share.
STRETCHED = 0.98


@dataclass(frozen=True)
class Arm:
    """The arm as two joints that are varied, all other joints folded away. Angles in rad.

    A robot without two joints that move its load has one posture only.
    """

    settings: Settings

    @property
    def robot(self) -> Robot:
        """The robot that the arm belongs to."""
        return self.settings.robot

    @cached_property
    def roles(self) -> Roles:
        """What the joints of the robot are for."""
        return roles_of(self.robot)

    @cached_property
    def varied(self) -> tuple[str, ...]:
        """The two joints that are varied, base first; none without an arm."""
        return arm_axes(self.robot)

    @property
    def columns(self) -> list[int]:
        """The numbers of the varied joints in `q`."""
        return [self.robot.joint_names.index(name) for name in self.varied]

    @property
    def moved(self) -> list[int]:
        """The numbers in `q` of the joints that a plan moves: those varied, then the turret."""
        return [*self.columns, *([] if self._turret is None else [self._turret])]

    @property
    def judged(self) -> tuple[str, ...]:
        """The joints that lift or are varied and have a torque limit."""
        names, limits = self.robot.joint_names, self.settings.limits.torque
        arm = [n for n in self.roles.arm if n in (*self.roles.axes, *self.varied)]
        return tuple(n for n in arm if math.isfinite(limits[names.index(n)]))

    @cached_property
    def folded(self) -> Floats:
        """Positions (j,) with flippers folded and the arm ahead, all else at zero or in between."""
        q = rest_posture(self.robot)
        if self._turret is not None:
            q[self._turret] = self.turret_at(0.0)
        for name in self.roles.flippers:
            k, joint = self.robot.joint_names.index(name), self.robot.joint(name)
            for angle in (0.0, math.pi):
                trial = q.copy()
                trial[k] = angle
                found = stability(self.robot, trial, (0.0, 0.0, -self.robot.gravity))
                stands = int(np.asarray(found.state)) == STANDING
                if stands and joint.lower <= angle <= joint.upper:
                    q = trial
        return q

    @cached_property
    def grid(self) -> Floats:
        """Postures (n, j) of the varied joints that touch neither ground nor deck, arm ahead."""
        if not self.varied:
            return self.folded[None, :]
        q = self._every(self.folded)
        return q[self.clear(q)]

    def _every(self, at: Floats) -> Floats:
        """Return `at` (j,) with the varied joints anywhere in their ranges (n, j)."""
        columns = []
        for name in self.varied:
            joint = self.robot.joint(name)
            low, high = max(joint.lower, -math.pi), min(joint.upper, math.pi)
            columns.append(np.radians(np.arange(math.degrees(low), math.degrees(high), STEP_DEG)))
        first, second = (x.ravel() for x in np.meshgrid(*columns, indexing='ij'))
        q = np.tile(at, (len(first), 1))
        q[:, self.columns] = np.stack([first, second], axis=-1)
        return q

    @property
    def turret_joint(self) -> str | None:
        """The joint that turns the arm about the vertical before the varied ones; or None."""
        return None if self._turret is None else self.robot.joint_names[self._turret]

    @cached_property
    def _turret(self) -> int | None:
        """The number of the joint that turns the arm about the vertical; None: there is none."""
        name = self.roles.turret
        known = name is not None and self.varied and name not in self.varied
        return self.robot.joint_names.index(str(name)) if known else None

    @cached_property
    def _turns(self) -> tuple[float, float]:
        """The sign of the turret's axis, and where the arm points with the turret at 0 (rad)."""
        assert self._turret is not None  # noqa: S101 - asked for a turret only
        joint = self.robot.joint(self.robot.joint_names[self._turret])
        origin = place_of(self.robot, joint.child, (0.0, 0.0, 0.0))
        sign = math.copysign(
            1.0, float((place_of(self.robot, joint.child, joint.axis) - origin)[2])
        )
        rest = rest_posture(self.robot)
        hand = self.points(self._every(rest))[..., len(self.ends), :2] - origin[:2]
        reach = np.linalg.norm(hand, axis=-1)
        # An arm that reaches over itself points both ways: the one ahead is meant.
        far = hand[reach >= STRETCHED * reach.max()]
        x, y = far[far[:, 0].argmax()].tolist()
        return sign, math.atan2(y, x) - sign * float(rest[self._turret])

    def turret_at(self, heading: float) -> float:
        """Return the turret's angle (rad) for the arm to point to a heading, as near as it can.

        `heading` (rad): 0 is ahead, pi/2 to the left. 0 without a turret.
        """
        if self._turret is None:
            return 0.0
        sign, ahead = self._turns
        joint = self.robot.joint(self.robot.joint_names[self._turret])
        wanted = sign * (heading - ahead)
        ways = [wanted, wanted - 2.0 * math.pi, wanted + 2.0 * math.pi]
        near = [min(max(way, joint.lower), joint.upper) for way in ways]
        k = min(range(len(ways)), key=lambda k: abs(near[k] - ways[k]))
        return near[k]

    def turned(self, q: Floats, turret: float) -> Floats:
        """Return postures with the turret at an angle (rad); unchanged without a turret."""
        if self._turret is None:
            return q
        turned = q.copy()
        turned[..., self._turret] = turret
        return turned

    def turret(self, q: Floats) -> float:
        """Return the turret's angle (rad) in a posture (j,); 0 without a turret."""
        return 0.0 if self._turret is None else float(q[self._turret])

    def heading(self, q: Floats) -> float:
        """Return where the turret points the arm (rad, 0 ahead) in a posture (j,)."""
        if self._turret is None:
            return 0.0
        sign, ahead = self._turns
        return sign * self.turret(q) + ahead

    @cached_property
    def feet(self) -> Floats:
        """The contact points (n, 3) in m, `base_link`, that no joint moves; all if all move."""
        robot = self.robot
        points = [(c, place_of(robot, c.link, c.position)) for c in robot.contacts]
        still = [p for c, p in points if not {*chain_to(robot, c.link)} & {*robot.joint_names}]
        return np.array(still or [p for _, p in points])

    def clear(self, q: Floats) -> Mask:
        """Return whether arm and load touch neither ground nor deck (...,), for `q` (..., j)."""
        if not self.varied:
            return np.ones(q.shape[:-1], dtype=bool)
        points = self.points(q)
        bad = self._inside(points) if self.on_column else self._on_deck(points)
        columns = [np.asarray(x) for x in np.moveaxis(q, -1, 0)]
        height = clearance(mechanics_of(self.robot), None, columns, self.robot.payload.cog)
        good: Mask = ~bad[..., 1:].any(axis=-1) & (height >= CLEARANCE)
        return good

    @cached_property
    def on_column(self) -> bool:
        """Whether the arm begins higher above the ground than the robot is long or wide.

        It then stands on a column: what is below its shoulder is not the deck.
        """
        height = float(self.points(self.folded)[0, 2]) - self.robot.ground
        return height > float(np.ptp(self.feet[:, :2], axis=0).max())

    def _on_deck(self, points: Floats) -> Mask:
        """Return which points along the arm (..., k) are low above the robot's own deck."""
        low, high = self.feet.min(axis=0) - AROUND, self.feet.max(axis=0) + AROUND
        deck = points[..., 0, 2, None]
        over = (points[..., :2] > low[:2]).all(axis=-1) & (points[..., :2] < high[:2]).all(axis=-1)
        bad: Mask = over & (points[..., 2] < deck + CLEARANCE)
        return bad

    def _inside(self, points: Floats) -> Mask:
        """Return which points along the arm (..., k), behind its second joint, meet its column."""
        away = np.linalg.norm(points[..., :2] - points[..., :1, :2], axis=-1)
        below = points[..., 2] < points[..., :1, 2] + CLEARANCE
        number = np.arange(points.shape[-2])
        second = self.ends.index(self.varied[1])
        behind = (number > second) & (number != len(self.ends) + 1)
        bad: Mask = below & (away < AROUND) & behind
        return bad

    def chain(self, q: Floats) -> Floats:
        """Return the arm's joints and the load as points (k, 3) in m, `base_link`, for `q` (j,).

        Empty without an arm.
        """
        if not self.varied:
            return np.empty((0, 3))
        found: Floats = self.points(q)[: len(self.ends) + 1]
        return found

    @cached_property
    def ends(self) -> tuple[str, ...]:
        """The joints whose places are the arm: from the first varied one to the load."""
        arm = self.roles.arm
        return arm[arm.index(self.varied[0]) :]

    def points(self, q: Floats) -> Floats:
        """Return points along the arm from shoulder to load (..., k, 3) in m, `base_link`."""
        robot = self.robot
        places = [Contact(n, robot.joint(n).child, (0.0, 0.0, 0.0)) for n in self.ends]
        hand = robot.payload_link or robot.joint(self.ends[-1]).child
        seen = replace(robot, contacts=(*places, Contact('grip', hand, robot.payload.cog)))
        columns = np.moveaxis(q, -1, 0)
        posture = posture_of(mechanics_of(seen), list(columns), 0.0, (0.0, 0.0, 0.0))
        joints = np.stack(
            [np.stack(np.broadcast_arrays(*p, columns[0])[:3], axis=-1) for p in posture.contacts],
            axis=-2,
        )
        between = (joints[..., 1:, :] + joints[..., :-1, :]) / 2.0
        found: Floats = np.concatenate([joints, between], axis=-2)
        return found


@dataclass(frozen=True, slots=True)
class Found:
    """The model's margins for postures `q` (n, j).

    `share` (n, j) is the torque over its limit with its sign, `tilt` (n,) the tilt left (rad).
    """

    q: Floats
    share: Floats
    tilt: Floats

    @property
    def most(self) -> Floats:
        """Largest share of a torque limit (n,), whatever its sign."""
        largest: Floats = np.abs(self.share).max(axis=-1, initial=0.0)
        return largest


def look(arm: Arm, q: Floats, ground: tuple[str, float], load: float) -> Found:
    """Return the margins of postures on a ground (orientation, tilt in rad) with a load (kg)."""
    gravity = gravity_of(*ground, arm.robot.gravity)
    found = margins(arm.robot, q, gravity, Payload(load, arm.robot.payload.cog))
    share = found.torque / np.array(arm.settings.limits.torque)
    tilt = np.nan_to_num(found.angle.min(axis=-1), nan=-math.pi)
    return Found(q, share, tilt)


def safe(arm: Arm, found: Found, spare: float = 0.0) -> Mask:
    """Return where no ERROR limit is passed (n,), with `spare` (share; times 20 deg) to it."""
    limits = arm.settings.limits
    use, tilt = limits.torque_error - spare, limits.tip_error + spare * math.radians(20.0)
    good: Mask = (found.most < use) & (found.tilt > tilt)
    return good


def spread_out(q: Floats, count: int, names: Sequence[int]) -> list[int]:
    """Return up to `count` rows of `q` (n, j) far from each other in the joints `names`."""
    if not len(q):
        return []
    chosen = [0]
    away = np.abs(q[:, names] - q[0, names]).max(axis=1)
    while len(chosen) < min(count, len(q)) and away.max() > math.radians(STEP_DEG):
        k = int(away.argmax())
        chosen.append(k)
        away = np.minimum(away, np.abs(q[:, names] - q[k, names]).max(axis=1))
    return chosen
