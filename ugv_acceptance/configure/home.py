"""The link that carries the load of a robot, found in its tree; postures as plain numbers."""

import re
from collections.abc import Mapping

from ugv_acceptance.configure.draft import ASK, CHECK, Derived
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.roles import chain_to, roles_of

# Names of links that carry loads, best first: they only decide between links of one body.
_NAMES = tuple(
    re.compile(pattern)
    for pattern in (r'tool|tcp', r'(^|_)ee(f|_|$)|end_?eff', r'grip|grasp|hand|palm', r'flange')
)
# A gripper's fingers have so many joints each at most.
_PHALANGES = 3
# A chain of so many measured joints may be an arm, though none of them lifts; a head has two.
_SEVERAL = 3


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
        ends = _rivals(robot, _SEVERAL)
        if not ends:
            return Derived(None, CHECK, 'no chain of measured joints that lifts a load')
        return Derived(ends[-1], ASK, f'{ends[-1]} ends a chain of joints, none of which lifts')
    at, fingers = _palm(robot, arm)
    fixed = [robot.joint(name) for name in arm]
    ends = _fixed_to(robot, at)
    rivals = _rivals(robot, len(arm), arm)
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


def _rivals(robot: Robot, length: int, arm: tuple[str, ...] = ()) -> list[str]:
    """Return the ends of other chains of as many measured joints that share none with the arm."""
    roles = roles_of(robot)
    other = {*roles.legs, *roles.flippers, *roles.wheels, *arm}
    found = []
    for link in robot.links:
        own = [n for n in chain_to(robot, link.name) if n in robot.joint_names]
        if len(own) >= length and not set(own) & other:
            found.append(link.name)
    return found
