"""The robot as it was at one moment, from its right side and from behind, as a static SVG.

Its own shapes on their slope, the plumb line from the centre of gravity to the ground, what it
stands on, and the edge over which it would tip. Down in the picture is where gravity points.
"""

import html
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ugv_acceptance.evaluation.advice.tipped import has_tipped
from ugv_acceptance.evaluation.margin_words import degrees_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Payload, Robot, Vector
from ugv_acceptance.model.solids import Place, placed, places_of, solids_of
from ugv_acceptance.model.stability import SIDES, margins, stances_of, standing
from ugv_acceptance.model.tree import in_body, plain, tree_of
from ugv_acceptance.report.robot_picture import outline
from ugv_acceptance.type_aliases import Floats

# Size of each of the two views, and what is left free around the robot, in pixels.
_WIDTH, _HEIGHT, _ROOM, _FOOT = 350.0, 240.0, 14.0, 30.0
# Where the ground meets no robot, it is drawn so far (m) to both sides.
_FAR = 100.0
_INK, _RED, _AMBER, _BLUE, _FILL = '#111', '#c00016', '#a87f00', '#0047b3', '#c9c9c4'
_LEVEL = 'fill="none" stroke="#111" stroke-width="1.6" stroke-dasharray="6 4"'

Flat = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Standing:
    """A robot at one moment: joint positions (j,), gravity (m/s2, `base_link`) and its load."""

    q: tuple[float, ...]
    gravity: Vector
    payload: Payload


@dataclass(frozen=True, slots=True)
class _Shape:
    """A shape or a bone in `base_link` (m): the hull of points, each with a radius around."""

    joint: str
    points: tuple[Vector, ...]
    radius: float


@dataclass(frozen=True, slots=True)
class _Scene:
    """What is drawn (m, `base_link`): shapes, joints, feet that carry, centre of gravity, load.

    `angles` (rad) is the tilt left to each of SIDES, `over` the joints at their limit.
    """

    shapes: tuple[_Shape, ...]
    joints: tuple[Vector, ...]
    feet: tuple[Vector, ...]
    cog: Vector
    load: Vector | None
    angles: dict[str, float]
    over: frozenset[str]


@dataclass(frozen=True, slots=True)
class _View:
    """A view: its words, its sides left and right on the page, and how it flattens a point.

    `deep` is the number of the coordinate along which it looks.
    """

    words: str
    sides: tuple[str, str]
    across: Callable[[Vector], float]
    deep: int


_VIEWS = (
    _View('from its right side', ('rear', 'front'), lambda p: p[0], 1),
    _View('from behind', ('left', 'right'), lambda p: -p[1], 0),
)


def side_view(at: Standing, settings: Settings, name: str) -> str:
    """Return both views as one <svg>; `name` is in its ids, so that several fit on a page."""
    scene = _scene(at, settings)
    parts = [_defs(name)]
    for k, view in enumerate(_VIEWS):
        left = k * (_WIDTH + 10.0)
        inside = ''.join(_drawn(_Page(scene, view, at, settings), at, settings))
        parts.append(
            f'<g transform="translate({left:g} 0)"><g clip-path="url(#{name}-view)">{inside}</g>'
            f'<rect width="{_WIDTH:g}" height="{_HEIGHT:g}" fill="none" stroke="#999"/></g>'
        )
    words = html.escape(view_words(at, settings))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * _WIDTH + 10:g} {_HEIGHT:g}" '
        f'width="{2 * _WIDTH + 10:g}" role="img" aria-label="{words}" font-family="sans-serif" '
        f'font-size="12">{"".join(parts)}</svg>'
    )


def view_words(at: Standing, settings: Settings) -> str:
    """Return what a side view shows in words: the nearest edge and the joint most used."""
    scene = _scene(at, settings)
    known = {side: x for side, x in scene.angles.items() if math.isfinite(x)}
    if not known:
        return 'The robot; no tilt margin is known'
    side = min(known, key=lambda s: known[s])
    return f'The robot; nearest edge: {side}, {degrees_words(known[side])}'


