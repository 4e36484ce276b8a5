"""How a recording is read does not show in its result."""

from pathlib import Path

import pytest
from hardening.sameness import trial


@pytest.mark.parametrize('name', ['packbot_fail', 'packbot_gap'])
def test_the_way_of_reading_changes_no_byte_of_the_result(
    repository: Path, tmp_path: Path, name: str
) -> None:
    """Threads, parts, file order and single messages give the same result, byte for byte."""
    outcome = trial(repository / 'bags' / name, tmp_path)
    assert outcome.held, outcome.measured
