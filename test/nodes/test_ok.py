"""`~/ok` over DDS: a driver that is killed, stopped or half dead, and every state of the node."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lifecycle_msgs.msg import Transition
from nodes.live_case import Driver, Live, session_of
from nodes.test_monitor_control import STRETCHED, change
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from ugv_acceptance.monitoring.ok_word import SETTLED
from ugv_acceptance.nodes.monitor.node import Monitor
from ugv_acceptance.nodes.monitor.ok_output import DEADLINE, PERIOD

TOPIC = 'acceptance_monitor/ok'
# What a busy machine may take (s) beyond what is promised; the clock set by hand in
# test/monitoring/test_ok_word.py allows nothing.
ALLOWED = 1.0
# A driver in a process of its own, which sends what the word on its standard input says.
DRIVER = """
import sys, threading, time
sys.path.insert(0, sys.argv[1])
import rclpy
from nodes.live_case import Driver, imu, joints
rclpy.init()
driver, how, stamp = Driver('robot_driver', sys.argv[2]), ['both'], time.time_ns()
def listen():
    for line in sys.stdin:
        how[0] = line.strip()
threading.Thread(target=listen, daemon=True).start()
while True:
    if how[0] != 'repeat':
        stamp = time.time_ns()
    if how[0] in ('both', 'joints', 'repeat'):
        driver.joints.publish(joints(stamp=stamp))
    if how[0] in ('both', 'imu', 'repeat'):
        driver.imu.publish(imu(stamp=stamp))
    time.sleep(0.01)