def _defs(name: str) -> str:
    return (
        f'<defs><clipPath id="{name}-view"><rect width="{_WIDTH:g}" height="{_HEIGHT:g}"/>'
        '</clipPath></defs>'
    )


def _scene(at: Standing, settings: Settings) -> _Scene:
    robot, mechanics = settings.robot, mechanics_of(settings.robot)
    tree, places = tree_of(robot), places_of(robot, at.q)
    posture: Any = posture_of(mechanics, at.q, at.payload.mass, at.payload.cog)
    footing = standing(stances_of(mechanics, posture), at.gravity).footing
    now = margins(robot, [at.q], [at.gravity], at.payload)
    uses = zip(robot.joint_names, now.torque[0].tolist(), settings.limits.torque, strict=True)
    shapes = [
        _Shape(tree.bodies[s.body].joint, tuple(placed(s, places[s.body])), s.radius)
        for s in solids_of(robot)
    ]
    load = None
    if robot.payload_link is not None and at.payload.mass > 0.0:
        load = _point(robot, places, robot.payload_link, at.payload.cog)
    return _Scene(
        (*shapes, *_bones(robot, places, {shape.joint for shape in shapes})),
        tuple(places[k][1] for k in range(1, len(tree.bodies))),
        tuple(plain(posture.contacts[k]) for k in footing.polygon) if footing else (),
        plain(posture.cog),
        load,
        dict(zip(SIDES, map(float, now.angle[0]), strict=True)),
        frozenset(n for n, tau, limit in uses if abs(tau) >= limit),
    )


def _point(robot: Robot, places: Sequence[Place], link: str, xyz: Vector) -> Vector:
    body, at = in_body(tree_of(robot), link, xyz)
    (rotation, origin), point = places[body], np.array(plain(at))
    return plain((np.array(rotation) @ point + np.array(origin)).tolist())


def _bones(robot: Robot, places: Sequence[Place], drawn: set[str]) -> Iterable[_Shape]:
    """Yield a bar for each body without a shape: to the joints, feet and load that it carries."""
    tree = tree_of(robot)
    ends = [(body.parent, places[k][1]) for k, body in enumerate(tree.bodies) if k]
    ends += [
        (tree.frames[c.link][0], _point(robot, places, c.link, c.position)) for c in robot.contacts
    ]
    if robot.payload_link is not None:
        at = _point(robot, places, robot.payload_link, robot.payload.cog)
        ends.append((tree.frames[robot.payload_link][0], at))
    for body, end in ends:
        if body and tree.bodies[body].joint not in drawn:
            yield _Shape(tree.bodies[body].joint, (places[body][1], end), 0.0)


class _Page:
    """Where a point (m, `base_link`) is in a view, in pixels: turned so that gravity is down."""

    def __init__(self, scene: _Scene, view: _View, at: Standing, settings: Settings) -> None:
        self.scene, self.view = scene, view
        gu, gv = view.across(at.gravity), at.gravity[2]
        size = math.hypot(gu, gv) or 1.0
        self.turn = (-gv / size, -gu / size)
        ground = settings.robot.ground
        self.ground = ((0.0, 0.0, ground),) * 2
        if scene.feet:
            self.ground = _section(scene.feet, _plumb(scene, at.gravity), view)
        points = [p for s in scene.shapes for p in s.points]
        points += [scene.cog, *scene.feet, *([scene.load] if scene.load else [])]
        flat = np.array([self.flat(p) for p in points])
        low, high = flat.min(axis=0) - 0.03, flat.max(axis=0) + 0.06
        room = np.array((_WIDTH - 2.0 * _ROOM, _HEIGHT - _ROOM - _FOOT))
        self.scale = float((room / (high - low)).min())
        self.left = _WIDTH / 2.0 - self.scale * float(low[0] + high[0]) / 2.0
        self.foot = _HEIGHT - _FOOT + self.scale * float(low[1])

    def flat(self, p: Vector) -> Flat:
        """Return a point in m: to the right, and up."""
        u, v, (c, s) = self.view.across(p), p[2], self.turn
        return u * c - v * s, u * s + v * c

    def pixel(self, q: Flat) -> Flat:
        """Return the pixel of a flat point."""
        return self.left + q[0] * self.scale, self.foot - q[1] * self.scale

    def at(self, p: Vector) -> Flat:
        """Return the pixel of a point."""
        return self.pixel(self.flat(p))


