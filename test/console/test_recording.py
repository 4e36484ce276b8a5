"""A recording's frames against the live evaluator fed with the same messages."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nodes.live_case import imu, joints

from ugv_acceptance import BadSample
from ugv_acceptance.bag.encode import inertia_cdr, joint_state_cdr
from ugv_acceptance.bag.recording import open_recording
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import load
from ugv_acceptance.console.recording import RecordingFeed, ShownRecording, shown_recording
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR, has_tipped
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE
from ugv_acceptance.evaluation.live import LiveEvaluator

CONFIG = load('packbot')
SETTINGS = CONFIG.settings
BAGS = Path(__file__).parents[2] / 'bags'


def judged(name: str) -> ShownRecording:
    """Return one of the recordings that ship."""
    return shown_recording(open_recording(BAGS / name), CONFIG)


@pytest.fixture(scope='module')
def fail() -> ShownRecording:
    """Return the run that tips over."""
    return judged('packbot_fail')


def test_frames_are_those_of_the_live_evaluator(fail: ShownRecording) -> None:
    """At every row of the track the live evaluator, fed message by message, knows the same."""
    bag, live = fail.bag, LiveEvaluator(SETTINGS)
    live.start(bag.start_ns)
    wanted = {int(t): k for k, t in enumerate(fail.track.time)}
    compared = 0
    for when, kind, row in messages(fail):
        if kind == 'joints':
            live.joint_state(when, *row)
        elif kind == 'imu':
            live.imu(when, *row)
        else:
            live.carry(when, *row)
        k = wanted.get(when)
        if k is None or live.margins is None or live.margins.time != when:
            continue
        compared += 1
        shown = fail.snapshot_at(when)
        assert shown.torque == pytest.approx(live.margins.torque, abs=1e-9)
        assert shown.angle == pytest.approx(live.margins.stability.angle, abs=1e-9)
        assert shown.q == live.margins.q
        assert shown.payload == live.payload
    assert compared > 500


def test_after_the_fall_every_alert_says_to_stand_clear(fail: ShownRecording) -> None:
    """What is active while the robot lies there advises no motion; before that it does."""
    said: dict[bool, set[str]] = {True: set(), False: set()}
    for k in range(240, 290):
        shown = fail.snapshot_at(fail.bag.start_ns + k * 100_000_000)
        if shown.known:
            active = {row.advice for row in shown.alerts if row.end is None}
            said[has_tipped(shown.angle)] |= active
    assert said[True] == {STAND_CLEAR}
    assert STAND_CLEAR not in said[False]
    assert any('elbow' in words for words in said[False])


def messages(recording: ShownRecording) -> list[tuple[int, str, tuple[Any, ...]]]:
    """Return a recording's messages one by one, in order of receipt."""
    found: list[tuple[int, str, tuple[Any, ...]]] = []
    for batch in recording.bag.batches(recording.evaluation.judgement.topics):
        for p in batch.payload:
            for k, when in enumerate(p.log_time.tolist()):
                found.append((when, 'load', (float(p.mass[k]), p.com[k].tolist(), p.frame_id)))
        for j in batch.joints:
            rows = zip(
                j.log_time.tolist(),
                j.stamp.tolist(),
                j.position.tolist(),
                j.velocity.tolist(),
                j.effort.tolist(),
                strict=True,
            )
            found += [(t, 'joints', (stamp, j.names, *rest)) for t, stamp, *rest in rows]
        for i in batch.imu:
            columns = zip(
                i.log_time.tolist(),
                i.stamp.tolist(),
                i.orientation.tolist(),
                i.orientation_covariance_0.tolist(),
                i.angular_velocity.tolist(),
                i.linear_acceleration.tolist(),
                strict=True,
            )
            found += [(t, 'imu', tuple(rest)) for t, *rest in columns]
    return sorted(found, key=lambda m: m[0])


def test_the_level_follows_the_alerts(fail: ShownRecording) -> None:
    """Early in the run all is well, at its end it is not."""
    start = fail.bag.start_ns
    assert fail.snapshot_at(start + 1_500_000_000).level == OK
    assert fail.snapshot_at(start + 28_000_000_000).level == ERROR


def test_a_gap_is_no_data() -> None:
    """While the IMU was silent there are no margins, and the input says so."""
    gap = judged('packbot_gap')
    shown = gap.snapshot_at(gap.bag.start_ns + 9_500_000_000)
    assert (shown.level, shown.known, shown.torque) == (STALE, False, ())
    assert [row.level for row in shown.inputs] == [OK, STALE, OK]
    assert gap.snapshot_at(gap.bag.start_ns + 13_000_000_000).known


def recorded(folder: Path, *parts: tuple[str, float, float, float]) -> ShownRecording:
    """Return a recording of parts: (topic, Hz, from, to) in seconds."""
    types = {
        '/joint_states': 'sensor_msgs/msg/JointState',
        '/imu/data': 'sensor_msgs/msg/Imu',
        '/payload': 'geometry_msgs/msg/InertiaStamped',
    }
    link = SETTINGS.robot.payload_link or ''
    rows = [
        (10**9 + round((start + k / hertz) * 1e9), topic)
        for topic, hertz, start, end in parts
        for k in range(round((end - start) * hertz))
    ]
    with BagWriter(folder) as writer:
        for topic, kind in types.items():
            writer.add_topic(topic, kind, Qos())
        for when, topic in sorted(rows):
            data = {
                '/joint_states': lambda t: joints(stamp=t),
                '/imu/data': lambda t: imu(stamp=t),
                '/payload': lambda t: inertia_cdr(t, link, 1.0, (0.0, 0.0, 0.0)),
            }[topic](when)
            writer.write(topic, when, data)
    return shown_recording(open_recording(folder), CONFIG)


