"""The same messages through real DDS into the monitor and from the recording: equal results."""

import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nodes.live_case import Live, live_nodes, ros_context, session_of

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.reader import choose_topics, open_bag
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts import Alert
from ugv_acceptance.evaluation.live import Margins
from ugv_acceptance.evaluation.recorded import RecordedEvaluator

NS = 1_000_000_000
SECONDS = 6.0
# Alerts may begin and end this much later live (ns): transport and a busy machine.
LATE = 250_000_000


@pytest.fixture(scope='module', autouse=True)
def _ros() -> Iterator[None]:
    with ros_context():
        yield


@pytest.fixture
def live() -> Iterator[Live]:
    """Return an executor for the nodes of one test."""
    with live_nodes() as nodes:
        yield nodes


def write_run(folder: Path) -> Path:
    """Record a run that reaches out and leans, with a gap, partial joint states and NaN."""
    rng = np.random.default_rng(7)
    start = 1_700_000_000 * NS
    path = folder / 'run'
    with BagWriter(path) as writer:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState', Qos())
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu', Qos())
        for k in range(int(SECONDS * 200)):
            t = k / 200
            now = start + k * NS // 200
            if k % 2 == 0:
                writer.write('/joint_states', now, joint_message(t, now - 400_000, rng))
            if not 2.0 < t < 2.8:
                writer.write('/imu/data', now + 1_000_000, imu_message(t, now, rng))
    return path


def joint_message(t: float, stamp: int, rng: np.random.Generator) -> bytes:
    """Return the arm on its way out and back; no two are alike."""
    reach = math.sin(math.pi * t / SECONDS)
    arm = 1.8 - 1.8 * reach + rng.normal(0, 1e-4)
    names = ['turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint']
    q = [rng.normal(0, 1e-4), arm, -2.2 + 2.2 * reach, rng.normal(0, 1e-4)]
    if int(t * 100) % 7 == 0:  # a driver that reports the flipper on its own
        names, q = names[:3], q[:3]
    if int(t * 100) % 90 == 45:
        q[1] = math.nan
    return joint_state_cdr(stamp, 'base_link', names, q, [0.0] * len(q), [0.0] * len(q))


def imu_message(t: float, stamp: int, rng: np.random.Generator) -> bytes:
    """Return a slope that rises to 20 degrees on the right."""
    roll = math.radians(20) * math.sin(math.pi * t / SECONDS) + rng.normal(0, 1e-5)
    orientation = (math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2))
    force = (0.0, 9.81 * math.sin(roll), 9.81 * math.cos(roll))
    return imu_cdr(stamp, 'imu_link', orientation, (0.2, 0.0, 0.0), force)


def recorded(path: Path) -> tuple[dict[Any, Any], list[Alert], int]:
    """Return margins by (joint positions, gravity), alerts, and the start (ns) of the recording."""
    bag = open_bag(path)
    evaluator = RecordedEvaluator(load().settings, detail=True)
    evaluator.start(bag.start_ns)
    margins = {}
    for batch in bag.batches(choose_topics(bag)):
        rows = evaluator.batch(batch)
        for k in np.flatnonzero(rows.known):
            key = (tuple(rows.q[k].tolist()), tuple(rows.gravity[k].tolist()))
            margins[key] = numbers_of(rows.torque[k], rows.angle[k], rows.moment[k], rows.energy[k])
    evaluator.finish(bag.end_ns)
    return margins, list(evaluator.watch.log), bag.start_ns


def numbers_of(*parts: Any) -> np.ndarray:
    """Return the numbers of one row in one array."""
    return np.concatenate([np.asarray(part, np.float64) for part in parts])


def played(live: Live, path: Path) -> tuple[dict[Any, Any], list[Alert], Any, int]:
    """Play the recording by the player in a process of its own into a monitor in this one."""
    monitor = live.monitor(publish_rate=0.0)
    found = {}

    def take(_: int, margins: Margins) -> None:
        tip = margins.stability
        key = (margins.q, margins.gravity)
        found[key] = numbers_of(margins.torque, tip.angle, tip.moment, tip.energy)

    session_of(monitor).on_margins = take
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    code = 'from ugv_acceptance.cli import main; main()'
    process = subprocess.Popen(
        [sys.executable, '-c', code, 'replay', str(path), '--restamp'],
        env=environment,
        stdout=subprocess.DEVNULL,
    )
    try:
        live.until(lambda: session_of(monitor).counts['imu'].taken > 0)
        began = session_of(monitor).clock.now()
        strangers = [
            len(monitor.get_publishers_info_by_topic(t)) for t in ('/joint_states', '/imu/data')
        ]
        assert strangers == [1, 1], 'somebody else publishes here'
        end = time.monotonic() + SECONDS - 0.5
        live.until(lambda: time.monotonic() > end)
        live.until(lambda: process.poll() is not None)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 0
    session = session_of(monitor)
    return found, list(session.evaluator.watch.log), session, began


def kind_of(alert: Alert) -> tuple[str, str, int]:
    """Return what an alert is about."""
    return alert.rule.code, alert.rule.subject, alert.rule.level


def ordered(alerts: list[Alert]) -> list[Alert]:
    """Return alerts by kind, then by time."""
    return sorted(alerts, key=lambda alert: (kind_of(alert), alert.start))


def test_live_equals_bag(live: Live, tmp_path: Path) -> None:
    """Equal margins (1e-12) for equal pairs of messages, and the same alerts at the same times."""
    path = write_run(tmp_path)
    bag_margins, bag_alerts, start = recorded(path)
    live_margins, live_alerts, session, began = played(live, path)
    joints, imus = session.counts['joint_states'], session.counts['imu']
    counts = open_bag(path).topics
    assert (joints.taken, imus.taken) == (counts['/joint_states'].count, counts['/imu/data'].count)

    both = bag_margins.keys() & live_margins.keys()
    assert len(both) > 0.5 * len(bag_margins)
    for key in both:
        np.testing.assert_allclose(live_margins[key], bag_margins[key], rtol=1e-12, atol=1e-12)

    # Before the player began and after it ended nothing came: true, but not in the recording.
    during = [a for a in live_alerts if a.start > began - NS // 10]
    during = [a for a in during if a.rule.code != 'INPUT_STALE' or a.start < joints.last]
    assert [kind_of(a) for a in ordered(during)] == [kind_of(a) for a in ordered(bag_alerts)]
    for ours, theirs in zip(ordered(during), ordered(bag_alerts), strict=True):
        assert abs((ours.start - began) - (theirs.start - start)) < LATE
        if ours.end is not None and theirs.end is not None:
            assert abs((ours.end - began) - (theirs.end - start)) < LATE


def test_the_run_has_what_makes_it_hard(tmp_path: Path) -> None:
    """The run above raises alerts of every kind that the comparison is about."""
    _, alerts, _ = recorded(write_run(tmp_path))
    hard = {'TORQUE_LIMIT', 'TIP_OVER', 'INPUT_STALE', 'INPUT_INVALID'}
    assert hard <= {alert.rule.code for alert in alerts}
