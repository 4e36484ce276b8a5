"""The page that the demo serves, as somebody opens it while the demo plays."""

import json
import os
import pty
import subprocess
from collections.abc import Iterator
from contextlib import suppress

from console.servers import COMMAND, running
from console.test_server import client, next_of


def test_the_demo_serves_the_console_of_its_run() -> None:
    """The demo prints an address first; the page there shows the run, live."""
    with running(*COMMAND, 'demo', '--rate', '2') as process:
        line = next(line for line in process.stdout or () if 'in a browser' in line)
        url = next(word for word in line.split() if word.startswith('http'))
        with client(url) as opened:
            assert json.loads(opened.recv(timeout=60))['source'] == 'live'
            while next_of(opened, 'frame')['level'] == 'STALE':
                pass


def test_the_demo_works_in_a_terminal_and_without_a_page() -> None:
    """Where a person watches, a table of margins is drawn, and the alerts count: exit code 0."""
    ours, theirs = pty.openpty()
    command = [*COMMAND, 'demo', '--rate', '6', '--no-console']
    environment = {**os.environ, 'TERM': 'xterm', 'COLUMNS': '120'}
    environment.pop('_ROS_WHEELS_BOOTSTRAP_COMPLETE', None)
    with subprocess.Popen(command, stdout=theirs, stderr=theirs, env=environment) as process:
        os.close(theirs)
        said = ''.join(written(ours))
    assert process.returncode == 0, said
    for text in ('tip to the right (deg)', 'Ctrl-C ends', 'Everything worked.'):
        assert text in said
    assert 'http' not in said


def written(terminal: int) -> Iterator[str]:
    """Yield what is written to a terminal until nobody has it open, and close it."""
    with open(terminal, 'rb', buffering=0) as stream, suppress(OSError):
        while data := stream.read(65536):
            yield data.decode(errors='replace')
