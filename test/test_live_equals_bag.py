"""The same messages through real DDS into the monitor and from the recording: equal results."""

import math
import os
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nodes.live_case import Live, live_nodes, ros_context, session_of

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.reader import choose_topics, open_bag
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.monitoring.certainty import CODE as MARGIN_UNCERTAIN

NS = 1_000_000_000
SECONDS = 8.0
# Alerts may begin and end this much later live (ns): transport and a busy machine.
LATE = 1_000_000_000
# Silence (s) that is stale: shorter than the run's GAP (s), longer than a machine stands still.
PATIENCE, GAP = 1.2, (0.5, 2.5)


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
            if not GAP[0] < t < GAP[1]:
                writer.write('/imu/data', now + 1_000_000, imu_message(t, now, rng))
    return path


def joint_message(t: float, stamp: int, rng: np.random.Generator) -> bytes:
    """Return the arm on its way out and back; no two are alike."""
    reach = math.sin(math.pi * t / SECONDS)
    arm = 1.8 - 1.8 * reach + rng.normal(0, 1e-4)
    names = ['turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint']
    q = [rng.normal(0, 1e-4), arm, -2.2 + 2.2 * reach, rng.normal(0, 1e-4)]
    # A driver that reports the flipper on its own, and begins to do so late.
    if t < 0.8 or int(t * 100) % 7 == 0:
        names, q = names[:3], q[:3]
    if int(t * 100) % 90 == 45:
        q[1] = math.nan
    return joint_state_cdr(stamp, 'base_link', names, q, [0.0] * len(q), [0.0] * len(q))


def imu_message(t: float, stamp: int, rng: np.random.Generator) -> bytes:
    """Return a slope that rises to 20 degrees on the right."""
    roll = math.radians(20) * math.sin(math.pi * t / SECONDS) + rng.normal(0, 1e-5)
    orientation = (math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2))
    force = (0.0, 9.81 * math.sin(roll), 9.81 * math.cos(roll))
    turning = math.radians(20) * math.pi / SECONDS * math.cos(math.pi * t / SECONDS)
    return imu_cdr(stamp, 'imu_link', orientation, (turning, 0.0, 0.0), force)


@dataclass
class Evaluated:
    """Margins by (joint positions, gravity), and alerts."""

    margins: dict[Any, Any]
    alerts: list[Alert]


@dataclass
class Played:
    """One playing of `run`: what came live; in `heard` what was heard, by its receipt times."""

    run: Path
    heard: Path
    live: Evaluated
    started: int
    began: int
    ended: int
    counts: dict[str, int]


def policy() -> Settings:
    """Return the PackBot's settings, with patience for a busy machine that holds messages up."""
    settings = load().settings
    return replace(settings, delays=replace(settings.delays, stale_after=PATIENCE))


def numbers_of(*parts: Any) -> np.ndarray:
    """Return the numbers of one row in one array."""
    return np.concatenate([np.asarray(part, np.float64) for part in parts])


def recorded(path: Path, start: int | None = None, end: int | None = None) -> Evaluated:
    """Evaluate a recording from `start` to `end` (ns; None: its own)."""
    bag = open_bag(path)
    evaluator = RecordedEvaluator(policy(), detail=True)
    evaluator.start(bag.start_ns if start is None else start)
    margins = {}
    for batch in bag.batches(choose_topics(bag)):
        rows = evaluator.batch(batch)
        for k in np.flatnonzero(rows.known):
            key = (tuple(rows.q[k].tolist()), tuple(rows.gravity[k].tolist()))
            margins[key] = numbers_of(rows.torque[k], rows.angle[k], rows.moment[k], rows.energy[k])
    evaluator.finish(bag.end_ns if end is None else end)
    return Evaluated(margins, list(evaluator.watch.log))


def of_the_evaluator(log: Iterable[Alert]) -> list[Alert]:
    """Return the alerts without MARGIN_UNCERTAIN: of a recording the verdict has every bound.

    Live the session looks twice a second of its own clock, so when it is told depends on that.
    """
    return [alert for alert in log if alert.rule.code != MARGIN_UNCERTAIN]


@contextmanager
def written_down(path: Path) -> Iterator[None]:
    """Record what every live evaluator takes, with the time of receipt that it was told."""
    joint_state, imu = LiveEvaluator.joint_state, LiveEvaluator.imu
    with BagWriter(path) as writer, pytest.MonkeyPatch.context() as patch:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState', Qos())
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu', Qos())

        def take_joints(self: Any, now: int, stamp: int, names: Any, *arrays: Any) -> Any:
            writer.write('/joint_states', now, joint_state_cdr(stamp, '', names, *arrays))
            return joint_state(self, now, stamp, names, *arrays)

        def take_imu(self: Any, now: int, stamp: int, q: Any, first: float, *v: Any) -> Any:
            covariances = ((first, *(0.0,) * 8), (0.0,) * 9, (0.0,) * 9)
            writer.write('/imu/data', now, imu_cdr(stamp, '', q, v[0], v[1], covariances))
            return imu(self, now, stamp, q, first, *v)

        patch.setattr(LiveEvaluator, 'joint_state', take_joints)
        patch.setattr(LiveEvaluator, 'imu', take_imu)
        yield


