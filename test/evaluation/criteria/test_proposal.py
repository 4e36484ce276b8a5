"""Criteria proposed from a good run: read back as YAML, and held to the run's own numbers."""

from typing import Any

import pytest
import yaml

from ugv_acceptance.evaluation.criteria.proposal import proposed_criteria


def value(
    must_be: str, worst: float | None, limit: float, bound: float | None, unit: str = 'N m'
) -> dict[str, Any]:
    """Return a criterion's outcome on a value."""
    return {
        'name': 'the "value"',
        'requirement': 'stays good',
        'measured': {
            'signal': 'torque',
            'of': 'lift',
            'must_be': must_be,
            'worst': worst,
            'limit': limit,
            'unit': unit,
            'uncertainty': None if bound is None else {'bound': bound},
        },
    }


def proposed(
    *outcomes: dict[str, Any], protected: str = 'all', rate: float | None = 49.7, gap: float = 0.05
) -> Any:
    """Return the criteria proposed for a run, as YAML reads them."""
    found = {'rate_hz': rate, 'longest_gap_s': gap}
    result = {
        'criteria': {'results': list(outcomes)},
        'bag': {'protected': protected},
        'inputs': {'joint_states': found, 'imu': {'rate_hz': 200.0, 'longest_gap_s': 0.31}},
    }
    return yaml.safe_load(proposed_criteria(result, 'a: "robot"'))


@pytest.mark.parametrize(
    ('worst', 'limit', 'bound', 'expected'),
    [
        (20.0, 45.0, 1.5, 24.0),  # 20 + 1.5 + 2, up to two digits
        (20.0, 45.0, None, 22.0),
        (40.0, 45.0, 2.0, 45.0),  # not beyond the configuration
        (-20.0, 45.0, 1.5, -16.0),
        (0.0, 45.0, 0.0, 0.0),
        (0.123, 45.0, None, 0.14),
    ],
)
def test_what_must_stay_below_gets_room_above(
    worst: float, limit: float, bound: float | None, expected: float
) -> None:
    """A proposed upper bound is the worst value plus uncertainty and a tenth, up to the limit."""
    found = proposed(value('below', worst, limit, bound))['criteria']['the "value"']
    assert found['below_nm'] == pytest.approx(expected)
    assert (found['value'], found['of']) == ('torque', 'lift')
    assert found['requirement'] == 'stays good'


@pytest.mark.parametrize(
    ('worst', 'limit', 'bound', 'expected'),
    [
        (20.0, 5.0, 1.5, 16.0),  # 20 - 1.5 - 2, down to two digits
        (20.0, 5.0, None, 18.0),
        (5.5, 5.0, 0.2, 5.0),
        (-2.0, -9.0, 0.1, -2.3),
    ],
)
def test_what_must_stay_above_gets_room_below(
    worst: float, limit: float, bound: float | None, expected: float
) -> None:
    """A proposed lower bound is the worst value less uncertainty and a tenth, down to the limit."""
    found = proposed(value('above', worst, limit, bound, 'deg'))['criteria']['the "value"']
    assert found['above_deg'] == pytest.approx(expected)


@pytest.mark.parametrize(
    ('unit', 'key'), [('m', 'below_m'), ('N', 'below_n'), ('deg/s', 'below_degps'), ('', 'below')]
)
def test_the_key_names_the_unit(unit: str, key: str) -> None:
    """The keys of proposed criteria end in the unit, as docs/criteria.md spells them."""
    assert key in proposed(value('below', 1.0, 9.0, None, unit))['criteria']['the "value"']


def test_what_was_not_seen_is_not_demanded() -> None:
    """No criterion is proposed from a value that was never known, nor from a rate of 0."""
    alert = {'name': 'no alert', 'requirement': '', 'measured': {'alerts': []}}
    found = proposed(value('below', None, 9.0, None), alert, rate=None)['criteria']
    assert set(found) == {
        'no error', 'coverage', 'whole file', 'all messages', 'protected', 'gaps of joint_states',
        'rate of imu', 'gaps of imu',
    }  # fmt: skip


def test_data_are_demanded_as_good_as_they_were() -> None:
    """Nine tenths of the rate, twice the gap but at least 0.2 s, checksums where all had one."""
    found = proposed()
    criteria = found['criteria']
    assert found['name'] == 'a: "robot"'
    assert (found['version'], found['coverage'], found['uncertainty']) == (1, 0.95, 'rss')
    assert criteria['rate of joint_states'] == {
        'data': 'rate', 'of': 'joint_states', 'at_least': 44
    }  # fmt: skip
    assert criteria['rate of imu']['at_least'] == 180
    assert criteria['gaps of joint_states']['at_most_s'] == 0.2
    assert criteria['gaps of imu']['at_most_s'] == pytest.approx(0.62)
    assert criteria['coverage'] == {'data': 'coverage', 'at_least': 0.95}
    assert criteria['protected'] == {'data': 'protected', 'at_least': 1}
    assert 'protected' not in proposed(protected='some')['criteria']
