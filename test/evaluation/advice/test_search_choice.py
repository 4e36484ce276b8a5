"""The choice of advice: scores of margins, which margin comes first, and where a motion ends."""

import math
from dataclasses import replace

import numpy as np
import pytest
from evaluation.streams import settings
from robots import DOWN

from ugv_acceptance.evaluation.advice import search as advice
from ugv_acceptance.evaluation.advice.search import SLACK, Advice, advise, scores_of
from ugv_acceptance.evaluation.settings import Limits
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import margins

LIMITS = Limits((40.0, math.inf), tip_warn=0.3, tip_error=0.1, tip_deadband=0.02)
TOLD = replace(settings(), limits=LIMITS)
GOOD = 5.0


def cut(gain: float) -> str:
    """Return a gain without its last digits: one decimal below ten."""
    return f'{math.floor(gain)}' if gain >= 10.0 else f'{math.floor(10.0 * gain) / 10.0:g}'


def case(scores: tuple[float, ...], worst: int) -> advice._Case:
    """Return a situation of these scores."""
    at, down = np.zeros(2), np.array(DOWN)
    torque = np.zeros(2)
    return advice._Case(
        TOLD, at, down, Payload(), np.array(scores), torque, 0, worst, 1.1 + SLACK
    )  # fmt: skip


def end(
    *path: float, start: float = 0.2, forbidden: int | None = None
) -> tuple[int, float, bool] | None:
    """Return where to stop on a path on which the first margin scores so, all others well."""
    scores = np.full((len(path), 6), GOOD)
    scores[:, 0] = path
    never = np.arange(len(path)) == forbidden
    return advice._end(case((start, *[GOOD] * 5), 0), scores, never)


def test_a_score_is_one_at_warn_and_zero_at_error() -> None:
    """Tilt between 0.1 and 0.3 rad, torque between 32 and 40 N m; unjudged joints are infinite."""
    angle = np.array(((0.3, 0.1, 0.2, 0.5), (0.0, 0.1, 0.1, 0.1)))
    torque = np.array(((32.0, 900.0), (-40.0, 0.0)))
    found = scores_of(TOLD, torque, angle)
    assert found[0] == pytest.approx((1.0, 0.0, 0.5, 2.0, 1.0, np.inf))
    assert found[1] == pytest.approx((-0.5, 0.0, 0.0, 0.0, 0.0, np.inf))
    assert scores_of(TOLD, np.array((36.0, 0.0)), angle[0])[4] == pytest.approx(0.5)


def test_limits_that_lie_together_keep_half_a_degree_apart() -> None:
    """WARN and ERROR limits that coincide are scored with a span of 0.5 deg, or 2 % of torque."""
    close = Limits((40.0, math.inf), torque_warn=1.0, tip_warn=0.1, tip_error=0.1)
    angle = np.full(4, 0.1 + math.radians(0.5))
    found = scores_of(replace(TOLD, limits=close), np.array((39.2, 0.0)), angle)
    assert found[:5] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ('scores', 'worst'),
    [
        ((0.5, 0.4, 2.0, 2.0, 0.3, 2.0), 1),  # two warn of tilt, one of torque: tilt first
        ((0.5, 0.4, 2.0, 2.0, -0.1, 2.0), 4),  # past ERROR comes before all
        ((-0.1, 0.4, 2.0, 2.0, -0.5, 2.0), 0),
        ((1.5, 1.4, 2.0, 2.0, 0.9, 2.0), 4),  # what warns comes before what does not
        ((1.0, 1.4, 2.0, 2.0, 0.99, 2.0), 4),
        ((0.1, 0.4, 2.0, 2.0, 0.0, 2.0), 4),  # the limit itself is past it
        ((3.0, 2.5, 2.0, 2.4, 1.9, 1.8), 2),
    ],
)
def test_the_margin_spoken_of_first(scores: tuple[float, ...], worst: int) -> None:
    """Margins past ERROR come before those past WARN, then tilts before torques, then the least."""
    assert advice._most_severe(np.array(scores)) == worst


def test_a_path_stops_where_it_is_enough() -> None:
    """A path ends at the first step that clears the warning's deadband."""
    assert end(0.5, 1.05, 1.2, 1.5) == (2, 1.2, True)


