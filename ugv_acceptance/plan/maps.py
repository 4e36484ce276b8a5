"""The safe maps printed with a plan: tilt left and torque used over both arm joints."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ugv_acceptance.model.robot import Joint
from ugv_acceptance.plan.plan import Plan
from ugv_acceptance.plan.search import STEP_DEG, Arm, look
from ugv_acceptance.report.format import short_name
from ugv_acceptance.report.regions import degree_axes, draw_regions, figure, legend, svg_of
from ugv_acceptance.studies.maps import Levels
from ugv_acceptance.type_aliases import Floats

# Steps (deg) of the map; a joint's range in it.
MAP_STEP, MAP_RANGE = 3.0, (-180.0, 181.0)


def safe_maps(
    arm: Arm, plan: Plan, visited: Mapping[str, Sequence[float]] | None = None
) -> list[dict[str, str]]:
    """Return the maps of tilt left and torque used over both arm joints, a page's row per load.

    The numbers on them are the plan's steps on level ground with that load; H is home. `visited`
    are the cells of a run's coverage: first joint (deg) -> second joint (deg).
    """
    if not arm.varied:
        return []
    cells = [(float(a), b) for a, row in (visited or {}).items() for b in row]
    limits, full = arm.settings.limits, arm.robot.payload.mass
    x, y = (_axis(arm.robot.joint(name)) for name in arm.varied)
    q = np.broadcast_to(arm.folded, (len(x), len(y), len(arm.folded))).copy()
    first, second = arm.columns
    q[..., first], q[..., second] = x[:, None], y
    maps = []
    for load in dict.fromkeys((0.0, full / 2.0, full)):
        found = look(arm, q.reshape(-1, q.shape[-1]), ('level', 0.0), load)
        tilt = np.degrees(found.tilt).reshape(len(x), -1)
        use = found.most.reshape(len(x), -1)
        bounds = Levels(math.degrees(limits.tip_warn), math.degrees(limits.tip_error))
        torque = Levels(1.0 - limits.torque_warn, 1.0 - limits.torque_error)
        marks = _marks(arm, plan, load)
        fields = ((tilt, bounds), (1.0 - use, torque))
        maps.append(_drawn(arm, (x, y), fields, load, (marks, cells)))
    return maps


def standing_words(arm: Arm) -> str:
    """Return how the joints stand that the safe map does not vary."""
    turret = 'turret ahead' if arm.turret_joint is not None else ''
    others = sorted({*arm.robot.joint_names} - {*arm.varied, *arm.roles.flippers})
    rest = 'the other joints at rest' if len(others) > bool(turret) else ''
    flippers = 'flippers folded' if arm.roles.flippers else ''
    words = ', '.join(word for word in (turret, flippers, rest, 'level ground') if word)
    return words[0].upper() + words[1:]


def _axis(joint: Joint) -> Floats:
    """Return the positions (n,) in rad of a joint along a map: its range, one turn at most."""
    low, high = (math.degrees(end) for end in (joint.lower, joint.upper))
    start, end = max(low, MAP_RANGE[0]), min(high + MAP_STEP / 2.0, MAP_RANGE[1])
    axis: Floats = np.radians(np.arange(start, end, MAP_STEP))
    return axis


def _marks(arm: Arm, plan: Plan, load: float) -> list[tuple[float, float, str]]:
    """Return positions (deg) of both joints and a label, for home and each step on level ground."""
    first, second = arm.varied
    held = [
        s
        for s in plan.steps
        if s.action == 'hold' and not s.ground.tilt_deg and s.payload_kg == round(load, 3)
    ]
    found = [(plan.home_deg[first], plan.home_deg[second], 'H')]
    for step in held:
        at = {**plan.home_deg, **step.posture_deg}
        found.append((at[first], at[second], step.id.partition('-')[0]))
    return found


def _drawn(
    arm: Arm,
    axis: tuple[Floats, Floats],
    fields: Any,  # noqa: ANN401 - arrays
    load: float,
    on_it: tuple[Sequence[tuple[float, float, str]], Sequence[tuple[float, float]]],
) -> dict[str, str]:
    marks, cells = on_it
    made = figure(7.4, 3.1)
    first, second = (short_name(name.removesuffix('_joint'), 40) for name in arm.varied)
    for k, (title, (margin, levels)) in enumerate(
        zip(('tip-over', 'motor torque'), fields, strict=True), 1
    ):
        axes = made.add_subplot(1, 2, k)
        x_deg, y_deg = (np.degrees(values) for values in axis)
        draw_regions(axes, x_deg, y_deg, margin, levels)
        degree_axes(axes, first, second)
        axes.set_title(title)
        if cells:
            x, y = (np.array(cells) + STEP_DEG / 2.0).T
            axes.plot(x, y, 's', markersize=1.6, color='#1f4e8c')
        for x, y, word in marks:
            box = {'facecolor': 'white', 'edgecolor': 'black', 'pad': 1.0, 'linewidth': 0.5}
            axes.text(x, y, word, fontsize=6, ha='center', va='center', bbox=box)
    legend(made, loc='outside lower center', ncols=3)
    caption = f'{load:g} kg in the gripper' if load else 'gripper empty'
    if min(float(margin.min()) - levels.caution for margin, levels in fields) >= 0.0:
        caption += ': no limit is near, on level ground'
    return {'svg': svg_of(made, f'map{load:g}'.replace('.', '_')), 'caption': caption}
