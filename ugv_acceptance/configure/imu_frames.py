"""Where the frame that an IMU's messages name is on the robot, by its URDF and /tf_static."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.draft import CERTAIN, CHECK, Derived
from ugv_acceptance.configure.evidence import StaticTransform
from ugv_acceptance.evaluation.inputs.frames import Transform, link_of, place_of
from ugv_acceptance.model.expressions import matmul
from ugv_acceptance.model.robot import ZERO, Matrix, Robot, Vector
from ugv_acceptance.model.tree import plain

# How far (rad) URDF and /tf_static may differ.
_SAME = math.radians(2.0)


@dataclass(frozen=True, slots=True)
class Placed:
    """A frame on the root link: `rotation` of its axes, None if nothing tells; its position.

    `source` says what tells, `sure` that this is the frame that messages name. `other` is what
    /tf_static says where that differs. `joints` are the movable joints between root and frame.
    """

    link: str
    rotation: Matrix | None
    position: Derived[Vector]
    source: str = ''
    sure: bool = False
    other: Matrix | None = None
    joints: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


def placed(
    urdf: Urdf,
    frame: str | None,
    posture: Mapping[str, float],
    transforms: Sequence[StaticTransform],
) -> Placed:
    """Return where a frame is in the root link's axes with the joints at `posture` (rad, m).

    `frame` None: of an IMU of which no message was seen. A frame that neither URDF nor /tf_static
    knows is taken for the URDF's link of an IMU.
    """
    robot, told = (
        _still(urdf, posture),
        [(t.parent, t.child, t.xyz, t.rotation) for t in transforms],
    )
    if frame is None:
        return _named(urdf, robot, '')
    bare = frame.lstrip('/')
    link = link_of(robot, bare) if bare else None
    if link is None:
        link = _prefixed(robot, bare)
    if link is not None:
        return _on_link(urdf, robot, link, frame, told)
    place = place_of(robot, bare, told) if bare else None
    if place is not None:
        steps = ' - '.join(place.steps)
        joints = _joints(urdf, place.steps)
        return Placed(
            bare, place.rotation, Derived(place.xyz, CERTAIN, f'/tf_static ({steps})'),
            f'/tf_static ({steps})', sure=True, joints=joints, remarks=_moves(bare, joints),
        )  # fmt: skip
    return _named(urdf, robot, frame)


def _still(urdf: Urdf, posture: Mapping[str, float]) -> Robot:
    """Return the robot as one body, with all joints held at a posture; those left out at 0."""
    at = {joint.name: posture.get(joint.name, 0.0) for joint in urdf.joints}
    for _ in urdf.mimics:  # one may follow another
        at |= {m.joint: m.multiplier * at[m.follows] + m.offset for m in urdf.mimics}
    return Robot(urdf.name, urdf.links, urdf.joints, (), held=tuple(at.items()))


def _on_link(urdf: Urdf, robot: Robot, link: str, frame: str, told: Sequence[Transform]) -> Placed:
    place = place_of(robot, link)
    joints = _joints(urdf, (link,))
    remarks = list(_moves(link, joints))
    if place is None:
        return Placed(link, None, Derived(ZERO, CHECK, 'not known'), joints=joints)
    other = _by_transforms(robot, frame.lstrip('/'), told)
    if other is not None and turn_between(place.rotation, other) <= _SAME:
        other = None
    if other is not None:
        remarks.append(f'the URDF and /tf_static disagree on how {link} is turned')
    sure = link == frame.lstrip('/') or frame.endswith(f'/{link}')
    source = f"the URDF's link {link}"
    position = Derived(place.xyz, CERTAIN if sure else CHECK, source)
    return Placed(link, place.rotation, position, source, sure, other, joints, tuple(remarks))


def _by_transforms(robot: Robot, frame: str, told: Sequence[Transform]) -> Matrix | None:
    """Return how /tf_static turns a frame that is a link too; None if it does not tell."""
    for parent, child, _, rotation in told:
        if child == frame and (place := place_of(robot, parent, told)) is not None:
            return _plain(matmul(place.rotation, rotation))
    return None


def _named(urdf: Urdf, robot: Robot, frame: str) -> Placed:
    """Return where the URDF has a link on which the frame is, or that is called after an IMU."""
    links = [link.name for link in urdf.links]
    on = [part for part in frame.split('/')[-2::-1] if part in links] if frame else []
    imus = sorted((name for name in links if _is_imu(name)), key=len)
    if not on and not imus:
        none = f'no link and no transform is called {frame!r}' if frame else 'no link of an IMU'
        position = Derived(ZERO, CHECK, f'{none}: assumed at the origin of {robot.root}')
        return Placed('', None, position)
    chosen = (on or imus)[0]
    found = _on_link(urdf, robot, chosen, chosen, ())
    remarks = list(found.remarks)
    if frame and on:
        remarks.append(f'the frame {frame} is assumed to have the axes of the link {chosen}')
    elif frame:
        remarks.append(f'no link and no transform is called {frame}: {chosen} is used')
    if not on and len(imus) > 1:
        remarks.append(f'several links have the name of an IMU: {", ".join(imus)}')
    position = Derived(found.position.value, CHECK, found.source)
    return Placed(
        chosen,
        found.rotation,
        position,
        found.source,
        not frame,
        None,
        found.joints,
        tuple(remarks),
    )


def _prefixed(robot: Robot, bare: str) -> str | None:
    """Return the one link whose name is a frame's with a prefix of the robot's before it."""
    found = [x.name for x in robot.links if bare and x.name.endswith((f'_{bare}', f'/{bare}'))]
    return found[0] if len(found) == 1 else None


def _is_imu(name: str) -> bool:
    return any(part.startswith('imu') for part in re.split(r'[^a-z0-9]+', name.casefold()))


def _joints(urdf: Urdf, steps: Sequence[str]) -> tuple[str, ...]:
    """Return the movable joints between the root and the first link among `steps`."""
    above = {joint.child: joint for joint in urdf.joints}
    links = {link.name for link in urdf.links}
    at, found = next((step for step in steps if step in links), ''), list[str]()
    while at in above:
        found += [above[at].name] if above[at].kind != 'fixed' else []
        at = above[at].parent
    return tuple(found[::-1])


def _moves(link: str, joints: Sequence[str]) -> tuple[str, ...]:
    if not joints:
        return ()
    return (f'{link} is moved by {", ".join(joints)}: its mounting is right in this posture only',)


def _plain(matrix: Sequence[Sequence[object]]) -> Matrix:
    a, b, c = (plain(row) for row in matrix)  # type: ignore[arg-type]  # numbers in and out
    return (a, b, c)


def turn_between(one: Matrix, other: Matrix) -> float:
    """Return the angle (rad) by which two rotations differ."""
    trace = sum(a * b for r, s in zip(one, other, strict=True) for a, b in zip(r, s, strict=True))
    return math.acos(max(-1.0, min(1.0, 0.5 * (trace - 1.0))))


def rpy_of(rotation: Matrix) -> Vector:
    """Return roll, pitch and yaw (rad) about fixed axes, as in a URDF, of a rotation matrix.

    Where the pitch is 90 degrees the yaw takes all of what roll and yaw are together.
    """
    (a, b, _), (d, e, _), (g, h, i) = rotation
    pitch = math.atan2(-g, math.hypot(a, d))
    if math.hypot(a, d) > 1e-9:
        return (math.atan2(h, i), pitch, math.atan2(d, a))
    return (0.0, pitch, math.atan2(-b, e))