def test_a_path_that_is_not_enough_stops_where_nearly_all_is_gained() -> None:
    """A path that never is enough ends at the first step with 95 % of its largest gain."""
    assert end(0.5, 0.9, 0.97, 1.0, 0.6) == (2, 0.97, False)
    assert end(0.5, 0.9, 0.95, 1.0, 0.6) == (3, 1.0, False)


@pytest.mark.parametrize(('gained', 'counts'), [(0.09, False), (0.11, True)])
def test_a_path_that_gains_next_to_nothing_is_none(gained: float, counts: bool) -> None:  # noqa: FBT001
    """A path that gains less than a tenth of the span from ERROR to WARN is not advised."""
    assert (end(0.2 + gained) is not None) == counts


def test_a_path_ends_before_what_it_must_not() -> None:
    """A forbidden step, or another margin below its warning limit, or its own below what it was."""
    assert end(0.5, 0.6, 1.5, forbidden=2) == (1, 0.6, False)
    assert end(0.5, 0.6, 1.5, forbidden=0) is None
    assert end(0.5, 0.19, 1.5) == (0, 0.5, False)
    scores = np.full((3, 6), GOOD)
    scores[:, 0] = (0.5, 0.6, 1.5)
    scores[2, 4] = 0.99
    start = case((0.2, *[GOOD] * 5), 0)
    assert advice._end(start, scores, np.zeros(3, np.bool_)) == (1, 0.6, False)


def test_a_margin_that_is_low_may_stay_as_low() -> None:
    """Advice may leave another margin that already warns as low as it is, but not lower it."""
    scores = np.full((2, 6), GOOD)
    scores[:, 0], scores[:, 4] = (0.5, 1.5), (0.7, 0.7)
    start = case((0.2, GOOD, GOOD, GOOD, 0.7, GOOD), 0)
    assert advice._end(start, scores, np.zeros(2, np.bool_)) == (1, 1.5, True)
    scores[1, 4] = 0.69
    assert advice._end(start, scores, np.zeros(2, np.bool_)) == (0, 0.5, False)


def told(kind: str, seconds: float, gain: float, *, enough: bool) -> Advice:
    """Return a piece of advice."""
    return Advice(kind, 'x', 0.1, seconds, 'front', gain, enough, '')


def test_advice_is_ordered_by_use() -> None:
    """Advice that is enough comes first, turns last, then the fastest; else the largest gain."""
    order = [
        told('joint', 1.0, 0.1, enough=True),
        told('payload', 10.0, 0.5, enough=True),
        told('turn', 0.5, 0.9, enough=True),
        told('joint', 3.0, 0.4, enough=False),
        told('joint', 1.0, 0.2, enough=False),
        told('turn', 1.0, 0.9, enough=False),
    ]
    turned = order[3:] + order[:3]
    assert sorted(turned, key=advice._order) == order


def test_a_load_set_down_gains_what_the_model_says_of_the_empty_hand() -> None:
    """The lift at 45 N m of 40: 5 kg at 1.1 m are gone; what it may keep follows from 32 N m."""
    mass = 2.0
    before = margins(TOLD.robot, np.zeros(2), DOWN, Payload(mass, (0.1, 0.0, 0.0))).torque[0]
    found = advise(TOLD, (0.0, 0.0), DOWN, Payload(mass, (0.1, 0.0, 0.0)), of='lift')
    (load,) = [a for a in found if a.kind == 'payload']
    assert load.gain == pytest.approx(mass * 9.81 * 1.1)
    assert load.amount == -mass
    assert load.enough == (abs(before) - load.gain <= 32.0)
    holds = (32.0 - (abs(before) - load.gain)) / (9.81 * 1.1)
    assert f'is {mass - holds:.1f} kg too heavy' in load.sentence
    assert f': {cut(load.gain)} N m less on the lift' in load.sentence


def test_a_load_that_is_light_is_not_spoken_of() -> None:
    """Setting down is not advised if it gains less than a tenth of the span from ERROR to WARN."""
    for mass in (0.0, 0.07):
        kinds = [a.kind for a in advise(TOLD, (0.0, 0.0), DOWN, Payload(mass, (0.1, 0.0, 0.0)))]
        assert 'payload' not in kinds
    heavier = advise(TOLD, (0.0, 0.0), DOWN, Payload(0.5, (0.1, 0.0, 0.0)), of='lift')
    assert 'payload' in [a.kind for a in heavier]


