"""The monitor's session without ROS: message bytes in, margins and alerts out."""

import struct
import time
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from bag.bag_cases import cdr, joint_state
from hypothesis import given
from hypothesis import strategies as st
from nodes.live_case import FOLDED, NAMES, imu, joints

from ugv_acceptance import BadConfig
from ugv_acceptance.bag.encode import JointStateBytes, joint_state_cdr
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts.messages import LIVE
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE, Alert, Rule
from ugv_acceptance.evaluation.ground import CARRIED
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Untold
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.monitoring.alarm_tracker import KEPT, AlarmTracker
from ugv_acceptance.monitoring.diagnostics import diagnostics_of, verdict_of
from ugv_acceptance.monitoring.receipt_clock import RESHIFT, ReceiptClock, StampShift
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.guarded import guarded
from ugv_acceptance.nodes.monitor.parameters import (
    changed,
    check_locked,
    knobs_of,
    unknown,
)

CONFIG = load()
NS = 1_000_000_000


def session(problems: list[str] | None = None) -> Session:
    """Return a session of the PackBot whose problems are written to a list."""
    told = [] if problems is None else problems
    return Session(CONFIG.settings, lambda _s, _m: None, lambda: None, told.append)


@dataclass(slots=True)
class Stopwatch:
    """A clock that shows what it is set to (ns)."""

    at: int

    def now(self) -> int:
        """Return that."""
        return self.at


GOOD = {'joint_states': joints(stamp=NS), 'imu': imu(stamp=NS)}


