"""Draws a robot as its configuration describes it, so that a wrong contact point is seen at once.

Three views to one scale: outlines of the collision geometry, contact points with their names, the
support polygon, the centre of gravity with its plumb line, the ground, the axes of the IMU.
"""

import html
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ugv_acceptance.evaluation.margin_words import degrees_words
from ugv_acceptance.model.robot import Matrix, Vector
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.report.regions import STYLE, figure, svg_of
from ugv_acceptance.type_aliases import Floats

# Title, the axes shown to the right and upwards, and which way they point on the page.
VIEWS = (
    ('seen from the right', 0, 2, 1.0),
    ('seen from the front', 1, 2, 1.0),
    ('seen from above', 0, 1, 1.0),
)
_AXES = ('x, forwards (m)', 'y, to the left (m)', 'z, upwards (m)')
# Directions in which the outline of a shape is searched.
_TURNS = 72
# Length of the IMU's axes, and room around the robot, as shares of its size.
_ARROW, _ROOM = 0.16, 0.09
_RED, _GREEN, _BLUE = '#d62728', '#2ca02c', '#1f5fd0'
# Names of contact points are written where there are no more of them.
_MOST_NAMES = 24
_LONGEST_LINE = 62


@dataclass(frozen=True, slots=True)
class Part:
    """A link's collision geometry as points (n, 3), m in the root link's axes."""

    link: str
    points: Floats


@dataclass(frozen=True, slots=True)
class Mark:
    """A contact point: where it is (m, root link), what is `wrong` with it; '': nothing."""

    name: str
    at: Vector
    wrong: str = ''


@dataclass(frozen=True, slots=True)
class RobotPicture:
    """What is drawn of a robot; m and axes of its root link.

    `polygon` are numbers of `marks`, counter-clockwise from above. `margins` (deg) is the tilt left
    to each of SIDES, NaN where none is known. `imu` is its place and axes. `lines` are sentences.
    """

    title: str
    parts: tuple[Part, ...]
    marks: tuple[Mark, ...]
    polygon: tuple[int, ...]
    cog: Vector
    ground: float
    margins: tuple[float, ...]
    imu: tuple[Vector, Matrix] | None = None
    root: str = 'base_link'
    lines: tuple[str, ...] = field(default=())


def outline(points: Floats) -> Floats:
    """Return the corners (k, 2) of the convex outline of points (n, 2), counter-clockwise."""
    angles = np.arange(_TURNS) * (2.0 * math.pi / _TURNS)
    ways = np.array([np.cos(angles), np.sin(angles)])
    # The least of noise lets equal extremes of a box fall on one corner each.
    found = np.argmax(np.round(points @ ways, 9), axis=0)
    keep = [k for i, k in enumerate(found) if k != found[i - 1] or not i]
    corners: Floats = points[list(dict.fromkeys(keep))]
    return corners


def draw_robot(picture: RobotPicture) -> Figure:
    """Return the figure: three views, and the margins and remarks in words."""
    made = figure(11.5, 8.2)
    with mpl.rc_context(STYLE):
        grid = made.subplots(2, 2)
        spread = _extent(picture)
        for axes, view in zip((grid[0][0], grid[0][1], grid[1][0]), VIEWS, strict=True):
            _view(axes, picture, view, spread)
        _words(grid[1][1], picture)
        made.suptitle(picture.title, parse_math=False, fontsize=12)
    return made


def _extent(picture: RobotPicture) -> tuple[Floats, Floats]:
    """Return the lowest and highest corner (3,) of all that is drawn, with some room."""
    points = [np.array([m.at for m in picture.marks]).reshape(-1, 3), np.array([picture.cog])]
    points += [part.points for part in picture.parts]
    points.append(np.array([[*picture.cog[:2], picture.ground]]))
    every = np.concatenate(points)
    every = every[np.isfinite(every).all(axis=1)]
    low, high = every.min(axis=0), every.max(axis=0)
    if picture.imu is not None:
        # An arrow whose tip lies outside of the axes would not be drawn at all.
        place, turn = np.array(picture.imu[0]), np.array(picture.imu[1])
        tips = place + _ARROW * float((high - low).max() or 1.0) * np.vstack([turn.T, np.zeros(3)])
        low, high = np.minimum(low, tips.min(axis=0)), np.maximum(high, tips.max(axis=0))
    room = _ROOM * float((high - low).max() or 1.0)
    return low - room, high + room


def _view(
    axes: Axes, picture: RobotPicture, view: tuple[str, int, int, float], spread: tuple[Any, Any]
) -> None:
    title, across, up, _ = view
    pick = [across, up]
    # Without the room around it: so long were the arrows for which room was made.
    size = float((spread[1] - spread[0]).max()) / (1.0 + 2.0 * _ROOM) * 0.8
    for part in picture.parts:
        corners = outline(part.points[:, pick])
        if len(corners) > 2:
            axes.fill(*corners.T, facecolor='#b9c3cc', alpha=0.35, edgecolor='#55606a', lw=0.7)
        else:
            axes.plot(*corners.T, color='#55606a', lw=0.7)
    if picture.polygon:
        ring = np.array([picture.marks[k].at for k in picture.polygon])[:, pick]
        axes.fill(*ring.T, facecolor='#7fc97f', alpha=0.35, edgecolor=_GREEN, lw=1.4)
    if up == 2 and math.isfinite(picture.ground):
        axes.axhline(picture.ground, color='#7a5c3a', lw=1.4)
        down = [picture.cog[2], picture.ground]
        axes.plot([picture.cog[across]] * 2, down, color='black', lw=0.9, ls='--')
    _marks(axes, picture, pick)
    axes.plot(picture.cog[across], picture.cog[up], 'o', ms=9, mfc='white', mec='black', zorder=6)
    axes.plot(picture.cog[across], picture.cog[up], '+', ms=9, color='black', zorder=7)
    _imu(axes, picture, pick, _ARROW * size)
    axes.set_aspect('equal')
    axes.set(xlabel=_AXES[across], ylabel=_AXES[up])
    axes.set_title(f'{title}{_seen(picture, up)}', parse_math=False)
    axes.set_xlim(spread[0][across], spread[1][across])
    axes.set_ylim(spread[0][up], spread[1][up])
    axes.grid(visible=True, lw=0.3, color='#dddddd')
    axes.set_axisbelow(True)


