"""Trials of files: damaged recordings, one recording read in several ways, hostile robot files."""

import tempfile
from collections.abc import Iterable
from pathlib import Path

from hardening import damage, robots_fuzzed, sameness
from hardening import lossy as relays
from hardening.outcome import Outcome

ROOT = Path(__file__).resolve().parents[2]
# Seconds that any file may take.
PATIENCE = 5.0
CONFORMANCE = ROOT.parent / 'shared' / 'bags' / 'conformance'


def damaged(share: float) -> Iterable[Outcome]:
    """Read files cut at every byte, with 10,000 flipped bits, wrong lengths, bombs of 1 GiB."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        yield damage.cuts(path, round(1 / share), PATIENCE)
        yield damage.flips(path, int(10_000 * share), patience=PATIENCE)
        yield damage.hostile(path, int(4_000 * share), patience=PATIENCE)
        yield damage.bombs(path, patience=PATIENCE)
    if CONFORMANCE.is_dir():
        yield damage.conformance(CONFORMANCE, PATIENCE)
    else:
        yield Outcome('no conformance files beside this checkout', None)


def same(_share: float) -> Iterable[Outcome]:
    """Judge the three recordings that ship in several ways that must not change the result."""
    for name in ('packbot_pass', 'packbot_fail', 'packbot_gap'):
        with tempfile.TemporaryDirectory() as folder:
            yield sameness.trial(ROOT / 'bags' / name, Path(folder))


def robots(share: float) -> Iterable[Outcome]:
    """Load 10,000 fuzzed robots, hostile files, 500 links and 100 branches."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        yield robots_fuzzed.fuzz(path, int(10_000 * share), patience=PATIENCE)
        yield robots_fuzzed.hostile(path, PATIENCE)
        yield robots_fuzzed.large(path, 499, branches=False, patience=PATIENCE)
        yield robots_fuzzed.large(path, 100, branches=False, patience=PATIENCE)
        yield robots_fuzzed.large(path, 100, branches=True, patience=PATIENCE)


def lossy(share: float) -> Iterable[Outcome]:
    """Lose parts of two recordings in six ways, with 50 seeds each."""
    for name in ('packbot_pass', 'packbot_fail'):
        for way in relays.WAYS:
            with tempfile.TemporaryDirectory() as folder:
                yield relays.trial(ROOT / 'bags' / name, Path(folder), way, int(50 * share) or 1)