@pytest.mark.parametrize(
    ('of', 'worst', 'enough'),
    [
        ('front', 0, 1.0 + 0.02 / 0.2),  # the deadband of tilt beside 0.2 rad of span
        ('right', 3, 1.0 + 0.02 / 0.2),
        ('lift', 4, 1.0 + 2.0 / 40.0 / 0.2),  # 2 N m beside a fifth of 40
    ],
)
def test_enough_is_beyond_the_deadband_of_the_warning(of: str, worst: int, enough: float) -> None:
    """Advice counts as enough only if it passes the warning's deadband, which ends the alert."""
    (found,) = advice._cases(TOLD, [(0.0, 0.0)], [DOWN], Payload(), [of])
    assert found is not None
    assert (found.worst, found.subject, found.tips) == (worst, of, worst < 4)
    assert found.enough == pytest.approx(enough + SLACK, abs=1e-9)
    assert found.enough > enough


def test_a_robot_that_stands_on_nothing_gets_no_advice() -> None:
    """A robot without contact points has no known margins, and gets no advice."""
    floating = replace(TOLD, robot=replace(TOLD.robot, contacts=()))
    assert advise(floating, (0.0, 0.0), DOWN, Payload(9.0), of='lift') == ()
    assert advise(TOLD, (0.0, 0.0), DOWN, Payload(9.0), of='lift') != ()


def at_level(mass: float) -> tuple[float, float]:
    """Return the lift's share of 40 N m, and the tilt left to the front, of the level arm."""
    found = margins(TOLD.robot, np.zeros(2), DOWN, Payload(mass, (0.1, 0.0, 0.0)))
    return float(np.abs(found.torque[0]) / 40.0), float(found.angle[0])


def test_a_margin_at_its_warning_limit_needs_no_advice() -> None:
    """A margin equal to its warning limit gets no advice; a margin just below it does."""
    use, _ = at_level(1.0)
    load = Payload(1.0, (0.1, 0.0, 0.0))
    for warn, quiet in ((use, True), (math.nextafter(use, 0.0), False)):
        limits = replace(LIMITS, torque_warn=warn, torque_error=2.0)
        found = advise(replace(TOLD, limits=limits), (0.0, 0.0), DOWN, load, of='lift')
        assert (found == ()) is quiet


def test_a_load_whose_absence_reaches_the_limit_is_enough() -> None:
    """Setting the load down is enough if the empty gripper is exactly at the warning limit."""
    empty, _ = at_level(0.0)
    for warn, enough in ((empty, True), (math.nextafter(empty, 0.0), False)):
        limits = replace(LIMITS, torque_warn=warn, torque_error=2.0)
        told = advise(
            replace(TOLD, limits=limits), (0.0, 0.0), DOWN, Payload(3.0, (0.1, 0.0, 0.0)), of='lift'
        )
        (load,) = [a for a in told if a.kind == 'payload']
        assert load.enough is enough
        assert load.seconds == 10.0  # later than what moves by itself


SLOPE = (2.0, 0.0, -9.6)


def kinds(limits: Limits, of: str, down: tuple[float, float, float] = SLOPE) -> set[str]:
    """Return the kinds of advice for a robot whose level arm leans over downhill."""
    told = advise(replace(TOLD, limits=limits), (0.2, 0.0), down, Payload(1.0), of)
    return {a.kind for a in told}


def test_turning_is_for_a_tilt_that_only_warns() -> None:
    """A turn is advised for a tilt between WARN and ERROR, not past ERROR and not for a motor."""
    found = margins(TOLD.robot, np.array((0.2, 0.0)), SLOPE, Payload(1.0))
    front = float(found.angle[0])
    warns = Limits((99.0, 99.0), tip_warn=front + 0.1, tip_error=math.nextafter(front, 0.0))
    assert 'turn' in kinds(warns, 'front')
    assert 'turn' not in kinds(replace(warns, tip_error=front), 'front')
    assert 'turn' not in kinds(replace(warns, tip_error=front + 0.05), 'front')
    weak = Limits((45.0, 99.0), tip_warn=0.1, tip_error=0.05)
    assert 'joint' in kinds(weak, 'lift')
    assert 'turn' not in kinds(weak, 'lift')


