"""How a verb ends when it is told to, by Ctrl-C (SIGINT) or SIGTERM.

What runs until then ends in order, with 0. What was to bring a result and has none ends at once,
with 128 and the signal's number, as a shell tells of it: neither a pass nor a fail.
"""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM)


def end_on_signals() -> Callable[[], int]:
    """Let a signal end this process wherever it is; what is open is closed, and nothing printed.

    Return what gives the exit code once a signal came, 0 before.
    """
    codes = [0]

    def leave(number: int, _: object) -> None:
        codes.append(128 + number)
        raise SystemExit(codes[-1])

    for number in SIGNALS:
        signal.signal(number, leave)
    return lambda: codes[-1]


@contextmanager
def asked_to_end() -> Iterator[Callable[[], bool]]:
    """Yield what says whether a signal came; meanwhile it ends nothing."""
    came: list[int] = []
    before = {n: signal.signal(n, lambda number, _: came.append(number)) for n in SIGNALS}
    try:
        yield lambda: bool(came)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
