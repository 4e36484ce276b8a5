"""Parameters of a running monitor change together or not at all."""

from hardening.parameter_sets import trial


def test_sets_are_wholly_taken_or_wholly_refused() -> None:
    """What is told by the parameters is what the evaluation judges by, after every set."""
    outcome = trial(150, seed=4)
    assert outcome.held, outcome.measured
