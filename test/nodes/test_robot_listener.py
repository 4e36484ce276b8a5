"""A running robot tells the same of itself as its recording."""

import re
import subprocess
import sys
from pathlib import Path

from configure.seen_robots import Sent, description, joint, recorded, urdf_of
from nodes.live_case import Live
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

from ugv_acceptance.configure.collector import OWN
from ugv_acceptance.configure.recorded import evidence_of
from ugv_acceptance.nodes.monitor.publishers import LATCHED, MARGIN_TOPICS

ARM = Sent({'lift': 0.4, 'bend': -0.7})
URDF = urdf_of(joint('lift'), joint('bend', parent='lift_link'))
# What both have in common, though not the times and numbers of messages.
SAID = """
from ugv_acceptance.nodes.robot_listener import listen
seen = listen(3.0)
print((seen.urdf, seen.transforms, seen.joint_states, seen.joints, seen.imus, seen.doubts))
"""


def rounded(text: str) -> str:
    """A text with its numbers to six digits: means of other numbers of messages."""
    return re.sub(r'\d+\.\d+', lambda found: f'{float(found[0]):.6f}', text)


class Robot(Node):
    """A robot that sent its URDF before anybody listened, and goes on with the rest."""

    def __init__(self) -> None:
        super().__init__('robot')
        self.description = self.create_publisher(String, 'robot_description', LATCHED)
        self.description.publish(description(URDF).data)
        self.states = self.create_publisher(JointState, 'joint_states', 10)
        self.imu = self.create_publisher(Imu, 'imu/data', 10)
        self.own = self.create_publisher(JointState, 'acceptance_monitor/static_torque', 10)
        self.messages = [ARM.states().messages()[0].data, ARM.imu().messages()[0].data]

    def send(self) -> None:
        """Publish joint states, IMU, and what a monitor would say."""
        self.states.publish(self.messages[0])
        self.own.publish(self.messages[0])
        self.imu.publish(self.messages[1])


def test_a_running_robot_tells_what_its_recording_tells(live: Live, tmp_path: Path) -> None:
    """The URDF sent long before, joints, IMU; not what a monitor publishes."""
    robot: Robot = live.add(Robot())
    command = [sys.executable, '-c', SAID]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as listener:
        live.until(lambda: listener.poll() is not None, robot.send)
        assert listener.stdout is not None
        said = listener.stdout.read()
    assert listener.returncode == 0
    bag = recorded(tmp_path / 'run.mcap', description(URDF), ARM.states(), ARM.imu())
    seen = evidence_of(bag)
    wanted = (seen.urdf, seen.transforms, seen.joint_states, seen.joints, seen.imus, seen.doubts)
    assert rounded(said.strip()) == rounded(str(wanted))


def test_the_topics_of_a_monitor_are_known() -> None:
    """Those that it publishes are those that are not taken for a robot's."""
    assert {topic.rpartition('/')[2] for topic in MARGIN_TOPICS} == OWN


def test_nobody_to_listen_to_is_told_in_one_line() -> None:
    """With what to look after."""
    code = 'import ugv_acceptance.nodes.robot_listener as x; x.DISCOVERY = 0.0; x.listen(0.0)'
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=False)
    assert 'nobody publishes' in done.stderr.splitlines()[-1]
