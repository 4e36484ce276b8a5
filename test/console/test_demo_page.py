"""The page that the demo serves, as somebody opens it while the demo plays."""

import json

from console.servers import COMMAND, running
from console.test_server import client, next_of


def test_the_demo_serves_the_console_of_its_run() -> None:
    """The demo prints an address first; the page there shows the run, live."""
    with running(*COMMAND, 'demo', '--rate', '2') as process:
        line = next(line for line in process.stdout or () if 'in a browser' in line)
        url = next(word for word in line.split() if word.startswith('http'))
        with client(url) as opened:
            assert json.loads(opened.recv(timeout=20))['source'] == 'live'
            while next_of(opened, 'frame')['level'] == 'STALE':
                pass


def test_the_demo_can_do_without() -> None:
    """With --no-console it says nothing of a page."""
    with running(*COMMAND, 'demo', '--rate', '30', '--no-console') as process:
        said, _ = process.communicate(timeout=60)
    assert process.returncode == 0, said
    assert 'http' not in said