def rates_at(recording: ShownRecording, seconds: float) -> list[float]:
    """Return the rates shown of joint states, IMU and payload, so long after the start."""
    shown = recording.snapshot_at(10**9 + round(seconds * 1e9))
    return [row.rate for row in shown.inputs]


def test_the_rate_is_that_of_the_moment(tmp_path: Path) -> None:
    """Each input's Hz are those at which it came then, not what they were or were to be."""
    made = recorded(
        tmp_path / 'run',
        ('/joint_states', 50.0, 0.0, 8.0),
        ('/joint_states', 20.0, 8.0, 16.0),
        ('/imu/data', 100.0, 0.0, 16.0),
        ('/payload', 1.0, 4.0, 10.0),
    )
    assert rates_at(made, 2.0) == pytest.approx([50.0, 100.0, 0.0], rel=0.01)
    assert rates_at(made, 7.5) == pytest.approx([50.0, 100.0, 1.0], rel=0.01)
    assert rates_at(made, 15.0) == pytest.approx([20.0, 100.0, 0.0], rel=0.01)


def test_a_short_recording_shows_its_rates(tmp_path: Path) -> None:
    """A few messages are enough: an input of 5 Hz shows 5 Hz after two seconds."""
    made = recorded(
        tmp_path / 'run', ('/joint_states', 5.0, 0.0, 3.0), ('/imu/data', 10.0, 0.0, 3.0)
    )
    assert rates_at(made, 2.0) == pytest.approx([5.0, 10.0, 0.0], rel=0.01)


def test_pairs_of_messages_are_two(tmp_path: Path) -> None:
    """What comes in pairs comes at twice the rate of the pairs, not of what is between the two."""
    made = recorded(
        tmp_path / 'run',
        ('/joint_states', 10.0, 0.0, 8.0),
        ('/joint_states', 10.0, 0.001, 8.001),
        ('/imu/data', 50.0, 0.0, 8.0),
    )
    assert rates_at(made, 6.0) == pytest.approx([20.0, 50.0, 0.0], rel=0.02)


def test_a_rate_is_not_taken_over_a_gap() -> None:
    """The messages behind a gap show at which rate they come."""
    gap = judged('packbot_gap')
    start = gap.bag.start_ns
    (_, imu_row, _) = gap.snapshot_at(start + 11_500_000_000).inputs
    assert imu_row.rate == pytest.approx(200.0, rel=0.02)


def test_a_recording_without_one_margin_can_be_shown(tmp_path: Path) -> None:
    """Joint states alone: nothing is known at any time, and there is a timeline all the same."""
    with BagWriter(tmp_path / 'run') as writer:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState', Qos())
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu', Qos())
        for k in range(5):
            writer.write('/joint_states', 10**9 + k, joint_state_cdr(10**9 + k, '', ['a'], [0.0]))
    shown = shown_recording(open_recording(tmp_path / 'run'), CONFIG)
    bag = shown.bag
    for when in (bag.start_ns, bag.end_ns):
        snapshot = shown.snapshot_at(when)
        assert (snapshot.level, snapshot.known) == (STALE, False)
    assert set(shown.timeline()['tilt_deg']) == {None}
    assert shown.timeline()['verdict'] == 'INCONCLUSIVE'


@settings(max_examples=60)
@given(st.floats(-5.0, 40.0))
def test_no_alert_tells_what_is_yet_to_come(fail: ShownRecording, seconds: float) -> None:
    """At any time an alert of tipping over tells the worst up to then, not later."""
    when = fail.bag.start_ns + int(seconds * 1e9)
    shown = fail.snapshot_at(when)
    known = np.fmin.reduce(fail.track.angle[: fail.track.row(when) + 1], axis=None, initial=np.inf)
    for row in shown.alerts:
        assert row.start <= when
        if row.code == 'TIP_OVER' and 'before the robot tips' in row.text:
            said = float(row.text.split(' degrees')[0])
            assert said >= math.degrees(known) - 0.1


def test_the_timeline_holds_every_alert_and_the_worst(fail: ShownRecording) -> None:
    """The timeline has the judgement's verdict, all its alerts, and the least tilt left."""
    line, result = fail.timeline(), fail.evaluation.result
    assert line['verdict'] == result['verdict'] == 'FAIL'
    assert len(line['alerts']) == len(result['alerts'])
    least = min(x for x in line['tilt_deg'] if x is not None)
    assert least == pytest.approx(result['stability']['min_angle_deg'], abs=1e-5)


def test_commands_are_checked(fail: ShownRecording) -> None:
    """A recording plays, pauses, seeks; what it cannot do is refused with words."""
    feed = RecordingFeed(fail, now=lambda: 0.0)
    feed.command('seek', {'to_s': 7})
    feed.command('pause', {})
    assert feed.extra()['playback'] == {'position_s': 7.0, 'playing': False, 'speed': 1.0}
    for do, values in (
        ('seek', {'to_s': 'x'}),
        ('seek', {'to_s': math.nan}),
        ('seek', {'to_s': True}),
        ('seek', {'to_s': 10**400}),
        ('speed', {'speed': 3}),
        ('acknowledge', {}),
    ):
        with pytest.raises(BadSample):
            feed.command(do, values)
