"""Postures of the arm's two main joints, and the margins that the model gives for them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance import BadConfig
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.clearance import CLEARANCE, clearance
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Payload, Robot
from ugv_acceptance.model.stability import STANDING, margins, stability
from ugv_acceptance.studies.orientations import gravity_of
from ugv_acceptance.type_aliases import Floats

Mask = NDArray[np.bool_]

# Step (deg) of the search; hull's width (m) beyond its contacts.
STEP_DEG, AROUND = 5.0, 0.12
# Points between two postures at which a motion is checked.
PATH = 25


@dataclass(frozen=True, slots=True)
class Roles:
    """Which joints have which role: the arm's two axes, a turret under them, flippers (or none)."""

    axes: tuple[str, str]
    turret: str | None
    flipper: str | None


def roles_of(settings: Settings) -> Roles:
    """Return the roles of a robot's joints. Raises BadConfig unless two have a torque limit."""
    robot, limits = settings.robot, settings.limits.torque
    pairs = zip(robot.joint_names, limits, strict=True)
    limited = [name for name, limit in pairs if math.isfinite(limit)]
    chain = _chain(robot, robot.payload_link or robot.root)
    axes = [name for name in robot.joint_names if name in limited and name in chain]
    if len(axes) < 2:
        raise BadConfig(f'{robot.name}: expected two arm joints with a torque limit, got {axes}')
    others = [n for n in chain if n in robot.joint_names and n not in axes]
    feet = {name for c in robot.contacts for name in _chain(robot, c.link)}
    flipper = next((n for n in robot.joint_names if n in feet), None)
    return Roles((axes[0], axes[1]), others[0] if others else None, flipper)


def _chain(robot: Robot, link: str) -> list[str]:
    """Return the joints from a link down to the root."""
    names = []
    while link != robot.root:
        joint = next(j for j in robot.joints if j.child == link)
        names.append(joint.name)
        link = joint.parent
    return names


@dataclass(frozen=True)
class Arm:
    """The arm as two joints that are varied, all other joints folded away. Angles in rad."""

    settings: Settings
    roles: Roles

    @property
    def robot(self) -> Robot:
        """The robot that the arm belongs to."""
        return self.settings.robot

    @cached_property
    def folded(self) -> Floats:
        """Positions (j,) with flippers folded, all else at zero."""
        q = np.zeros(len(self.robot.joint_names))
        if self.roles.flipper is not None:
            k = self.robot.joint_names.index(self.roles.flipper)
            for angle in (0.0, math.pi):
                trial = q.copy()
                trial[k] = angle
                found = stability(self.robot, trial, (0.0, 0.0, -self.robot.gravity))
                if int(np.asarray(found.state)) == STANDING:
                    q = trial
        return q

    @cached_property
    def grid(self) -> Floats:
        """Postures (n, j) of both axes that touch neither ground nor deck, the turret ahead."""
        columns = []
        for name in self.roles.axes:
            joint = self.robot.joint(name)
            low, high = max(joint.lower, -math.pi), min(joint.upper, math.pi)
            columns.append(np.radians(np.arange(math.degrees(low), math.degrees(high), STEP_DEG)))
        first, second = (x.ravel() for x in np.meshgrid(*columns, indexing='ij'))
        q = np.tile(self.folded, (len(first), 1))
        names = self.robot.joint_names
        q[:, names.index(self.roles.axes[0])] = first
        q[:, names.index(self.roles.axes[1])] = second
        return q[self.clear(q)]

    def turned(self, q: Floats, turret: float) -> Floats:
        """Return postures with the turret at an angle (rad); unchanged without a turret."""
        if self.roles.turret is None:
            return q
        turned = q.copy()
        turned[..., self.robot.joint_names.index(self.roles.turret)] = turret
        return turned

    def turret(self, q: Floats) -> float:
        """Return the turret's angle (rad) in a posture (j,); 0 without a turret."""
        name = self.roles.turret
        return 0.0 if name is None else float(q[self.robot.joint_names.index(name)])

    def clear(self, q: Floats) -> Mask:
        """Return whether arm and load touch neither ground nor deck (...,), for `q` (..., j)."""
        points = self._points(q)
        feet = np.array([c.position for c in self.robot.contacts if c.link == self.robot.root])
        low, high = feet.min(axis=0) - AROUND, feet.max(axis=0) + AROUND
        deck = points[..., 0, 2, None]
        over = (points[..., :2] > low[:2]).all(axis=-1) & (points[..., :2] < high[:2]).all(axis=-1)
        bad = over & (points[..., 2] < deck + CLEARANCE)
        columns = [np.asarray(x) for x in np.moveaxis(q, -1, 0)]
        height = clearance(mechanics_of(self.robot), None, columns, self.robot.payload.cog)
        good: Mask = ~bad[..., 1:].any(axis=-1) & (height >= CLEARANCE)
        return good

    def chain(self, q: Floats) -> Floats:
        """Return the arm's joints and the load as points (k, 3) in m, `base_link`, for `q` (j,)."""
        found: Floats = self._points(q)[: len(self.roles.axes) + 1]
        return found

    def _points(self, q: Floats) -> Floats:
        """Return points along the arm from shoulder to load (..., k, 3) in m, `base_link`."""
        chain = _chain(self.robot, self.robot.payload_link or self.robot.root)[::-1]
        ends = [c for c in chain if c in (*self.roles.axes,)]
        places = [Contact(n, self.robot.joint(n).child, (0.0, 0.0, 0.0)) for n in ends]
        grip = Contact('grip', str(self.robot.payload_link), self.robot.payload.cog)
        seen = replace(self.robot, contacts=(*places, grip))
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
        largest: Floats = np.abs(self.share).max(axis=-1)
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
