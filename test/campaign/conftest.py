"""A small fleet written once, and campaigns on it."""

from pathlib import Path

import pytest
from campaign.fleet import write_fleet


@pytest.fixture(scope='session')
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of six recordings: two good, one tips, one half silent, a copy, one is none."""
    return write_fleet(tmp_path_factory.mktemp('fleet'))
