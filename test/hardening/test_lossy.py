"""What is lost on the way never turns a failure into a pass, nor a pass into a failure."""

from pathlib import Path

import pytest
from hardening.lossy import WAYS, trial


@pytest.mark.parametrize('way', list(WAYS))
@pytest.mark.parametrize('name', ['packbot_pass', 'packbot_fail'])
def test_a_lossy_relay_changes_no_verdict(
    repository: Path, tmp_path: Path, name: str, way: str
) -> None:
    """Messages lost singly, in bursts, or late give the same verdict or INCONCLUSIVE."""
    outcome = trial(repository / 'bags' / name, tmp_path, way, seeds=1)
    assert outcome.held, outcome.measured
