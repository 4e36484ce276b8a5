"""Trials of messages: by the million, for a day, of wrong clocks, broken drivers, parameters."""

from collections.abc import Iterable

from hardening import clocks as wrong_clocks
from hardening import decoding, long_day, parameter_sets
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


def parameters(share: float) -> Iterable[Outcome]:
    """Put 10,000 sets to a running monitor."""
    yield parameter_sets.trial(int(10_000 * share))