def play(live: Live, run: Path, heard: Path) -> Played:
    """Play a run by the player in a process of its own into a monitor in this one."""
    live.alone()
    monitor = live.monitor(publish_rate=0.0, delays__stale_after_s=PATIENCE)
    session, found = session_of(monitor), {}

    def take(_: int, margins: Margins) -> None:
        tip = margins.stability
        key = (margins.q, margins.gravity)
        found[key] = numbers_of(margins.torque, tip.angle, tip.moment, tip.energy)

    session.on_margins = take
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    code = 'from ugv_acceptance.cli import main; main()'
    command = [sys.executable, '-c', code, 'replay', str(run), '--restamp']
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as process:
        live.until(lambda: session.counts['imu'].taken > 0)
        began = session.clock.now()
        topics = ('/joint_states', '/imu/data')
        live.until(lambda: [monitor.count_publishers(topic) for topic in topics] == [1, 1])
        live.until(lambda: process.poll() is not None)
    end = time.monotonic() + 0.5  # what is on its way when the player ends
    live.until(lambda: time.monotonic() > end)
    ended = session.clock.now()
    session.evaluator.tick(ended)
    counts = {name: count.taken for name, count in session.counts.items()}
    alerts = of_the_evaluator(session.evaluator.watch.log)
    started = session.evaluator.fresh[0].started
    return Played(run, heard, Evaluated(found, alerts), started, began, ended, counts)


@pytest.fixture(scope='module')
def played(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Played]:
    """Play the run once for all tests."""
    folder = tmp_path_factory.mktemp('live')
    run, heard = write_run(folder), folder / 'heard'
    with ros_context(), live_nodes() as live:
        with written_down(heard):
            found = play(live, run, heard)
        yield found


def kind_of(alert: Alert) -> tuple[str, str, int]:
    """Return what an alert is about."""
    return alert.rule.code, alert.rule.subject, alert.rule.level


def begun(alerts: list[Alert]) -> dict[tuple[str, str, int], int]:
    """Return when the first alert of each kind began (ns)."""
    return {kind_of(alert): alert.start for alert in reversed(ordered(alerts))}


def ordered(alerts: list[Alert]) -> list[Alert]:
    """Return alerts by kind, then by time."""
    return sorted(alerts, key=lambda alert: (kind_of(alert), alert.start))


def test_no_message_is_lost(played: Played) -> None:
    """The monitor takes every message of the recording."""
    topics = open_bag(played.run).topics
    assert played.counts['joint_states'] == topics['/joint_states'].count
    assert played.counts['imu'] == topics['/imu/data'].count


def test_equal_pairs_have_equal_margins(played: Played) -> None:
    """A pair of messages gives the same margins live and from the recording, to 1e-12."""
    bag = recorded(played.run).margins
    both = bag.keys() & played.live.margins.keys()
    assert len(both) > 0.5 * len(bag)
    for key in both:
        np.testing.assert_allclose(played.live.margins[key], bag[key], rtol=1e-12, atol=1e-12)


def test_what_was_heard_gives_the_same_margins_from_a_bag(played: Played) -> None:
    """A recording of the messages the monitor received gives exactly its margins."""
    bag = recorded(played.heard, played.started, played.ended).margins
    assert bag.keys() == played.live.margins.keys()
    for key, numbers in bag.items():
        np.testing.assert_allclose(played.live.margins[key], numbers, rtol=1e-12, atol=1e-12)


def test_what_was_heard_gives_the_same_alerts_from_a_bag(played: Played) -> None:
    """A recording of what the monitor heard gives its alerts: kind, start, end and peak."""
    ours = ordered(played.live.alerts)
    theirs = ordered(recorded(played.heard, played.started, played.ended).alerts)
    assert [kind_of(a) for a in ours] == [kind_of(a) for a in theirs]
    assert [(a.start, a.end) for a in ours] == [(a.start, a.end) for a in theirs]
    np.testing.assert_allclose([a.peak for a in ours], [a.peak for a in theirs], rtol=1e-12)


def test_the_recording_gives_the_same_alerts(played: Played) -> None:
    """The recording that was played gives the alerts that came live, as late as transport is.

    Of each kind the first: what is over for a moment is told twice where the machine is busy.
    """
    theirs, start = begun(recorded(played.run).alerts), open_bag(played.run).start_ns
    # Before the player began and after it ended nothing came: true, but not in the recording.
    during = [a for a in played.live.alerts if a.start > played.began - NS // 10]
    ours = begun([a for a in during if a.start < played.began + SECONDS * NS])
    assert ours.keys() == theirs.keys()
    for kind, live in ours.items():
        assert abs((live - played.began) - (theirs[kind] - start)) < LATE


def test_the_run_has_what_makes_it_hard(played: Played) -> None:
    """The run raises alerts of every kind that the comparison is about."""
    hard = {'TORQUE_LIMIT', 'TIP_OVER', 'INPUT_STALE', 'INPUT_INVALID', 'INPUT_INCOMPLETE'}
    assert hard <= {alert.rule.code for alert in recorded(played.run).alerts}