def _plumb(scene: _Scene, gravity: Vector) -> Vector:
    """Return where the plumb line meets the plane of the feet; the centre where it does not."""
    a, b, c = (np.array(p) for p in scene.feet[:3])
    normal, cog, down = np.cross(b - a, c - a), np.array(scene.cog), np.array(gravity)
    across = float(normal @ down)
    if not across < 0.0:
        return scene.cog
    return plain((cog + down * float(normal @ (a - cog)) / across).tolist())


def _section(feet: Sequence[Vector], at: Vector, view: _View) -> tuple[Vector, Vector]:
    """Return both ends of the support polygon in a section along a view, through a point."""
    deep = [p[view.deep] for p in feet]
    level = min(max(at[view.deep], min(deep)), max(deep))
    cuts: list[Vector] = []
    for a, b in zip(feet, (*feet[1:], feet[0]), strict=True):
        start, end = a[view.deep] - level, b[view.deep] - level
        if start == end == 0.0:
            cuts += [a, b]
        elif start * end <= 0.0:
            share = start / (start - end)
            cuts.append(plain([x + share * (y - x) for x, y in zip(a, b, strict=True)]))
    cuts.sort(key=view.across)
    return cuts[0], cuts[-1]


def _drawn(page: _Page, at: Standing, settings: Settings) -> Iterable[str]:
    scene, fallen = page.scene, has_tipped(page.scene.angles.values())
    a, b = (page.flat(p) for p in page.ground)
    slope = math.atan2(b[1] - a[1], b[0] - a[0]) if a != b else 0.0
    along = (math.cos(slope) * _FAR, math.sin(slope) * _FAR)
    far = [page.pixel((a[0] + k * along[0], a[1] + k * along[1])) for k in (-1.0, 1.0)]
    if scene.feet:
        yield from _ground(far, fallen=fallen)
    for shape in scene.shapes:
        yield _shape(page, shape)
    for joint in scene.joints:
        yield _dot(page.at(joint), 3.0, '#fff', _INK)
    if scene.feet:
        yield _line(page.at(page.ground[0]), page.at(page.ground[1]), _BLUE, 4.0)
        yield from (_dot(page.at(p), 4.0, _BLUE, _BLUE) for p in page.ground)
    yield from _weight(page, slope, settings)
    if scene.load is not None:
        x, y = page.at(scene.load)
        yield f'<rect x="{x - 5:.1f}" y="{y - 5:.1f}" width="10" height="10" fill="{_BLUE}"/>'
        yield _text(x, y - 9.0, f'{at.payload.mass:.1f} kg', 'middle')
    yield from _words(page, slope, fallen=fallen)


def _ground(far: Sequence[Flat], *, fallen: bool) -> Iterable[str]:
    (x0, y0), (x1, y1) = far
    if not fallen:
        below = f'{x1:.1f},{y1 + 9e4:.1f} {x0:.1f},{y0 + 9e4:.1f}'
        yield f'<polygon points="{x0:.1f},{y0:.1f} {x1:.1f},{y1:.1f} {below}" fill="#efe8dd"/>'
    dash = ' stroke-dasharray="8 6"' if fallen else ''
    yield _line((x0, y0), (x1, y1), '#6b4a1f', 2.5, dash)


