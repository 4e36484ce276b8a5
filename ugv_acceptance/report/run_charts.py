"""Charts of a run over time: margins with their limits, and the alerts below them."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ugv_acceptance.evaluation.downsampling import Strips
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.report.alert_lines import worst_time
from ugv_acceptance.report.regions import draw_regions, figure, legend
from ugv_acceptance.studies.bilinear import Grid
from ugv_acceptance.studies.maps import Levels, rollover_map, torque_forms, utilisation_map
from ugv_acceptance.type_aliases import Floats, Json

# Colour-blind safe, and told apart by dashes as well.
LINES = (('#0072b2', '-'), ('#d55e00', '--'), ('#009e73', '-.'), ('#cc79a7', ':'), ('#56b4e9', '-'))
ALERT_COLOURS = {'WARN': '#e69f00', 'ERROR': '#d55e00', 'STALE': '#7f7f7f'}
ALERT_HATCHES = {'WARN': '', 'ERROR': '////', 'STALE': '..'}
# Points drawn; more are reduced to the worst of each group.
MOST_POINTS = 1500


def judged_joints(settings: Settings) -> list[int]:
    """Return the indices of the joints with a torque limit."""
    return [j for j, limit in enumerate(settings.limits.torque) if math.isfinite(limit)]


def run_chart(
    strips: Strips, result: Json, settings: Settings, window: tuple[float, float] | None = None
) -> Figure | None:
    """Return a chart of a run's margins over time, or in a window (s); None if none are known."""
    start, end = window or (0.0, result['coverage']['duration_s'])
    rows = (strips.time >= start - 0.1) & (strips.time <= end + 0.1)
    if not rows.any():
        return None
    alerts = [a for a in result['alerts'] if a['start_s'] <= end and _end(a, end) >= start]
    kinds = list(dict.fromkeys((a['code'], a['subject']) for a in alerts))[:8]
    made = figure(7.4, 3.6 + 0.22 * len(kinds))
    heights = [2.0, 2.0, 0.3 + 0.3 * len(kinds)]
    torque, tip, strip = made.subplots(3, 1, sharex=True, height_ratios=heights)
    time, picks = strips.time[rows], _thinned(int(rows.sum()))
    _draw_torque(torque, time, strips.torque[rows], settings, picks)
    _draw_tip(tip, time, strips.angle[rows], settings, picks)
    _draw_alerts(strip, alerts, kinds, end)
    for axes in (torque, tip):
        _shade_unknown(axes, result, end)
        axes.grid(visible=True, linewidth=0.3)
    strip.set_xlim(start, max(end, start + 1e-3))
    strip.set_xlabel('time since the start of the recording (s)')
    return made


def _end(alert: Json, otherwise: float) -> float:
    return otherwise if alert['end_s'] is None else float(alert['end_s'])


def _thinned(count: int) -> NDArray[np.intp]:
    """Return the first column of each group of columns that is drawn as one point."""
    return np.arange(0, count, max(1, math.ceil(count / MOST_POINTS)))


def _draw_torque(
    axes: Axes, time: Floats, torque: Floats, settings: Settings, picks: NDArray[np.intp]
) -> None:
    joints = judged_joints(settings)
    for (colour, dashes), j in zip(LINES * len(joints), joints, strict=False):
        share = np.fmax.reduceat(torque[:, j], picks) / settings.limits.torque[j]
        name = plain(settings.robot.joint_names[j])
        axes.plot(time[picks], 100.0 * share, color=colour, linestyle=dashes, lw=1.1, label=name)
    _limit(axes, 100.0 * settings.limits.torque_error, 'DANGER')
    axes.axhline(100.0 * settings.limits.torque_warn, color='#777777', lw=0.7, ls=':')
    axes.set_ylim(0.0, 1.3 * axes.get_ylim()[1])
    axes.set_ylabel('torque (% of limit)')
    if joints:
        axes.legend(loc='upper left', ncols=3, fontsize=7.0)


def _draw_tip(
    axes: Axes, time: Floats, angle: Floats, settings: Settings, picks: NDArray[np.intp]
) -> None:
    worst = np.degrees(np.fmin.reduceat(angle, picks))
    axes.plot(time[picks], np.where(np.isfinite(worst), worst, np.nan), color='#0072b2', lw=1.1)
    _limit(axes, math.degrees(settings.limits.tip_error), 'DANGER')
    axes.axhline(math.degrees(settings.limits.tip_warn), color='#777777', lw=0.7, ls=':')
    axes.set_ylabel('to tipping (deg)')


def _limit(axes: Axes, at: float, word: str) -> None:
    axes.axhline(at, color='black', lw=1.0)
    axes.annotate(
        word, (1.0, at), xycoords=('axes fraction', 'data'), fontsize=7.0, ha='right', va='bottom'
    )


def _shade_unknown(axes: Axes, result: Json, end: float) -> None:
    """Hatch the gaps of an input, in which no margins were known."""
    for key in ('joint_states', 'imu'):
        for first, last in result['inputs'][key]['first_gaps_s']:
            if first <= end:
                axes.axvspan(
                    first, last, facecolor='#dddddd', edgecolor='#999999', hatch='..', lw=0.0
                )


