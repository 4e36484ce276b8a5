"""How far the model itself may be off: the errors that all joints and postures share.

A mass that is 3 % off changes the torques of all joints in all postures together. Taken as
independent such errors look like loads that nobody carries.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ugv_acceptance.evaluation.criteria.uncertainty import (
    PAYLOAD,
    Source,
    torque_effects,
)
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.reactions import reactions_of
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.row_selection import pick
from ugv_acceptance.model.stability import many_stances, many_standing
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.type_aliases import Floats

# Where the configuration says nothing: share of a body's mass, its centre of gravity (m), the zero
# of a joint (rad, m).
MASS, COG, TURN, SLIDE = 0.03, 0.005, np.radians(1.0), 0.002
# Postures from which the largest static torques are found, and how far gravity may lean (m/s2).
DRAWN, LEAN = 400, 1.5
# A joint's size is at least this share of the arm's largest torque, and of its own limit.
LEAST = 0.01
# What a sliding joint without limits may travel (m), to either side.
HALF_SLIDE = 0.3


@dataclass(frozen=True, slots=True)
class Sizes:
    """Per joint the largest static torque without a load, and the most torque a kg makes (j,).

    `link` is where the load hangs: the payload link, or the end of the arm if `guessed`; None: the
    robot has no arm. `most` (kg) is the largest load that is considered.
    """

    torque: Floats
    lever: Floats
    link: str | None
    guessed: bool
    most: float


def sources_for(robot: Robot, configured: Sequence[Source]) -> tuple[Source, ...]:
    """Return the +/- on the numbers of the arm: the configured ones, and defaults for the others.

    The load's own mass is left out: it is what is asked for.
    """
    told = {(s.subject, s.what) for s in configured}
    own = [s for s in configured if (s.subject, s.what) != (PAYLOAD, 'mass')]
    tree, links = mechanics_of(robot).tree, {link.name: link for link in robot.links}
    found = [s for s in own if s.what in {'mass', 'cog', 'place', 'offset', 'roll', 'pitch'}]
    for k, body in enumerate(tree.bodies[1:], start=1):
        mine = [links[name] for name, frame in tree.frames.items() if frame[0] == k]
        heaviest = max(mine, key=lambda link: link.mass)
        if body.mass > 0.0 and not any((x.name, 'mass') in told for x in mine):
            found.append(Source('', heaviest.name, 'mass', MASS * body.mass))
        if body.mass > 0.0 and not any((x.name, 'cog') in told for x in mine):
            reach = COG * body.mass / heaviest.mass
            found += [Source('', heaviest.name, 'cog', reach, axis) for axis in range(3)]
        if body.joint in robot.joint_names and (body.joint, 'offset') not in told:
            found.append(Source('', body.joint, 'offset', SLIDE if body.prismatic else TURN))
    return tuple(found)


def arm_end(robot: Robot) -> str | None:
    """Return the link at the end of the longest chain of moving joints; None if none moves."""
    tree = mechanics_of(robot).tree
    depth = [0] * len(tree.bodies)
    for k, body in enumerate(tree.bodies[1:], start=1):
        depth[k] = depth[body.parent] + 1
    if len(depth) < 2:
        return None
    last = max(range(len(depth)), key=lambda k: (depth[k], tree.bodies[k].mass))
    parents = {joint.parent for joint in robot.joints}
    names = [name for name, frame in tree.frames.items() if frame[0] == last]
    return next((n for n in reversed(names) if n not in parents), names[-1])


def loaded(robot: Robot) -> tuple[Robot, bool]:
    """Return the robot with a link that can carry, and whether that link was only guessed."""
    if robot.payload_link is not None:
        return robot, False
    end = arm_end(robot)
    return (robot, True) if end is None else (replace(robot, payload_link=end), True)


def levers(robot: Robot, q: Floats, gravity: Floats) -> Floats:
    """Return the torque per kg of load (P, j), N m/kg (N/kg), in postures (P, j)."""
    cog = robot.payload.cog
    one, none = (static_torque(robot, q, gravity, Payload(m, cog)) for m in (1.0, 0.0))
    found: Floats = one - none
    return found


@lru_cache(maxsize=8)
def sizes_of(robot: Robot, limits: tuple[float, ...] = ()) -> Sizes:
    """Return how large a robot's static torques are, from random postures within its limits."""
    carrying, guessed = loaded(robot)
    rng = np.random.default_rng(5)
    ends = [robot.joint(name).travel(HALF_SLIDE) for name in robot.joint_names]
    low, high = np.array(ends).reshape(-1, 2).T
    q = rng.uniform(np.maximum(low, -np.pi), np.minimum(high, np.pi), (DRAWN, len(ends)))
    gravity = np.array((0.0, 0.0, -robot.gravity)) + LEAN * rng.normal(size=(DRAWN, 3))
    empty = Payload(0.0, robot.payload.cog)
    torque = np.abs(static_torque(carrying, q, gravity, empty)).max(axis=0, initial=0.0)
    lever = np.abs(levers(carrying, q, gravity)).max(axis=0, initial=0.0)
    told = np.where(np.isfinite(limits), limits, 0.0) if limits else np.zeros(len(ends))
    top = torque.max(initial=0.0)
    torque = np.maximum(torque, LEAST * np.maximum(np.maximum(told, top), 1e-6))
    feels = lever > 0.05 * lever.max(initial=0.0)
    most = 3.0 * float((torque[feels] / lever[feels]).max(initial=0.0))
    most = max(most, 2.0 * robot.payload.mass)
    return Sizes(torque, lever, carrying.payload_link, guessed, most)


def model_errors(
    robot: Robot, sources: Sequence[Source], q: Floats, gravity: Floats, load: float
) -> Floats:
    """Return the effect (s, P, j) of each source on the static torques in postures (P, j)."""
    effects = torque_effects(robot, sources, q, gravity, Payload(load, robot.payload.cog))
    found: Floats = effects[np.abs(effects).max(axis=(1, 2), initial=0.0) > 0.0]
    return found


def spread_errors(robot: Robot, q: Floats, gravity: Floats, load: float) -> Floats:
    """Return how far (s, P, j) joints that carry may be off the even spread of the weight.

    Evenly distributed over what balance leaves open, in each of P postures (P, j) by itself.
    """
    mechanics, count = mechanics_of(robot), len(q)
    if not mechanics.carried or not count:
        return np.zeros((0, *q.shape))
    posture = posture_of(mechanics, list(q.T), load, robot.payload.cog)
    wide = np.zeros(q.shape)
    down: Any = tuple(gravity.T)
    stances = many_stances(mechanics, posture, count)
    for rows, stance in many_standing(stances, count, np.arange(count), down):
        fields = posture.torque_gradients, posture.mass, posture.cog, posture.contacts
        some = type(posture)(*pick((*fields, posture.loads, posture.laws), rows))
        found = reactions_of(mechanics, some, stance.points, pick(down, rows))
        for j in found.carrying:
            wide[rows, j] = (found.most[j] - found.least[j]) / np.sqrt(12.0)
    postures, joints = np.nonzero(wide)
    errors = np.zeros((len(postures), *q.shape))
    errors[np.arange(len(postures)), postures, joints] = wide[postures, joints]
    return errors
