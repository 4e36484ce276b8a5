"""Worker processes that end at once with the process that gave them work.

A Ctrl-C on a terminal reaches every process there. Workers are deaf to it, so that none of them
prints how it was broken off: this process hears it, and ends them.
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
    """A pool whose work is given up where its block is left by an exception, such as a signal's."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:  # noqa: ANN401 - as its base says
        """Give work to a process, which may be started for it."""
        with _uninterrupted(), _deaf():
            return super().submit(fn, *args, **kwargs)

    def __exit__(self, kind: type[BaseException] | None, *rest: Any) -> None:  # noqa: ANN401, PYI036 - its base
        if kind is not None:
            for process in list((self._processes or {}).values()):
                process.kill()
        super().__exit__(kind, *rest)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Hear signals only after the block: a process broken off while it starts would say so."""
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
    """Let processes that start meanwhile never hear SIGINT; this one hears it a little later."""
    # Its start would end the block on the signal.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