@st.composite
def mutated(draw: st.DrawFn) -> tuple[str, bytes]:
    """Draw a good message with bytes changed, cut or added; or any bytes at all."""
    name = draw(st.sampled_from(sorted(GOOD)))
    if draw(st.booleans()):
        return name, draw(st.binary(max_size=300))
    data = bytearray(GOOD[name])
    for _ in range(draw(st.integers(0, 4))):
        data[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
    return name, bytes(data[: draw(st.integers(0, len(data)))]) + draw(st.binary(max_size=9))


@given(st.lists(mutated(), max_size=8))
def test_no_bytes_end_the_session(messages: list[tuple[str, bytes]]) -> None:
    """Whatever comes is evaluated or counted as malformed; our own code never faults on it."""
    watched = session()
    takes = {'joint_states': watched.take_joint_state, 'imu': watched.take_imu}
    for name, data in messages:
        takes[name](data)
    watched.tick()
    taken = sum(count.taken + count.malformed for count in watched.counts.values())
    assert taken == len(messages)
    assert 'MONITOR_FAULT' not in [alert.rule.code for alert in watched.evaluator.watch.log]


def test_a_fault_of_ours_is_an_error_and_not_the_end() -> None:
    """An exception in the evaluation is reported, and leaves no margins behind."""
    problems: list[str] = []
    watched = session(problems)

    def broken(*_: Any) -> None:
        raise ZeroDivisionError

    watched.take_imu(imu())
    watched.take_joint_state(joints())
    before = watched.evaluator.margins
    watched._guard('imu', broken)(b'')
    assert before is not None
    assert watched.evaluator.margins is None
    assert watched.level == STALE
    assert problems
    assert [alert.rule.code for alert in watched.faults.active] == ['MONITOR_FAULT']


def test_a_fault_in_a_timer_is_an_error_and_not_the_end() -> None:
    """What fails in a timer's work is told, leaves the margins unknown, and does not come out."""
    told: list[str] = []
    watched = session(told)

    class Watching:
        """A monitor as far as a timer needs one."""

        session: Session | None = watched

        def get_logger(self) -> Any:
            return SimpleNamespace(error=lambda text, **_: told.append(text))

    def tick() -> None:
        raise ZeroDivisionError

    guarded(Watching(), tick)()
    assert watched.evaluator.margins is None
    assert any('ZeroDivisionError' in text for text in told)
    assert any(alert.rule.code == 'MONITOR_FAULT' for alert in watched.active)


def test_margins_come_with_the_second_input() -> None:
    """Either input alone gives no margins; both do, and then every message."""
    got: list[int] = []
    watched = Session(CONFIG.settings, lambda s, _: got.append(s), lambda: None, lambda _: None)
    stamp = time.time_ns()
    watched.take_imu(imu(stamp=stamp))
    assert got == []
    watched.take_joint_state(joints(stamp=stamp + 1))
    watched.take_imu(imu(stamp=stamp + 2))
    assert got == [stamp + 1, stamp + 2]
    assert watched.level == OK


def test_joints_of_another_robot_are_named_live() -> None:
    """Messages that name no joint of the robot are told with their names, and `init` is."""
    clock = Stopwatch(NS)
    watched = Session(CONFIG.settings, lambda _s, _m: None, lambda: None, lambda _t: None, clock)
    for _ in range(100):
        clock.at += NS // 50
        names = ('front_left_wheel', 'front_right_wheel')
        watched.take_joint_state(joint_state_cdr(clock.at, '', names, (0.1, 0.2)))
        watched.take_imu(imu(stamp=clock.at))
        watched.tick()
    status = verdict_of(watched)
    assert status.level == STALE
    assert 'front_left_wheel, front_right_wheel' in status.message
    assert 'ugv-acceptance init' in status.message


def test_any_clock_dates_what_is_heard() -> None:
    """Receipt, silence and faults are dated by the clock that is given, nothing by another."""
    clock, told = Stopwatch(time.time_ns()), list[str]()
    got: list[Margins] = []
    watched = Session(CONFIG.settings, lambda _, m: got.append(m), lambda: None, told.append, clock)
    for _ in range(20):
        clock.at += NS // 50
        watched.take_imu(imu(stamp=clock.at))
        watched.take_joint_state(joints(stamp=clock.at))
    assert (told, got[-1].time) == ([], clock.at)
    assert watched.level == OK
    clock.at += 100 * NS
    watched.tick()
    assert {a.rule.code for a in watched.active} == {'INPUT_STALE'}


@given(
    st.integers(0, 2**31 - 1),
    st.lists(st.tuples(st.floats(width=64), st.floats(width=64)), min_size=1, max_size=8),
)
def test_filled_bytes_are_the_message(sec: int, pairs: list[tuple[float, float]]) -> None:
    """A filled template is byte for byte what serialising the message gives."""
    names = [f'joint_{k}' for k in range(len(pairs))]
    position, effort = zip(*pairs, strict=True)
    template = JointStateBytes(names, 'base')
    template.fill(5, [1.0] * len(names), [2.0] * len(names))
    data = template.fill(sec * NS + 7, position, effort)
    assert data == joint_state_cdr(sec * NS + 7, 'base', names, position, (), effort)
    whole = cdr(joint_state((sec, 7), 'base', names, (position, (), effort)))
    assert data == whole[: len(data)]


def test_the_receipt_clock_is_the_wall_clock_at_first() -> None:
    """Receipt times are nanoseconds since the epoch."""
    assert abs(ReceiptClock().now() - time.time_ns()) < NS


@given(st.integers(0, 2**60), st.integers(0, 2**60))
def test_simulated_stamps_are_shifted_into_receipt_time(now: int, simulated: int) -> None:
    """After /clock was seen, a stamp of its time is the time of receipt, within the slack."""
    stamps = StampShift(simulated=True)
    stamps.follow(now, simulated)
    assert abs(stamps.stamp(now, simulated) - now) <= RESHIFT


@given(st.integers(0, 2**60), st.lists(st.integers(0, 10**10), min_size=1, max_size=50))
def test_a_simulated_stamp_that_stands_still_does_so_whatever_the_clock_does(
    first: int, steps: list[int]
) -> None:
    """A slow or frozen /clock moves the shift, but not what a stamp was converted to."""
    stamps, now = StampShift(simulated=True), first
    stamps.follow(now, first // 2 + 1)
    still = stamps.stamp(now, first // 2)
    for step in steps:
        now += step
        stamps.follow(now, first // 2 + 1)
        assert stamps.stamp(now, first // 2) == still


def test_real_stamps_are_not_shifted() -> None:
    """Without use_sim_time nothing moves a stamp."""
    stamps = StampShift()
    stamps.follow(10 * NS, 3 * NS)
    assert stamps.stamp(10 * NS, 4 * NS) == 4 * NS


def alert(k: int, code: str = 'TIP_OVER') -> Alert:
    """Return an alert that begins at `k`."""
    return Alert(Rule(code, 'front', ERROR, 0.0, 0.0, 0, 0), k, 1.0)


def test_the_follower_tells_each_change_once() -> None:
    """An alert is raised once and cleared once."""
    log: list[Alert] = []
    alarm_tracker = AlarmTracker(log)
    assert not alarm_tracker.changed()
    log.append(alert(1))
    assert alarm_tracker.changed()
    assert [change.how for change in alarm_tracker.take()] == ['raised']
    assert not alarm_tracker.changed()
    log[0].end = 2
    assert [change.how for change in alarm_tracker.take()] == ['cleared']
    assert alarm_tracker.take() == []


def test_an_alert_shorter_than_a_look_is_told() -> None:
    """An alert raised and cleared between two looks is told as both, in that order."""
    short = alert(1)
    short.end = 2
    alarm_tracker = AlarmTracker([short])
    assert [change.how for change in alarm_tracker.take()] == ['raised', 'cleared']


@given(st.lists(st.integers(0, 400), max_size=30))
def test_memory_stays_bounded(bursts: list[int]) -> None:
    """Of cleared alerts no more than a fixed number is kept; active ones are never forgotten."""
    log: list[Alert] = [alert(0, 'NO_SUPPORT')]
    alarm_tracker = AlarmTracker(log)
    active = log[0]
    told = 0
    for burst in bursts:
        for k in range(burst):
            log.append(alert(k))
            log[-1].end = k + 1
        told += len(alarm_tracker.take())
        assert len(log) <= 2 * KEPT + 1
        assert len(alarm_tracker.alarms.table) <= 2
    assert any(found is active for found in log) or not bursts
    assert told == 2 * sum(bursts) + bool(bursts)


def test_what_is_over_and_seen_waits_for_nobody_but_a_tip_over() -> None:
    """Of failures that were acknowledged only a tip-over stays, until it is reset."""
    log = [alert(1), alert(2, 'TORQUE_LIMIT'), alert(2, 'INPUT_STALE')]
    alarm_tracker = AlarmTracker(log)
    alarm_tracker.take()
    assert len(alarm_tracker.alarms.acknowledge(2, 'Ada')) == 3
    for one in log:
        one.end = 3
    alarm_tracker.take()
    assert [alarm.alert for alarm in alarm_tracker.waiting] == [log[0]]
    alarm_tracker.alarms.reset(4, 'Ada')
    assert alarm_tracker.waiting == []


def test_failures_nobody_saw_wait_and_faults_of_inputs_do_not() -> None:
    """Only failures of the robot wait for somebody to have seen them."""
    log = [alert(1, 'TORQUE_LIMIT'), alert(2, 'INPUT_STALE')]
    alarm_tracker = AlarmTracker(log)
    alarm_tracker.take()
    for one in log:
        one.end = 3
    alarm_tracker.take()
    assert [alarm.alert for alarm in alarm_tracker.waiting] == [log[0]]
    alarm_tracker.alarms.acknowledge(4, 'Ada')
    assert alarm_tracker.waiting == []


@pytest.mark.parametrize('tunable', knobs_of(CONFIG.settings), ids=lambda tunable: tunable.name)
def test_a_parameter_reads_what_was_put(tunable: Any) -> None:
    """Putting what was got changes nothing; putting another value is read back."""
    settings = CONFIG.settings
    value = tunable.get(settings)
    assert tunable.get(tunable.put(settings, value)) == pytest.approx(value)
    if tunable.lower is not None:
        other = tunable.lower + 0.25 * (min(tunable.upper, 100.0) - tunable.lower)
        assert tunable.get(tunable.put(settings, other)) == pytest.approx(other)
        assert tunable.lower <= value <= tunable.upper


def test_a_misspelt_parameter_is_said() -> None:
    """A parameter that does not exist gives a warning with the nearest name."""
    (text,) = unknown(['limits.tip_wran_deg'], knobs_of(CONFIG.settings))
    assert 'limits.tip_wran_deg' in text
    assert 'limits.tip_warn_deg' in text


def test_a_big_endian_message_is_read_too() -> None:
    """The byte order is the sender's choice."""
    watched = session()
    watched.take_imu(imu())
    stamp = time.time_ns()
    message = joint_state((stamp // NS, stamp % NS), '', NAMES, (FOLDED, (), ()))
    data = cdr(message, little=False)
    assert struct.unpack_from('>i', data, 4)[0] == stamp // NS
    watched.take_joint_state(data)
    assert watched.evaluator.margins is not None


@pytest.mark.parametrize('tunable', knobs_of(CONFIG.settings), ids=lambda tunable: tunable.name)
def test_every_parameter_is_documented(repository: Path, tunable: Any) -> None:
    """docs/ros_interface.md names every parameter."""
    name = tunable.name if '.limit_' not in tunable.name else 'joints.JOINT.limit_nm'
    assert f'`{name}`' in (repository / 'docs' / 'ros_interface.md').read_text(encoding='utf-8')


@pytest.mark.parametrize('code', LIVE)
def test_every_alert_of_the_node_is_documented(repository: Path, code: str) -> None:
    """docs/ros_interface.md names every alert that only the node raises."""
    assert f'`{code}`' in (repository / 'docs' / 'ros_interface.md').read_text(encoding='utf-8')


def standing_on(kind: str | None, seconds: float = 1.0) -> Session:
    """Return a session of a PackBot that has stood on this kind of ground for so long."""
    clock = Stopwatch(NS)
    ground = replace(CONFIG.settings.ground, kind=kind)
    told = replace(CONFIG.settings, ground=ground)
    watched = Session(told, lambda _s, _m: None, lambda: None, lambda _t: None, clock)
    for _ in range(round(seconds * 50)):
        clock.at += NS // 50
        watched.take_joint_state(joints(stamp=clock.at))
        watched.take_imu(imu(stamp=clock.at))
        watched.tick()
    return watched


def test_the_verdict_says_what_the_ground_is_taken_for() -> None:
    """On flat ground the tilt left is a margin; nobody entered it, and that is said."""
    status = verdict_of(standing_on(None))
    assert (status.level, status.values['ground']) == (OK, 'flat (not entered)')
    assert 'all margins kept' in status.message
    assert 'at most' not in status.message
    assert verdict_of(standing_on('flat')).values['ground'] == 'flat'


@pytest.mark.parametrize('harmless', [True, False])
def test_a_joint_taken_as_held_is_told_and_its_doubt_is_no_ok(*, harmless: bool) -> None:
    """The verdict names it; where it may matter nothing is OK, and no margin is sent."""
    clock, sent = Stopwatch(NS), []
    held = Untold(3.1, harmless=harmless)
    told = replace(CONFIG.settings, untold=(None, None, None, held))
    watched = Session(told, lambda _s, m: sent.append(m), lambda: None, lambda _t: None, clock)
    for _ in range(60):
        clock.at += NS // 50
        data = joint_state_cdr(clock.at, '', NAMES[:3], FOLDED[:3], (), ())
        watched.take_joint_state(data)
        watched.take_imu(imu(stamp=clock.at))
        watched.tick()
    status = verdict_of(watched)
    levels = {s.level for s in diagnostics_of(status, CONFIG, watched, None) if 'T' in s.name[:2]}
    assert (status.level, levels) == ((OK, {OK}) if harmless else (STALE, {STALE}))
    assert bool(sent) == harmless
    assert watched.evaluator.margins is not None
    assert f'never told, taken as held: {NAMES[3]}' in status.message
    assert status.values['untold_joints'] == f'held: {{{NAMES[3]}: 0}}'


def test_on_stairs_no_margin_in_degrees_is_an_ok() -> None:
    """OK means there that the robot has not begun to tip; degrees are an upper bound."""
    watched = standing_on('stairs')
    status = verdict_of(watched)
    assert status.level == OK
    assert 'not begun to tip' in status.message
    assert 'upper bound' in status.message
    assert 'all margins kept' not in status.message
    assert status.values['trend'] == 'OK'
    tip = next(s for s in diagnostics_of(status, CONFIG, watched, None) if s.name == 'Tip-over')
    assert 'upper bound' in tip.message
    least = min(float(str(tip.values[f'{side}_deg'])) for side in SIDES)
    assert float(str(tip.values['cautious_deg'])) < least
    assert tip.values['ground'] == 'stairs'


def test_before_the_trend_is_known_there_are_no_data() -> None:
    """For the first moments on stairs nobody knows if the robot begins to tip."""
    watched = standing_on('stairs', 0.16)
    status = verdict_of(watched)
    assert (status.level, watched.level, status.values['trend']) == (STALE, STALE, 'not known yet')
    assert 'whether the robot begins to tip is not known yet' in status.message
    tip = next(s for s in diagnostics_of(status, CONFIG, watched, None) if s.name == 'Tip-over')
    assert tip.level == STALE


def test_flippers_that_carry_the_body_are_named_beside_the_tilt() -> None:
    """It is a word beside the margin and no alert; on stairs the upper bound says more."""
    for kind, named in ((None, True), ('stairs', False)):
        watched = standing_on(kind)
        low = (*FOLDED[:3], -0.7)
        for _ in range(5):
            watched.clock.at += NS // 50  # type: ignore[attr-defined]  # a Stopwatch
            watched.take_joint_state(joints(low, stamp=watched.clock.now()))
            watched.take_imu(imu(stamp=watched.clock.now()))
        watched.tick()
        assert (CARRIED in verdict_of(watched).message) == named
        assert not [alert for alert in watched.active if alert.rule.code == 'TIP_TREND']


def test_the_kind_of_ground_is_a_parameter_of_the_operator() -> None:
    """It is set while the monitor runs, even with locked parameters; another word is refused."""
    (tunable,) = (k for k in knobs_of(CONFIG.settings) if k.name == 'ground.kind')
    assert tunable.get(CONFIG.settings) == ''
    told = changed(CONFIG.settings, knobs_of(CONFIG.settings), {'ground.kind': 'uneven'})
    assert told.ground.kind == 'uneven'
    assert changed(told, knobs_of(told), {'ground.kind': ''}).ground.kind is None
    with pytest.raises(BadConfig, match=r"ground.kind: expected one of .*, got 'rubble'"):
        changed(told, knobs_of(told), {'ground.kind': 'rubble'})
    check_locked({'ground.kind': 'stairs'}, knobs_of(told))
