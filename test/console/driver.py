"""A robot's driver in a process of its own: publishes both inputs, takes postures from its stdin.

A line is four joint positions and the roll (rad), or `silent` or `speak` for the IMU.
"""

import math
import os
import sys
import threading
import time
from dataclasses import dataclass

import rclpy
from sensor_msgs.msg import Imu, JointState

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr

# rad/s: to the monitor a joint that is elsewhere at once, and again, is one of two robots. That is
# more than 0.1 rad from one message to the next, which comes right behind it on a busy machine.
SPEED = 4.0
NOISE = 1e-3  # m/s2
# rad: an orientation of exactly nothing is what an IMU sends that has none.
LEAN = 1e-4
NAMES = ('turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint')


@dataclass
class Robot:
    """How the robot is to stand."""

    q: tuple[float, ...] = (0.0, 2.0, -2.5, 2.0)
    roll: float = 0.0
    silent: bool = False


def listen(robot: Robot) -> None:
    """Take postures until the input ends."""
    for line in sys.stdin:
        word = line.strip()
        if word in {'silent', 'speak'}:
            robot.silent = word == 'silent'
        else:
            *q, robot.roll = (float(x) for x in word.split())
            robot.q = tuple(q)


def towards(goal: tuple[float, ...], q: tuple[float, ...], seconds: float) -> tuple[float, ...]:
    """Return the joints' positions so many seconds later."""
    way = SPEED * seconds
    return tuple(x + max(-way, min(way, end - x)) for end, x in zip(goal, q, strict=True))


def main() -> None:
    """Publish until the input ends."""
    rclpy.init()
    node = rclpy.create_node('driver')
    joints = node.create_publisher(JointState, 'joint_states', 100)
    imu = node.create_publisher(Imu, 'imu/data', 100)
    robot = Robot()
    listening = threading.Thread(target=listen, args=(robot,), daemon=True)
    listening.start()
    # Hz of joints, and of the IMU: a multiple. A bench asks for more than the tests.
    rates = [int(x) for x in os.environ.get('DRIVER_RATES', '50 50').split()]
    due, count, q = time.monotonic(), 0, robot.q
    while listening.is_alive():
        now, half = time.time_ns(), (robot.roll + LEAN) / 2
        if count % (rates[1] // rates[0]) == 0:
            q = towards(robot.q, q, 1.0 / rates[0])
            joints.publish(joint_state_cdr(now, '', NAMES, q, (0.0,) * 4, (0.0,) * 4))
        if not robot.silent:
            # A sensor that has moved and then repeats itself to the last digit counts as frozen.
            noise = NOISE * (count % 7 - 3)
            force = (noise, 9.81 * math.sin(robot.roll), 9.81 * math.cos(robot.roll))
            orientation = (math.sin(half), 0.0, 0.0, math.cos(half))
            imu.publish(imu_cdr(now, 'imu_link', orientation, (0.0, 0.0, 0.0), force))
        count += 1
        due = max(due + 1.0 / rates[1], time.monotonic() - 0.1)
        time.sleep(max(0.0, due - time.monotonic()))
    rclpy.shutdown()


if __name__ == '__main__':
    main()
