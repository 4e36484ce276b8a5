"""Minutes of the day that the hardening run simulates."""

from hardening.long_day import trial


def test_every_overload_is_alerted_and_nothing_else_is_critical() -> None:
    """Between overloads: jolts, NaN, garbage, silence, wrong clocks, messages that come twice."""
    outcome = trial(600, seed=3)
    assert outcome.held, outcome.measured
