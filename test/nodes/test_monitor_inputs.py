"""The monitor and its inputs: absent, silent, broken, from strangers, in a namespace, simulated."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from nodes.live_case import ERROR, FOLDED, OK, STALE, Live, imu, joints, levels, session_of
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu
from std_srvs.srv import Trigger

from ugv_acceptance.bag.encode import joint_state_cdr
from ugv_acceptance.bag.raw import Offered
from ugv_acceptance.monitoring.session import INPUTS, Session
from ugv_acceptance.nodes.bag_player import qos_of


def test_a_monitor_with_both_inputs_says_ok(live: Live) -> None:
    """Both inputs and a safe posture: the verdict is OK and says what is left."""
    _, driver = live.running()
    live.until(lambda: OK in levels(driver), driver.send)
    assert ' to tipping: ' in driver.verdicts[-1].message


@pytest.mark.parametrize('present', ['none', 'joints', 'imu'])
def test_never_ok_with_an_absent_input(live: Live, present: str) -> None:
    """With an input that never came, every verdict is STALE."""
    live.monitor()
    driver = live.driver()
    send = {
        'none': lambda: None,
        'joints': lambda: driver.joints.publish(joints()),
        'imu': lambda: driver.imu.publish(imu()),
    }[present]
    live.until(
        lambda: (
            any(a.values[2].value == 'imu' for a in driver.alerts)
            or any(a.values[2].value == 'joint_states' for a in driver.alerts)
        ),
        send,
    )
    live.until(lambda: len(driver.verdicts) > 1, send)
    assert set(levels(driver)) == {STALE}


def test_half_the_joints_are_no_margin(live: Live) -> None:
    """Messages that lack joints of the robot give no margins and a STALE verdict."""
    monitor, driver = live.monitor(), live.driver()

    def send() -> None:
        names = ('shoulder_joint', 'elbow_joint')
        driver.joints.publish(joint_state_cdr(time.time_ns(), '', names, (1.0, -1.0)))
        driver.imu.publish(imu())

    live.until(lambda: session_of(monitor).counts['joint_states'].taken > 20, send)
    live.until(lambda: driver.verdicts, send)
    assert session_of(monitor).evaluator.evaluated == 0
    assert set(levels(driver)) == {STALE}


PUBLISHER = """
import sys, time
sys.path.insert(0, sys.argv[1])
import rclpy
from nodes.live_case import Driver
rclpy.init()
driver = Driver('stoppable')
while True:
    driver.send()
    time.sleep(0.01)
"""


@pytest.mark.parametrize('end', [signal.SIGSTOP, signal.SIGKILL])
def test_a_publisher_that_stops_makes_the_verdict_stale(live: Live, end: signal.Signals) -> None:
    """After SIGSTOP or SIGKILL of the driver the input is STALE when its own limit is over."""
    live.alone()
    monitor = live.monitor()
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    here = str(Path(__file__).parents[1])
    process = subprocess.Popen([sys.executable, '-c', PUBLISHER, here], env=environment)
    try:
        counts = session_of(monitor).counts
        live.until(lambda: min(counts['imu'].taken, counts['joint_states'].taken) > 100)
        live.until(lambda: session_of(monitor).evaluator.margins is not None)
        live.until(
            lambda: not session_of(monitor).alarm_tracker.open
        )  # what the start was STALE for
        process.send_signal(end)
        live.until(lambda: stale(session_of(monitor)).keys() == {'joint_states', 'imu'})
    finally:
        process.kill()
        process.wait()
    session = session_of(monitor)
    delays = session.settings.delays
    for name, start in stale(session).items():
        fresh = session.evaluator.fresh[INPUTS.index(name)]
        learnt = max(fresh.period * delays.stale_periods, delays.stale_after * 1e9)
        assert start <= session.counts[name].last + int(learnt)
    assert monitor.verdict().level == STALE


def stale(session: Session) -> dict[str, int]:
    """Return since when (ns) inputs are stale, of those that have margins wait for them."""
    if session.evaluator.margins is not None:
        return {}
    found = [a for a in session.active if a.rule.code == 'INPUT_STALE']
    return {a.rule.subject: a.start for a in found}


def test_bytes_that_are_no_message_are_counted_and_survived(live: Live) -> None:
    """Garbage on an input is reported with its count; margins go on with the next good message."""
    monitor, driver = live.running()

    def send() -> None:
        bad = (b'', b'\0\1\0\0', b'\xff' * 40, joints()[:-9], joints() + b'\0' * 64, imu())
        for data in bad:
            driver.joints.publish(data)
        driver.send()

    live.until(lambda: session_of(monitor).counts['joint_states'].malformed >= 5, send)
    live.until(lambda: session_of(monitor).evaluator.margins is not None, driver.send)
    live.until(lambda: any('INPUT_MALFORMED' in a.name for a in driver.alerts), driver.send)
    name = 'acceptance_monitor: Input joint_states'
    live.until(
        lambda: (
            name in driver.diagnostics
            and any(
                v.key == 'malformed' and int(v.value) >= 5 for v in driver.diagnostics[name].values
            )
        ),
        driver.send,
    )


def test_nan_is_never_ok(live: Live) -> None:
    """A joint position of NaN gives no margins and an ERROR."""
    monitor, driver = live.running()
    bad = (float('nan'), *FOLDED[1:])
    live.until(
        lambda: any('INPUT_INVALID' in a.name for a in driver.alerts), lambda: driver.send(bad)
    )
    assert session_of(monitor).evaluator.margins is None
    assert session_of(monitor).level >= ERROR


def test_a_second_publisher_is_named(live: Live) -> None:
    """Two nodes on one input raise a WARN that names both."""
    live.alone()
    monitor, driver = live.running()
    assert not any('SECOND_PUBLISHER' in a.name for a in driver.alerts)
    live.driver('stranger')
    live.until(
        lambda: any(a.name.endswith('SECOND_PUBLISHER imu') for a in driver.alerts), driver.send
    )
    text = next(a.message for a in driver.alerts if a.name.endswith('SECOND_PUBLISHER imu'))
    assert '/driver' in text
    assert '/stranger' in text
    assert session_of(monitor).level >= 1


def test_a_publisher_that_is_not_allowed_is_named(live: Live) -> None:
    """With `allowed_publishers` any other node on an input raises a WARN that names it."""
    live.alone()
    _, driver = live.running(allowed_publishers=['/arm_driver'])
    live.until(lambda: any('FOREIGN_PUBLISHER' in a.name for a in driver.alerts), driver.send)
    assert '/driver' in next(a.message for a in driver.alerts if 'FOREIGN' in a.name)


def test_namespaces_and_remaps_choose_the_inputs(live: Live) -> None:
    """Two monitors in two namespaces hear each their own robot, one by a remapped topic."""
    one = live.monitor(arguments=('-r', '__ns:=/one'))
    two = live.monitor(arguments=('-r', '__ns:=/two', '-r', 'joint_states:=/one/joint_states'))
    driver = live.driver(namespace='/one')
    live.until(lambda: session_of(one).evaluator.margins is not None, driver.send)
    live.until(lambda: session_of(two).counts['joint_states'].taken > 0, driver.send)
    assert session_of(two).counts['imu'].taken == 0
    assert two.verdict().level == STALE
    live.until(lambda: 'one/acceptance_monitor: Monitor' in driver.diagnostics, driver.send)


def test_simulated_stamps_are_no_clock_fault(live: Live) -> None:
    """With use_sim_time, stamps of /clock's time are right although they are decades off."""
    monitor = live.monitor(use_sim_time=True)
    driver = live.driver()
    clock = driver.create_publisher(Clock, '/clock', 10)
    began = time.monotonic_ns()

    def send() -> None:
        now = 5_000_000_000 + time.monotonic_ns() - began
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(now, 1_000_000_000)
        clock.publish(message)
        driver.joints.publish(joints(stamp=now))
        driver.imu.publish(imu(stamp=now))

    live.until(lambda: session_of(monitor).evaluator.evaluated > 100, send)
    codes = {v.value for a in driver.alerts for v in a.values if v.key == 'code'}
    assert 'CLOCK' not in codes