def _shape(page: _Page, shape: _Shape) -> str:
    over = shape.joint in page.scene.over
    look = f'fill="{"#f3b9bd" if over else _FILL}" stroke="{_RED if over else "#333"}"'
    pixels = [page.at(p) for p in shape.points]
    if shape.radius > 0.0:
        x, y = pixels[0]
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{shape.radius * page.scale:.1f}" {look}/>'
    if len(pixels) < 3:
        return _line(pixels[0], pixels[-1], _RED if over else '#333', 6.0)
    corners: Floats = outline(np.array(pixels))
    return f'<polygon points="{" ".join(f"{x:.1f},{y:.1f}" for x, y in corners)}" {look}/>'


def _weight(page: _Page, slope: float, settings: Settings) -> Iterable[str]:
    """Yield the plumb line, the edge nearest to it, and the centre of gravity."""
    scene, cog = page.scene, page.flat(page.scene.cog)
    side = min(page.view.sides, key=lambda s: scene.angles[s])
    left, colour = scene.angles[side], _INK
    foot = page.flat(page.ground[0])
    steep = abs(slope) > math.radians(80.0)
    plumb = (cog[0], foot[1] + (cog[0] - foot[0]) * math.tan(slope))
    edge = page.ground[page.view.sides.index(side)]
    if scene.feet and math.isfinite(left):
        limits = settings.limits
        colour = _RED if left <= limits.tip_error else _AMBER if left <= limits.tip_warn else _INK
        x, y = page.at(edge)
        fill = '#fff' if colour == _INK else colour
        if left < 0.0 and not steep:
            yield _line((x, y), page.pixel(plumb), _RED, 4.0)
        corners = f'{x:.1f},{y + 2:.1f} {x - 7:.1f},{y + 14:.1f} {x + 7:.1f},{y + 14:.1f}'
        look = f'fill="{fill}" stroke="{colour}" stroke-width="1.6"'
        yield f'<polygon class="edge" points="{corners}" {look}/>'
    if scene.feet and not steep:
        (x0, y0), (x1, y1) = page.pixel(cog), page.pixel(plumb)
        yield f'<path class="plumb" d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}" {_LEVEL}/>'
    x, y = page.pixel(cog)
    yield _dot((x, y), 7.0, '#fff', _INK)
    yield f'<path d="M{x:.1f} {y:.1f}h7a7 7 0 0 1 -7 7zm0 0h-7a7 7 0 0 1 7 -7z" fill="{colour}"/>'


def _words(page: _Page, slope: float, *, fallen: bool) -> Iterable[str]:
    """Yield the words of a view: its sides with the tilt left, the slope, where it looks from."""
    for k, side in enumerate(page.view.sides):
        left = page.scene.angles[side]
        words = 'no edge' if left == math.inf else degrees_words(left)
        where = (_WIDTH - 6.0, 'end') if k else (6.0, 'start')
        yield _text(where[0], _HEIGHT - 8.0, f'{side}: {words}', where[1])
    yield _text(6.0, 16.0, page.view.words, 'start')
    steep = abs(math.degrees(slope))
    if fallen:
        yield _text(_WIDTH - 6.0, 16.0, 'it has tipped', 'end')
        yield _text(_WIDTH - 6.0, 32.0, 'dashed: the ground as it stood', 'end')
    elif steep >= 0.5:
        yield _text(_WIDTH - 6.0, 16.0, f'slope {steep:.1f} deg', 'end')


def _line(a: Flat, b: Flat, colour: str, width: float, more: str = '') -> str:
    return (
        f'<line x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}" stroke="{colour}" '
        f'stroke-width="{width:g}" stroke-linecap="round"{more}/>'
    )


def _dot(at: Flat, radius: float, fill: str, colour: str) -> str:
    return (
        f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius:g}" fill="{fill}" '
        f'stroke="{colour}" stroke-width="1.4"/>'
    )


def _text(x: float, y: float, words: str, anchor: str) -> str:
    halo = f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"'
    safe = html.escape(words)
    return f'{halo} fill="none" stroke="#fff" stroke-width="3">{safe}</text>{halo}>{safe}</text>'
