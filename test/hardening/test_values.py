"""What a broken driver sends is named, and no margin is computed from it."""

import pytest
from hardening.values import CASES, trial


@pytest.mark.parametrize('name', list(CASES))
def test_what_is_broken_is_named_and_gives_no_margin(name: str) -> None:
    """Every broken value raises its code with advice; margins come only from valid values."""
    assert not trial(name).failing(CASES[name])
