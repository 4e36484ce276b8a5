"""Access checks of the console: address, Host, Origin and token, and the page's permissions.

Any web page in a browser can send requests to a server on this machine. So the Host name is checked
against DNS rebinding, Origin against foreign pages, and clients that are no browser need the token.
"""

import hmac
import ipaddress
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs

from ugv_acceptance import BadConfig

SHORTEST_TOKEN = 8
HEADERS = (
    (
        b'content-security-policy',
        b"default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (b'x-content-type-options', b'nosniff'),
    (b'x-frame-options', b'DENY'),
    (b'referrer-policy', b'no-referrer'),
    (b'cross-origin-opener-policy', b'same-origin'),
    (b'cross-origin-resource-policy', b'same-origin'),
    (b'cache-control', b'no-cache'),
)

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]


def check_address(host: str, token: str | None) -> None:
    """Raise BadConfig for a `host` open to other machines without a token, or a short token."""
    if token is not None and len(token) < SHORTEST_TOKEN:
        raise BadConfig(f'--token: expected at least {SHORTEST_TOKEN} characters, got {len(token)}')
    if token is None and not is_loopback(host):
        raise BadConfig(
            f'--host {host}: expected 127.0.0.1, or a --token: others could command the monitor'
        )


def is_loopback(host: str) -> bool:
    """Return whether a host address is only reachable from this machine."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == 'localhost'


@dataclass(frozen=True, slots=True)
class Guard:
    """The access checks of one server that is bound to `host`."""

    host: str
    token: str | None

    def refusal(
        self, method: str, headers: Mapping[bytes, bytes], query: bytes
    ) -> HTTPStatus | None:
        """Return the HTTP status with which a request is refused, None if it is allowed.

        400: a Host that is not ours. 403, for methods other than GET and HEAD: an Origin that is
        not ours, a wrong token, or neither Origin nor token.
        """
        host = headers.get(b'host', b'').decode('latin-1')
        if not self._ours(host):
            return HTTPStatus.BAD_REQUEST
        if method in {'GET', 'HEAD'}:
            return None
        origin = headers.get(b'origin', b'').decode('latin-1')
        if origin and origin not in {f'http://{host}', f'https://{host}'}:
            return HTTPStatus.FORBIDDEN
        if self.token is not None:
            right = hmac.compare_digest(self.token.encode(), _token(headers, query))
            return None if right else HTTPStatus.FORBIDDEN
        return None if origin else HTTPStatus.FORBIDDEN

    def _ours(self, host: str) -> bool:
        name = host.rsplit(':', 1)[0] if not host.endswith(']') else host
        name = name.strip('[]')
        if name in {self.host, 'localhost'} or is_loopback(name):
            return True
        # Bound to all addresses: any address may pass, a name could be DNS rebinding.
        return not is_loopback(self.host) and _is_address(name)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _token(headers: Mapping[bytes, bytes], query: bytes) -> bytes:
    bearer = headers.get(b'authorization', b'')
    if bearer.startswith(b'Bearer '):
        return bearer.removeprefix(b'Bearer ')
    found = parse_qs(query.decode('latin-1')).get('token', [''])
    return found[0].encode()


def guarded(app: App, guard: Guard) -> App:
    """Return the application behind the access checks; every answer carries HEADERS."""

    async def checked(scope: Scope, receive: Receive, send: Send) -> None:
        if scope['type'] not in {'http', 'websocket'}:
            await app(scope, receive, send)
            return
        method = scope.get('method', 'WEBSOCKET')
        refused = guard.refusal(method, dict(scope['headers']), scope.get('query_string', b''))
        if refused is None:
            await app(scope, receive, send if method == 'WEBSOCKET' else _with_headers(send))
        elif scope['type'] == 'websocket':
            # Before it is accepted: the server answers the handshake with 403.
            await _refuse_websocket(scope, receive, send, refused)
        else:
            await _refuse(_with_headers(send), refused)

    return checked


def _with_headers(send: Send) -> Send:
    async def sending(message: MutableMapping[str, Any]) -> None:
        if message['type'] == 'http.response.start':
            message['headers'] = [*message.get('headers', ()), *HEADERS]
        await send(message)

    return sending


async def _refuse(send: Send, status: HTTPStatus) -> None:
    plain = [(b'content-type', b'text/plain')]
    await send({'type': 'http.response.start', 'status': int(status), 'headers': plain})
    await send({'type': 'http.response.body', 'body': f'{status} {status.phrase}\n'.encode()})


async def _refuse_websocket(scope: Scope, receive: Receive, send: Send, status: HTTPStatus) -> None:
    await receive()
    if 'websocket.http.response' in scope.get('extensions', {}):
        start = {'type': 'websocket.http.response.start', 'status': int(status), 'headers': []}
        await send(start)
        await send({'type': 'websocket.http.response.body', 'body': b''})
    else:
        await send({'type': 'websocket.close', 'code': 1008})
