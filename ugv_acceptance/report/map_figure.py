"""Writes a map as a picture or as a CSV file."""

import csv
import io
import math
from collections.abc import Callable
from textwrap import wrap
from typing import BinaryIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from ugv_acceptance.model.robot import Robot
from ugv_acceptance.report.format import short_name
from ugv_acceptance.report.map_data import MapData, Scene
from ugv_acceptance.report.regions import draw_regions, figure, legend, png_of, svg_of
from ugv_acceptance.studies.maps import CLASSES, classes
from ugv_acceptance.type_aliases import Floats

WORDS = {
    'torque': ('holds', 'CAUTION: near the limit', 'saturates'),
    'rollover': ('stands', 'CAUTION: little tilt left', 'tips over'),
    'payload': ('carries the load', 'CAUTION: little reserve', 'cannot carry it'),
    'drag': ('pulls over a fifth of its weight', 'over a tenth', 'less'),
}
# Most letters of a joint on its axis; most lines of the assumptions in the title.
_LONGEST, _MOST_LINES = 48, 6
# A larger step (degrees) between messages crossed the map's edge: no joint moves so far.
_WRAPPED = 180.0
# Lines of equal value beside the two boundaries.
_LINES = {'payload': (1.0, 2.0, 3.0, 6.0, 8.0, 12.0), 'drag': (25.0, 100.0, 150.0, 200.0)}


def _turns(robot: Robot, joint: int) -> bool:
    return not robot.joint(robot.joint_names[joint]).slides


def shown(robot: Robot, joint: int, values: Floats) -> Floats:
    """Return positions in the units shown to people: degrees, m where prismatic."""
    return np.degrees(values) if _turns(robot, joint) else values


def assumptions(scene: Scene, kind: str) -> str:
    """Return the assumptions of a map as text: attitude, payload, joints, limits."""
    gx, gy, gz = scene.gravity
    roll, pitch = math.atan2(-gy, -gz), math.atan2(gx, math.hypot(gy, gz))
    ground = 'level ground'
    if abs(roll) > 1e-9 or abs(pitch) > 1e-9:
        parts = {'roll': math.degrees(roll), 'pitch': math.degrees(pitch)}
        ground = ', '.join(
            f'{name} {angle:.0f}°' for name, angle in parts.items() if abs(angle) > 0.05
        )
    others = []
    for k, name in enumerate(scene.robot.joint_names):
        if k not in (scene.grid.first, scene.grid.second):
            unit = '°' if _turns(scene.robot, k) else ' m'
            value = float(shown(scene.robot, k, np.array(scene.grid.q[k])))
            others.append(f'{name} {value:.0f}{unit}' if unit == '°' else f'{name} {value:.2f} m')
    load = '' if scene.robot.payload_link is None else f'payload {scene.payload.mass:g} kg'
    if load and scene.payload.mass > scene.robot.mass:
        load += ' (more than the robot weighs)'
    limits = '' if kind == 'rollover' else _limits(scene)
    words = (ground, load, ', '.join(others), limits, 'at rest')
    return '; '.join(part for part in words if part)


def _limits(scene: Scene) -> str:
    known = {
        f'{limit:g} {"N m" if _turns(scene.robot, k) else "N"}'
        for k, limit in enumerate(scene.limits.torque)
        if math.isfinite(limit)
    }
    return f'torque limits {", ".join(sorted(known))}' if known else ''


def draw_map(scene: Scene, data: MapData, track: Floats | None = None) -> Figure:
    """Return the map as a figure; `track` (n, 2): positions (rad, m) of a recorded run."""
    robot, grid = scene.robot, scene.grid
    made = figure(7.4, 6.2)
    axes = made.subplots()
    x, y = shown(robot, grid.first, grid.x), shown(robot, grid.second, grid.y)
    draw_regions(axes, x, y, data.margin, data.levels, _label(data))
    lines = [
        v for v in _LINES.get(data.kind, ()) if v not in (data.levels.caution, data.levels.failure)
    ]
    if lines:
        found = axes.contour(
            x, y, np.minimum(data.value, 1e4).T, levels=lines, colors='#444444', linewidths=0.6
        )
        axes.clabel(found, fmt=f'%g {data.unit}', fontsize=7.5)
    if track is not None:
        _draw_track(axes, scene, track)
    _axis(axes, scene)
    words = _wrapped(assumptions(scene, data.kind))
    axes.set_title(f'{short_name(robot.name, _LONGEST)}: {data.what}\n{words}', fontsize=9.5)
    more = axes.get_legend_handles_labels()[0]
    legend(made, WORDS[data.kind], more, loc='outside lower center', ncols=3)
    return made


def _wrapped(text: str, width: int = 90) -> str:
    if len(text) <= width:
        return text
    at = text.rfind('; ', 0, width) + 1
    lines = [text[:at], text[at:].strip()]
    if at and len(lines[1]) <= width:
        return '\n'.join(lines)
    lines = wrap(text, width, max_lines=_MOST_LINES, placeholder=' …')
    return '\n'.join(lines)


