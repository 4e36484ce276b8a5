"""Bounds of single moments: which effects count for a signal, in the unit people see."""

import math
from typing import Any

import numpy as np
import pytest
from evaluation.streams import settings

from ugv_acceptance.evaluation.criteria.criteria import (
    IGNORED,
    RSS,
    WORST_CASE,
    AlertDemand,
    CriteriaSet,
    Criterion,
    Demand,
    Value,
)
from ugv_acceptance.evaluation.criteria.measurement import (
    CriteriaMeasurement,
    Moment,
    ValueMeasure,
    moment_json,
)
from ugv_acceptance.evaluation.criteria.uncertainty import (
    _OF,
    Bounds,
    Effects,
    Source,
    margin_bounds,
)
from ugv_acceptance.evaluation.inputs.payload import PayloadLog
from ugv_acceptance.model.robot import Payload

TOLD = settings()
SOURCES = (Source('a', 'lift', 'limit', 2.0), Source('b', 'slide', 'limit', 3.0))
EFFECTS = Effects(
    SOURCES,
    torque=np.array(((1.0, 2.0), (3.0, 4.0))),
    angle=np.array(((0.1, 0.2, 0.3, 0.4), (0.5, 0.6, 0.7, 0.8))),
    position=np.array(((0.01, 0.02), (0.03, 0.04))),
    limit=np.array(((10.0, 20.0), (30.0, 40.0))),
    tilt=np.array((0.7, 0.9)),
)


def moment(value: float, subject: str, gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)) -> Moment:  # fmt: skip # noqa: E501
    """Return a moment of the small robot."""
    return Moment(0, value, subject, (0.5, 0.1), gravity, Payload(1.5, (0.1, 0.0, 0.0)))


@pytest.mark.parametrize(
    ('signal', 'subject', 'expected'),
    [
        ('torque', 'slide', (2.0, 4.0)),
        ('torque_margin', 'slide', (22.0, 44.0)),
        ('torque_utilisation', 'slide', ((2.0 + 0.5 * 20.0) / 30.0, (4.0 + 0.5 * 40.0) / 30.0)),
        ('position', 'slide', (0.02, 0.04)),
        ('tip_angle', 'left', (0.2, 0.6)),
        ('tilt', 'robot', (0.7, 0.9)),
    ],
)
def test_a_signal_takes_its_own_effects(
    signal: str, subject: str, expected: tuple[float, float]
) -> None:
    """A share of a limit moves with the torque, and by its own size with the limit (30 N)."""
    assert _OF[signal](EFFECTS, moment(0.5, subject), TOLD) == pytest.approx(expected)


def test_the_largest_sources_are_named_in_order() -> None:
    """At most five, without those that do nothing, signs kept."""
    names = tuple(Source(str(k), 'lift', 'limit', 1.0) for k in range(8))
    effects = np.array((0.0, -5.0, 1.0, 2.0, 0.5, 4.0, -3.0, 0.0))
    found = Bounds(TOLD, names).largest(effects, 10.0)
    assert [(one['name'], one['effect']) for one in found] == [
        ('1', -50.0), ('5', 40.0), ('6', -30.0), ('3', 20.0), ('2', 10.0)
    ]  # fmt: skip
    few = Bounds(TOLD, names).largest(np.array((0.0,) * 7 + (1.0,)), 1.0)
    assert [one['name'] for one in few] == ['7']


def test_what_has_no_sources_or_is_no_margin_has_no_bound() -> None:
    """Measured values, such as speeds and efforts, have no uncertainty bound."""
    assert Bounds(TOLD, ()).of('torque', moment(1.0, 'lift')) is None
    assert Bounds(TOLD, SOURCES).of('speed', moment(1.0, 'lift')) is None
    assert Bounds(TOLD, SOURCES).of('torque_margin', moment(1.0, 'lift')) is not None


@pytest.mark.parametrize(
    ('gravity', 'roll', 'pitch'),
    [
        ((0.0, 0.0, -9.81), 0.0, 0.0),
        ((0.0, -9.81 * math.sin(0.3), -9.81 * math.cos(0.3)), math.degrees(0.3), 0.0),
        ((9.81 * math.sin(0.2), 0.0, -9.81 * math.cos(0.2)), 0.0, math.degrees(0.2)),
        ((3.0, 4.0, 0.0), -90.0, math.degrees(math.atan2(3.0, 4.0))),
    ],
)
def test_a_moment_is_told_in_degrees_and_metres(
    gravity: tuple[float, float, float], roll: float, pitch: float
) -> None:
    """Rolled to the right and pitched nose down are positive."""
    found = moment_json(moment(1.0, 'lift', gravity), TOLD)
    assert found['joints']['lift'] == {'position': pytest.approx(math.degrees(0.5)), 'unit': 'deg'}
    assert found['joints']['slide'] == {'position': pytest.approx(0.1), 'unit': 'm'}
    assert found['roll_deg'] == pytest.approx(roll)
    assert found['pitch_deg'] == pytest.approx(pitch)
    assert found['payload_kg'] == 1.5


def known(effects: Effects = EFFECTS) -> Bounds:
    """Return bounds to which the effects on the moment of `moment` are known."""
    found = moment(0.0, 'lift')
    return Bounds(TOLD, SOURCES, {(found.q, found.gravity, found.payload): effects})


def measure(demand: Value, *worst: Moment) -> ValueMeasure:
    """Return a measure with these worst moments."""
    found = ValueMeasure(Criterion('c', demand), TOLD, PayloadLog(TOLD), (0, 1))
    found.worst = list(worst)
    return found


