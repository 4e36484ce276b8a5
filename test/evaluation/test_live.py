"""Alerts at the exact limits of time and value, equal live and in a recording."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.streams import (
    MS,
    REST,
    T0,
    Carry,
    Imu,
    Joints,
    Message,
    S,
    batch_of,
    give,
    live,
    recorded,
    run_of,
    settings,
    split,
    tilted,
    upright,
)
from robots import tracked

from ugv_acceptance.evaluation.alerts.messages import describe
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, WARN, Alert
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.settings import Delays, ImuInput, JointInput, Limits, Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import margins

FREE = Limits((1e3, 1e3), tip_warn=0.01, tip_error=0.001)
QUICK = Delays(tip_on=0.1, torque_on=0.1, off=0.3, tip_off=0.3)


def told(
    messages: Sequence[Message], end: int, code: str, settings_: Settings | None = None
) -> list[tuple[str, int, int | None, float]]:
    """Return subject, start, end (ms) and peak of the alerts of a code: the same on both roads."""
    chosen = settings_ or settings(limits=FREE, delays=QUICK)
    _, ours = live(chosen, messages, end)
    _, evaluator = recorded(chosen, split(messages, [len(messages) // 3]), end)
    found = [[_facts(a) for a in log if a.rule.code == code] for log in (ours, evaluator.watch.log)]
    assert found[0] == found[1]
    return found[0]


def _facts(a: Alert) -> tuple[str, int, int | None, float]:
    end = None if a.end is None else round((a.end - T0) / MS)
    return a.rule.subject, round((a.start - T0) / MS), end, round(a.peak, 9)


@pytest.mark.parametrize(
    ('rate', 'found'),
    [
        (0.6, [('lift', 300, None, 0.6)]), (-0.6, [('lift', 300, None, 0.6)]), (0.5999, []),
        (-0.5999, []), (math.nan, []),
    ],
)  # fmt: skip
def test_a_speed_at_its_limit_is_too_fast(rate: float, found: Any) -> None:
    """A joint speed equal to its limit raises the alert after its delay, in both directions.

    A reported rate is believed as soon as the positions of 0.2 s have proven it.
    """
    limits = replace(FREE, speed=(0.6, math.inf))
    run = [
        replace(m, position=(0.1 + rate * (m.time - T0) / S, 0.0))
        if isinstance(m, Joints) and rate == rate  # noqa: PLR0124 - not NaN
        else m
        for m in run_of(1.0, joints=Joints(0, velocity=(rate, 9.0)))
    ]
    chosen = settings(limits=limits, delays=QUICK)
    assert told(run, T0 + S, 'STATIC_MODEL', chosen) == found


def test_a_robot_on_two_points_has_no_support() -> None:
    """A robot on two contact points raises NO_SUPPORT after the delay of a tilt."""
    chosen, run = settings(limits=FREE, delays=QUICK), run_of(1.0)
    assert told(run, T0 + S, 'NO_SUPPORT', chosen) == []
    robot = replace(chosen.robot, contacts=chosen.robot.contacts[:2])
    found = told(run, T0 + S, 'NO_SUPPORT', replace(chosen, robot=robot))
    assert found == [('robot', 101, None, 1.0)]


def test_sliding_is_told_from_the_warning_limit_on() -> None:
    """With a friction of 0.3, which holds to 16.7 degrees, a slope of 15 raises the warning."""
    lean = tilted(math.radians(15.0))
    run = run_of(1.0, imu=Imu(0, lean, acceleration=upright(lean)))
    left = math.atan(0.3) - math.radians(15.0)
    for warn, count in ((left + 1e-6, 1), (left - 1e-6, 0)):
        limits = replace(FREE, friction=0.3, tip_warn=warn)
        found = told(run, T0 + S, 'SLIDE', settings(limits=limits, delays=QUICK))
        assert len(found) == count


@pytest.mark.parametrize(('late', 'stale'), [(0, False), (1, True)])
@pytest.mark.parametrize(('silent', 'subject'), [(Joints, 'joint_states'), (Imu, 'imu')])
def test_a_message_on_its_deadline_is_not_late(
    silent: type,
    subject: str,
    late: int,
    stale: bool,  # noqa: FBT001
) -> None:
    """A message exactly at its deadline is in time; one nanosecond later its input was stale.

    Margins are known up to the deadline, itself included, whichever input asks.
    """
    run = run_of(2.0, imu_hz=50.0)
    start = T0 + (MS if silent is Imu else 0)
    last = start + 1480 * MS
    kept = [m for m in run if not (isinstance(m, silent) and last < m.time < last + 200 * MS)]
    other: Message = Imu(last + 100 * MS + late) if silent is Joints else Joints(
        last + 100 * MS + late
    )  # fmt: skip
    asked = sorted([*kept, other], key=lambda m: m.time)
    seen, _ = live(settings(limits=FREE), asked, T0 + 2 * S)
    ((_, found),) = [(m, x) for m, x in seen if m is other]
    assert (found is None) == stale
    rows, _ = recorded(settings(limits=FREE), [asked], T0 + 2 * S)
    assert bool(rows[0].known[rows[0].time == other.time][0]) != stale
    back = Joints(last + 100 * MS + late) if silent is Joints else Imu(last + 100 * MS + late)
    heard = sorted([*kept, back], key=lambda m: m.time)
    alerts = told(heard, T0 + 2 * S, 'INPUT_STALE')
    assert [one[0] for one in alerts] == [subject] * (1 if stale else 0)
    _, evaluator = recorded(settings(), [heard], T0 + 2 * S)
    which = int(silent is Imu)
    gap = [(last + 100 * MS, back.time)] if stale else []
    assert [g for g in evaluator.gaps[which] if g[0] == last + 100 * MS] == gap
    assert evaluator.gaps[1 - which] == []


def test_a_torque_is_told_at_two_levels() -> None:
    """A torque raises WARN and then ERROR as an arm reaches out from 0.5 s to 1 s."""
    run: list[Message] = [Imu(T0 - S)]
    for m in run_of(2.0):
        out = 500 <= (m.time - T0) // MS < 1000
        position = (0.1, 0.3) if out else (-0.9, 0.0)
        run.append(replace(m, position=position) if isinstance(m, Joints) else m)
    chosen = settings(limits=replace(FREE, torque=(45.0, math.inf)), delays=QUICK)
    found = told(run, T0 + 2 * S, 'TORQUE_LIMIT', chosen)
    assert found == [('lift', 600, 1300, round(9.81 * 4.75, 9))] * 2


@pytest.mark.parametrize(('room', 'count'), [(-0.01, 0), (0.001, 1), (0.01, 2)])
def test_a_tilt_is_told_at_two_levels(room: float, count: int) -> None:
    """A tilt raises WARN and then ERROR on ground that leans by 20 degrees from 1 s on."""
    lean, chosen = tilted(math.radians(20.0)), settings()
    gravity = -np.array(upright(lean))
    left = float(margins(chosen.robot, (0.0, 0.0), gravity).angle.min())
    run: list[Message] = [Imu(T0 - S)]
    for m in run_of(2.0):
        tilt = lean if (m.time - T0) // MS >= 1000 else tilted(0.001)
        one = replace(m, orientation=tilt, acceleration=upright(tilt)) if isinstance(m, Imu) else m
        run.append(one)
    limits = replace(FREE, tip_warn=left + room, tip_error=left + room - 0.005)
    chosen = settings(ImuInput(agreement=9.0), QUICK, limits)
    found = told(run, T0 + 2 * S, 'TIP_OVER', chosen)
    assert found == [('right', 1101, None, round(-left, 9))] * count


@pytest.mark.parametrize('lost', [math.nan, math.inf])
def test_an_acceleration_that_cannot_be_is_told_until_it_can(lost: float) -> None:
    """An impossible acceleration raises an alert while it comes, and never enters the low-pass."""
    run = [
        replace(m, acceleration=(lost, 0.0, 9.81))
        if isinstance(m, Imu) and 500 <= (m.time - T0) // MS < 700
        else m
        for m in run_of(2.0)
    ]
    assert told(run, T0 + 2 * S, 'INPUT_INVALID') == [('imu', 501, 1001, 1.0)]


def test_a_clock_that_is_off_is_told_until_it_is_right() -> None:
    """Stamps off by 2 s raise CLOCK until they are right; the jump back is wrong once more."""
    run = [
        replace(m, stamp=m.time - 2 * S)
        if isinstance(m, Joints) and 500 <= (m.time - T0) // MS < 700
        else m
        for m in run_of(2.0)
    ]
    assert told(run, T0 + 2 * S, 'CLOCK') == [('joint_states', 500, 1020, 1.0)]


def test_a_joint_that_was_never_named_is_missing_not_invalid() -> None:
    """A joint that no message ever named is missing after half a second, and not invalid."""
    run = [
        replace(m, names=('lift',), position=(0.1,)) if isinstance(m, Joints) else m
        for m in run_of(1.0)
    ]
    assert told(run, T0 + S, 'INPUT_INVALID') == []
    assert told(run, T0 + S, 'INPUT_INCOMPLETE') == [('joint_states', 520, None, 1.0)]


def test_a_recording_that_ends_in_silence_has_a_gap_to_its_end() -> None:
    """A gap that lasts to a recording's end counts from the input's deadline on."""
    for rest, gaps in ((100 * MS, []), (100 * MS + 1, [(T0 + 1080 * MS, T0 + 1080 * MS + 1)])):
        _, evaluator = recorded(settings(), [run_of(1.0)], T0 + 980 * MS + rest)
        assert evaluator.gaps[0] == gaps


def test_who_has_not_said_when_it_began_misses_nothing_before_the_first_message() -> None:
    """Without a start time no input is missed before its first message; later silence is stale."""
    evaluator, other = LiveEvaluator(settings()), RecordedEvaluator(settings())
    messages = run_of(1.0)
    for m in messages:
        give(evaluator, m)
    rows = other.batch(batch_of(messages))
    assert rows.known[1:].all()
    assert rows.moment.shape == (len(messages), 0)  # not unless asked for
    for log in (evaluator.watch.log, other.watch.log):
        assert not [a for a in log if a.rule.code == 'INPUT_STALE']
    assert other.gaps == ([], [])


@pytest.mark.parametrize(('late', 'missing'), [(0, False), (1, True)])
def test_a_joint_is_missing_when_its_last_message_is_older_than_silence_may_be(
    late: int,
    missing: bool,  # noqa: FBT001
) -> None:
    """A joint is missing 0.1 s after its last message at 50 Hz, though other joints still come."""
    run: list[Message] = [
        replace(m, names=('lift',), position=(0.1,))
        if isinstance(m, Joints) and m.time > T0 + S
        else m
        for m in run_of(1.1)
    ]
    run = [m for m in run if not (isinstance(m, Joints) and m.time > T0 + 1090 * MS)]
    run = [
        *(m for m in run if m.time < T0 + 1100 * MS),
        Joints(T0 + 1100 * MS + late, ('lift',), (0.1,)),
    ]
    found = told(run, T0 + 1101 * MS, 'INPUT_INCOMPLETE')
    assert found == ([('joint_states', 1100, None, 1.0)] if missing else [])


BAD_LOADS = [
    Carry(0, -1.0), Carry(0, math.nan), Carry(0, 1.0, (math.nan, 0.0, 0.0)),
    Carry(0, 2.0, frame='tool0'), Carry(0, 2.0, frame='shand'), Carry(0, 0.0, frame='base'),
]  # fmt: skip


@pytest.mark.parametrize('bad', BAD_LOADS, ids=str)
def test_after_a_payload_that_cannot_be_no_margin_is_known_until_a_good_one(bad: Carry) -> None:
    """From an impossible payload until the next good one, no margin is known, live or recorded."""
    run: list[Message] = sorted(
        [*run_of(2.0), replace(bad, time=T0 + 500 * MS + 1), Carry(T0 + 800 * MS + 1, 2.0)],
        key=lambda m: m.time,
    )
    assert told(run, T0 + 2 * S, 'PAYLOAD_INVALID') == [('payload', 500, 1100, 1.0)]
    seen, _ = live(settings(), run, T0 + 2 * S)
    torque = {m.time: x.torque[0] for m, x in seen if x is not None}
    # It counts from the next joint state on, as every payload does.
    unknown = [m.time for m, x in seen if x is None and not isinstance(m, Carry)]
    assert (unknown[1], unknown[-1]) == (T0 + 520 * MS, T0 + 811 * MS)
    first, good = (abs(torque[T0 + t * MS]) for t in (400, 1000))
    # 2 kg at the hand's origin, 1 m out, for 1 kg at 1.1 m.
    assert good - first == pytest.approx(9.81 * (2.0 - 1.1))
    rows, _ = recorded(settings(), split(run, [150]), T0 + 2 * S)
    blind = [int(t) for part in rows for t in part.time[~part.known]]
    assert blind == unknown


@pytest.mark.parametrize(
    ('bad', 'words'),
    [
        (Carry(0, 2.0, frame='ra/tool0'), "expected the frame hand, got 'ra/tool0'"),
        (Carry(0, math.nan), 'expected a mass from 0 to 100000 kg, got nan kg'),
        (Carry(0, 1.0, (0.0, math.inf, 0.0)), 'within 1000 m, got 0 inf 0 m'),
    ],
    ids=str,
)
def test_a_payload_alert_says_what_came_and_what_was_expected(bad: Carry, words: str) -> None:
    """The alert about a payload names the frame or value that came and the one expected."""
    run: list[Message] = sorted([*run_of(1.0), replace(bad, time=T0 + 500 * MS + 1)],
                                key=lambda m: m.time)  # fmt: skip
    _, alerts = live(settings(), run, T0 + S)
    _, evaluator = recorded(settings(), [run], T0 + S)
    for log in (alerts, evaluator.watch.log):
        sentences = [describe(a, settings()) for a in log if a.rule.code == 'PAYLOAD_INVALID']
        assert [words in sentence for sentence in sentences] == [True]


def test_a_load_on_a_robot_that_carries_none_makes_margins_unknown() -> None:
    """A load declared for a robot without payload link makes margins unknown; 0 kg does not."""
    bare = settings()
    bare = replace(bare, robot=replace(bare.robot, payload_link=None, payload=Payload()))
    run: list[Message] = sorted(
        [*run_of(2.0), Carry(T0 + 500 * MS + 1, 0.0), Carry(T0 + S + 1, 0.5)],
        key=lambda m: m.time,
    )
    seen, alerts = live(bare, run, T0 + 2 * S)
    known = [m.time for m, x in seen if x is not None and m.time > T0 + 100 * MS]
    assert known[-1] < T0 + 1020 * MS
    assert len(known) > 130
    assert 'no payload.link is configured' in describe(alerts[-1], bare)


def test_another_load_declared_by_a_person_makes_margins_known_again() -> None:
    """A payload set as a parameter ends what an impossible message began."""
    evaluator = LiveEvaluator(settings())
    evaluator.start(T0)
    for message in run_of(1.0):
        give(evaluator, message)
    evaluator.carry(T0 + S, math.nan, (0.0, 0.0, 0.0), 'hand')
    told = settings()
    same = replace(told, robot=replace(told.robot, payload=evaluator.payload))
    evaluator.adopt(same)
    assert not evaluator.load_known
    evaluator.adopt(replace(told, robot=replace(told.robot, payload=Payload(3.0))))
    evaluator.tick(T0 + S + MS)
    give(evaluator, Joints(T0 + S + 2 * MS))
    assert evaluator.margins is not None
    evaluator.tick(T0 + 4 * S)
    assert not [a for a in evaluator.watch.active if a.rule.code == 'PAYLOAD_INVALID']


def test_positions_that_cannot_be_are_told_until_they_can() -> None:
    """Impossible positions raise an alert from their message on until valid ones have come."""
    run = [
        replace(m, position=(math.nan, 0.0))
        if isinstance(m, Joints) and 500 <= (m.time - T0) // MS < 700
        else m
        for m in run_of(2.0)
    ]
    assert told(run, T0 + 2 * S, 'INPUT_INVALID') == [('joint_states', 500, 1000, 1.0)]


def test_the_margins_of_a_recording_are_those_of_the_model() -> None:
    """A recording's margins equal the model's row by row, whatever arm, slope and parts."""
    robot = tracked()
    names = robot.joint_names
    chosen = Settings(
        robot,
        tuple(JointInput(name) for name in names),
        ImuInput(agreement=9.0),
        Limits((1e3,) * 4),
    )
    rng = np.random.default_rng(6)
    messages: list[Message] = []
    for k in range(60):
        roll, pitch = rng.uniform(-0.3, 0.3, 2).tolist()
        q = tuple(rng.uniform((-3, 0.4, -0.4, -0.5), (3, 1, 1, 3)).tolist())
        lean = tilted(roll, pitch)
        messages += [
            Imu(T0 + 20 * k * MS, lean, acceleration=upright(lean)),
            Joints(T0 + (20 * k + 10) * MS, names, q),
        ]
    parts = split(messages, [1, 50])
    full, _ = recorded(chosen, parts, T0 + 2 * S)
    short, _ = recorded(chosen, parts, T0 + 2 * S, detail=False)
    found, checked = [], 0
    for rows, less in zip(full, short, strict=True):
        known = rows.known
        checked += int(known.sum())
        expected = margins(robot, rows.q[known], rows.gravity[known])
        for made in (rows, less):
            np.testing.assert_allclose(made.torque[known], expected.torque, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(made.angle[known], expected.angle, rtol=1e-9, atol=1e-9)
            assert made.state[known].tolist() == expected.state.tolist()
        found.append((less.moment.shape[1], less.energy.shape[1], less.zmp.shape[0]))
        assert np.isnan(rows.torque[~known]).all()
    assert checked == 119
    assert set(found) == {(0, 0, 0)}
    states = np.concatenate([rows.state[rows.known] for rows in full])
    assert len(set(states.tolist())) > 1  # on its tracks, and raised by its flippers


def test_a_live_robot_tells_its_level_rates_efforts_and_orientations() -> None:
    """A live evaluator gives the most severe active level, and rates and efforts in robot signs."""
    evaluator = LiveEvaluator(settings(limits=replace(FREE, speed=(0.6, math.inf)), delays=QUICK))
    evaluator.start(T0)
    for m in run_of(0.5, joints=Joints(0, velocity=(0.5, 0.1), effort=(0.02, 7.0))):
        at = 0.1 + 0.5 * (m.time - T0) / S
        give(evaluator, replace(m, position=(at, 0.0)) if isinstance(m, Joints) else m)
    assert evaluator.level == OK
    assert evaluator.evaluated == 74  # all but the first message
    assert evaluator.measured == ((-0.5, 0.1), (-20.0, 7.0))
    counts = evaluator.orientations
    assert list(counts.values()) == [0, 0, 50]  # the identity tells nothing by itself
    for k in range(20):
        give(evaluator, Joints(T0 + (500 + 20 * k) * MS, velocity=(0.7, 0.0)))
        give(evaluator, Imu(T0 + (501 + 20 * k) * MS, tilted(0.1), acceleration=REST))
    assert evaluator.level == WARN
    assert evaluator.orientations == {**counts, 'used': 20}
    evaluator.carry(T0 + 900 * MS, math.nan, (0.0, 0.0, 0.0), 'hand')
    assert evaluator.level == ERROR
