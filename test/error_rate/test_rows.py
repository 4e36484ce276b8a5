"""Every row of the table of wrong verdicts, on PackBot for 60 s; and good runs that look alike."""

from pathlib import Path

import pytest
from error_rate.plan import Plan
from error_rate.rows import ROWS


@pytest.mark.parametrize('name', list(ROWS))
def test_a_row_gets_the_verdict_it_must(name: str, tmp_path: Path) -> None:
    """A faulted run does not pass, a good one does, and the words that matter are told."""
    assert not ROWS[name].wrong(Plan(), tmp_path)