LIFT = Value('torque', 'lift', below=True, limit=45.0)
FRONT = Value('tip_angle', 'front', below=False, limit=0.1)


@pytest.mark.parametrize(
    ('method', 'used', 'bound'),
    [(RSS, RSS, math.sqrt(10.0)), (IGNORED, RSS, math.sqrt(10.0)), (WORST_CASE, WORST_CASE, 4.0)],
)
def test_a_bound_takes_from_what_is_left(method: str, used: str, bound: float) -> None:
    """Effects of 1 and 3 N m at 40 of 45; where bounds are ignored one is shown all the same."""
    found = known().worst(measure(LIFT, moment(40.0, 'lift')), method)
    assert found is not None
    assert (found['method'], found['unit']) == (used, 'N m')
    assert found['bound'] == pytest.approx(bound)
    assert found['excess'] == pytest.approx(5.0 - bound)
    assert found['largest'] == [{'name': 'b', 'effect': 3.0}, {'name': 'a', 'effect': 1.0}]


def test_a_bound_of_an_angle_is_in_degrees() -> None:
    """Bound, what is left, and what each source does."""
    found = known().worst(measure(FRONT, moment(0.7, 'front')), WORST_CASE)
    assert found is not None
    assert found['unit'] == 'deg'
    assert found['bound'] == pytest.approx(math.degrees(0.6))
    assert found['excess'] == pytest.approx(math.degrees(0.6 - 0.6), abs=1e-9)
    assert [one['effect'] for one in found['largest']] == pytest.approx(
        [math.degrees(0.5), math.degrees(0.1)]
    )


def test_the_moment_with_the_least_left_counts() -> None:
    """The bound is that of the moment with least left, which may not have the largest value."""
    bounds = known()
    other = moment(44.0, 'lift', (0.0, 1.0, -9.0))
    still = Effects(SOURCES, *(np.zeros_like(x) for x in (
        EFFECTS.torque, EFFECTS.angle, EFFECTS.position, EFFECTS.limit, EFFECTS.tilt)))  # fmt: skip
    bounds._known[other.q, other.gravity, other.payload] = still
    found = bounds.worst(measure(LIFT, other, moment(42.0, 'lift')), RSS)
    assert found is not None
    assert found['excess'] == pytest.approx(3.0 - math.sqrt(10.0))
    first = bounds.worst(measure(LIFT, other, moment(40.0, 'lift')), RSS)
    assert first is not None
    assert (first['excess'], first['bound'], first['largest']) == (1.0, 0.0, [])


def test_no_moment_and_no_number_have_no_bound() -> None:
    """A bound is unknown without a moment, or if the effect of one source is NaN."""
    assert known().worst(measure(LIFT), RSS) is None
    torque = EFFECTS.torque.copy()
    torque[1, 0] = math.nan
    broken = Effects(SOURCES, torque, EFFECTS.angle, EFFECTS.position, EFFECTS.limit, EFFECTS.tilt)
    assert known(broken).worst(measure(LIFT, moment(40.0, 'lift')), RSS) is None
    assert known(broken).worst(measure(FRONT, moment(0.7, 'front')), RSS) is not None


def test_margins_of_a_result_get_their_bounds() -> None:
    """Torque in N m of its limit, tilt in degrees; None where there is none."""
    use = Value('torque_utilisation', 'lift', below=True, limit=1.0)
    slide = Value('torque_utilisation', 'slide', below=True, limit=1.0)
    demands: dict[str, Demand] = {'a': use, 'b': slide, 'c': FRONT, 'd': AlertDemand(raised=False)}
    criteria = CriteriaSet('', 1, tuple(Criterion(k, d) for k, d in demands.items()), '')
    found = CriteriaMeasurement(criteria, TOLD, 0, 1)
    for name, value, subject in (('a', 0.5, 'lift'), ('c', 0.7, 'front')):
        of = found.measures[name]
        assert isinstance(of, ValueMeasure)
        of.worst = [moment(value, subject)]
    joints = {'lift': {'limit': 45.0, 'unit': 'N m'}, 'slide': {'limit': 30.0, 'unit': 'N'}}
    result: dict[str, Any] = {'torque': joints, 'stability': {}}
    margin_bounds(result, found, known())
    lift = result['torque']['lift']['uncertainty']
    effects = np.array((1.0 + 0.5 * 10.0, 3.0 + 0.5 * 30.0))  # of torque, and of half the limit
    assert lift['bound'] == pytest.approx(np.hypot(*effects))
    assert lift['excess'] == pytest.approx(22.5 - np.hypot(*effects))
    assert (lift['unit'], lift['method']) == ('N m', RSS)
    assert lift['largest'] == [
        {'name': 'b', 'effect': pytest.approx(18.0)}, {'name': 'a', 'effect': pytest.approx(6.0)}
    ]  # fmt: skip
    assert result['torque']['slide']['uncertainty'] is None
    assert result['stability']['uncertainty']['bound'] == pytest.approx(
        math.degrees(math.hypot(0.1, 0.5))
    )


def test_effects_on_a_moment_are_worked_out_once() -> None:
    """The effects on a moment are computed once; another payload makes another moment."""
    bounds = known()
    assert bounds.of('torque', moment(1.0, 'slide')) == pytest.approx((2.0, 4.0))
    assert len(bounds._known) == 1
    heavier = Moment(0, 1.0, 'slide', (0.5, 0.1), (0.0, 0.0, -9.81), Payload(9.0))
    assert bounds.of('torque', heavier) is not None
    assert len(bounds._known) == 2
