"""Clients that a console must bear: silent ones, and ones that open the socket and do not read."""

import json
import socket
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

# Bytes the kernel keeps for a client that does not read.
NARROW = 4096


def silent(url: str) -> socket.socket:
    """Open a connection that asks for nothing."""
    where = urlsplit(url)
    made = socket.socket()
    made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, NARROW)
    made.settimeout(60.0)
    made.connect((str(where.hostname), int(where.port or 0)))
    return made


def deaf(url: str) -> socket.socket:
    """Open the WebSocket as the page does, and read nothing of it."""
    lines = (
        'GET /live HTTP/1.1',
        f'Host: {urlsplit(url).netloc}',
        f'Origin: {url.rstrip("/")}',
        'Upgrade: websocket',
        'Connection: Upgrade',
        'Sec-WebSocket-Version: 13',
        'Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==',
    )
    made = silent(url)
    made.sendall('\r\n'.join([*lines, '', '']).encode())
    return made


def is_closed(connection: socket.socket) -> bool:
    """Return whether the other side has closed a connection, whatever it said before."""
    connection.settimeout(0.0)
    try:
        while connection.recv(65536):
            pass
    except BlockingIOError:
        return False
    except ConnectionError:
        return True
    return True


def messages(connection: socket.socket) -> Iterator[dict[str, Any]]:
    """Yield the messages that come on a deaf client's WebSocket, from now on read."""
    stream = connection.makefile('rb')
    while stream.readline().strip():
        pass
    while head := stream.read(2):
        size = head[1]
        if size > 125:
            size = int.from_bytes(stream.read(2 if size == 126 else 8), 'big')
        body = stream.read(size)
        if head[0] == 0x81:
            yield json.loads(body)
