"""The black box: saves the seconds around each critical alert as a small recording.

Messages are kept in memory as they came. A critical alert writes them to a file at once, and what
follows as it comes: if the process is killed later, half a second is lost.
"""

import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.recordings_kept import unused
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.evaluation.alerts.rules import FAILURES
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Alert

# Nanoseconds kept before a critical alert, and recorded after it.
BEFORE, AFTER = 30_000_000_000, 10_000_000_000
# Recordings a session makes at most: an alert that comes and goes must not fill the disk.
MOST = 100
# Messages kept at most, however fast they come.
KEPT = 200_000

# Seconds between flushes; time (s) to wait for a thread's end.
FLUSH, PATIENCE = 0.25, 10.0

# The channel of the robot's own description.
DESCRIPTION = 'robot_description'

Take = Callable[[bytes], None]
# Time of receipt (ns), channel, content.
Kept = tuple[int, str, bytes]


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic to record. `lasting`: its newest message counts until the next comes.

    `latched`: it is offered as transient local.
    """

    topic: str
    type: str
    reliability: str = 'best_effort'
    lasting: bool = False
    latched: bool = False

    @property
    def qos(self) -> Qos:
        """The quality of service that its recording says was offered."""
        return Qos(
            'reliable' if self.reliability == 'reliable' else 'best_effort',
            'transient_local' if self.latched else 'volatile',
        )


def is_critical(alert: Alert) -> bool:
    """Return whether an alert is a failure of the robot, for which a recording is made."""
    return alert.rule.level == ERROR and alert.rule.code in FAILURES


@dataclass(slots=True)
class BlackBox:
    """Keeps incoming messages in memory and writes recordings into `folder` (None: does nothing).

    Times in ns of receipt; `now` returns that of the message in hand. `on_problem` is called with
    the reason why a recording could not be made; the box then goes on keeping. `robot` is the
    description in force, the first message of every recording (empty: none). `saved` are the
    recordings whose past is in the file, `trouble` why the last one could not be made (empty: it
    was made). A thread writes, so that no message has to wait.
    """

    folder: Path | None
    channels: dict[str, Channel]
    now: Callable[[], int]
    on_problem: Callable[[str], None] = lambda _text: None
    most: int = MOST
    robot: bytes = b''
    saved: list[Path] = field(default_factory=list)
    trouble: str = ''
    _kept: deque[Kept] = field(default_factory=lambda: deque(maxlen=KEPT))
    _lasting: dict[str, bytes] = field(default_factory=dict)
    _queue: 'SimpleQueue[Kept | None] | None' = None
    _until: int = 0
    _threads: list[Thread] = field(default_factory=list)
    _problems: 'SimpleQueue[str]' = field(default_factory=SimpleQueue)

    @property
    def state(self) -> str:
        """'on', 'off', or why a recording of the next critical alert is doubtful."""
        if self.folder is None:
            return 'off'
        if self.trouble:
            return f'the last recording failed: {self.trouble}'
        if len(self._threads) >= self.most:
            return f'full: {self.most} recordings were made; activate the monitor again'
        return 'on'

    def tap(self, name: str, take: Take) -> Take:
        """Return `take` wrapped so that every message of a channel is kept before it is taken."""
        if self.folder is None:
            return take
        keep, now = self.keep, self.now

        def tapped(data: bytes) -> None:
            keep(now(), name, data)
            take(data)

        return tapped

    def keep(self, now: int, name: str, data: bytes) -> None:
        """Keep a serialised message, received at `now` (ns)."""
        kept = self._kept
        while kept and kept[0][0] < now - BEFORE:
            _, old, content = kept.popleft()
            if self.channels[old].lasting:
                self._lasting[old] = content
        kept.append((now, name, data))
        if self._queue is not None and now <= self._until:
            self._queue.put((now, name, data))

    def describe(self, now: int, data: bytes) -> None:
        """Keep a description that the robot told at `now` (ns), if it is not the one in force."""
        if self.folder is not None and data != self.robot:
            self.keep(now, DESCRIPTION, data)

    def alerts(self, now: int, raised: Sequence[Alert], summary: bytes) -> None:
        """Take a message of the channel `alerts`, and the alerts that were raised in it.

        A critical one starts a recording or prolongs it. Acknowledgements are kept as well.
        """
        if self.folder is None:
            return
        critical = [alert for alert in raised if is_critical(alert)]
        if critical:
            self._until = now + AFTER
        self.keep(now, 'alerts', summary)
        if critical and self._queue is None and len(self._threads) < self.most:
            self._begin(self.folder, now, critical[0])

    def advance(self, now: int) -> None:
        """Advance to `now` (ns): end a recording that is long enough, report problems."""
        if self._queue is not None and now > self._until:
            self._queue.put(None)
            self._queue = None
        while not self._problems.empty():
            self.on_problem(f'black box: {self._problems.get()}')

    def close(self) -> None:
        """End the current recording, and wait until all are written."""
        self.advance(self._until + 1)
        for thread in self._threads:
            thread.join(PATIENCE)
        self.advance(self._until + 1)

    def _begin(self, folder: Path, now: int, alert: Alert) -> None:
        when = datetime.fromtimestamp(now // 1_000_000_000, timezone.utc)
        stem = f'{when:%Y%m%dT%H%M%SZ}_{alert.rule.code}_{alert.rule.subject}'.lower()
        path = unused(folder / ''.join(c if c.isalnum() else '_' for c in stem))
        past = [message for message in self._kept if message[0] >= now - BEFORE]
        first = past[0][0] if past else now
        lasting = [(first, name, data) for name, data in self._lasting.items()]
        lasting = [*([(first, DESCRIPTION, self.robot)] if self.robot else []), *lasting]
        self._queue = SimpleQueue()
        work = (path, [*lasting, *past], self._queue)
        thread = Thread(target=self._record, args=work, name='black_box', daemon=True)
        self._threads.append(thread)
        thread.start()

    def _record(self, path: Path, past: list[Kept], queue: 'SimpleQueue[Kept | None]') -> None:
        """Write a recording; an error such as a full disk is reported and does not end the node."""
        try:
            # Not compressed: that would keep the processor from the messages that come now.
            with BagWriter(path, compression='') as writer:
                for channel in self.channels.values():
                    writer.add_topic(channel.topic, channel.type, channel.qos)
                for when, name, data in past:
                    writer.write(self.channels[name].topic, when, data)
                writer.flush()
                self.saved.append(path)
                self.trouble = ''
                self._follow(writer, queue)
        except (OSError, AcceptanceError) as error:
            self.trouble = ' '.join(str(error).split())
            self._problems.put(str(error))

    def _follow(self, writer: BagWriter, queue: 'SimpleQueue[Kept | None]') -> None:
        """Write messages from the queue until its end, flushing at least twice a second."""
        flushed = time.monotonic()
        while True:
            with suppress(Empty):
                message = queue.get(timeout=FLUSH)
                if message is None:
                    return
                writer.write(self.channels[message[1]].topic, message[0], message[2])
            if time.monotonic() - flushed > FLUSH:
                writer.flush()
                flushed = time.monotonic()
