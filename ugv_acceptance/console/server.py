"""The console's web server: one page, its files, and one WebSocket."""

import asyncio
import contextlib
import socket
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.responses import FileResponse
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from ugv_acceptance import BadConfig, BadSample
from ugv_acceptance.console.hub import Client, Hub
from ugv_acceptance.console.security import App, Guard, check_address, guarded

STATIC = Path(__file__).parent / 'static'
# Most bytes of a command.
LONGEST_COMMAND = 4096
# Buffers of a client in the kernel and here (bytes): old frames are dropped, not kept for later.
_BUFFER, _WRITTEN = 16384, 4096
# Most connections without a request yet, and the time (s) after which one is closed.
MOST_SILENT, _SILENCE = 64, 15.0


def application(hub: Hub, guard: Guard) -> App:
    """Return the console as an ASGI application behind its access checks."""

    async def page(_: object) -> FileResponse:
        return FileResponse(STATIC / 'index.html')

    async def live(websocket: WebSocket) -> None:
        await websocket.accept()
        await _converse(hub, websocket)

    @contextlib.asynccontextmanager
    async def running(_: object) -> AsyncIterator[None]:
        task = asyncio.create_task(hub.run())
        yield
        task.cancel()

    routes = [
        Route('/', page),
        WebSocketRoute('/live', live),
        Mount('/static', StaticFiles(directory=STATIC)),
    ]
    return guarded(Starlette(routes=routes, lifespan=running), guard)


async def _converse(hub: Hub, websocket: WebSocket) -> None:
    try:
        client = hub.join()
    except BadSample as error:
        await websocket.close(1013, str(error))
        return
    sending = asyncio.create_task(hub.serve(client, websocket.send_text))
    listening = asyncio.create_task(_listen(hub, client, websocket))
    try:
        # The first to end: the client left, sent no text, or takes nothing.
        await asyncio.wait({listening, sending}, return_when=asyncio.FIRST_COMPLETED)
    finally:
        hub.clients.discard(client)
        for task in (listening, sending):
            task.cancel()
        await asyncio.gather(listening, sending, return_exceptions=True)
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await websocket.close(1008)


async def _listen(hub: Hub, client: Client, websocket: WebSocket) -> None:
    """Carry out a client's commands until it disconnects or sends something other than text."""
    while isinstance(text := (await websocket.receive()).get('text'), str):
        hub.ask(client, text)


def serve(
    hub: Hub,
    host: str = '127.0.0.1',
    port: int = 0,
    token: str | None = None,
    ready: Callable[[str], None] = lambda _: None,
    asked: Callable[[], bool] = lambda: False,
) -> None:
    """Serve the console until SIGINT, SIGTERM or `asked`.

    `ready` takes the page's address once the port is open. Port 0 takes a free one. Raises
    BadConfig where the address is in use, is not this machine's, or may not be used.
    """
    check_address(host, token)
    family = socket.AF_INET6 if ':' in host else socket.AF_INET
    with socket.socket(family) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER)
        try:
            listener.bind((host, port))
        except (OSError, OverflowError) as error:
            text = f'console: expected a free address, {host}:{port} is not: {error}'
            raise BadConfig(text) from None
        listener.listen(64)
        config = uvicorn.Config(
            application(hub, Guard(host, token)),
            log_level='warning',
            access_log=False,
            server_header=False,
            ws_max_size=LONGEST_COMMAND,
            ws_max_queue=8,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=1,
        )
        name = f'[{host}]' if ':' in host else host
        ready(f'http://{name}:{listener.getsockname()[1]}/')
        _Server(config, asked).run(sockets=[listener])


class _Server(uvicorn.Server):
    """uvicorn's server, which also closes idle connections and limits the buffers of slow ones."""

    def __init__(self, config: uvicorn.Config, asked: Callable[[], bool]) -> None:
        super().__init__(config)
        self._asked = asked
        self._since: dict[Any, float] = {}

    async def on_tick(self, counter: int) -> bool:
        """Check all connections, ten times a second; return whether to end."""
        now, there = time.monotonic(), list(self.server_state.connections)
        # Only an HTTP connection has a cycle; None before its first request.
        silent = [c for c in there if getattr(c, 'cycle', c) is None]
        self._since = {c: self._since.get(c, now) for c in silent}
        oldest = sorted(silent, key=self._since.__getitem__)
        late = [c for c in silent if now - self._since[c] > _SILENCE]
        for connection in {*late, *oldest[: max(0, len(silent) - MOST_SILENT)]}:
            connection.transport.close()
        for connection in there:
            if not hasattr(connection, 'cycle'):
                connection.transport.set_write_buffer_limits(_WRITTEN)
        return await super().on_tick(counter) or self._asked()