@pytest.mark.parametrize(('worst', 'gain'), [(1, 0.5 * 0.2), (4, 0.5 * 0.2 * 40.0)])
def test_a_gain_is_told_in_the_unit_of_its_margin(worst: int, gain: float) -> None:
    """A gain in score is converted to the margin's unit: rad for a tilt, N m for a torque."""
    told = case((0.25,) * 6, worst)
    assert advice._gain(told, 0.75) == pytest.approx(gain)
    assert told.tips is (worst == 1)


def test_the_edges_of_where_to_stop() -> None:
    """A path stops exactly at the limits of enough, of nearly all, of too little, and of slack."""
    enough = 1.1 + SLACK
    assert end(0.5, enough, 1.5) == (1, enough, True)
    assert end(0.5, 0.95, 1.0, start=0.0) == (1, 0.95, False)
    assert end(0.25 + 0.1, start=0.25) is None
    assert end(math.nextafter(0.25 + 0.1, 1.0), start=0.25) is not None
    scores = np.full((2, 6), GOOD)
    scores[:, 0], scores[:, 4] = (0.5, 1.5), (GOOD, 1.0 - SLACK)
    start = case((0.2, *[GOOD] * 5), 0)
    assert advice._end(start, scores, np.zeros(2, np.bool_)) == (1, 1.5, True)
    scores[1, 4] = 1.0 - 2.0 * SLACK
    assert advice._end(start, scores, np.zeros(2, np.bool_)) == (0, 0.5, False)


def test_a_slide_gains_newtons_and_a_turning_joint_newton_metres() -> None:
    """Advice about a prismatic joint tells its gain in N, about a revolute one in N m."""
    told = replace(TOLD, limits=Limits((60.0, 10.0), torque_error=1.1))
    down = (9.81 * math.sin(-0.5), 0.0, -9.81 * math.cos(0.5))
    load = Payload(1.0, (0.1, 0.0, 0.0))
    found = advise(told, (0.0, 0.0), down, load, of='slide')
    set_down = next(a for a in found if a.kind == 'payload')
    assert set_down.gain == pytest.approx(9.81 * math.sin(0.5))
    assert set_down.sentence.endswith(': 4.7 N less on the slide')
    heavy = advise(told, (0.0, 0.0), DOWN, Payload(3.0, (0.1, 0.0, 0.0)), of='lift')
    assert all(' N m less on the lift' in a.sentence for a in heavy)


def test_a_tilt_is_told_in_degrees() -> None:
    """Advice about a tilt tells its gain in degrees, that of the model with the load set down."""
    told = replace(TOLD, limits=Limits((99.0, 99.0), tip_warn=0.9, tip_error=0.1))
    gain = at_level(0.0)[1] - at_level(5.0)[1]
    found = advise(told, (0.0, 0.0), DOWN, Payload(5.0, (0.1, 0.0, 0.0)), of='front')
    set_down = next(a for a in found if a.kind == 'payload')
    assert set_down.gain == pytest.approx(gain)
    words = f': {math.floor(math.degrees(gain))} deg further from tipping to the front'
    assert set_down.sentence == f'set the load of 5.0 kg down{words}'
    moved = next(a for a in found if a.kind == 'joint')
    assert moved.sentence.endswith(f'to the front, in {moved.seconds:.1f} s')
    assert moved.gain > 0.0


def test_an_arm_that_is_too_heavy_itself_can_hold_nothing() -> None:
    """If the arm alone exceeds its limit, all of the load is too heavy, and not more than that."""
    told = replace(TOLD, limits=Limits((25.0, 99.0)))
    found = advise(told, (0.0, 0.0), DOWN, Payload(3.0, (0.1, 0.0, 0.0)), of='lift')
    (load,) = [a for a in found if a.kind == 'payload']
    assert '3.0 kg is 3.0 kg too heavy' in load.sentence


@pytest.mark.parametrize(('mass', 'told'), [(0.05, False), (0.08, True)])
def test_setting_down_what_gains_next_to_nothing_is_not_told(mass: float, told: bool) -> None:  # noqa: FBT001
    """Setting down is not advised below a tenth of the span from ERROR to WARN: 0.72 N m here."""
    weak = replace(TOLD, limits=replace(LIMITS, torque=(36.0, math.inf)))
    found = advise(weak, (0.0, 0.0), DOWN, Payload(mass, (0.1, 0.0, 0.0)), of='lift')
    assert found
    assert ('payload' in [a.kind for a in found]) is told
