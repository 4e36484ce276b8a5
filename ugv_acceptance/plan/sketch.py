"""A small drawing of a step's posture: the robot on its ground.

Drawn from the model's own points, so the picture cannot differ from the numbers beside it.
"""

import math

import numpy as np

from ugv_acceptance.plan.plan import Step
from ugv_acceptance.plan.search import Arm
from ugv_acceptance.studies.orientations import ORIENTATIONS
from ugv_acceptance.type_aliases import Floats

# Size of the picture (m of the robot's world: half width, above and below the ground's middle).
WIDE, HIGH, DEEP = 1.3, 1.45, 0.45
# How far (m) the load of the picture's robot reaches; how much higher its arm starts.
FAR, LIFTED = 1.19, 0.19
# Height (m) of the hull as it is drawn; radius of the load.
HULL, LOAD = 0.18, 0.05
# A turret turned by more than this (rad) is seen from behind.
ASIDE = math.radians(45.0)


def sketch(arm: Arm, q: Floats, step: Step) -> str:
    """Return an SVG of the posture `q` (j,) in rad on the step's ground, with its load."""
    aside = abs(math.sin(arm.heading(q))) > math.sin(ASIDE)
    size = size_of(arm)
    # From the left, the front is to the right; from behind, the robot's right is to the right.
    axis = 1 if aside else 0
    sign = -1.0 if aside else 1.0
    ground = arm.robot.ground
    points = [(sign * float(p[axis]) / size, (float(p[2]) - ground) / size) for p in arm.chain(q)]
    ends = (arm.feet[:, axis].min(), arm.feet[:, axis].max())
    low, high = sorted(sign * float(f) / size for f in ends)
    lean = _lean(step, aside=aside)
    parts = [
        f'<line x1="{-WIDE}" y1="0" x2="{WIDE}" y2="0" class="ground"/>',
        f'<rect x="{low:.3f}" y="{-HULL}" width="{high - low:.3f}" height="{HULL}" rx="0.06"/>',
        '<polyline points="{}"/>'.format(' '.join(f'{x:.3f},{-y:.3f}' for x, y in points)),
        *(f'<circle cx="{x:.3f}" cy="{-y:.3f}" r="0.025"/>' for x, y in points[:-1]),
    ]
    if step.payload_kg and points:
        x, y = points[-1]
        parts.append(f'<circle cx="{x:.3f}" cy="{-y:.3f}" r="{LOAD}" class="load"/>')
    view = 'from behind' if aside else 'from its right side'
    body = ''.join(parts)
    return (
        f'<svg viewBox="{-WIDE} {-HIGH} {2 * WIDE} {HIGH + DEEP}" role="img"'
        f' aria-label="the robot {view}"><line x1="{-WIDE}" y1="0" x2="{WIDE}" y2="0"'
        f' class="level"/><g transform="rotate({lean:.1f})">{body}</g>'
        f'<text x="{-WIDE + 0.05}" y="{-HIGH + 0.15}">{view}</text></svg>'
    )


def size_of(arm: Arm) -> float:
    """Return how much larger (times) the robot is than the picture's world, 1 for a PackBot."""
    ends = [np.abs(arm.feet[:, :2]).max()]
    if arm.varied:
        load = arm.points(arm.grid)[:, len(arm.ends)]
        ends += [np.abs(load[:, :2]).max(), (load[:, 2] - arm.robot.ground).max() - LIFTED]
    return float(max(ends)) / FAR


def _lean(step: Step, *, aside: bool) -> float:
    """Return how far (deg) the ground is turned clockwise in the picture."""
    heading = ORIENTATIONS[step.ground.orientation].heading
    if heading is None or not step.ground.tilt_deg:
        return 0.0
    towards = -math.sin(heading) if aside else math.cos(heading)
    tilt = math.radians(step.ground.tilt_deg)
    return math.degrees(math.atan(math.tan(tilt) * towards))
