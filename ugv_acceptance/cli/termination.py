"""How a verb ends on Ctrl-C (SIGINT) or SIGTERM, and with which exit code.

A verb that runs until stopped ends in order, with 0. One that was to bring a result and has none
ends at once, with 128 plus the signal's number, as shells do: neither a pass nor a fail.
"""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM)
# Seconds between the attempts to end.
AGAIN = 0.2


@contextmanager
def ended_by_signals() -> Iterator[Callable[[], int]]:
    """Let a signal end this process at any point; open files are closed, nothing is printed.

    Yield a function that gives the exit code once a signal came, 0 before. An exception raised
    where it cannot propagate, as in a callback of an import, is lost: it is raised again until it
    ends the process.
    """
    codes, hook = [0], sys.unraisablehook

    def leave(number: int, _: object) -> None:
        codes.append(128 + number)
        signal.setitimer(signal.ITIMER_REAL, AGAIN, AGAIN)
        raise SystemExit(codes[-1])

    def again(*_: object) -> None:
        error = sys.exc_info()[1]
        while error is not None and not isinstance(error, SystemExit):
            error = error.__context__
        # While SystemExit is handled, open files are being closed.
        if error is None:
            raise SystemExit(codes[-1])

    def lost(what: 'sys.UnraisableHookArgs') -> None:
        if not isinstance(what.exc_value, SystemExit):
            hook(what)

    sys.unraisablehook = lost
    signal.signal(signal.SIGALRM, again)
    for number in SIGNALS:
        signal.signal(number, leave)
    try:
        yield lambda: codes[-1]
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


@contextmanager
def asked_to_end() -> Iterator[Callable[[], bool]]:
    """Yield a function that says whether a signal came; signals end nothing meanwhile."""
    came: list[int] = []
    before = {n: signal.signal(n, lambda number, _: came.append(number)) for n in SIGNALS}
    try:
        yield lambda: bool(came)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
