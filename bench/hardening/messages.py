"""Trials of messages: by the million, for a day, of wrong clocks and broken drivers."""

from collections.abc import Iterable

from hardening import clocks as wrong_clocks
from hardening import decoding, long_day
from hardening import values as broken
from hardening.outcome import Outcome


def mutants(share: float) -> Iterable[Outcome]:
    """Take a million mutants of each input."""
    return decoding.trial(int(1_000_000 * share)).values()


def day(share: float) -> Iterable[Outcome]:
    """Evaluate a day."""
    yield long_day.trial(int(86_400 * share))


def clocks(_share: float) -> Iterable[Outcome]:
    """Try every wrong clock."""
    return wrong_clocks.outcomes()


def values(_share: float) -> Iterable[Outcome]:
    """Send every broken message."""
    return broken.outcomes()
