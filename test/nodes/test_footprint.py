"""~/support_polygon and ~/center_of_mass: what the published tip-over margins really rest on."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from geometry_msgs.msg import PointStamped, PolygonStamped
from nodes.live_case import FOLDED, Live, joints, session_of
from rclpy.node import Node
from reference_margin import reference_margin
from robots import centre, feet
from sensor_msgs.msg import JointState

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.edges import SIDES
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.monitoring.drawing import figure_of, shapes_of, skeleton_of
from ugv_acceptance.monitoring.footprint import TILTS, Footprint, footprint_of
from ugv_acceptance.type_aliases import Floats

SETTINGS = load().settings
ROBOT = SETTINGS.robot
BASE = [k for k, contact in enumerate(ROBOT.contacts) if contact.link == 'base_link']
# Joint positions (rad), load (kg), roll and pitch (deg): flat, loaded and stretched, on flippers.
CASES = {
    'folded': (FOLDED, 0.0, 0.0, 0.0),
    'loaded': ((0.4, 0.8, -0.9, 2.0), 3.0, 8.0, -5.0),
    'on flippers': ((0.0, 2.0, -2.5, -0.7), 1.0, 3.0, 4.0),
    'level flippers': ((0.2, 1.5, -2.0, 0.0), 2.0, -4.0, 0.0),
}


def gravity(roll: float, pitch: float) -> tuple[float, float, float]:
    """Return gravity (m/s2) in base axes of a robot at this attitude (deg)."""
    r, p = math.radians(roll), math.radians(pitch)
    x, y, z = math.sin(p), -math.sin(r) * math.cos(p), -math.cos(r) * math.cos(p)
    return (9.81 * x, 9.81 * y, 9.81 * z)


def evaluated(
    q: tuple[float, ...], load_kg: float, down: Sequence[float], settings: Settings = SETTINGS
) -> LiveEvaluator:
    """Return an evaluator that has taken one message of each input."""
    evaluator = LiveEvaluator(settings)
    evaluator.start(0)
    evaluator.carry(1, load_kg, (0.0, 0.0, 0.0), '')
    names, still = settings.robot.joint_names, (0.0,) * len(q)
    evaluator.joint_state(2, 2, names, q, still, still)
    up = tuple(-x for x in down)
    evaluator.imu(3, 3, (0.0, 0.0, 0.0, 0.0), -1.0, (0.0, 0.0, 0.0), up)
    assert evaluator.margins is not None
    return evaluator


def found(evaluator: LiveEvaluator) -> Footprint:
    """Return its footprint."""
    footprint = footprint_of(evaluator)
    assert footprint is not None
    return footprint


def least_about(polygon: Floats, center: Floats, down: Floats) -> float:
    """Return the least tilt (rad) about an edge: between gravity and the way down to the edge."""
    angles = []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        edge = (b - a) / np.linalg.norm(b - a)
        to = a - center
        to, pull = to - edge * (to @ edge), down - edge * (down @ edge)
        inside = np.cross(to, pull) @ edge
        angles.append(math.atan2(inside, to @ pull))
    return min(angles)


@pytest.mark.parametrize('case', list(CASES))
def test_the_margin_follows_from_polygon_and_centre(case: str) -> None:
    """Least tilt about the polygon's edges = least tilt left, both by other code than the model.

    The centre is that of plain matrices, the margin also that of all footings by brute force.
    """
    q, load_kg, roll, pitch = CASES[case]
    down = gravity(roll, pitch)
    evaluator = evaluated(q, load_kg, down)
    margins, footprint = evaluator.margins, found(evaluator)
    assert margins is not None
    _, center = centre(ROBOT, q, Payload(load_kg))
    np.testing.assert_allclose(footprint.center, center, atol=1e-9)
    points = feet(ROBOT, q)
    best = reference_margin(points, center, down, BASE)
    corners = {tuple(np.round(p, 9)) for p in footprint.polygon}
    assert corners <= {tuple(np.round(point, 9)) for point in points}
    polygon = np.array(footprint.polygon)
    least = min(map(float, margins.stability.angle))
    assert least == pytest.approx(best.margin, abs=1e-9)
    rocked = least_about(polygon, center, np.array(down)) - best.rocking
    assert least == pytest.approx(rocked, abs=1e-9)


@pytest.mark.parametrize('case', list(CASES))
def test_it_is_what_the_markers_draw(case: str) -> None:
    """The corners of the drawing without the last, which closes it, and its centre of gravity."""
    q, load_kg, roll, pitch = CASES[case]
    evaluator = evaluated(q, load_kg, gravity(roll, pitch))
    margins = evaluator.margins
    assert margins is not None
    skeleton = skeleton_of(figure_of(ROBOT), q, margins.gravity, evaluator.payload)
    assert skeleton is not None
    drawn = {s.name: s.points for s in shapes_of(skeleton, margins, SETTINGS)}
    assert found(evaluator).polygon == drawn['support'][:-1]
    assert found(evaluator).center == pytest.approx(drawn['cog'][0], abs=1e-12)


def test_there_is_no_polygon_without_a_tip_over_margin() -> None:
    """Of a robot whose tilt nobody measures no point; its centre of gravity is known."""
    settings = replace(SETTINGS, imu=replace(SETTINGS.imu, attitude='level'))
    footprint = found(evaluated(FOLDED, 0.0, gravity(0.0, 0.0), settings))
    assert footprint.polygon == ()
    assert footprint.center == pytest.approx(centre(ROBOT, FOLDED, Payload(0.0))[1])


def test_a_monitor_publishes_them_while_it_publishes_margins(live: Live) -> None:
    """In the robot's frame, with the stamp of the message, counter-clockwise; silent like margins.

    The sides of ~/stability have names that no joint has.
    """
    monitor, driver = live.running(frame_prefix='r1/')
    ears: Node = live.add(Node('ears'))
    polygons, centers, tilts = list[PolygonStamped](), list[PointStamped](), list[JointState]()
    at = 'acceptance_monitor'
    ears.create_subscription(PolygonStamped, f'{at}/support_polygon', polygons.append, 10)
    ears.create_subscription(PointStamped, f'{at}/center_of_mass', centers.append, 10)
    ears.create_subscription(JointState, f'{at}/stability', tilts.append, 10)
    live.until(lambda: polygons and centers and tilts, driver.send)
    assert tuple(tilts[-1].name) == TILTS == tuple(f'tilt_{side}' for side in SIDES)
    assert not set(TILTS) & set(ROBOT.joint_names)
    same = polygons[-1].header.stamp
    live.until(lambda: any(t.header.stamp == same for t in [*tilts, *centers]), driver.send)
    for message in (polygons[-1], centers[-1]):
        assert message.header.frame_id == 'r1/base_link'
    corners = [(p.x, p.y) for p in polygons[-1].polygon.points]
    turns = [a[0] * b[1] - a[1] * b[0] for a, b in pairwise(corners)]
    assert len(corners) == 4
    assert min(turns) > 0.0
    # Only one input: no margins, so nothing of this.
    live.until(lambda: session_of(monitor).evaluator.margins is None)
    live.spin(0.3)
    counts = len(polygons), len(centers), len(tilts)
    live.spin(0.5, lambda: driver.joints.publish(joints()))
    assert (len(polygons), len(centers), len(tilts)) == counts
