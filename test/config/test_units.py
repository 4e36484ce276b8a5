"""Quantities as people write them."""

import math

import pytest

from ugv_acceptance import BadConfig
from ugv_acceptance.config.units import KEY_ENDINGS, UNITS, Measure, parse, quantity, split_key


@pytest.mark.parametrize(
    ('text', 'kind', 'value'),
    [
        ('30deg', 'angle', math.pi / 6),
        ('-90 deg', 'angle', -math.pi / 2),
        ('30°', 'angle', math.pi / 6),
        ('0.5 rad', 'angle', 0.5),
        ('0', 'angle', 0.0),
        ('50 N m', 'torque', 50.0),
        ('50 N*m', 'torque', 50.0),
        ('30 lbf*ft', 'torque', 40.67453844994),
        ('36 deg/s', 'angular rate', math.pi / 5),
        ('25 cm', 'length', 0.25),
        ('10 lb', 'mass', 4.5359237),
        ('1e-1 s', 'time', 0.1),
        ('9.8 m/s^2', 'acceleration', 9.8),
    ],
)
def test_a_text_with_a_unit_becomes_si(text: str, kind: str, value: float) -> None:
    """The value is that of the same quantity in SI units and radians."""
    assert quantity(text, kind, 'x') == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    'text', ['30 N m', '30', '-0.5', 'nan', 'inf', '1e10', '', 'deg', '3 furlongs', '1 2 deg']
)
def test_what_is_no_angle_is_refused(text: str) -> None:
    """The error names the field, what was expected and what came."""
    with pytest.raises(BadConfig, match=r'^--posture: expected .*, got '):
        quantity(text, 'angle', '--posture')


@pytest.mark.parametrize('value', [math.nan, math.inf, True, None, [1], '30 deg'])
def test_a_measure_takes_only_finite_numbers_of_its_kind(value: object) -> None:
    """The unit in the key's name does not make a number of what is none."""
    with pytest.raises(ValueError, match='expected'):
        parse(Measure(value, 'kg'), ('mass',))


def test_the_unit_in_a_text_wins_over_the_one_in_the_key() -> None:
    """`offset_deg: "0.5 rad"` says what it means."""
    assert parse(Measure('0.5 rad', 'deg'), ('angle',)).value == 0.5


def test_a_key_ends_in_its_unit() -> None:
    """Only endings that are units are cut off, and never the whole key."""
    assert split_key('limit_nm') == ('limit', 'nm')
    assert split_key('static_speed_degps') == ('static_speed', 'deg/s')
    assert split_key('specific_force') == ('specific_force', None)
    assert split_key('_m') == ('_m', None)


def test_every_key_ending_names_a_known_unit() -> None:
    """The two tables agree."""
    assert set(KEY_ENDINGS.values()) <= set(UNITS)
