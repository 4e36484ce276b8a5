"""Robot files of an attacker or a tired person: refused with the file, or right."""

from pathlib import Path

import pytest
from hardening import robots_fuzzed


def test_fuzzed_robots_are_taken_or_refused_in_one_line(tmp_path: Path) -> None:
    """Robot files with pieces inserted or cut are loaded or refused in one line."""
    outcome = robots_fuzzed.fuzz(tmp_path, 200, seed=2)
    assert outcome.held, outcome.measured


def test_bombs_entities_and_cycles_are_refused(tmp_path: Path) -> None:
    """Nothing of the machine is read, nothing hangs."""
    outcome = robots_fuzzed.hostile(tmp_path)
    assert outcome.held, outcome.measured


@pytest.mark.parametrize(('joints', 'branches'), [(499, False), (100, False), (100, True)])
def test_large_robots_keep_their_mass_and_torques(
    tmp_path: Path,
    joints: int,
    branches: bool,  # noqa: FBT001
) -> None:
    """Five hundred links in a chain, branches of a hundred joints, a hundred on one base."""
    outcome = robots_fuzzed.large(tmp_path, joints, branches=branches)
    assert outcome.held, outcome.measured
