"""Trials of recordings: damaged by the thousand, and read in several ways."""

import tempfile
from collections.abc import Iterable
from pathlib import Path

from hardening import damage, sameness
from hardening.outcome import Outcome

ROOT = Path(__file__).resolve().parents[2]
CONFORMANCE = ROOT.parent / 'shared' / 'bags' / 'conformance'


def damaged(share: float) -> Iterable[Outcome]:
    """Cut at every byte, flip 10,000 bits, 4,000 wrong lengths, bombs of 1 GiB, 656 files."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        yield damage.cuts(path, round(1 / share))
        yield damage.flips(path, int(10_000 * share))
        yield damage.hostile(path, int(4_000 * share))
        yield damage.bombs(path)
    if CONFORMANCE.is_dir():
        yield damage.conformance(CONFORMANCE)
    else:
        yield Outcome('no conformance files beside this checkout', None)


def same(_share: float) -> Iterable[Outcome]:
    """Judge the three recordings that ship."""
    for name in ('packbot_pass', 'packbot_fail', 'packbot_gap'):
        with tempfile.TemporaryDirectory() as folder:
            yield sameness.trial(ROOT / 'bags' / name, Path(folder))
