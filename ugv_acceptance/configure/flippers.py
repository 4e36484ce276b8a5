"""Where a flipper comes to the ground: what hangs on the body on one joint and reaches so far."""

import math
from collections.abc import Sequence

import numpy as np

from ugv_acceptance.configure.carrying import MARKER, Notes
from ugv_acceptance.configure.collision import Solid
from ugv_acceptance.configure.posture import Posture
from ugv_acceptance.model.resting import Face
from ugv_acceptance.model.robot import Joint
from ugv_acceptance.model.tree import rotation_about
from ugv_acceptance.type_aliases import Floats

# Parts of a flipper are its lowest within this (m).
SAME = 0.001


def say_flippers(posture: Posture, face: Face, notes: Notes) -> None:
    """Name what hangs on the body on one joint and reaches the ground as that turns, and where."""
    up, base = np.array(face.normal), set(posture.rigid(posture.root))
    for link, joint in posture.above.items():
        if joint.kind in ('fixed', 'prismatic') or joint.parent not in base:
            continue
        own = [s for s in posture.solids if s.link in posture.rigid(link) and s.reach > MARKER]
        if posture.inner(link) or not own or abs(posture.axis(joint) @ up) > 0.5:
            continue
        angle = _reaching(posture, joint, own, face)
        if angle is None:
            continue
        points = [
            f'[{", ".join(f"{x:.5g}" for x in point)}]'
            for point in _tips(posture, joint, own, angle, up)
        ]
        notes.remarks.append(
            f'{link} reaches the ground as {joint.name} turns by {math.degrees(angle):.1f} deg: if '
            f'the robot ever stands on it, add to the contacts a point of {link} at '
            f'{" and ".join(points)}'
        )


def _turned(posture: Posture, joint: Joint, solid: Solid, angle: float) -> Solid:
    """Return a solid with a joint turned by an angle (rad)."""
    turn = np.array(rotation_about(_triple(posture.axis(joint)), angle), dtype=np.float64)
    origin = posture.frames[joint.child][1]
    return solid.placed(turn, origin - turn @ origin)


def _reaching(posture: Posture, joint: Joint, own: Sequence[Solid], face: Face) -> float | None:
    """Return the smallest turn (rad) at which geometry comes to the ground, within its travel."""
    up, at = np.array(face.normal), posture.positions.get(joint.name, 0.0)
    low, high = joint.travel()

    def height(angle: float) -> float:
        turned = (_turned(posture, joint, solid, angle) for solid in own)
        return min(face.height(one.lowest(up).tolist()) for one in turned)

    for angle in np.radians(np.arange(1, 181)):
        for sign in (-1.0, 1.0):
            if low <= at + sign * angle <= high and height(sign * angle) <= 0.0:
                near, far = sign * (angle - math.radians(1.0)), sign * angle
                for _ in range(40):
                    middle = (near + far) / 2.0
                    near, far = (near, middle) if height(middle) <= 0.0 else (middle, far)
                return float(far)
    return None


def _tips(
    posture: Posture, joint: Joint, own: Sequence[Solid], angle: float, up: Floats
) -> list[Floats]:
    """Return the middles (link axes, m) of what is lowest with a joint turned by an angle (rad)."""
    turned = [_turned(posture, joint, solid, angle) for solid in own]
    heights = [float(one.lowest(up) @ up) for one in turned]
    rotation, origin = posture.frames[joint.child]
    spin = np.array(rotation_about(_triple(posture.axis(joint)), angle), dtype=np.float64)
    return [
        (spin @ rotation).T @ (one.patch(up, SAME).mean(axis=0) - origin)
        for one, height in zip(turned, heights, strict=True)
        if height <= min(heights) + SAME
    ]


def _triple(v: Floats) -> tuple[float, float, float]:
    x, y, z = v.tolist()
    return x, y, z
