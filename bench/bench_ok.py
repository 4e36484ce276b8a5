"""How late `~/ok` becomes false after a driver was killed, stopped or half dead.

    nice python -m bench.bench_ok [--times 5]

Monitor, driver and listener are processes of their own. Of every failure: the time from the last
good message (as the driver stamped it) to the last true word and to the first false one, against
the promise, stale limit + 0.1 s. Clocks are those of one machine.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Bool

from ugv_acceptance.monitoring.ok_word import SETTLED
from ugv_acceptance.nodes.executor import end

# Stale limit (s) of inputs at 100 Hz, and what is promised above it.
LIMIT, ABOVE = 0.1, 0.1
# True words in a row before a driver fails: the period of the inputs was learnt by then.
STEADY = 10
PATIENCE = 240.0
HOWS = ('killed', 'stopped', 'joints', 'imu', 'repeat', 'nan')
# Sends both inputs until told otherwise on standard input; prints the time of the last good pair.
DRIVER = """
import json, math, os, sys, threading, time
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
NAMES = ('turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint')
rclpy.init()
node, how = Node('robot_driver'), ['both']
joints = node.create_publisher(JointState, 'joint_states', 10)
imu = node.create_publisher(Imu, 'imu/data', 10)
last = os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT)
threading.Thread(target=lambda: [how.__setitem__(0, line.strip()) for line in sys.stdin],
                 daemon=True).start()
stamp = time.time_ns()
while True:
    now = how[0]
    if now != 'repeat':
        stamp = time.time_ns()
    q = (0.0, math.nan if now == 'nan' else 2.0, -2.5, 2.0)
    if now == 'both':
        os.pwrite(last, b'%020d' % time.time_ns(), 0)
    if now != 'imu':
        joints.publish(joint_state_cdr(stamp, '', NAMES, q))
    if now != 'joints':
        imu.publish(imu_cdr(stamp, 'imu_link', (0.0, 0.0, 0.0, 1.0), (0.0,) * 3, (0.0, 0.0, 9.81)))
    time.sleep(0.01)
"""


class Gate(Node):
    """Hears the word: `heard` are (time since the epoch in ns, word)."""

    def __init__(self, namespace: str) -> None:
        super().__init__('gate', namespace=namespace)
        self.heard: list[tuple[int, bool]] = []
        self.create_subscription(Bool, 'acceptance_monitor/ok', self._take, 1)

    def _take(self, word: Bool) -> None:
        self.heard.append((time.time_ns(), word.data))


@contextmanager
def running(*command: str) -> Iterator['subprocess.Popen[str]']:
    """Run a process of this Python; kill it at the end."""
    drop = '_ROS_WHEELS_BOOTSTRAP_COMPLETE'
    environment = {key: value for key, value in os.environ.items() if key != drop}
    process = subprocess.Popen(
        [sys.executable, *command],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.kill(process.pid, signal.SIGCONT)
        process.kill()
        process.wait()


def fail(driver: 'subprocess.Popen[str]', how: str) -> None:
    """Let a driver fail."""
    if how in {'killed', 'stopped'}:
        os.kill(driver.pid, signal.SIGKILL if how == 'killed' else signal.SIGSTOP)
    elif driver.stdin is not None:
        driver.stdin.write(f'{how}\n')
        driver.stdin.flush()


def once(how: str, number: int, folder: str) -> tuple[float, float]:
    """Return when the last true and the first false word came (s) after the last good message."""
    space, path = f'/{how}_{number}', f'{folder}/{how}_{number}'
    executor, gate = SingleThreadedExecutor(), Gate(space)
    executor.add_node(gate)
    names = ('--ros-args', '-r', f'__ns:={space}')
    monitor = 'from ugv_acceptance.nodes.monitor.node import main; main()'
    with running('-c', monitor, *names), running('-c', DRIVER, path, *names) as driver:
        latest = time.monotonic() + PATIENCE
        true_for = 0
        while true_for < STEADY and time.monotonic() < latest:
            executor.spin_once(timeout_sec=0.5)
            true_for = true_for + 1 if gate.heard and gate.heard[-1][1] else 0
        time.sleep(random.uniform(0.0, 0.2))  # any phase of the timers
        fail(driver, how)
        until = time.monotonic() + LIMIT + ABOVE + SETTLED + 1.0
        while time.monotonic() < until:
            executor.spin_once(timeout_sec=0.05)
        with open(path) as file:  # noqa: PTH123 - one line
            good = int(file.read())
    executor.shutdown()
    end(gate)
    true = [at for at, word in gate.heard if word and at >= good]
    false = [at for at, word in gate.heard if not word and at >= good]
    if not false or true_for < STEADY:
        sys.exit(f'{how}: expected a true word and then a false one, got {gate.heard[-20:]}')
    return (max(true, default=good) - good) / 1e9, (min(false) - good) / 1e9


def main() -> None:
    """Print the worst of every failure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--times', type=int, default=5)
    parser.add_argument('--of', nargs='*', default=HOWS, choices=HOWS)
    parser.add_argument('--folder', default=os.environ.get('TMPDIR', '/tmp'))  # noqa: S108
    options = parser.parse_args()
    rclpy.init(domain_id=int(os.environ.setdefault('ROS_DOMAIN_ID', str(random.randint(1, 101)))))
    print(f'{options.times} times each; promised: no true word after {LIMIT + ABOVE:.2f} s')
    print(f'{"":10}{"last true s, worst":>20}{"first false s, median":>23}{"worst":>8}')
    found: dict[str, list[tuple[float, float]]] = {}
    for how in options.of:
        found[how] = [once(how, k, options.folder) for k in range(options.times)]
        true, false = zip(*found[how], strict=True)
        middle = sorted(false)[len(false) // 2]
        print(f'{how:10}{max(true):20.3f}{middle:23.3f}{max(false):8.3f}', flush=True)
    print(json.dumps(found))
    rclpy.shutdown()


if __name__ == '__main__':
    main()
