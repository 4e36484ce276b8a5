"""What a broken driver sends is named, and no margin is computed from it."""

import pytest
from hardening.values import CASES, trial

from ugv_acceptance.evaluation.wording import advice


@pytest.mark.parametrize('name', list(CASES))
def test_what_is_broken_is_named_and_gives_no_margin(name: str) -> None:
    """Each has its code with advice; margins come only from what is sound, and are finite."""
    case = CASES[name]
    codes, evaluated, finite = trial(name)
    assert finite
    assert case.known or not evaluated
    assert not case.code or (case.code in codes and advice(case.code))
    assert case.code or not codes - {'TIP_OVER', 'TORQUE_LIMIT'}