"""


@contextmanager
def started(namespace: str) -> Iterator['subprocess.Popen[str]']:
    """Run a driver; kill it at the end, if not before."""
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    command = [sys.executable, '-c', DRIVER, str(Path(__file__).parents[1]), namespace]
    process = subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        if process.stdin is not None:
            process.stdin.close()


@dataclass
class Words:
    """The words heard with their times of receipt (s, steady)."""

    heard: list[tuple[float, bool]] = field(default_factory=list)

    def take(self, word: Bool) -> None:
        """Take a word."""
        self.heard.append((time.monotonic(), word.data))

    def now(self) -> bool:
        """Return the newest word; false before the first."""
        return bool(self.heard) and self.heard[-1][1]

    def true_since(self, when: float) -> float:
        """Return the time of the last true word, that of `when` (s) if there was none since."""
        return max([when, *(at for at, word in self.heard if word)])


def asking(seconds: float) -> Any:
    """Return the quality of service of a gate that asks for a deadline."""
    profile: Any = QoSProfile
    return profile(depth=1, deadline=Duration(seconds=seconds))


def words_of(live: Live, namespace: str = '') -> Words:
    """Return what a gate of motion hears: it asks for a deadline of 0.3 s."""
    words, gate = Words(), live.add(Node('gate', namespace=namespace))
    gate.create_subscription(Bool, TOPIC, words.take, asking(0.3))
    return words


def killed(driver: 'subprocess.Popen[str]') -> None:
    """Kill it: SIGKILL."""
    driver.kill()
    driver.wait()


def stopped(driver: 'subprocess.Popen[str]') -> None:
    """Stop it: SIGSTOP; it is there and says nothing."""
    os.kill(driver.pid, signal.SIGSTOP)


def told(word: str) -> Callable[['subprocess.Popen[str]'], None]:
    """Return a function that tells a driver what to send from now on."""

    def tell(driver: 'subprocess.Popen[str]') -> None:
        assert driver.stdin is not None
        driver.stdin.write(f'{word}\n')
        driver.stdin.flush()

    return tell


FAILURES: dict[str, Callable[['subprocess.Popen[str]'], None]] = {
    'killed': killed,
    'stopped': stopped,
    'only_joints': told('joints'),
    'only_imu': told('imu'),
    'repeats': told('repeat'),
}


def test_no_true_word_comes_later_than_said_after_a_driver_failed(live: Live) -> None:
    """From the stale limit and 0.1 s after the last good message on every word is false.

    Five robots at once, each with a driver of its own, which fails in its own way.
    """
    with ExitStack() as stack:
        drivers = {how: stack.enter_context(started(f'/{how}')) for how in FAILURES}
        monitors = {how: live.monitor(arguments=('-r', f'__ns:=/{how}')) for how in FAILURES}
        words = {how: words_of(live, f'/{how}') for how in FAILURES}
        live.until(lambda: all(heard.now() for heard in words.values()))
        failed = {}
        for how, fail in FAILURES.items():
            fail(drivers[how])
            failed[how] = time.monotonic()
        live.until(lambda: not any(heard.now() for heard in words.values()))
        live.spin(1.0)
    for how, heard in words.items():
        limit = max(t.limit for t in session_of(monitors[how]).evaluator.fresh) / 1e9
        since = failed[how]
        assert heard.true_since(since) - since <= limit + PERIOD + ALLOWED, how
        assert not heard.now()


def test_it_is_said_in_every_state_and_true_only_when_active(live: Live) -> None:
    """Unconfigured, inactive, without data, in DANGER, after a reset: false, ten times a second."""
    monitor, words, driver = live.monitor(up=False), words_of(live), live.driver()
    for transition in (None, Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        if transition is not None:
            assert change(live, transition)
        before = len(words.heard)
        live.until(lambda b=before: len(words.heard) >= b + 10)  # type: ignore[misc]
        assert not any(word for _, word in words.heard)
    live.until(words.now, driver.send)
    reset_at = time.monotonic()
    live.call(Trigger, 'acceptance_monitor/reset')
    live.until(lambda: not words.now())
    assert session_of(monitor).evaluator.margins is None
    live.until(words.now, driver.send)
    assert words.heard[-1][0] - reset_at > SETTLED
    assert change(live, Transition.TRANSITION_DEACTIVATE)
    live.until(lambda: not words.now(), driver.send)
    before = len(words.heard)
    live.until(lambda: len(words.heard) >= before + 10, driver.send)
    assert not any(word for _, word in words.heard[before:])


def ready(live: Live) -> tuple[Monitor, Driver, Words]:
    """Return a monitor whose word is true, the driver, and the words heard."""
    words = words_of(live)
    monitor, driver = live.running()
    live.until(words.now, driver.send)
    return monitor, driver, words


def test_it_is_false_before_the_verdict_tells_of_danger(live: Live) -> None:
    """Not at the next turn of its timer: who hears DANGER has heard the word before."""
    _, driver, words = ready(live)
    at = len(driver.verdicts)
    live.until(
        lambda: any(v.level[0] >= 2 for v in driver.verdicts[at:]), lambda: driver.send(STRETCHED)
    )
    live.until(lambda: not words.now(), lambda: driver.send(STRETCHED))
    values = {pair.key: pair.value for pair in driver.verdicts[-1].values}
    assert values['ok'].startswith('no: ')


def test_the_verdict_says_why_not(live: Live) -> None:
    """`ok` is `yes`, or `no` and the reason, of the word that was said."""
    _, driver, words = ready(live)

    def said() -> str:
        values = {pair.key: str(pair.value) for pair in driver.verdicts[-1].values}
        return values.get('ok', '')

    live.until(lambda: said() == 'yes', driver.send)
    live.until(lambda: said() == 'no: margins not known')
    assert not words.now()


def test_a_fault_of_ours_is_false(live: Live) -> None:
    """An exception while the word is looked for is false, and does not end the monitor."""
    monitor, driver, words = ready(live)
    session_of(monitor).evaluator.joints.layouts = None
    live.until(lambda: not words.now(), driver.send)
    before = len(words.heard)
    live.until(lambda: len(words.heard) >= before + 10, driver.send)
    assert not any(word for _, word in words.heard[before:])


def test_the_lock_in_the_documentation_is_open_only_while_the_word_is_true(
    live: Live, repository: Path
) -> None:
    """The node of docs/ros_interface.md, run as it stands there: locked, open, locked."""
    text = (repository / 'docs' / 'ros_interface.md').read_text('utf-8')
    found = re.findall(r'```python\n(.*?)```', text, re.DOTALL)
    (code,) = (block for block in found if 'margins_lock' in block)
    locks, words, driver = Words(), words_of(live), live.driver()
    driver.create_subscription(Bool, 'margins_lock', locks.take, 1)
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    live.monitor()
    with subprocess.Popen([sys.executable, '-c', code], env=environment) as process:
        try:
            live.until(lambda: locks.heard)
            assert locks.now()
            live.until(lambda: not locks.now(), driver.send)
            assert words.now()
            live.until(locks.now)
            assert not words.now()
        finally:
            process.kill()


def test_the_deadline_that_is_offered_is_kept(live: Live) -> None:
    """A subscriber that asks for 0.2 s matches; one that asks for less does not."""
    live.monitor()
    heard: dict[float, list[Bool]] = {DEADLINE: [], DEADLINE / 2: []}
    gate = live.add(Node('gate'))
    for seconds, taken in heard.items():
        gate.create_subscription(Bool, TOPIC, taken.append, asking(seconds))
    live.until(lambda: len(heard[DEADLINE]) >= 10)
    assert heard[DEADLINE / 2] == []
