"""The markers: what a viewer draws, from a real monitor over DDS."""

from dataclasses import replace

import numpy as np
from nodes.live_case import FOLDED, Live
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from ugv_acceptance.bag.encode_views import Shape
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.model.robot import Joint, Link
from ugv_acceptance.monitoring.drawing import (
    GREEN,
    LIFETIME,
    NAMES,
    RED,
    figure_of,
    shapes_of,
    skeleton_of,
)

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


def drawn(q: tuple[float, ...]) -> dict[str, Shape]:
    """Return what is drawn of a posture by name."""
    margins = margins_at(q)
    figure, load = figure_of(SETTINGS.robot), SETTINGS.robot.payload
    skeleton = skeleton_of(figure, q, margins.gravity, load)
    assert skeleton is not None
    return {shape.name: shape for shape in shapes_of(skeleton, margins, SETTINGS)}


def points(shape: Shape) -> np.ndarray:
    """Return a shape's points (n, 3)."""
    return np.array(shape.points)


def test_a_stretched_arm_is_red_to_the_front() -> None:
    """The worst edge is the front one, in red; the overloaded limb is red too."""
    found = drawn(STRETCHED)
    edge, safe = found['worst_edge'], drawn(FOLDED)['worst_edge']
    assert (points(edge)[:, 0] > 0.2).all()
    assert (edge.colour, safe.colour) == (RED, GREEN)
    limbs = found['limbs']
    assert len(limbs.colours) == len(limbs.points)
    assert set(limbs.colours) == {RED, GREEN}


def test_the_outline_is_closed_about_the_plumb_point() -> None:
    """The outline ends where it begins; the plumb line of a folded arm ends inside it."""
    found = drawn(FOLDED)
    outline, under = points(found['support']), points(found['plumb'])
    np.testing.assert_array_equal(outline[0], outline[-1])
    assert outline[:, :2].min(axis=0)[0] < under[1][0] < outline[:, :2].max(axis=0)[0]


def test_a_monitor_draws_for_who_listens(live: Live) -> None:
    """Each is there once, in base_link, and goes by itself when the monitor dies."""
    live.monitor()
    driver, heard = live.driver(), list[MarkerArray]()
    viewer: Node = live.add(Node('viewer'))
    viewer.create_subscription(MarkerArray, 'acceptance_monitor/markers', heard.append, 10)
    live.until(lambda: heard, driver.send)
    assert tuple(marker.ns for marker in heard[-1].markers) == NAMES
    for marker in heard[-1].markers:
        assert marker.header.frame_id == 'base_link'
        assert 0 < marker.lifetime.sec + marker.lifetime.nanosec / 1e9 <= LIFETIME
        assert marker.header.stamp.sec > 0


def test_shapes_in_another_frame_of_the_base_are_where_they_were() -> None:
    """In the axes of a link that is shifted and turned, under its name and the robot's prefix."""
    margins = margins_at(FOLDED)
    robot = SETTINGS.robot
    turned = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    joint = Joint('mast_joint', 'fixed', robot.root, 'mast', (0.1, 0.2, 0.3), turned)
    links, joints = (*robot.links, Link('mast')), (*robot.joints, joint)
    there = replace(robot, links=links, joints=joints)
    told = replace(SETTINGS, robot=there, base_frame='mast', frame_prefix='r1/')
    figure, load = figure_of(there), robot.payload
    skeleton = skeleton_of(figure, FOLDED, margins.gravity, load)
    assert skeleton is not None
    assert told.frame == 'r1/mast'
    for shape in shapes_of(skeleton, margins, told):
        back = points(shape).reshape(-1, 3) @ np.array(turned).T + (0.1, 0.2, 0.3)
        np.testing.assert_allclose(
            back, points(drawn(FOLDED)[shape.name]).reshape(-1, 3), atol=1e-9
        )
