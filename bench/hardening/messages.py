"""Trials of messages: millions of mutated ones, a whole day, wrong clocks, broken drivers."""

from collections.abc import Iterable

from hardening import clocks as wrong_clocks
from hardening import decoding, long_day, parameter_sets
from hardening import values as broken
from hardening.outcome import Outcome


def mutants(share: float) -> Iterable[Outcome]:
    """Decode and evaluate a million mutated messages of each input."""
    return decoding.trial(int(1_000_000 * share)).values()


def day(share: float) -> Iterable[Outcome]:
    """Evaluate a simulated day of messages with faults in it."""
    yield long_day.trial(int(86_400 * share))


def clocks(_share: float) -> Iterable[Outcome]:
    """Evaluate messages with every kind of wrong clock."""
    return wrong_clocks.outcomes()


def values(_share: float) -> Iterable[Outcome]:
    """Evaluate every kind of broken message."""
    return broken.outcomes()


def parameters(share: float) -> Iterable[Outcome]:
    """Set 10,000 random sets of parameters on a running monitor."""
    yield parameter_sets.trial(int(10_000 * share))
