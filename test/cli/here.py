"""The command in the process of the test: as a person types it, without the start of a Python."""

import io
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from unittest.mock import patch

from ugv_acceptance.cli import app, main


@contextmanager
def signals_kept() -> Iterator[None]:
    """Give this process back what the command sets for its own: signals, timer, hook."""
    kept = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)}
    timer, hook = signal.getitimer(signal.ITIMER_REAL), sys.unraisablehook
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for number, handler in kept.items():
            signal.signal(number, handler)
        signal.setitimer(signal.ITIMER_REAL, *timer)


def ugv(*arguments: object) -> 'subprocess.CompletedProcess[str]':
    """Run the command here; an error that no person can act on is raised.

    For what is printed and written. How a process starts, ends and is killed is tried with
    processes: test_termination.py, test_live_verbs.py, test_outputs.py.
    """
    words = ['ugv-acceptance', *map(str, arguments)]
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding='utf-8') for _ in range(2))
    code: object = 0
    app.registered_commands.clear()
    with (
        signals_kept(),
        patch.object(sys, 'argv', words),
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
    texts = []
    for stream in (out, err):
        stream.flush()
        stream.seek(0)
        texts.append(stream.read())
    assert isinstance(code, int)
    return subprocess.CompletedProcess(words, code, *texts)
