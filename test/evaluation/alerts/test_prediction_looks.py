"""Predictions from hand-made samples 50 ms apart: the exact numbers at which they begin and end."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from evaluation.margin_rows import rows
from evaluation.streams import MS, T0, S, settings

from ugv_acceptance.evaluation.alerts.prediction import Prediction, foresight_of
from ugv_acceptance.evaluation.alerts.state_machine import WARN, Alert, Rule, Signal
from ugv_acceptance.evaluation.settings import Delays, Limits

LIMIT = (40.0, 20.0)
Numbers = Callable[[int], float]
Told = list[tuple[str, str, float, float | None]]
# Whether looks are judged as they come, some at a time, or all at once.
EACH = pytest.mark.parametrize('each', [1, 4, 1000])


@dataclass
class Looks:
    """What a robot of two joints shows at look k: tilt left to the front, and of the first joint.

    `at` is when (ms after the first).
    """

    tilt: Numbers = lambda _: 1.0
    torque: Numbers = lambda _: 5.0
    effort: Numbers = lambda _: 5.0
    q: Numbers = float
    at: Numbers = lambda k: 50.0 * k
    delays: Delays = field(default_factory=lambda: Delays(tip_on=0.0, torque_on=0.0))
    limit: tuple[float, float] = LIMIT

    def told(self, count: int, each: int = 1000) -> Told:
        """Return code, subject, start and end (in looks of 50 ms) of every alert."""
        log: list[Alert] = []

        def signal(code: str, subject: str, at: tuple[float, float], delay: float) -> Signal:
            return Signal(Rule(code, subject, WARN, *at, round(delay * S), 0), log)

        limits = Limits(self.limit, torque_warn=0.8, torque_deadband=2.0)
        prediction = foresight_of(settings(limits=limits, delays=self.delays), signal)
        for k in range(count):
            now = T0 + round(self.at(k) * MS)
            angle = (self.tilt(k), 1.0, 1.0, math.nan)
            torque, effort = (self.torque(k), 0.0), (self.effort(k), 0.0)
            prediction.keep(now, angle, torque, effort, (self.q(k), float(k)))
            if (k + 1) % each == 0:
                prediction.judge(self.limit)
        prediction.judge(self.limit)
        return [(a.rule.code, a.rule.subject, _look(a.start), a.end and _look(a.end)) for a in log]


def _look(time: int) -> float:
    return (time - T0) / (50 * MS)


def steps(*values: float) -> Numbers:
    """Return values one by one; the last stays."""
    return lambda k: values[min(k, len(values) - 1)]


@EACH
def test_an_end_a_second_away_is_told(each: int) -> None:
    """A tip-over is predicted from 1 s before it on: with 0.975 s left, not with 1.025 s."""
    found = Looks(tilt=lambda k: 0.1525 - 0.005 * k).told(20, each)
    assert found == [('TIP_AHEAD', 'front', 11.0, None)]


@EACH
def test_a_rate_needs_five_looks(each: int) -> None:
    """No prediction is made from fewer than five samples, however near the limit is."""
    found = Looks(tilt=lambda k: 0.05 - 0.005 * k).told(6, each)
    assert found == [('TIP_AHEAD', 'front', 4.0, None)]


@EACH
def test_what_is_gone_is_gone_at_any_rate(each: int) -> None:
    """A prediction stays when no tilt is left, though none is lost any more."""
    assert Looks(tilt=lambda _: 0.0).told(9, each) == [('TIP_AHEAD', 'front', 4.0, None)]


@pytest.mark.parametrize(('rate', 'told'), [(0.0174, False), (0.0176, True)])
def test_a_tilt_that_is_lost_slowly_is_no_warning(rate: float, told: bool) -> None:  # noqa: FBT001
    """A tilt lost at less than 1 deg/s (0.0175 rad/s) gives no prediction."""
    found = Looks(tilt=lambda k: rate * (1.2 - 0.05 * k)).told(7)
    assert bool(found) is told


@pytest.mark.parametrize(('before', 'told'), [(0.0074062500000000005, True), (0.0074, False)])
def test_the_least_rate_itself_counts(before: float, told: bool) -> None:  # noqa: FBT001
    """A tilt lost at exactly the least rate gives a prediction."""
    tilt = np.linspace(before, 0.00390625, 5).tolist()
    assert bool(Looks(tilt=steps(*tilt)).told(5)) is told


@pytest.mark.parametrize(('rate', 'told'), [(1.19, False), (1.21, True)])
@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_torque_that_grows_slowly_is_no_warning(rate: float, sign: float, told: bool) -> None:  # noqa: FBT001
    """A torque that grows by less than 3 % of its limit a second gives no prediction."""
    found = Looks(torque=lambda k: sign * (40.0 - rate * (1.2 - 0.05 * k))).told(7)
    assert bool(found) is told
    assert not told or found[0][:2] == ('TORQUE_AHEAD', 'lift')


@pytest.mark.parametrize(('apart', 'told'), [(100.0, True), (101.0, False)])
def test_a_rate_over_more_than_four_tenths_of_a_second_is_none(apart: float, told: bool) -> None:  # noqa: FBT001
    """Samples more than 0.1 s apart give no rate, because four intervals span at most 0.4 s."""
    found = Looks(tilt=lambda k: 0.05 - 0.05 * k * apart / 1000.0, at=lambda k: k * apart).told(9)
    assert bool(found) is told


def test_a_rate_is_that_of_the_time_between_looks() -> None:
    """Looks 0.1 s apart lose twice as much: of 0.3 rad at 0.2 rad/s one second is left at 0.5 s."""
    found = Looks(tilt=lambda k: 0.301 - 0.02 * k, at=lambda k: 100.0 * k).told(12)
    assert found == [('TIP_AHEAD', 'front', 12.0, None)]


@pytest.mark.parametrize(('share', 'told'), [(0.59, True), (0.61, False)])
def test_a_loss_that_comes_for_the_most_part_at_once_is_a_jump(share: float, told: bool) -> None:  # noqa: FBT001
    """A margin of which more than 60 % is lost in one interval has jumped: no prediction."""
    rest = (1.0 - share) / 3.0
    lost = np.cumsum((0.0, rest, rest, rest, share)) * 0.1
    assert bool(Looks(tilt=steps(*(0.2 - lost).tolist())).told(5)) is told


@EACH
@pytest.mark.parametrize(('left', 'end'), [(1.495, None), (1.505, 12.0)])
def test_a_warning_ahead_ends_where_a_second_and_a_half_are_left(
    left: float, end: float | None, each: int
) -> None:
    """A prediction ends once more than 1.5 s are left at the present rate.

    The tilt falls ever more slowly, at last by 0.02 rad/s.
    """
    lost = np.cumsum((0, 5, 5, 5, 5, 4, 3, 2, 2, 1, 1, 1, 1)) * 1e-3
    tilt = 0.02 * left + lost[-1] - lost
    assert Looks(tilt=steps(*tilt.tolist())).told(13, each) == [('TIP_AHEAD', 'front', 4.0, end)]


@EACH
@pytest.mark.parametrize(
    ('efforts', 'start', 'end'),
    [
        ((31.9, 32.0, 30.0), 1.0, None),  # the limit itself; 2 N m of deadband
        ((-32.0, 0.0, 31.9, 29.9), 0.0, 1.0),  # either way
        ((33.0, 30.1, 29.9, 31.9), 0.0, 2.0),
    ],
)
def test_an_effort_of_four_fifths_of_its_limit_is_told(
    efforts: tuple[float, ...], start: float, end: float | None, each: int
) -> None:
    """An effort of 80 % of its limit raises a warning; below 75 % it ends."""
    found = Looks(effort=steps(*efforts)).told(len(efforts), each)
    assert found == [('EFFORT_LIMIT', 'lift', start, end)]


def test_an_effort_without_a_limit_is_never_too_much() -> None:
    """A joint without an effort limit never gets an effort warning."""
    assert Looks(effort=steps(1e6, 1e9), limit=(math.inf, 20.0)).told(9) == []


def growing(growth: float, *, jump: bool = False) -> Numbers:
    """Return a torque that grows by so much in nine looks, evenly or at once."""
    return lambda k: 10.0 + (growth * (k > 8) if jump else growth * k / 9.0)


@dataclass(frozen=True)
class Weak:
    """What a motor shows: its effort, by how much it wavers, how the need grows, looks apart."""

    effort: float = 20.0
    wavers: float = 0.0
    growth: float = 4.0
    apart: float = 50.0
    jump: bool = False
    sign: float = 1.0


@EACH
@pytest.mark.parametrize(
    ('case', 'told'),
    [
        (Weak(), True),
        (Weak(sign=-1.0), True),
        (Weak(wavers=0.59), True),  # 0.015 of 40 N m
        (Weak(wavers=0.61), False),
        (Weak(growth=2.81), True),  # 0.07 of it
        (Weak(growth=2.79), False),
        (Weak(growth=-4.0), False),
        (Weak(effort=12.1), True),  # from 0.3 of it
        (Weak(effort=11.9), False),
        (Weak(effort=-20.0), True),
        (Weak(effort=38.7), True),  # to 0.97 of it
        (Weak(effort=38.9), False),
        (Weak(apart=111.0), True),  # nine looks in a second
        (Weak(apart=112.0), False),
        (Weak(jump=True), False),
    ],
)
def test_an_even_effort_while_the_need_grows_is_a_weak_motor(
    case: Weak,
    each: int,
    told: bool,  # noqa: FBT001
) -> None:
    """Over ten looks; a load that is declared makes the need jump."""
    need = growing(case.growth, jump=case.jump)
    found = Looks(
        torque=lambda k: case.sign * need(k),
        effort=lambda k: case.effort + case.wavers * (k % 2),
        at=lambda k: case.apart * k,
    ).told(10, each)
    weak = [a[1:] for a in found if a[0] == 'MOTOR_WEAK']
    assert weak == ([('lift', 9 * case.apart / 50, None)] if told else [])


@pytest.mark.parametrize(('largest', 'weak'), [(6.0, True), (6.1, False)])
def test_six_tenths_of_the_growth_may_come_at_once(largest: float, weak: bool) -> None:  # noqa: FBT001
    """A motor is judged weak only if at most 60 % of the need's growth came in one interval."""
    need = steps(0.0, largest, 7.0, 7.5, 8.0, 8.5, 9.0, 9.5, 9.75, 10.0)
    found = Looks(torque=need, effort=lambda _: 20.0).told(10)
    assert (('MOTOR_WEAK', 'lift', 9.0, None) in found) is weak


