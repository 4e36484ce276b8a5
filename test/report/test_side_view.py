"""The robot at one moment as an SVG, against the model's margins and plain geometry."""

import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from robots import paper_arm

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.advice.tipped import has_tipped
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import STANDING, margins
from ugv_acceptance.report.side_view import Standing, side_view, view_words
from ugv_acceptance.simulation.vehicle import gravity_on_slope

PACKBOT = load('packbot').settings
SVG = '{http://www.w3.org/2000/svg}'
turns = st.floats(-3.1, 3.1)


def views(svg: str) -> list[ET.Element]:
    """Return the two views of a drawing, which is well-formed XML."""
    return ET.fromstring(svg).findall(  # noqa: S314 - our own
        f'{SVG}g/{SVG}g'
    )


def words(view: ET.Element) -> list[str]:
    """Return all that is written in a view."""
    return [''.join(text.itertext()) for text in view.iter(f'{SVG}text')]


def numbers(element: ET.Element, name: str) -> list[float]:
    """Return the numbers of an attribute."""
    return [float(x) for x in re.findall(r'-?[\d.]+', element.get(name, ''))]


def ground_of(view: ET.Element) -> tuple[float, float]:
    """Return slope (rad, up to the right) and height above the ground line at x = 0 (pixels)."""
    line = next(e for e in view.iter(f'{SVG}line') if e.get('stroke') == '#6b4a1f')
    x0, y0, x1, y1 = (float(line.get(k, 'nan')) for k in ('x1', 'y1', 'x2', 'y2'))
    return math.atan2(y0 - y1, x1 - x0), y0 - x0 * (y1 - y0) / (x1 - x0)


@settings(max_examples=15, deadline=None)
@given(
    st.tuples(turns, st.floats(0.3, 2.8), turns, turns),
    st.floats(0.0, 0.6),
    turns,
    st.floats(0.0, 6.0),
)
def test_the_plumb_line_falls_inside_the_edge_while_the_tilt_is_positive(
    q: tuple[float, ...], slope: float, heading: float, mass: float
) -> None:
    """Vertical, down to the ground line; beyond the triangle of an edge it has tipped over.

    On its tracks: raised on its flippers, what it may rock to counts as well and is not drawn.
    """
    down = gravity_on_slope(9.81, slope, heading)
    at = Standing(q, tuple(down.tolist()), Payload(mass))
    now = margins(PACKBOT.robot, [q], [down], at.payload)
    assume(int(now.state[0]) == STANDING)
    angle = now.angle[0]
    drawn = views(side_view(at, PACKBOT, 'one'))
    for view, (left, right) in zip(drawn, ((2, 0), (1, 3)), strict=True):
        plumb = next(e for e in view.iter(f'{SVG}path') if e.get('class') == 'plumb')
        x0, y0, x1, y1 = numbers(plumb, 'd')
        edge = next(e for e in view.iter(f'{SVG}polygon') if e.get('class') == 'edge')
        tip = numbers(edge, 'points')[0]
        feet = next(e for e in view.iter(f'{SVG}line') if e.get('stroke') == '#0047b3')
        # Beside a corner of the support the section is a point, with no inside.
        assume(float(feet.get('x2', 'nan')) - float(feet.get('x1', 'nan')) > 1.0)
        k = right if abs(tip - float(feet.get('x2', 'nan'))) < 0.11 else left
        assert angle[k] == pytest.approx(min(angle[left], angle[right]))
        assert (x0, y0 < y1) == (x1, True)
        tilt, start = ground_of(view)
        assert y1 == pytest.approx(start - x1 * math.tan(tilt), abs=1.0)
        inside = tip - x1 if k == right else x1 - tip
        # A tenth of a pixel is not drawn; past an edge of the other view there is no section.
        others = [angle[n] for n in range(4) if n not in {left, right}]
        assert inside * angle[k] > 0.0 or abs(inside) <= 0.3 or min(others) < 0.0
        assert ('it has tipped' in words(view)) == has_tipped(angle)


@pytest.mark.parametrize('slope', [0.0, 0.1, -0.3])
def test_the_ground_slopes_as_the_attitude_says(slope: float) -> None:
    """Nose up, the ground rises to the front; from behind it is level, and so nothing is said."""
    down = (-9.81 * math.sin(slope), 0.0, -9.81 * math.cos(slope))
    at = Standing((0.0, 1.5, -2.0, math.pi), down, Payload(1.0))
    side, rear = views(side_view(at, PACKBOT, 'one'))
    assert ground_of(side)[0] == pytest.approx(slope, abs=1e-3)
    assert ground_of(rear)[0] == pytest.approx(0.0, abs=1e-3)
    said = f'slope {abs(math.degrees(slope)):.1f} deg'
    assert [said in words(view) for view in (side, rear)] == [slope != 0.0, False]


def test_a_joint_at_its_limit_is_red_and_an_edge_by_its_level() -> None:
    """Stretched out with 4 kg the shoulder is past its limit and the robot past its edge."""
    at = Standing((0.0, 0.3, 0.2, 2.0), (0.0, 0.0, -9.81), Payload(4.0))
    side, _ = views(side_view(at, PACKBOT, 'one'))
    filled = [e.get('fill') for e in side.iter(f'{SVG}polygon')]
    assert '#f3b9bd' in filled
    assert '#c9c9c4' in filled
    edge = next(e for e in side.iter(f'{SVG}polygon') if e.get('class') == 'edge')
    assert edge.get('fill') == '#c00016'
    assert view_words(at, PACKBOT) == 'The robot; nearest edge: front, -3.6 deg'
    assert '4.0 kg' in words(side)
    calm = Standing((0.0, 2.0, -2.5, 2.0), (0.0, 0.0, -9.81), Payload(0.0))
    colours = {e.get('fill') for v in views(side_view(calm, PACKBOT, 'x')) for e in v.iter()}
    assert not colours & {'#f3b9bd', '#c00016', '#a87f00'}


def test_two_drawings_fit_on_a_page_and_the_same_is_drawn_the_same() -> None:
    """Ids carry the name."""
    at = Standing((0.0, 0.3, 0.2, 2.0), (0.0, 0.0, -9.81), Payload(4.0))
    one, two = (side_view(at, PACKBOT, name) for name in ('one', 'two'))
    assert one == side_view(at, PACKBOT, 'one')
    assert set(re.findall(r'id="([^"]*)"', one)) == {'one-view'}
    assert one.replace('one-view', 'two-view') == two


def test_an_arm_without_shapes_or_feet_is_drawn_by_its_joints() -> None:
    """Bars from joint to joint and to the load; no ground, no edge, no plumb line."""
    bare = replace(PACKBOT, robot=paper_arm(), limits=replace(PACKBOT.limits, torque=(99.0, 99.0)))
    at = Standing((0.3, 0.2), (0.0, 0.0, -9.81), Payload(4.0))
    side, _ = views(side_view(at, bare, 'one'))
    bars = [e for e in side.iter(f'{SVG}line') if e.get('stroke-width') == '6']
    lengths = [
        math.dist(*(tuple(float(e.get(k + n, 'nan')) for k in 'xy') for n in '12')) for e in bars
    ]
    assert lengths[0] / lengths[1] == pytest.approx(0.55 / 0.64, rel=0.01)
    assert not [e for e in side.iter() if e.get('class') or e.get('stroke') == '#6b4a1f']
    assert view_words(at, bare) == 'The robot; no tilt margin is known'
