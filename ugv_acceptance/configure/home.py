"""The posture from which a robot is described, and the link that carries its load."""

import math
import re
from collections.abc import Mapping

from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.draft import ASK, CERTAIN, CHECK, Derived, Joints
from ugv_acceptance.configure.evidence import Evidence
from ugv_acceptance.model.robot import Joint, Robot
from ugv_acceptance.model.roles import chain_to, roles_of

# Names of links that carry loads, best first: they only decide between links of one body.
_NAMES = tuple(
    re.compile(pattern)
    for pattern in (r'tool|tcp', r'(^|_)ee(f|_|$)|end_?eff', r'grip|grasp|hand|palm', r'flange')
)
# A gripper's fingers have so many joints each at most.
_PHALANGES = 3


def home_posture(
    urdf: Urdf, joints: Joints, evidence: Evidence | None
) -> dict[str, Derived[float]]:
    """Return the position (rad, m) of every movable joint from which the robot is described.

    Of measured joints that at rest in the recording, of others where they are held; else 0, or the
    middle of the range where 0 is outside of it. Joints that follow others are left out.
    """
    seen = {joint.topic_name: joint.at_rest for joint in evidence.joints} if evidence else {}
    told = {joint.name: seen.get(joint.topic_name, math.nan) for joint in joints.measured}
    held = dict(joints.held)
    follows = {mimic.joint for mimic in urdf.mimics}
    found: dict[str, Derived[float]] = {}
    for joint in urdf.joints:
        if joint.kind == 'fixed' or joint.name in follows:
            continue
        at = told.get(joint.name, math.nan)
        if evidence is not None and math.isfinite(at):
            found[joint.name] = Derived(at, CERTAIN, f'at rest in {evidence.where}')
        elif joint.name in held:
            found[joint.name] = held[joint.name]
        else:
            found[joint.name] = _within(joint)
    return found


def _within(joint: Joint) -> Derived[float]:
    if joint.lower <= 0.0 <= joint.upper:
        return Derived(0.0, CHECK, 'the zero posture: no recording tells another')
    middle = (joint.lower + joint.upper) / 2.0
    return Derived(middle, CHECK, 'the middle of its range, which does not hold 0')


def positions(home: Mapping[str, Derived[float]]) -> dict[str, float]:
    """Return a posture as plain positions (rad, m)."""
    return {name: one.value for name, one in home.items() if one.value is not None}


def payload_link(robot: Robot) -> Derived[str]:
    """Return the link that carries the load: at the end of the longest chain of measured joints.

    Wheels, legs and flippers are no such chain. Of a gripper it is the palm that carries the
    fingers. Value None with the grade CHECK: there is no arm.
    """
    arm = roles_of(robot).arm
    if not arm:
        return Derived(None, CHECK, 'no chain of measured joints that lifts a load')
    at, fingers = _palm(robot, arm)
    fixed = [robot.joint(name) for name in arm]
    ends = _fixed_to(robot, at)
    rivals = _rivals(robot, arm)
    link, why = _best(robot, at, ends)
    source = f'the end of {" -> ".join(_few(arm))}' + (', which carries the fingers' * fingers)
    if rivals:
        return Derived(link, ASK, f'{source}; but {rivals[0]} ends a chain as long')
    return Derived(link, CHECK if fixed else ASK, source + why)


def _few(names: tuple[str, ...]) -> tuple[str, ...]:
    return names if len(names) <= 3 else (names[0], '...', names[-1])


def _palm(robot: Robot, arm: tuple[str, ...]) -> tuple[str, bool]:
    """Return the last link of an arm before it parts into fingers, and whether it does."""
    movable = [joint for joint in robot.joints if joint.kind != 'fixed']
    for back, name in enumerate(reversed(arm[-_PHALANGES:])):
        body = _body(robot, robot.joint(name).parent)
        others = [j for j in movable if j.name != name and j.parent in body]
        chain = chain_to(robot, robot.joint(name).child)
        if any(j.name not in chain for j in others) and len(arm) > back + 1:
            return robot.joint(arm[-back - 2]).child, True
    return robot.joint(arm[-1]).child, False


def _body(robot: Robot, link: str) -> set[str]:
    """Return the links that are rigidly joined to a link, itself included."""
    found, grown = {link}, True
    fixed = [joint for joint in robot.joints if joint.kind == 'fixed']
    while grown:
        grown = False
        for joint in fixed:
            if (joint.parent in found) != (joint.child in found):
                found |= {joint.parent, joint.child}
                grown = True
    return found


def _fixed_to(robot: Robot, link: str) -> tuple[str, ...]:
    """Return a link and all that hang on it by fixed joints, nearest first."""
    found = [link]
    for name in found:
        found += [j.child for j in robot.joints if j.parent == name and j.kind == 'fixed']
    return tuple(found)


def _best(robot: Robot, at: str, ends: tuple[str, ...]) -> tuple[str, str]:
    """Return which of the links of the last body carries, and how that was chosen."""
    for name in _NAMES:
        named = [link for link in ends if name.search(link.lower())]
        if named:
            return named[0], ', by its name among links of one body' * (len(ends) > 1)
    parents = {joint.parent for joint in robot.joints}
    leaves = [link for link in ends if link not in parents]
    return (leaves[0], '') if len(leaves) == 1 else (at, '')


def _rivals(robot: Robot, arm: tuple[str, ...]) -> list[str]:
    """Return the ends of other chains of as many measured joints that share none with the arm."""
    roles = roles_of(robot)
    other = {*roles.legs, *roles.flippers, *roles.wheels, *arm}
    found = []
    for link in robot.links:
        own = [n for n in chain_to(robot, link.name) if n in robot.joint_names]
        if len(own) >= len(arm) and not set(own) & other:
            found.append(link.name)
    return found
