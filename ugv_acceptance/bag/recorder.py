"""Records messages as they come, from a thread that writes: in parts, with an eye on the disk.

Whoever takes messages never waits for the disk. Several times a second what has come is written and
handed to the operating system, so a process that is killed loses no more than that.
"""

import errno
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from ugv_acceptance import AcceptanceError, BadBag
from ugv_acceptance.bag.mcap_writer import Compression
from ugv_acceptance.bag.writer import BagWriter, Qos, definition_of

# Seconds between writes, and between looks at the disk.
PAUSE, LOOK = 0.15, 1.0
# Bytes that wait in memory at most while the disk does not take them.
MOST_HELD = 256 << 20
# Messages of a topic that each further part begins with.
MOST_LASTING = 200
# What tells which earlier message of a topic a new one replaces: equal keys, the later one counts.
Key = Callable[[bytes], Hashable]


@dataclass(frozen=True, slots=True)
class Room:
    """How a recording is divided and when it ends: bytes, and seconds; None: not by that.

    It ends before less than `reserve` bytes are left on the disk.
    """

    part_bytes: int | None = None
    part_seconds: float | None = None
    reserve: int = 500_000_000


@dataclass(slots=True)
class _Declared:
    """A topic that comes up: its type and what its publishers offer."""

    name: str
    type: str
    qos: Sequence[Qos]


_Message = tuple[str, int, bytes]


@dataclass(slots=True)
class Recorder:
    """Writes messages into a new rosbag2 folder until `close`, or until it cannot.

    `trouble` is why it ended by itself (empty: it did not): what was written until then is there.
    `free` are the bytes left on the disk, `dropped` the messages that found no room in memory. Each
    part begins again with the messages of the topics that last, so that it can be judged alone.
    """

    folder: Path
    room: Room = Room()
    compression: Compression = 'zstd'
    trouble: str = ''
    free: int = 0
    dropped: int = 0
    parts: int = 1
    _writer: BagWriter = field(init=False)
    _queue: 'deque[_Message | _Declared]' = field(default_factory=deque)
    _types: dict[str, str] = field(default_factory=dict)
    _keys: dict[str, Key] = field(default_factory=dict)
    _lasting: dict[str, dict[Hashable, bytes]] = field(default_factory=dict)
    _put: int = 0
    _taken: int = 0
    _last: int = 0
    _over: threading.Event = field(default_factory=threading.Event)
    _thread: threading.Thread = field(init=False)

    def __post_init__(self) -> None:
        self._writer = _writer_in(self.folder, self.compression)
        self.free = free_bytes(self.folder)
        if self.free < self.room.reserve:
            self._writer.close()
            raise BadBag(
                f'{self.folder}: expected at least {self.room.reserve / 1e6:.6g} MB left on the '
                f'disk, which are to stay free, got {self.free / 1e6:.6g} MB'
            )
        self._thread = threading.Thread(target=self._run, name='recorder', daemon=True)
        self._thread.start()

    @property
    def size(self) -> int:
        """Bytes written so far."""
        return self._writer.written_bytes

    def declare(
        self, name: str, type_: str, qos: Sequence[Qos], lasting: Key | None = None
    ) -> None:
        """Declare a topic, or what its publishers offer from now on; BadBag for an unknown type.

        Each further part begins with the messages of a topic that is `lasting`.
        """
        definition_of(type_)
        if self._types.setdefault(name, type_) != type_:
            raise BadBag(f'{name}: recorded as {self._types[name]}, not also as {type_}')
        if lasting is not None:
            self._keys[name] = lasting
        self._queue.append(_Declared(name, type_, tuple(qos)))

    def put(self, name: str, now: int, data: bytes) -> None:
        """Record a serialised message of a declared topic, received at `now` (ns); never waits."""
        if self._put - self._taken > MOST_HELD or self.trouble:
            self.dropped += 1
            return
        self._put += len(data)
        self._queue.append((name, now, data))

    def close(self) -> None:
        """Write what has come, finish the files and wait for that; further calls do nothing."""
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        try:
            self._record()
            self._writer.close()
        except OSError as error:
            self.trouble = self.trouble or _cannot_write(error)
            with suppress(OSError, AcceptanceError):
                self._writer.close()
        except Exception as error:  # noqa: BLE001 - said, not swallowed: the recording has ended
            self.trouble = self.trouble or f'a fault in our code: {error!r}'

    def _record(self) -> None:
        began = looked = time.monotonic()
        while not self._over.wait(PAUSE) and not self.trouble:
            self._drain()
            now = time.monotonic()
            if self._is_full(now - began):
                self._writer.split()
                began, self.parts = now, self.parts + 1
                self._begin_again()
            if now - looked >= LOOK:
                looked = now
                self._look_at_the_disk()
        self._drain()

    def _drain(self) -> None:
        for item in self._waiting():
            if isinstance(item, _Declared):
                self._writer.add_topic(item.name, item.type, item.qos)
                self._writer.offer(item.name, item.qos)
                continue
            name, when, data = item
            self._taken += len(data)
            self._writer.write(name, when, data)
            self._last = when
            if name in self._keys:
                self._keep(name, data)
        self._writer.flush()

    def _waiting(self) -> 'Iterator[_Message | _Declared]':
        """Yield what has come until now; what comes meanwhile waits for the next time."""
        for _ in range(len(self._queue)):
            yield self._queue.popleft()

    def _keep(self, name: str, data: bytes) -> None:
        kept, key = self._lasting.setdefault(name, {}), self._keys[name](data)
        kept.pop(key, None)
        kept[key] = data
        if len(kept) > MOST_LASTING:
            del kept[next(iter(kept))]

    def _begin_again(self) -> None:
        for name, kept in self._lasting.items():
            for data in kept.values():
                self._writer.write(name, self._last, data)
        self._writer.flush()

    def _is_full(self, seconds: float) -> bool:
        size, most = self.room.part_bytes, self.room.part_seconds
        by_size = size is not None and self._writer.part_bytes >= size
        return by_size or (most is not None and seconds >= most)

    def _look_at_the_disk(self) -> None:
        if not self._writer.path.exists():
            raise FileNotFoundError(errno.ENOENT, 'the file is gone', str(self._writer.path))
        self.free = free_bytes(self.folder)
        if self.free < self.room.reserve:
            self.trouble = (
                f'{self.free / 1e6:.3g} MB are left on the disk, and {self.room.reserve / 1e6:.3g} '
                'MB are to stay free'
            )


def free_bytes(folder: Path) -> int:
    """Return the bytes that may still be written on the disk of a folder."""
    found = os.statvfs(folder)
    return found.f_bavail * found.f_frsize


def _writer_in(folder: Path, compression: Compression) -> BagWriter:
    try:
        return BagWriter(folder, compression=compression)
    except OSError as error:
        raise BadBag(f'{folder}: {_cannot_write(error)}') from None


def _cannot_write(error: OSError) -> str:
    return f'cannot be written: {error.strerror or error}'
