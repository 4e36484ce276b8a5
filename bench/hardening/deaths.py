"""Trials of files left by a process killed at a random moment, and of full or read-only disks."""

import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

from hardening import full_disk
from hardening import kills as killed
from hardening.outcome import Outcome

PASS = Path(__file__).resolve().parents[2] / 'bags' / 'packbot_pass'


def in_folder(trial: Callable[[Path], Outcome]) -> Outcome:
    """Make a trial in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        return trial(Path(folder))


def kills(share: float) -> Iterable[Outcome]:
    """Kill recorder, monitor, campaign and report twenty times each."""
    times = max(1, round(20 * share))
    yield in_folder(lambda folder: killed.recorder(folder, times))
    yield in_folder(lambda folder: killed.black_box(folder, times))
    yield in_folder(lambda folder: killed.campaign(PASS, folder, times))
    yield in_folder(lambda folder: killed.report(PASS, folder, times))


def disks(_share: float) -> Iterable[Outcome]:
    """Write to disks that are full or read-only."""
    for state in ('full', 'read-only'):
        yield in_folder(lambda folder, of=state: full_disk.verbs(PASS, folder, of))  # type: ignore[misc]
        yield in_folder(lambda folder, of=state: full_disk.watched(folder, of))  # type: ignore[misc]
    yield in_folder(full_disk.recorder)
    yield in_folder(lambda folder: full_disk.resumed(PASS, folder))