def _label(data: MapData) -> Callable[[float], str]:
    def label(margin: float) -> str:
        space = '' if data.unit in '°%' else ' '
        return f'{data.sign * margin:.3g}{space}{data.unit}'

    return label


def _draw_track(axes: Axes, scene: Scene, track: Floats) -> None:
    """Draw the path of a run on the map, from a circle to a square, modulo full turns."""
    points = []
    for joint, axis, values in zip(
        (scene.grid.first, scene.grid.second), (scene.grid.x, scene.grid.y), track.T, strict=True
    ):
        turn = 2.0 * math.pi
        inside = (values - axis[0]) % turn + axis[0] if _turns(scene.robot, joint) else values
        points.append(shown(scene.robot, joint, inside))
    x, y = points
    jump = np.hypot(np.diff(x, prepend=x[:1]), np.diff(y, prepend=y[:1])) > _WRAPPED
    axes.plot(np.where(jump, np.nan, x), y, color='white', lw=4.0)
    axes.plot(np.where(jump, np.nan, x), y, color='#0b3d91', lw=1.8, label='recorded run')
    axes.plot(x[0], y[0], 'o', color='#0b3d91', mec='white', ms=13, label='start', ls='')
    axes.plot(x[-1], y[-1], 's', color='#0b3d91', mec='white', ms=7, label='end', ls='')


def _axis(axes: Axes, scene: Scene) -> None:
    for axis, joint, values in (
        (axes.xaxis, scene.grid.first, scene.grid.x),
        (axes.yaxis, scene.grid.second, scene.grid.y),
    ):
        turns = _turns(scene.robot, joint)
        span = float(shown(scene.robot, joint, values[-1:] - values[:1])[0])
        steps = [s for s in (5.0, 10.0, 15.0, 30.0, 60.0) if span / s <= 9]
        axis.set_major_locator(MultipleLocator(steps[0]) if turns and steps else MaxNLocator())
        name = short_name(scene.robot.joint_names[joint], _LONGEST)
        axis.set_label_text(f'{name}, degrees' if turns else f'{name}, m')


def write_map(
    file: BinaryIO, ending: str, scene: Scene, data: MapData, track: Floats | None = None
) -> None:
    """Write the map in the format of an ending, one of ENDINGS."""
    _WRITERS[ending](file, scene, data, track)


def _write_svg(file: BinaryIO, scene: Scene, data: MapData, track: Floats | None) -> None:
    file.write(svg_of(draw_map(scene, data, track), data.kind).encode('utf-8'))


def _write_png(file: BinaryIO, scene: Scene, data: MapData, track: Floats | None) -> None:
    file.write(png_of(draw_map(scene, data, track)))


def _write_csv(binary: BinaryIO, scene: Scene, data: MapData, _: Floats | None) -> None:
    """Write one line per cell: positions (rad, m), value, class, cause."""
    robot, grid = scene.robot, scene.grid
    kind = classes(data.margin, data.levels.caution, data.levels.failure)
    names = [robot.joint_names[grid.first], robot.joint_names[grid.second]]
    with io.TextIOWrapper(binary, newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(
            [*names, f'{data.kind}_{_ENDINGS.get(data.unit, data.unit)}', 'class', 'cause']
        )
        for i, x in enumerate(grid.x):
            for j, y in enumerate(grid.y):
                cause = '' if data.cause is None else data.causes[int(data.cause[i, j])]
                cells = [f'{x:.6f}', f'{y:.6f}', f'{data.value[i, j]:.6g}']
                writer.writerow([*cells, CLASSES[kind[i, j]], cause])


def _write_npz(file: BinaryIO, scene: Scene, data: MapData, track: Floats | None) -> None:
    grid = scene.grid
    arrays: dict[str, np.ndarray] = {
        'x': grid.x,
        'y': grid.y,
        'value': data.value,
        'class': classes(data.margin, data.levels.caution, data.levels.failure),
        'names': np.array([scene.robot.joint_names[k] for k in (grid.first, grid.second)]),
        'gravity': np.array(scene.gravity),
        'payload_mass': np.array(scene.payload.mass),
    }
    if data.cause is not None:
        arrays |= {'cause': data.cause, 'causes': np.array(data.causes)}
    if track is not None:
        arrays['track'] = track
    np.savez_compressed(file, **arrays)  # type: ignore[arg-type]  # its own flag is no array


# Units as column names have them.
_ENDINGS = {'°': 'deg', '%': 'percent'}

_WRITERS: dict[str, Callable[[BinaryIO, Scene, MapData, Floats | None], None]] = {
    '.svg': _write_svg,
    '.png': _write_png,
    '.csv': _write_csv,
    '.npz': _write_npz,
}
ENDINGS = tuple(_WRITERS)
