"""Distinguishes a run that could not be judged here from a recording that cannot be read.

No memory, disk space, network or permission: those are faults of the machine and say nothing about
the run. A file that is missing, or is no recording, is a fault of the run.
"""

import errno
from collections.abc import Iterable, Iterator
from pathlib import Path

# Error numbers caused by machine, network or permissions, where this system has them. EIO is not
# among them: a bad sector gives it too.
_NAMES = (
    *('ENOMEM', 'ENOSPC', 'EDQUOT', 'EROFS', 'EFBIG', 'EMFILE', 'ENFILE', 'EAGAIN', 'EBUSY'),
    *('EINTR', 'ENOLCK', 'EACCES', 'EPERM', 'ESTALE', 'EREMOTEIO', 'ECOMM', 'ENONET', 'ENOLINK'),
    *('EPROTO', 'ENETDOWN', 'ENETUNREACH', 'ENETRESET', 'EHOSTDOWN', 'EHOSTUNREACH', 'EPIPE'),
    *('ENOTCONN', 'ENOBUFS', 'ESHUTDOWN', 'ECONNABORTED', 'ECONNREFUSED', 'ECONNRESET'),
    'ETIMEDOUT',
)
_MACHINE = frozenset(getattr(errno, name) for name in _NAMES if hasattr(errno, name))


def is_of_the_machine(error: BaseException, files: Iterable[Path]) -> bool:
    """Return whether an error is caused by the machine, not by the run's `files`."""
    return any(
        isinstance(cause, (MemoryError, ConnectionError, TimeoutError, PermissionError))
        or (isinstance(cause, OSError) and cause.errno in _MACHINE)
        # Something else is missing, such as the folder for temporary files.
        or (isinstance(cause, FileNotFoundError) and all(file.exists() for file in files))
        for cause in _causes(error)
    )


def words(error: BaseException) -> str:
    """Return an error's text as one line of up to 200 characters; without text its type's name."""
    return ' '.join(str(error).split())[:200] or type(error).__name__


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__
