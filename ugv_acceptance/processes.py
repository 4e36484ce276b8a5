"""Worker processes that end at once with the process that started them.

Ctrl-C on a terminal sends SIGINT to every process there. Workers ignore it, so that none of them
prints a traceback: the parent process receives it and kills them.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import Any

_ENDING = (signal.SIGINT, signal.SIGTERM)


class Workers(ProcessPoolExecutor):
    """A process pool that kills its workers when its `with` block ends by an exception."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:  # noqa: ANN401 - as its base says
        """Submit a call as ProcessPoolExecutor does; a new worker starts with SIGINT blocked."""
        with _uninterrupted(), _deaf():
            return super().submit(fn, *args, **kwargs)

    def __exit__(self, kind: type[BaseException] | None, *rest: Any) -> None:  # noqa: ANN401, PYI036 - its base
        if kind is not None:
            for process in list((self._processes or {}).values()):
                process.kill()
        super().__exit__(kind, *rest)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Delay SIGINT and SIGTERM to the end of the block, so that no worker dies while it starts."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {n: signal.signal(n, lambda number, _: came.append(number)) for n in _ENDING}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for one in came:
            signal.raise_signal(one)


@contextmanager
def _deaf() -> Iterator[None]:
    """Block SIGINT in processes started inside the block; this process gets it afterwards."""
    # Started here, because starting it later would unblock SIGINT.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
