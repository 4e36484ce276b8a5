"""A clock that is wrong is told within a second and disturbs neither margins nor staleness."""

import pytest
from hardening.clocks import CLOCKS, trial


@pytest.mark.parametrize('name', list(CLOCKS))
def test_a_wrong_clock_is_told_and_disturbs_nothing(name: str) -> None:
    """Stamps that jump, freeze, are zero, days off or restart raise CLOCK and change no margin."""
    told, silent, known = trial(name)
    assert known
    assert told <= 1.0
    assert -0.02 < silent <= 0.11
