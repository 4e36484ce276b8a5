"""Bounds of single moments: which effects count for a signal, in the unit people see."""

import math

import numpy as np
import pytest
from evaluation.streams import settings

from ugv_acceptance.evaluation.bounds import _OF, Bounds, moment_json
from ugv_acceptance.evaluation.examination import Moment
from ugv_acceptance.evaluation.uncertainty import Effects, Source
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
    """Speeds and efforts are measured, not computed."""
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
