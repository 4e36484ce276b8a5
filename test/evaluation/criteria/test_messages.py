"""How a violation is told: the value, its limit, when, and for how long."""

import math

import pytest
from evaluation.hand_made import findings, made, seconds
from evaluation.streams import settings

from ugv_acceptance.evaluation.criteria.criteria import ANY, Criterion, DataDemand, Value
from ugv_acceptance.evaluation.criteria.messages import demand_words
from ugv_acceptance.evaluation.criteria.verdict import judge_value
from ugv_acceptance.evaluation.settings import Limits

TOLD = settings(limits=Limits((50.0, 30.0)))
RAD = math.radians(1.0)
LEFT = 'must stay above 5 deg'
RUN = made(
    seconds(0.0, 2.5),
    until=seconds(2.5, 10.0),
    torque=[(60.04, 36.0), (1.0, 2.0)],
    angle=[(4 * RAD, 20 * RAD, 30 * RAD, -3 * RAD), (1.0,) * 4],
    q=[(0.0, 0.39), (0.0, 0.0)],
    gravity=[(9.81 * math.sin(40 * RAD), 0.0, -9.81 * math.cos(40 * RAD)), (0.0, 0.0, -9.81)],
)


@pytest.mark.parametrize(
    ('demand', 'said'),
    [
        (Value('torque_utilisation', 'lift', below=True, limit=0.9),
         'lift 120 % of its limit at 0.00 s: it needs 60.0 of 50.0 N m; must stay below 90 %'),
        (Value('torque_utilisation', 'slide', below=True, limit=1.0),
         'slide 120 % of its limit at 0.00 s: it needs 36.0 of 30.0 N; must stay below 100 %'),
        (Value('tip_angle', 'front', below=False, limit=5 * RAD),
         f'4 deg to tipping: FRONT at 0.00 s; {LEFT}'),
        (Value('tip_angle', ANY, below=False, limit=5 * RAD),
         f'3 deg past tipping: RIGHT at 0.00 s; {LEFT}'),
        (Value('position', 'slide', below=True, limit=0.3),
         'position of slide was 0.39 m at 0.00 s; must stay below 0.3 m'),
        (Value('tilt', 'robot', below=True, limit=30 * RAD),
         'tilt of the base was 40 deg at 0.00 s; must stay below 30 deg'),
    ],
)  # fmt: skip
def test_a_violation_in_words(demand: Value, said: str) -> None:
    """A violation is told with its value, limit, time and duration, in the joint's unit."""
    found = judge_value(*findings(TOLD, demand, [RUN]))
    assert found.reason == f'{said} (2.50 s in violation)'


@pytest.mark.parametrize(
    ('demand', 'words'),
    [
        (DataDemand('longest_gap', most=0.2), 'longest gap: at most 0.2 s'),
        (DataDemand('rate', 'imu', least=10.0), 'rate of imu: at least 10 Hz'),
    ],
)
def test_a_bound_that_is_not_given_is_not_told(demand: DataDemand, words: str) -> None:
    """A demand with one bound does not mention the other, infinite one."""
    assert demand_words(Criterion('it', demand), TOLD) == words


def test_a_tilt_of_nothing_is_not_past_the_tipping_point() -> None:
    """A tilt left of 0 is not told as past the tipping point, which begins below 0."""
    level = made(seconds(0), until=seconds(10), angle=[(0.0, 1.0, 1.0, 1.0)])
    found = judge_value(*findings(TOLD, Value('tip_angle', ANY, below=False, limit=0.1), [level]))
    assert found.reason.startswith('0 deg to tipping: FRONT at 0.00 s;')


@pytest.mark.parametrize(
    ('demand', 'said'),
    [
        (Value('torque_utilisation', 'lift', below=True, limit=1.2006), '120.08 % of its limit'),
        (Value('torque_utilisation', 'lift', below=True, limit=1.2007), '120.08 % of its limit'),
        (Value('tilt', 'robot', below=True, limit=39.999 * RAD), 'was 40 deg'),
        (Value('position', 'slide', below=True, limit=0.3899), 'was 0.39 m'),
    ],
)
def test_a_violation_never_reads_as_its_limit(demand: Value, said: str) -> None:
    """However little it is beyond, value and limit are told apart."""
    assert said in judge_value(*findings(TOLD, demand, [RUN])).reason


def test_a_dwell_tells_how_long_it_was_kept() -> None:
    """A dwell that was too short tells how long the limit was kept, of how long was demanded."""
    demand = Value('torque', 'lift', below=True, limit=30.0, dwell=8.0)
    found = judge_value(*findings(TOLD, demand, [RUN]))
    assert found.reason == (
        'it: held for 7.50 s; required: static torque (magnitude) of lift below 30 N m '
        'for 8 s without a break'
    )