@EACH
def test_the_bounds_of_a_weak_motor_count(each: int) -> None:
    """Each to the last bit, of 100 and 40 N m: waver, growth, share of the limit, time."""
    wavers = Looks(torque=growing(9.0), effort=lambda k: 50.0 + 1.5 * (k % 2), limit=(100.0, 20.0))
    grows = Looks(torque=lambda k: 0.07 * 40.0 * k / 9.0, effort=lambda _: 20.0)
    late = Looks(
        torque=growing(4.0), effort=lambda _: 20.0, at=lambda k: 100.0 * k + 100.0 * (k == 9)
    )
    weak = ('MOTOR_WEAK', 'lift', 9.0, None)
    assert weak in wavers.told(10, each)
    assert weak in grows.told(10, each)
    assert ('MOTOR_WEAK', 'lift', 20.0, None) in late.told(10, each)
    for share in (0.3, 0.97):
        low = Looks(torque=growing(9.0), effort=lambda _: 100.0 * share, limit=(100.0, 20.0))  # noqa: B023
        assert weak in low.told(10, each)


@EACH
@pytest.mark.parametrize(
    ('tilt', 'start'), [((0.0, 0.0, 1.0), 9.0), ((-1e-9, 1.0), 10.0), ((1.0, -1e-9, 1.0), 11.0)]
)
def test_a_motor_is_not_weak_within_ten_looks_of_lying(
    tilt: tuple[float, ...], start: float, each: int
) -> None:
    """On the very edge the robot still stands."""
    found = Looks(tilt=steps(*tilt), torque=growing(4.0), effort=lambda _: 20.0).told(13, each)
    assert [a for a in found if a[0] == 'MOTOR_WEAK'] == [('MOTOR_WEAK', 'lift', start, None)]


