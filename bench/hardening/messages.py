"""Trials of messages: by the million, for a day."""

from collections.abc import Iterable

from hardening import decoding, long_day
from hardening.outcome import Outcome


def mutants(share: float) -> Iterable[Outcome]:
    """Take a million mutants of each input."""
    return decoding.trial(int(1_000_000 * share)).values()


def day(share: float) -> Iterable[Outcome]:
    """Evaluate a day."""
    yield long_day.trial(int(86_400 * share))
