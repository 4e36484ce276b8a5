"""The server with many clients: every command is answered, and slow clients harm no other."""

import json
import os
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import takewhile
from pathlib import Path
from typing import Any

import pytest
from console.crowd import deaf, is_closed, messages, silent
from console.servers import console
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from ugv_acceptance.console.hub import MOST_CLIENTS
from ugv_acceptance.console.server import MOST_SILENT


@contextmanager
def client(url: str) -> Iterator[ClientConnection]:
    """Return a client that is greeted as the page is."""
    where, origin = url.replace('http', 'ws') + 'live', Origin(url.rstrip('/'))
    with connect(where, origin=origin, open_timeout=60) as opened:
        yield opened


def ask(opened: ClientConnection, text: str) -> dict[str, Any]:
    """Send a command; return its answer."""
    opened.send(text)
    return next_of(opened, 'answer')


def next_of(opened: ClientConnection, kind: str) -> dict[str, Any]:
    """Return the next message of a kind."""
    while True:
        found: dict[str, Any] = json.loads(opened.recv(timeout=60))
        if found['kind'] == kind:
            return found


def test_a_client_gets_robot_map_and_frames(bag_url: str) -> None:
    """First the robot, then frames that follow each other, and a map."""
    with client(bag_url) as opened:
        hello = json.loads(opened.recv(timeout=60))
        assert (hello['kind'], hello['robot'], hello['source']) == ('hello', 'packbot', 'bag')
        numbers = [next_of(opened, 'frame')['number'] for _ in range(3)]
        assert numbers == sorted(set(numbers))
        ask(opened, json.dumps({'do': 'axes', 'x': 'turret_joint', 'y': 'elbow_joint'}))
        assert next_of(opened, 'map')['x'] == 'turret_joint'


@pytest.mark.parametrize(
    'text',
    [
        '',
        '{',
        '[]',
        '{"do": 5}',
        '{"do": "seek", "to_s": "x"}',
        '{"do": "seek", "to_s": NaN}',
        '{"do": "axes", "x": "<b>", "y": null}',
        '{"do": "probe", "x": 1e999, "y": []}',
        pytest.param(f'{{"do": "seek", "to_s": 1{"0" * 400}}}', id='a whole number without end'),
        pytest.param(f'{{"do": "probe", "x": 0, "y": 1{"0" * 400}}}', id='the same on the map'),
        '{"do": "acknowledge"}',
        '[' * 2000,
    ],
)
def test_a_bad_command_is_refused_with_words(bag_url: str, text: str) -> None:
    """Whatever a client sends is answered, and the frames go on."""
    with client(bag_url) as opened:
        found = ask(opened, text)
        assert not found['ok']
        assert found['text']
        next_of(opened, 'frame')


@pytest.mark.parametrize('data', [b'bytes', 'x' * 100_000])
def test_what_is_no_command_ends_that_client_only(bag_url: str, data: bytes | str) -> None:
    """A client that sends bytes or far too much is let go; another one sees no difference."""
    with client(bag_url) as good, client(bag_url) as bad:
        bad.send(data)
        with pytest.raises(ConnectionClosed, match=r'1008|1009'):
            next_of(bad, 'no such kind')
        next_of(good, 'frame')


def test_a_crowd_delays_nobody_and_costs_no_memory(repository: Path) -> None:
    """Beside 20 clients that read nothing and 100 silent ones another gets every frame."""
    with console(str(repository / 'bags' / 'packbot_pass')) as (url, process), ExitStack() as stack:
        good = stack.enter_context(client(url))
        first = next_of(good, 'frame')['number']
        before = resident(process.pid)
        for make in (deaf,) * 20 + (silent,) * 100:
            stack.enter_context(make(url))
        numbers = [next_of(good, 'frame')['number'] for _ in range(80)]
        assert numbers[-1] - first <= len(numbers) + 8
        assert resident(process.pid) - before < 20e6


def resident(pid: int) -> int:
    """Return the memory (bytes) of a process."""
    return int(Path(f'/proc/{pid}/statm').read_text().split()[1]) * os.sysconf('SC_PAGE_SIZE')


def test_a_slow_client_loses_old_frames_and_gets_the_newest(bag_url: str) -> None:
    """Who reads after a while gets few old frames, then those of now: none were kept for it."""
    with client(bag_url) as good, deaf(bag_url) as slow:
        slow.recv(1, socket.MSG_PEEK)  # it is served
        ask(good, 'what was sent before the answer to this')
        began = next_of(good, 'frame')['number']
        while (now := next_of(good, 'frame')['number']) < began + 80:
            pass
        read = (message['number'] for message in messages(slow) if message['kind'] == 'frame')
        old = list(takewhile(lambda number: number < now, read))
    assert old == sorted(set(old))
    assert len(old) < 40
    assert now - old[0] > 60


def test_silent_connections_make_room(bag_url: str) -> None:
    """Of many connections that ask for nothing some are closed at once; a client is served."""
    with ExitStack() as stack:
        crowd = [stack.enter_context(silent(bag_url)) for _ in range(MOST_SILENT + 40)]
        while (closed := sum(map(is_closed, crowd))) < 40:
            time.sleep(0.05)
        assert closed < len(crowd)
        with client(bag_url) as opened:
            next_of(opened, 'frame')


def test_more_clients_than_can_be_served_are_turned_away(bag_url: str) -> None:
    """One client too many is closed at once, and those that are in stay."""
    with ExitStack() as stack:
        opened = [stack.enter_context(client(bag_url)) for _ in range(MOST_CLIENTS)]
        with client(bag_url) as late, pytest.raises(ConnectionClosed, match='1013'):
            late.recv(timeout=60)
        next_of(opened[0], 'frame')
