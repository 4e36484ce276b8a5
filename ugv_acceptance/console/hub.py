"""Sends one feed to many clients: each frame is made once, and slow clients skip frames."""

import asyncio
import json
import math
import sys
from collections import deque
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ugv_acceptance import AcceptanceError, BadSample
from ugv_acceptance.console.frame import describe_robot, frame_of
from ugv_acceptance.console.safe_map import Axes, MapKey, axes_of, key_of, probe, safe_map
from ugv_acceptance.console.snapshot import Awaited, Feed, Snapshot
from ugv_acceptance.monitoring.drawing import Figure, figure_of


def number_in(values: Mapping[str, object], name: str) -> float:
    """Return a finite number from a client's command. Raises BadSample where there is none."""
    value = values.get(name)
    # Integers of JSON have no largest value, floats have.
    most = sys.float_info.max
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= most:
        raise BadSample(f'{name}: expected a finite number, got {value!r:.60}')
    return float(value)


# Seconds between frames and, at least, between two maps.
FRAME = 1 / 15
MAP = 1 / 3
# A client that takes nothing for this long (s) is disconnected; most clients at a time.
PATIENCE = 10.0
MOST_CLIENTS = 32
# Answers that wait for a client; commands of all clients that wait for an answer.
_ANSWERS, _AWAITED = 32, 64
_AS_JSON = json.JSONEncoder(separators=(',', ':'), allow_nan=False).encode


@dataclass(slots=True, eq=False)
class Client:
    """A connected page or terminal: its newest unsent frame and map, and answers to its commands.

    `sending` is the time (s) since when a message is on its way to it, infinite if none is.
    """

    axes: Axes | None
    frame: str | None = None
    map: str | None = None
    answers: deque[str] = field(default_factory=lambda: deque(maxlen=_ANSWERS))
    shown: MapKey | None = None
    ready: asyncio.Event = field(default_factory=asyncio.Event)
    sending: float = math.inf
    server: 'asyncio.Task[None] | None' = None

    def take(self) -> list[str]:
        """Return the unsent messages and remove them: answers, then the map, then the frame."""
        found = [*self.answers, *(text for text in (self.map, self.frame) if text is not None)]
        self.answers.clear()
        self.frame = self.map = None
        self.ready.clear()
        return found


@dataclass(slots=True, eq=False)
class Hub:
    """Makes frames at 15 Hz while a client is connected, and carries out clients' commands."""

    feed: Feed
    clients: set[Client] = field(default_factory=set)
    sent: int = 0
    _figure: Figure = field(init=False)
    _snapshot: Snapshot = field(init=False)
    _maps: dict[MapKey, str] = field(default_factory=dict)
    _map_due: float = 0.0
    _awaited: list[tuple[Client, object, Awaited]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._figure = figure_of(self.feed.settings.robot)
        self._snapshot = self.feed.snapshot()

    async def run(self) -> None:
        """Make frames until cancelled."""
        clock = asyncio.get_running_loop().time
        due = clock()
        while True:
            self._snapshot = self.feed.snapshot()
            self._answer_awaited()
            if self.clients:
                self._let_go(clock() - PATIENCE)
                self._offer_frame()
                if clock() >= self._map_due:
                    self._map_due = max(self._map_due + MAP, clock())
                    await self._offer_maps()
            # Late frames are left out, not made up for.
            due = max(due + FRAME, clock())
            await asyncio.sleep(due - clock())

    def _let_go(self, since: float) -> None:
        """Disconnect clients whose message has been on its way since before a time (s)."""
        for client in self.clients:
            if client.sending < since and client.server is not None:
                client.server.cancel()

    def _offer_frame(self) -> None:
        self.sent += 1
        frame = frame_of(self._snapshot, self.feed.settings, self._figure)
        text = as_json({'kind': 'frame', 'number': self.sent, **frame, **self.feed.extra()})
        for client in self.clients:
            client.frame = text
            client.ready.set()

    async def _offer_maps(self) -> None:
        snapshot, settings = self._snapshot, self.feed.settings
        for client in tuple(self.clients):
            key = key_of(snapshot, settings, client.axes)
            if client.axes is None or key is None or key == client.shown:
                continue
            if key not in self._maps:
                made = await asyncio.to_thread(safe_map, snapshot, settings, client.axes)
                while len(self._maps) >= MOST_CLIENTS:
                    del self._maps[next(iter(self._maps))]
                self._maps[key] = as_json({'kind': 'map', **made})
            client.shown, client.map = key, self._maps[key]
            client.ready.set()

    def join(self) -> Client:
        """Return a new client with its first message. Raises BadSample where there are too many."""
        if len(self.clients) >= MOST_CLIENTS:
            raise BadSample(f'expected at most {MOST_CLIENTS} clients')
        client = Client(axes_of(self.feed.settings))
        hello = {**describe_robot(self.feed.settings), **self.feed.describe()}
        client.answers.append(as_json({'kind': 'hello', 'axes': client.axes, **hello}))
        client.ready.set()
        self.clients.add(client)
        return client

    async def serve(self, client: Client, send: Callable[[str], Awaitable[None]]) -> None:
        """Send a client its messages until it disconnects or takes nothing any more."""
        client.server, clock = asyncio.current_task(), asyncio.get_running_loop().time
        while True:
            await client.ready.wait()
            for text in client.take():
                client.sending = clock()
                await send(text)
            client.sending = math.inf

    def ask(self, client: Client, text: str) -> None:
        """Carry out a client's command (JSON with `do`) and answer it, also where it is invalid."""
        number: object = None
        try:
            values = json.loads(text)
            if not isinstance(values, dict) or not isinstance(values.get('do'), str):
                raise BadSample('expected an object with "do"')
            number = values.get('number')
            done = self._do(client, values['do'], values)
        except (AcceptanceError, ValueError, RecursionError) as error:
            _answer(client, number, {'ok': False, 'text': str(error)})
            return
        if callable(done):
            self._awaited.append((client, number, done))
        else:
            _answer(client, number, {'ok': True, **done})

    def _answer_awaited(self) -> None:
        """Answer the commands whose answers have come since the last frame."""
        for waiting in tuple(self._awaited):
            client, number, said = waiting
            try:
                text = said()
                if text is None:
                    continue
                answer = {'ok': True, 'text': text}
            except AcceptanceError as error:
                answer = {'ok': False, 'text': str(error)}
            self._awaited.remove(waiting)
            _answer(client, number, answer)

    def _do(self, client: Client, do: str, values: dict[str, Any]) -> dict[str, Any] | Awaited:
        settings = self.feed.settings
        if do == 'axes':
            client.axes = axes_of(settings, (str(values.get('x')), str(values.get('y'))))
            client.shown = None
            return {'axes': client.axes}
        if do == 'probe':
            at = (number_in(values, 'x'), number_in(values, 'y'))
            return {'probe': probe(self._snapshot, settings, client.axes, at)}
        if len(self._awaited) >= _AWAITED:
            raise BadSample(f'{do}: {_AWAITED} commands wait for an answer: try again in a moment')
        said = self.feed.command(do, values)
        return {'text': said} if isinstance(said, str) else said


def _answer(client: Client, number: object, answer: dict[str, Any]) -> None:
    client.answers.append(as_json({'kind': 'answer', 'number': _small(number), **answer}))
    client.ready.set()


def as_json(value: dict[str, Any]) -> str:
    """Return compact JSON by the standard, so without NaN."""
    return _AS_JSON(value)


def _small(number: object) -> int | None:
    """Return the number by which a client marks its command, None unless a small integer."""
    return number if isinstance(number, int) and abs(number) < 1 << 53 else None
