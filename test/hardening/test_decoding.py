"""No content of a message ends the monitor: a short form of a million mutants per type."""

from hardening.decoding import SEEDS, trial


def test_mutated_messages_fault_nothing_and_fill_no_memory() -> None:
    """Bits, lengths, cuts and odd numbers: each message is evaluated or refused."""
    found = trial(4000, seed=1)
    assert set(found) == set(SEEDS)
    for outcome in found.values():
        assert outcome.held, outcome.measured
