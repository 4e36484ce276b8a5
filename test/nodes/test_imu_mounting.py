"""A live monitor whose IMU is placed by the frame of its messages, and a robot with a prefix."""

import time
from pathlib import Path
from typing import Any

import numpy as np
from framed_robot import robot_files
from nodes.live_case import Driver, Live, session_of
from nodes.tf2_type import provide_tf2_msgs
from rclpy.node import Node
from rclpy.publisher import Publisher
from scipy.spatial.transform import Rotation
from visualization_msgs.msg import MarkerArray

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.transforms import transforms_cdr
from ugv_acceptance.nodes.monitor.publishers import LATCHED

provide_tf2_msgs()
IMU = Rotation.from_euler('xyz', [1.5708, 0.0, 0.5])
PLACED = (0.1, 0.0, 0.2), IMU.as_quat().tolist()


def send(driver: Driver, frame: str) -> None:
    """Publish one message of each input of a robot that stands level."""
    now, random = time.time_ns(), np.random.default_rng()
    force = IMU.inv().apply([0.0, 0.0, 9.81]) + random.normal(0.0, 0.01, 3)
    spin = random.normal(0.0, 0.001, 3)
    driver.joints.publish(joint_state_cdr(now, '', ['arm_joint'], [0.3]))
    driver.imu.publish(imu_cdr(now, frame, IMU.as_quat(), spin, force))


def static_publisher(live: Live) -> Publisher:
    """Return a publisher of /tf_static as tf2's static broadcaster makes it."""
    from tf2_msgs.msg import TFMessage  # noqa: PLC0415 - provided above

    node: Node = live.add(Node('static_broadcaster'))
    return node.create_publisher(TFMessage, '/tf_static', LATCHED)


def said(driver: Driver) -> str:
    """Return how the IMU is mounted, as the newest diagnostics say."""
    status = driver.diagnostics.get('acceptance_monitor: Input imu')
    values: dict[str, Any] = {v.key: v.value for v in status.values} if status else {}
    return str(values.get('mounting', ''))


def test_the_urdf_tells_and_shapes_carry_the_prefix(live: Live, tmp_path: Path) -> None:
    """Of a robot under base_footprint whose frames all begin with r1/."""
    config = str(robot_files(tmp_path, 'base_footprint'))
    monitor, driver = live.monitor(config=config, frame_prefix='r1/'), live.driver()
    heard = list[MarkerArray]()
    viewer: Node = live.add(Node('viewer'))
    viewer.create_subscription(MarkerArray, 'acceptance_monitor/markers', heard.append, 10)
    live.until(lambda: heard and said(driver), lambda: send(driver, 'r1/imu_link'))
    assert {marker.header.frame_id for marker in heard[-1].markers} == {'r1/base_footprint'}
    margins = session_of(monitor).evaluator.margins
    np.testing.assert_allclose(margins.gravity, (0.0, 0.0, -9.81), atol=1e-5)
    assert said(driver).startswith('from the URDF (imu_link - base_footprint): rpy 90 0 28.65 deg')


def test_a_frame_that_nobody_knows_is_no_data_until_tf_static_tells(
    live: Live, tmp_path: Path
) -> None:
    """With a sentence that names the frame; then the margins are there."""
    monitor, driver = live.monitor(config=str(robot_files(tmp_path))), live.driver()
    live.until(
        lambda: any("its frame 'xsens' is no link" in v.message for v in driver.verdicts),
        lambda: send(driver, 'xsens'),
    )
    assert driver.verdicts[-1].level == b'\x03'
    assert session_of(monitor).evaluator.margins is None
    assert said(driver).startswith('not known')
    publisher, heard = static_publisher(live), monitor.count_subscribers
    publisher.publish(transforms_cdr([('base_link', 'xsens', *PLACED)]))
    live.until(
        lambda: session_of(monitor).evaluator.margins is not None and 'tf_static' in said(driver),
        lambda: send(driver, 'xsens'),
    )
    live.until(lambda: not heard('/tf_static'), lambda: send(driver, 'xsens'))


def test_transforms_that_were_told_before_the_monitor_came_are_heard(
    live: Live, tmp_path: Path
) -> None:
    """They are told once, and kept for who comes later (transient local)."""
    publisher = static_publisher(live)
    publisher.publish(transforms_cdr([('r1/base_link', 'xsens', *PLACED)]))
    monitor, driver = live.monitor(config=str(robot_files(tmp_path))), live.driver()
    live.until(
        lambda: session_of(monitor).evaluator.margins is not None, lambda: send(driver, 'xsens')
    )
