"""What advice is about and where it ends: scores, the margin spoken of first, the step to stop."""

import math
from dataclasses import replace

import numpy as np
import pytest
from evaluation.streams import settings
from robots import DOWN

from ugv_acceptance.evaluation import advice
from ugv_acceptance.evaluation.advice import SLACK, Advice, advise, scores_of
from ugv_acceptance.evaluation.settings import Limits
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import margins

LIMITS = Limits((40.0, math.inf), tip_warn=0.3, tip_error=0.1, tip_deadband=0.02)
TOLD = replace(settings(), limits=LIMITS)
GOOD = 5.0


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
    """A warning where the error is has a span of 0.5 degrees, or a fiftieth of the torque."""
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
    """Past ERROR before WARN, of those a tilt before a torque, then the least."""
    assert advice._most_severe(np.array(scores)) == worst


def test_a_path_stops_where_it_is_enough() -> None:
    """At the first step that is clear of the warning's deadband."""
    assert end(0.5, 1.05, 1.2, 1.5) == (2, 1.2, True)


def test_a_path_that_is_not_enough_stops_where_nearly_all_is_gained() -> None:
    """At 95 % of the most: of 0.8 gained, from 0.76 on."""
    assert end(0.5, 0.9, 0.97, 1.0, 0.6) == (2, 0.97, False)
    assert end(0.5, 0.9, 0.95, 1.0, 0.6) == (3, 1.0, False)


@pytest.mark.parametrize(('gained', 'counts'), [(0.09, False), (0.11, True)])
def test_a_path_that_gains_next_to_nothing_is_none(gained: float, counts: bool) -> None:  # noqa: FBT001
    """A tenth of the way from ERROR to WARN is the least."""
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
    """What warns already must only not become worse."""
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
    """Enough, no turn, fastest; else what gains most, turns last."""
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
    assert f'{load.gain:.0f} N m less on the lift' in load.sentence


def test_a_load_that_is_light_is_not_spoken_of() -> None:
    """Nor one of no mass: setting it down gains less than a tenth of the span, 0.8 N m."""
    for mass in (0.0, 0.07):
        kinds = [a.kind for a in advise(TOLD, (0.0, 0.0), DOWN, Payload(mass, (0.1, 0.0, 0.0)))]
        assert 'payload' not in kinds
    heavier = advise(TOLD, (0.0, 0.0), DOWN, Payload(0.5, (0.1, 0.0, 0.0)), of='lift')
    assert 'payload' in [a.kind for a in heavier]