@EACH
def test_a_motor_that_follows_again_is_weak_no_more(each: int) -> None:
    """The warning ends with the first look whose last ten are not even."""
    found = Looks(torque=growing(4.0), effort=lambda k: 20.0 if k < 14 else 25.0).told(16, each)
    assert [a for a in found if a[0] == 'MOTOR_WEAK'] == [('MOTOR_WEAK', 'lift', 9.0, 14.0)]


def frozen(each: int, count: int = 8, **looks: Numbers) -> list[float]:
    """Return the looks at which a frozen encoder is told, of a joint that stands still."""
    found = Looks(**{'q': lambda _: 0.5, **looks}).told(count, each)  # type: ignore[arg-type]
    assert {a[1] for a in found} <= {'lift'}
    return [a[2] for a in found if a[0] == 'ENCODER_FROZEN']


@EACH
@pytest.mark.parametrize('change', [6.01, -6.01])
def test_a_position_that_stands_for_six_looks_while_effort_changes_is_frozen(
    change: float, each: int
) -> None:
    """An encoder is frozen if six samples are equal while effort changed by 15 % of the limit."""
    assert frozen(each, effort=steps(10.0, 10.0 + change)) == [6.0]
    assert frozen(each, effort=steps(10.0, 10.0 + 0.998 * change)) == []


