"""Seconds of the minutes that the hardening run watches a robot over DDS."""

from hardening.soak import KINDS, trial


def test_over_dds_an_overload_is_alerted_and_no_message_is_lost() -> None:
    """A driver, the monitor and who listens, each a process: a fault every few seconds."""
    outcome = trial(20.0, rates=(50.0, 100.0), soon=KINDS['overload'])
    assert outcome.held, outcome.measured
