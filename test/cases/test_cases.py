"""The 56 quirks of recordings that people met: each is judged as it must be, in words that help."""

from pathlib import Path

import pytest
from cases.table import GIVEN, MADE, SHARED


@pytest.mark.parametrize('name', list(MADE))
def test_a_quirk_comes_out_as_it_must(name: str, tmp_path: Path) -> None:
    """A recording with one quirk gets a verdict that may come, and the words that must be said."""
    case = MADE[name]
    assert not case.expected.wrong(case.verdict(tmp_path))


@pytest.mark.skipif(not SHARED.is_dir(), reason=f'recordings of others are not here: {SHARED}')
@pytest.mark.parametrize('name', list(GIVEN))
def test_the_recording_of_others_comes_out_as_it_must(name: str, tmp_path: Path) -> None:
    """The same holds for the recordings that other people wrote after reports of users."""
    case = GIVEN[name]
    assert not case.expected.wrong(case.verdict(tmp_path))


@pytest.mark.skipif(not SHARED.is_dir(), reason=f'recordings of others are not here: {SHARED}')
def test_every_recording_of_others_has_a_case() -> None:
    """No recording of ../shared/bags/cases is left out of the table."""
    assert set(GIVEN) == {path.name for path in SHARED.iterdir() if path.is_dir()}