@EACH
def test_what_gravity_changes_is_no_sign_of_a_frozen_encoder(each: int) -> None:
    """A robot that is tilted needs another effort; where only the torque changes, none did."""
    lean = steps(10.0, 17.0)
    assert frozen(each, effort=lean, torque=lean) == []
    assert frozen(each, torque=lean) == []
    against = steps(10.0, 6.0)
    assert frozen(each, effort=steps(10.0, 13.0), torque=against) == []
    assert frozen(each, effort=lean, torque=against) == [6.0]


@EACH
@pytest.mark.parametrize(('jump', 'told'), [(2, []), (4, [9.0])])
def test_a_change_counts_since_the_position_last_moved(
    jump: int, told: list[float], each: int
) -> None:
    """It moves at look 3: an effort that leapt before says nothing, one that leaps later does."""

    def effort(k: int) -> float:
        return 10.0 + 7.0 * (k >= jump)

    assert frozen(each, 13, effort=effort, q=steps(0.5, 0.5, 0.5, 0.6)) == told


@EACH
def test_a_position_that_moves_again_ends_it(each: int) -> None:
    """A frozen encoder's alert ends when the position changes by one bit."""
    q = [0.5] * 11 + [math.nextafter(0.5, 1.0)]
    found = Looks(q=steps(*q), effort=steps(10.0, 17.0)).told(14, each)
    assert found == [('ENCODER_FROZEN', 'lift', 6.0, 11.0)]


@EACH
def test_a_weak_joint_that_moves_is_not_frozen(each: int) -> None:
    """A joint that moves never has a frozen encoder, even with a small effort limit."""
    found = Looks(torque=lambda _: 0.2, effort=lambda k: 0.5 * (k % 3), limit=(2.0, 2.0)).told(
        12, each
    )
    assert found == []


