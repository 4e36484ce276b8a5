"""The markers: what a viewer draws, from a real monitor over DDS."""

import numpy as np
from nodes.live_case import FOLDED, Live
from rclpy.node import Node
from visualization_msgs.msg import Marker, MarkerArray

from ugv_acceptance.config import load
from ugv_acceptance.console.skeleton import figure_of, skeleton_of
from ugv_acceptance.evaluation.live import LiveEvaluator, Margins
from ugv_acceptance.nodes.markers import LIFETIME, NAMES, markers_of

SETTINGS = load().settings
STRETCHED = (0.0, 0.3, 0.2, 2.0)


def margins_at(q: tuple[float, ...]) -> Margins:
    """Return the margins of a level robot."""
    evaluator = LiveEvaluator(SETTINGS)
    evaluator.start(0)
    evaluator.imu(1, 1, (0.0, 0.0, 0.0, 1.0), 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))
    names = SETTINGS.robot.joint_names
    margins = evaluator.joint_state(2, 2, names, q, (0.0,) * 4, (0.0,) * 4)
    assert margins is not None
    return margins


def drawn(q: tuple[float, ...]) -> dict[str, Marker]:
    """Return the markers of a posture by name."""
    margins = margins_at(q)
    figure, load = figure_of(SETTINGS.robot), SETTINGS.robot.payload
    skeleton = skeleton_of(figure, q, margins.gravity, load)
    assert skeleton is not None
    return {marker.ns: marker for marker in markers_of(skeleton, margins, SETTINGS)}


def points(marker: Marker) -> np.ndarray:
    """Return a marker's points (n, 3)."""
    return np.array([(p.x, p.y, p.z) for p in marker.points])


def test_every_marker_has_its_name_and_vanishes() -> None:
    """Each is there once, in base_link, and goes by itself when the monitor dies."""
    found = drawn(FOLDED)
    assert tuple(found) == NAMES
    for marker in found.values():
        assert marker.header.frame_id == 'base_link'
        assert 0 < marker.lifetime.sec + marker.lifetime.nanosec / 1e9 <= LIFETIME


def test_a_stretched_arm_is_red_to_the_front() -> None:
    """The worst edge is the front one, in red; the overloaded limb is red too."""
    found = drawn(STRETCHED)
    edge, safe = found['worst_edge'], drawn(FOLDED)['worst_edge']
    assert (points(edge)[:, 0] > 0.2).all()
    assert edge.color.r > edge.color.g
    assert safe.color.g > safe.color.r
    limbs = found['limbs']
    assert len(limbs.colors) == len(limbs.points)
    red = [c.r > c.g for c in limbs.colors]
    assert any(red)
    assert not all(red)


def test_the_outline_is_closed_about_the_plumb_point() -> None:
    """The outline ends where it begins; the plumb line of a folded arm ends inside it."""
    found = drawn(FOLDED)
    outline, under = points(found['support']), points(found['plumb'])
    np.testing.assert_array_equal(outline[0], outline[-1])
    assert outline[:, :2].min(axis=0)[0] < under[1][0] < outline[:, :2].max(axis=0)[0]


def test_a_monitor_draws_for_who_listens(live: Live) -> None:
    """A running monitor publishes all of them to a viewer that subscribes."""
    live.monitor()
    driver, heard = live.driver(), list[MarkerArray]()
    viewer: Node = live.add(Node('viewer'))
    viewer.create_subscription(MarkerArray, 'acceptance_monitor/markers', heard.append, 10)
    live.until(lambda: heard, driver.send)
    assert tuple(marker.ns for marker in heard[-1].markers) == NAMES
    assert heard[-1].markers[0].header.stamp.sec > 0
