"""Trials over real DDS, between real processes: silent inputs, second publishers, lost messages."""

import tempfile
from collections.abc import Iterable
from pathlib import Path

from hardening import lossy_wire, silence, soak
from hardening.outcome import Outcome

BAGS = Path(__file__).resolve().parents[2] / 'bags'
# Seconds of the soak, and of its shortest form.
SOAK, SHORTEST = 600.0, 20.0


def real_time(share: float) -> Iterable[Outcome]:
    """Watch a robot in real time for ten minutes."""
    yield soak.trial(max(SHORTEST, SOAK * share))


def silences(share: float) -> Iterable[Outcome]:
    """Silence an input in each way ten times; one that never starts; one whose QoS differs."""
    for way in silence.ENDS:
        yield silence.trial(way, max(1, round(10 * share)))
    for kind in ('mute', 'silent joints', 'silent imu'):
        yield silence.absent(kind)
    with tempfile.TemporaryDirectory() as folder:
        yield silence.mismatched(Path(folder))


def strangers(share: float) -> Iterable[Outcome]:
    """Start a second publisher ten times."""
    yield silence.strangers(max(1, round(10 * share)))


def lossy(share: float) -> Iterable[Outcome]:
    """Play two recordings through a relay that loses messages in six ways, three times each."""
    for name in ('packbot_pass', 'packbot_fail'):
        for seed in range(max(1, round(3 * share))):
            with tempfile.TemporaryDirectory() as folder:
                yield from lossy_wire.trial(BAGS / name, Path(folder), seed)