def test_every_kind_of_warning_has_its_own_delay() -> None:
    """Tilt that of tip-over, torque, effort and encoder that of torque; a weak motor none."""
    looks = Looks(
        tilt=lambda k: 0.1525 - 0.005 * k,
        torque=lambda k: 20.0 + k,
        effort=lambda k: 20.0 if k < 12 else 60.0,
        q=lambda _: 0.5,
        delays=Delays(tip_on=0.075, torque_on=0.11),
    )
    found = {code: start for code, _, start, _ in looks.told(18)}
    assert found == {
        'TIP_AHEAD': 11.0 + 1.5,
        'TORQUE_AHEAD': 4.0 + 2.2,
        'EFFORT_LIMIT': 12.0 + 2.2,
        'MOTOR_WEAK': 9.0,
        'ENCODER_FROZEN': pytest.approx(12.0 + 2.2),
    }


@pytest.mark.parametrize(('now', 'due'), [(0, 50), (1, 50), (49, 50), (50, 100), (130, 150)])
def test_the_next_look_is_due_at_a_whole_multiple_of_fifty_milliseconds(now: int, due: int) -> None:
    """After the sample that was kept; the first one is due whenever it comes."""
    prediction = quiet([])
    assert prediction.due == 0
    prediction.keep(T0 + now * MS, (1.0,) * 4, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
    assert prediction.due == T0 + due * MS


def quiet(log: list[Alert]) -> Prediction:
    """Return the predictions of the small robot, whose alerts go to a log without delay."""

    def signal(code: str, subject: str, at: tuple[float, float], _: float) -> Signal:
        return Signal(Rule(code, subject, WARN, *at, 0, 0), log)

    return foresight_of(settings(limits=Limits(LIMIT)), signal)


def test_who_never_lets_time_pass_keeps_the_last_thousand_looks() -> None:
    """1024 of them wait at most: the first 76 of 1100 are forgotten."""
    log: list[Alert] = []
    prediction = quiet(log)
    for k in range(1100):
        effort = (35.0 if k < 100 else 0.0, 0.0)
        prediction.keep(T0 + k * 50 * MS, (1.0,) * 4, (0.0, 0.0), effort, (float(k), float(k)))
    prediction.judge(LIMIT)
    assert [(_look(a.start), a.end and _look(a.end)) for a in log] == [(76.0, 100.0)]


def test_the_signals_are_those_of_sides_and_joints() -> None:
    """Predictions are watched for four sides and with four warnings for each joint."""
    rules = [signal.rule for signal in quiet([]).signals()]
    sides = [(rule.code, rule.subject) for rule in rules[:4]]
    assert sides == [('TIP_AHEAD', side) for side in ('front', 'left', 'rear', 'right')]
    codes: Sequence[str] = ('TORQUE_AHEAD', 'EFFORT_LIMIT', 'MOTOR_WEAK', 'ENCODER_FROZEN')
    assert [(r.code, r.subject) for r in rules[4:]] == [
        (code, joint) for code in codes for joint in ('lift', 'slide')
    ]


def test_of_a_recording_the_first_known_row_of_each_fifty_milliseconds_is_a_look() -> None:
    """However it is cut into parts."""
    prediction = quiet([])
    parts = [
        ((0.010, 0.020, 0.060, 0.070), (True, True, False, True)),
        ((0.099, 0.120, 0.149, 0.150), (True, True, True, True)),
        ((0.199,), (True,)),
        ((0.200, 0.249, 0.260, 0.330), (True,) * 4),
        ((0.420,), (False,)),
    ]
    dues = []
    for time, known in parts:
        told = rows(time, known=known)
        joints = told.pairs.joints
        effort = replace(joints, effort=np.zeros_like(joints.q))
        prediction.rows(replace(told, pairs=replace(told.pairs, joints=effort)), LIMIT)
        dues.append(prediction.due // MS)
    assert (prediction._time // MS).tolist() == [10, 70, 120, 150, 200, 260, 330]
    assert dues == [100, 200, 200, 350, 350]