def _seen(picture: RobotPicture, up: int) -> str:
    return '' if up == 2 else f': {len(picture.marks) or "no"} contact points'


def _marks(axes: Axes, picture: RobotPicture, pick: Sequence[int]) -> None:
    """Draw the contact points: red and crossed where something is wrong with them."""
    told: set[tuple[float, float]] = set()
    centre = np.mean([mark.at for mark in picture.marks], axis=0) if picture.marks else np.zeros(3)
    for k, mark in enumerate(picture.marks):
        x, y = (mark.at[axis] for axis in pick)
        colour = _RED if mark.wrong else '#0b6b0b'
        axes.plot(
            x, y, 'X' if mark.wrong else 'o', ms=9 if mark.wrong else 5, color=colour, zorder=8
        )
        # In a view along the ground several stand behind each other: they are written once.
        place = (round(x, 2), round(y, 2))
        if place in told or len(picture.marks) > _MOST_NAMES:
            continue
        told.add(place)
        behind = [
            str(n + 1)
            for n, other in enumerate(picture.marks)
            if (round(other.at[pick[0]], 2), round(other.at[pick[1]], 2)) == place
        ]
        left = x < centre[pick[0]]
        axes.annotate(
            ','.join(behind) if len(behind) < 5 else f'{k + 1}...',
            (x, y),
            xytext=(-5 if left else 5, -10),
            textcoords='offset points',
            ha='right' if left else 'left',
            fontsize=8,
            color=colour,
            zorder=9,
        )


def _imu(axes: Axes, picture: RobotPicture, pick: Sequence[int], length: float) -> None:
    if picture.imu is None:
        return
    place, turn = picture.imu
    x, y = (place[axis] for axis in pick)
    axes.plot(x, y, 's', ms=4, color='black', zorder=9)
    for axis, colour in enumerate((_RED, _GREEN, _BLUE)):
        dx, dy = (length * turn[row][axis] for row in pick)
        if math.hypot(dx, dy) > 0.05 * length:
            axes.annotate(
                '',
                (x + dx, y + dy),
                xytext=(x, y),
                arrowprops={'arrowstyle': '->', 'color': colour, 'lw': 1.6},
                zorder=9,
            )


def _words(axes: Axes, picture: RobotPicture) -> None:
    """Write margins, names of contact points and remarks; what is wrong in red."""
    axes.axis('off')
    lines: list[tuple[str, str]] = [(text, 'black') for text in _margin_lines(picture)]
    if len(picture.marks) <= _MOST_NAMES:
        lines += [_mark_line(k, mark) for k, mark in enumerate(picture.marks)]
    else:
        wrong = [(k, mark) for k, mark in enumerate(picture.marks) if mark.wrong]
        lines += [_mark_line(k, mark) for k, mark in wrong]
    lines += [(text, '#444444') for text in picture.lines]
    step = min(0.052, 1.0 / max(len(lines), 1))
    for k, (text, colour) in enumerate(lines):
        short = text if len(text) <= _LONGEST_LINE else f'{text[: _LONGEST_LINE - 3]}...'
        axes.text(
            0.0,
            1.0 - k * step,
            short,
            transform=axes.transAxes,
            va='top',
            fontsize=min(9.0, 170.0 * step),
            color=colour,
            parse_math=False,
        )


def _margin_lines(picture: RobotPicture) -> list[str]:
    known = [
        f'{side.upper()} {degrees_words(math.radians(angle))}'
        for side, angle in zip(SIDES, picture.margins, strict=False)
        if math.isfinite(angle)
    ]
    x, y, z = picture.cog
    return [
        'to tipping, as it stands:',
        '   ' + (', '.join(known) if known else 'not known'),
        f'centre of gravity: {x:.3f} {y:.3f} {z:.3f} m in {picture.root}',
        'IMU axes: x red, y green, z blue' if picture.imu else 'no IMU, or its mounting is unknown',
    ]


def _mark_line(k: int, mark: Mark) -> tuple[str, str]:
    x, y, z = mark.at
    text = f'{k + 1}  {mark.name}  {x:.3f} {y:.3f} {z:.3f}'
    return (f'{text}: {mark.wrong}', _RED) if mark.wrong else (text, '#0b6b0b')


def picture_png(picture: RobotPicture) -> bytes:
    """Return the picture as the bytes of a PNG file."""
    target = io.BytesIO()
    with mpl.rc_context(STYLE):
        told = {'Software': 'ugv_acceptance', 'Title': 'robot picture'}
        draw_robot(picture).savefig(target, format='png', dpi=120, metadata=told)
    return target.getvalue()


def picture_html(picture: RobotPicture) -> str:
    """Return the picture as one HTML page that needs nothing else."""
    title = html.escape(picture.title)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<title>Robot picture: {title}</title>'
        '<style>body{font-family:sans-serif;margin:1em}svg{max-width:100%;height:auto}</style>'
        f'</head><body>\n{svg_of(draw_robot(picture), "robot")}\n</body></html>\n'
    )
