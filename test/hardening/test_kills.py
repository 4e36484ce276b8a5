"""What is left when recorder or report are killed, or the disk is full: once each."""

from pathlib import Path

import pytest
from hardening import full_disk, kills


def test_a_killed_recorder_keeps_what_it_promised(tmp_path: Path) -> None:
    """A recording whose recorder was killed is readable and lacks less than a second."""
    outcome = kills.recorder(tmp_path, 1, seed=1)
    assert outcome.held, outcome.measured


def test_a_killed_report_leaves_old_or_whole_files(tmp_path: Path, repository: Path) -> None:
    """A killed evaluation leaves each file as it was or complete."""
    outcome = kills.report(repository / 'bags' / 'packbot_pass', tmp_path, 1, seed=1)
    assert outcome.held, outcome.measured


def test_on_a_full_disk_every_verb_says_so_in_one_line(tmp_path: Path, repository: Path) -> None:
    """On a full disk every verb ends with code 2 and one line; older results stay."""
    outcome = full_disk.verbs(repository / 'bags' / 'packbot_gap', tmp_path, 'full')
    if outcome.held is None:
        pytest.skip(outcome.measured)
    assert outcome.held, outcome.measured
