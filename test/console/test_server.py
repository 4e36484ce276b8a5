"""The server among clients: every question is answered, and who is slow harms nobody."""

import json
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from ugv_acceptance.console.hub import MOST_CLIENTS


@contextmanager
def client(url: str) -> Iterator[ClientConnection]:
    """Return a client that is greeted as the page is."""
    with connect(url.replace('http', 'ws') + 'live', origin=Origin(url.rstrip('/'))) as opened:
        yield opened


def ask(opened: ClientConnection, text: str) -> dict[str, Any]:
    """Send a command; return its answer."""
    opened.send(text)
    return next_of(opened, 'answer')


def next_of(opened: ClientConnection, kind: str) -> dict[str, Any]:
    """Return the next message of a kind."""
    while True:
        found: dict[str, Any] = json.loads(opened.recv(timeout=20))
        if found['kind'] == kind:
            return found


def test_a_client_gets_robot_map_and_frames(bag_url: str) -> None:
    """First the robot, then frames that follow each other, and a map."""
    with client(bag_url) as opened:
        hello = json.loads(opened.recv(timeout=20))
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


def test_a_slow_client_loses_old_frames_and_delays_nobody(bag_url: str) -> None:
    """Beside clients that read nothing another gets 20 frames a second; theirs are dropped."""
    with client(bag_url) as good:
        where = urlsplit(bag_url)
        slow = []
        for _ in range(5):
            one = socket.socket()
            one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            one.connect((str(where.hostname), int(where.port or 0)))
            lines = (
                'GET /live HTTP/1.1',
                f'Host: {where.netloc}',
                f'Origin: {bag_url.rstrip("/")}',
                'Upgrade: websocket',
                'Connection: Upgrade',
                'Sec-WebSocket-Version: 13',
                'Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==',
            )
            one.sendall('\r\n'.join([*lines, '', '']).encode())
            slow.append(one)
        first = next_of(good, 'frame')['number']
        end = time.monotonic() + 4.0
        got = last = first
        count = 0
        while time.monotonic() < end:
            last = next_of(good, 'frame')['number']
            count += 1
        for one in slow:
            one.close()
    assert count >= 0.9 * (last - got)
    assert count > 40


def test_more_clients_than_can_be_served_are_turned_away(bag_url: str) -> None:
    """One client too many is closed at once, and those that are in stay."""
    with ExitStack() as stack:
        opened = [stack.enter_context(client(bag_url)) for _ in range(MOST_CLIENTS)]
        with client(bag_url) as late, pytest.raises(ConnectionClosed, match='1013'):
            late.recv(timeout=20)
        next_of(opened[0], 'frame')