def test_a_missing_clock_is_said(live: Live) -> None:
    """use_sim_time without /clock raises a WARN; margins are computed all the same."""
    _, driver = live.running(use_sim_time=True)
    live.until(lambda: any('NO_CLOCK' in a.name for a in driver.alerts), driver.send)


def test_stamps_of_another_clock_are_a_clock_fault(live: Live) -> None:
    """Stamps nine days off raise CLOCK, and staleness is not disturbed by them."""
    monitor, driver = live.monitor(), live.driver()
    late = 9 * 86400 * 1_000_000_000

    def send() -> None:
        driver.joints.publish(joints(stamp=time.time_ns() - late))
        driver.imu.publish(imu(stamp=time.time_ns() - late))

    live.until(lambda: any('CLOCK' in a.name for a in driver.alerts), send)
    live.until(lambda: session_of(monitor).evaluator.margins is not None, send)


def test_a_frozen_clock_disturbs_no_staleness(live: Live) -> None:
    """With /clock frozen, running stamps raise CLOCK, and silence is STALE as ever."""
    monitor = live.monitor(use_sim_time=True)
    driver = live.driver()
    clock = driver.create_publisher(Clock, '/clock', 10)
    frozen = Clock()
    frozen.clock.sec = 1000
    began = time.monotonic_ns()

    def send() -> None:
        clock.publish(frozen)
        now = 1000 * 1_000_000_000 + time.monotonic_ns() - began
        driver.joints.publish(joints(stamp=now))
        driver.imu.publish(imu(stamp=now))

    live.until(lambda: session_of(monitor).evaluator.margins is not None, send)
    live.until(lambda: any('CLOCK' in a.name for a in driver.alerts), send)
    live.until(lambda: session_of(monitor).level == STALE, lambda: clock.publish(frozen))


def test_a_quality_of_service_that_does_not_match_is_named(
    live: Live, repository: Path, tmp_path: Path
) -> None:
    """A best-effort driver and a configuration that wants reliable: an ERROR that says so."""
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text(encoding='utf-8')
    text = text.replace('../urdf', str(repository / 'urdf'))
    config = tmp_path / 'reliable.yaml'
    config.write_text(text.replace('reliability: best_effort', 'reliability: reliable'))
    live.monitor(config=str(config))
    driver = live.driver()
    quick = qos_of(Offered('best_effort'))
    quiet = driver.create_publisher(Imu, 'imu/data', quick)
    live.until(
        lambda: any('INPUT_QOS imu' in a.name for a in driver.alerts), lambda: quiet.publish(imu())
    )
    assert 'RELIABILITY' in next(a.message for a in driver.alerts if 'INPUT_QOS' in a.name)


def test_a_look_for_publishers_that_comes_after_the_end_does_nothing(live: Live) -> None:
    """Its turn may be waiting when the monitor is deactivated or reset: that must not end it."""
    monitor, _ = live.running()
    inputs = monitor._inputs
    assert inputs is not None
    assert live.call(Trigger, 'acceptance_monitor/reset').success
    for _ in range(20):
        inputs._look()
    assert monitor._inputs is not inputs
