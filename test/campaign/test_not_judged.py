"""A run that could not be judged is told apart from a recording that cannot be read."""

import errno
from pathlib import Path

import pytest

from ugv_acceptance import BadBag
from ugv_acceptance.campaign.not_judged import is_of_the_machine


def caused(error: Exception) -> BadBag:
    """Return the error of a recording that came of another."""
    bad = BadBag('cannot be read')
    bad.__cause__ = error
    return bad


@pytest.mark.parametrize(
    ('error', 'machine'),
    [
        (MemoryError(), True),
        (OSError(errno.ESTALE, 'stale'), True),
        (OSError(errno.ENOSPC, 'full'), True),
        (PermissionError('no key'), True),
        (ConnectionResetError(), True),
        (TimeoutError(), True),
        (OSError(errno.EIO, 'bad sector'), False),
        (BadBag('expected MCAP'), False),
        (ValueError('garbled'), False),
    ],
)
def test_an_error_is_of_the_machine_or_of_the_recording(
    error: Exception, *, machine: bool, tmp_path: Path
) -> None:
    """No memory, disk space, network or permission is the machine's fault, also as a cause."""
    assert is_of_the_machine(error, [tmp_path]) is machine
    assert is_of_the_machine(caused(error), [tmp_path]) is machine


def test_what_is_missing_is_of_the_recording_only_if_it_is_its_file(tmp_path: Path) -> None:
    """A folder for temporary files that is gone says nothing of a recording that is there."""
    assert is_of_the_machine(FileNotFoundError(), [tmp_path])
    assert not is_of_the_machine(FileNotFoundError(), [tmp_path, tmp_path / 'gone'])
