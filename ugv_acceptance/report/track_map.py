"""The map of two joints with the way the run took over it."""

import math

import numpy as np
from matplotlib.figure import Figure

from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.strips import Strips
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.report.regions import draw_regions, figure, legend
from ugv_acceptance.report.run_charts import Json, judged_joints, plain
from ugv_acceptance.studies.bilinear import Grid
from ugv_acceptance.studies.maps import Levels, rollover_map, torque_forms, utilisation_map

CELLS = 121


def track_map(strips: Strips, result: Json, settings: Settings) -> Figure | None:
    """Return the map of the two judged joints that moved most, with the run's track on it.

    All else - the other joints, attitude, payload - is as when the tilt left first broke its limit,
    else as when it was least. None where
    the robot has no two such joints or the run no known posture.
    """
    pair = _moving_pair(strips, settings)
    moment = _telling_moment(result)
    if pair is None or moment is None:
        return None
    grid = _grid(pair, moment, settings)
    gravity = _gravity(moment, settings.robot.gravity)
    payload = Payload(float(moment['payload_kg']), settings.robot.payload.cog)
    limits = np.array(settings.limits.torque)
    forms = torque_forms(settings.robot, grid, gravity, payload)
    load = 100.0 * utilisation_map(settings.robot, grid, forms, limits)
    tip = np.degrees(rollover_map(settings.robot, grid, gravity, payload).angle)
    made = figure(7.4, 3.7)
    left, right = made.subplots(1, 2, sharey=True)
    bounds = settings.limits
    torque_levels = Levels(-100.0 * bounds.torque_warn, -100.0 * bounds.torque_error)
    tip_levels = Levels(math.degrees(bounds.tip_warn), math.degrees(bounds.tip_error))
    for axes, margin, levels, words in (
        (left, -load, torque_levels, 'torque'),
        (right, tip, tip_levels, 'tip-over'),
    ):
        draw_regions(axes, np.degrees(grid.x), np.degrees(grid.y), margin, levels)
        q = np.degrees(strips.q[:, pair])
        axes.plot(q[:, 0], q[:, 1], color='#0072b2', lw=1.4)
        axes.plot(q[:1, 0], q[:1, 1], 'o', color='#0072b2', ms=4.0)
        axes.set_title(words)
        axes.set_xlabel(_axis_name(settings, pair[0]))
    left.set_ylabel(_axis_name(settings, pair[1]))
    areas = ('within limits', 'caution', 'beyond limits')
    legend(made, areas, loc='outside lower center', ncols=3)
    return made


def _axis_name(settings: Settings, joint: int) -> str:
    return plain(settings.robot.joint_names[joint]) + ' (deg)'


def _moving_pair(strips: Strips, settings: Settings) -> list[int] | None:
    turning = [
        j
        for j in judged_joints(settings)
        if settings.robot.joint(settings.robot.joint_names[j]).kind != 'prismatic'
    ]
    known = strips.q[np.isfinite(strips.q).all(axis=1)]
    if len(turning) < 2 or len(known) < 2:
        return None
    order = sorted(turning, key=lambda j: -float(np.ptp(known[:, j])))
    return sorted(order[:2])


def _telling_moment(result: Json) -> Json | None:
    """Return when the tilt left first broke its limit, else when it was least."""
    for outcome in result['criteria']['results']:
        measured = outcome['measured']
        if measured.get('signal') == 'tip_angle' and measured['moment'] is not None:
            found: Json = measured['first_violation'] or measured['moment']
            return found
    return None


def _gravity(moment: Json, g: float) -> tuple[float, float, float]:
    roll, pitch = math.radians(moment['roll_deg']), math.radians(moment['pitch_deg'])
    return (
        g * math.sin(pitch),
        -g * math.cos(pitch) * math.sin(roll),
        -g * math.cos(pitch) * math.cos(roll),
    )


def _grid(pair: list[int], moment: Json, settings: Settings) -> Grid:
    q = np.array([x['position'] for x in moment['joints'].values()])
    turning = [
        settings.robot.joint(name).kind != 'prismatic' for name in settings.robot.joint_names
    ]
    q = np.where(turning, np.radians(q), q)
    x, y = (np.linspace(*_range(settings, j), CELLS) for j in pair)
    return Grid(pair[0], pair[1], x, y, q)


def _range(settings: Settings, joint: int) -> tuple[float, float]:
    limits = settings.robot.joint(settings.robot.joint_names[joint])
    low, high = limits.lower, limits.upper
    if not math.isfinite(low + high) or high - low > 2.0 * math.pi:
        return -math.pi, math.pi
    return low, high