def _draw_alerts(axes: Axes, alerts: list[Json], kinds: list[tuple[str, str]], end: float) -> None:
    """Draw a lane for each of `kinds`; all alerts of a lane and level are one collection."""
    bars: dict[tuple[int, str], list[tuple[float, float]]] = {}
    worst: dict[int, list[float]] = {}
    lanes = {kind: lane for lane, kind in enumerate(kinds)}
    for alert in alerts:
        lane = lanes.get((alert['code'], alert['subject']))
        if lane is None:
            continue
        start, at = alert['start_s'], worst_time(alert)
        span = start, max(_end(alert, end) - start, 0.0)
        bars.setdefault((lane, alert['level']), []).append(span)
        if at is not None:
            worst.setdefault(lane, []).append(at)
    # A danger begins as a caution, so that it is drawn over it.
    for lane, level in sorted(bars, key=lambda of: of[1] != 'WARN'):
        height = 0.7 if level == 'ERROR' else 0.4
        axes.broken_barh(
            bars[lane, level],
            (lane - height / 2.0, height),
            facecolors=ALERT_COLOURS.get(level, '#777777'),
            hatch=ALERT_HATCHES.get(level, ''),
            edgecolor='black',
            linewidth=0.4,
        )
    for lane, times in worst.items():
        axes.plot(times, [lane] * len(times), 'v', color='black', markersize=4.0)
    names = [plain(f'{code} {subject}') for code, subject in kinds]
    axes.set_yticks(range(len(kinds)), names, fontsize=6.5)
    axes.set_ylim(len(kinds) - 0.4, -0.6)
    if not kinds:
        axes.set_yticks([0], ['no alerts'], fontsize=6.5)


def plain(name: str) -> str:
    """Return a name short enough for a label, with matplotlib's math sign `$` escaped."""
    return name.replace('$', r'\$')[:40]


CELLS = 121


def track_map(strips: Strips, result: Json, settings: Settings) -> Figure | None:
    """Return the map of the two judged joints that moved most, with the run's path on it.

    The other joints, attitude and payload are as when the tilt left first passed its limit, else
    as when it was least. None where the robot has no two such joints or the run no known posture.
    """
    pair = _moving_pair(strips, settings)
    moment = _telling_moment(result)
    if pair is None or moment is None:
        return None
    grid = _grid(pair, moment, settings)
    gravity = gravity_of(moment, settings.robot.gravity)
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
    areas = ('OK', 'CAUTION', 'DANGER')
    legend(made, areas, loc='outside lower center', ncols=3)
    return made


def _axis_name(settings: Settings, joint: int) -> str:
    return plain(settings.robot.joint_names[joint]) + ' (deg)'


def _moving_pair(strips: Strips, settings: Settings) -> list[int] | None:
    turning = [
        j
        for j in judged_joints(settings)
        if not settings.robot.joint(settings.robot.joint_names[j]).slides
    ]
    known = strips.q[np.isfinite(strips.q).all(axis=1)]
    if len(turning) < 2 or len(known) < 2:
        return None
    order = sorted(turning, key=lambda j: -float(np.ptp(known[:, j])))
    return sorted(order[:2])


def _telling_moment(result: Json) -> Json | None:
    """Return the margins when the tilt left first passed its limit, else when it was least."""
    for outcome in result['criteria']['results']:
        measured = outcome['measured']
        if measured.get('signal') == 'tip_angle' and measured['moment'] is not None:
            found: Json = measured['first_violation'] or measured['moment']
            return found
    return None


def gravity_of(moment: Json, g: float) -> tuple[float, float, float]:
    """Return gravity (m/s2, `base_link`) of a result's moment; `g` is its size."""
    roll, pitch = math.radians(moment['roll_deg']), math.radians(moment['pitch_deg'])
    return (
        g * math.sin(pitch),
        -g * math.cos(pitch) * math.sin(roll),
        -g * math.cos(pitch) * math.cos(roll),
    )


def positions_of(moment: Json, settings: Settings) -> Floats:
    """Return the joint positions (j,), rad or m, of a result's moment."""
    q = np.array([x['position'] for x in moment['joints'].values()], dtype=np.float64)
    turning = [not settings.robot.joint(name).slides for name in settings.robot.joint_names]
    found: Floats = np.where(turning, np.radians(q), q)
    return found


def _grid(pair: list[int], moment: Json, settings: Settings) -> Grid:
    q = positions_of(moment, settings)
    x, y = (np.linspace(*_range(settings, j), CELLS) for j in pair)
    return Grid(pair[0], pair[1], x, y, q)


def _range(settings: Settings, joint: int) -> tuple[float, float]:
    low, high = settings.robot.joint(settings.robot.joint_names[joint]).travel()
    return (low, high) if high - low <= 2.0 * math.pi else (-math.pi, math.pi)
