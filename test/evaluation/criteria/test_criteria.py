"""What is demanded without a file: every limit of the configuration, and nothing else."""

import hashlib
import json
import math
from dataclasses import asdict, replace
from typing import Any

import pytest
from evaluation.streams import settings

from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    RSS,
    AlertDemand,
    CriteriaSet,
    Criterion,
    DataDemand,
    Value,
    default_criteria,
)
from ugv_acceptance.evaluation.settings import Limits

LIMITS = Limits((40.0, 30.0), torque_error=0.9, tip_error=0.2)


@pytest.mark.parametrize(
    ('below', 'value', 'left'),
    [(True, 3.0, 2.0), (True, 6.0, -1.0), (False, 6.0, 1.0), (False, 3.0, -2.0), (True, 5.0, 0.0)],
)
def test_what_is_left_to_a_limit_is_negative_in_violation(
    value: float, left: float, *, below: bool
) -> None:
    """The distance to a limit is negative in violation, for upper and lower limits."""
    assert Value('torque', 'lift', below=below, limit=5.0).distance(value) == left


@pytest.mark.parametrize(
    'allowance', ['time_in_violation', 'longest_violation', 'share_in_violation', 'dwell']
)
def test_any_allowance_lets_a_sample_be_in_violation(allowance: str) -> None:
    """With an allowance, even of 0 s, a criterion is judged by time in violation."""
    plain = Value('torque', 'lift', below=True, limit=5.0)
    assert plain.always
    told: dict[str, Any] = {allowance: 0.0}
    assert not replace(plain, **told).always


def test_without_a_file_every_limit_holds_at_every_moment() -> None:
    """Each joint's torque, tip-over to any side, support; a recording long enough and whole."""
    found = default_criteria(settings(limits=LIMITS))
    assert [c.demand for c in found.criteria] == [
        Value('torque_utilisation', 'lift', below=True, limit=0.9),
        Value('torque_utilisation', 'slide', below=True, limit=0.9),
        Value('tip_angle', ANY, below=False, limit=0.2),
        AlertDemand(raised=False, code='NO_SUPPORT', level='ERROR'),
        DataDemand('coverage', least=0.95),
        DataDemand('duration', least=1.0),
        DataDemand('salvaged', most=0.0),
        DataDemand('lost_messages', most=0.0),
    ]
    assert all(c.window is None and c.uncertainty is None for c in found.criteria)
    assert all(c.requirement for c in found.criteria)
    assert (found.version, found.coverage, found.uncertainty, found.path) == (1, 0.95, RSS, None)


def test_a_joint_without_a_limit_is_not_judged() -> None:
    """A joint without a torque limit gets no criterion."""
    found = default_criteria(settings(limits=Limits((math.inf, 30.0))))
    assert [c.name for c in found.criteria if isinstance(c.demand, Value)] == [
        'torque slide',
        'tip-over',
    ]


def test_the_checksum_is_that_of_the_criteria_as_json() -> None:
    """The criteria's checksum is that of their JSON with sorted keys, in whatever order."""
    found = default_criteria(settings(limits=LIMITS))
    plain = [{**asdict(c), 'kind': type(c.demand).__name__} for c in found.criteria]
    text = json.dumps(plain, sort_keys=True)
    assert found.sha256 == hashlib.sha256(text.encode()).hexdigest()
    other = default_criteria(settings(limits=replace(LIMITS, tip_error=0.21)))
    assert other.sha256 != found.sha256


def test_a_criterion_may_treat_bounds_as_it_likes() -> None:
    """A criterion's own method for uncertainty comes before the method of the set."""
    plain = Criterion('c', DataDemand('coverage'))
    told = CriteriaSet('', 1, (plain,), '', uncertainty='worst_case')
    assert told.uncertainty_of(plain) == 'worst_case'
    assert told.uncertainty_of(replace(plain, uncertainty='ignored')) == 'ignored'


def test_data_of_any_number_meet_a_demand_without_bounds() -> None:
    """A demand on data without bounds is always met; unless told otherwise it never fails a run."""
    demand = DataDemand('gaps')
    assert demand.least < -1e300
    assert demand.most > 1e300
    assert not demand.fails
