"""Reads a recording once from start to end, chunk after chunk in order of log time.

One thread unpacks ahead of the one that decodes.
"""

from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import Any

import numpy as np

from ugv_acceptance.bag.cdr import Kind
from ugv_acceptance.bag.chunks import Buffers
from ugv_acceptance.bag.columns import ColumnDecoder, Columns, batch, select
from ugv_acceptance.bag.foreign import ForeignIndex, foreign_blocks
from ugv_acceptance.bag.layout import Wire
from ugv_acceptance.bag.mcap_index import Channel, McapIndex, Piece
from ugv_acceptance.bag.mcap_source import McapSource, Piecework, Unpacked, Wanted
from ugv_acceptance.evaluation.samples import Batch


class Sequencer:
    """Holds messages back until no earlier one can come.

    Chunks overlap a little in time, since several topics are written as they arrive. Only the
    overlap is held, so memory does not grow with the recording.
    """

    def __init__(self) -> None:
        self._held: list[Columns] = []
        self._from: int | None = None
        self.late = 0

    def push(self, columns: Iterable[Columns], until: int | None) -> Batch | None:
        """Add columns; return a batch of all messages logged before `until` (ns), None if none.

        `until` promises that no earlier message follows; None, that none follows at all. Messages
        that break an earlier promise are dropped and counted in `late`.
        """
        ready, held = [], []
        for part in [*self._held, *self._on_time(columns)]:
            before, after = _split(part, until)
            ready += before
            held += after
        self._held = held
        self._from = until
        return batch(ready) if ready else None

    def _on_time(self, columns: Iterable[Columns]) -> list[Columns]:
        if self._from is None:
            return list(columns)
        kept = []
        for part in columns:
            late, rest = _split(part, self._from)
            self.late += sum(len(c.log_time) for c in late)
            kept += rest
        return kept


def _split(columns: Columns, until: int | None) -> tuple[list[Columns], list[Columns]]:
    """Split columns into messages logged before `until` (ns) and the others, order kept."""
    times = columns.log_time
    if until is None or not times.size or times.max() < until:
        return [columns], []
    if times.min() >= until:
        return [], [columns]
    before = times < until
    number = int(np.count_nonzero(before))
    if before[:number].all():
        return [select(columns, slice(number))], [select(columns, slice(number, None))]
    return [select(columns, before)], [select(columns, ~before)]


_WIRES: dict[str, Wire] = {'cdr': 'cdr', 'ros1': 'ros1'}
_MAX_FINDINGS = 200
_AHEAD = 3  # pieces in memory: one is decoded, one ready, one being unpacked


def normal_type(name: str) -> str:
    """Return the ROS 2 name of a type: sensor_msgs/Imu becomes sensor_msgs/msg/Imu."""
    parts = name.split('/')
    return f'{parts[0]}/msg/{parts[1]}' if len(parts) == 2 else name


def wire_of(channel: Channel) -> Wire | None:
    """Return the encoding of a channel's messages: cdr or ros1, None if it is another."""
    return _WIRES.get(channel.encoding)


@dataclass(frozen=True, slots=True)
class Member:
    """One file of a recording: its path, storage format and index.

    `content` is the path of the uncompressed content, a temporary file (`keep` holds it) if `path`
    is compressed.
    """

    path: Path
    content: Path
    storage: str
    index: McapIndex | ForeignIndex
    keep: Any = None

    @property
    def name(self) -> str:
        """The file's name."""
        return self.path.name

    def span(self) -> tuple[int, int] | None:
        """Return the first and last log time in ns, None without messages."""
        if isinstance(self.index, ForeignIndex):
            return (self.index.first, self.index.last) if any(self.index.counts.values()) else None
        # A chunk that holds only schemas gives its time span as 0 to 0.
        held = [p for p in self.index.pieces if p.last] or self.index.pieces
        return (min(p.first for p in held), max(p.last for p in held)) if held else None

    def findings(self) -> list[str]:
        """Return the sentences about oddities that were found when the file was opened."""
        return self.index.findings if isinstance(self.index, McapIndex) else []

    def wanted(self, topics: dict[str, Kind[Any]]) -> Wanted:
        """Return decoders for the file's channels that hold these topics in a readable form."""
        found = {}
        for channel in self.index.channels.values():
            kind, wire = topics.get(channel.topic), wire_of(channel)
            if kind and wire and normal_type(channel.type) == kind.type:
                decoder = ColumnDecoder(kind, channel.id & 0xFFFF, wire)
                found[channel.id] = (channel.topic, decoder)
        return found


@dataclass(frozen=True, slots=True)
class Facts:
    """Counts and findings from reading a recording.

    `counts` are messages read by topic; `malformed` those of them that could not be decoded, with
    the reason of the first; `late` counts messages logged before the end of an earlier batch, which
    are dropped; `findings` are sentences; `complete` says whether reading reached the end.
    """

    counts: dict[str, int] = field(default_factory=dict)
    malformed: dict[str, tuple[int, str]] = field(default_factory=dict)
    late: int = 0
    findings: tuple[str, ...] = ()
    complete: bool = False


class Reading(Iterator[Batch]):
    """An iterator over the batches of a recording by log time; `facts` is what was found so far.

    Within a batch a topic's messages are grouped by chunk, by names, and by which arrays they hold:
    each group is in file order, groups are in order of their first message. Nothing is read beyond
    the log time `until` (ns).
    """

    def __init__(
        self,
        members: Sequence[Member],
        topics: dict[str, Kind[Any]],
        expected: dict[str, int],
        workers: int = 1,
        until: int | None = None,
    ) -> None:
        self._until = until
        self._members = members
        self._topics = topics
        self._expected = expected
        self._workers = workers
        self._total = Piecework(counts=dict.fromkeys(topics, 0))
        self._sequencer = Sequencer()
        self._complete = False
        self._stream = self._batches()

    def __next__(self) -> Batch:
        return next(self._stream)

    def close(self) -> None:
        """Stop reading early and release threads and files."""
        self._stream.close()

    @property
    def facts(self) -> Facts:
        """Counts and findings so far; complete once all batches have been taken."""
        total = self._total
        findings = list(dict.fromkeys(total.findings))
        if len(findings) > _MAX_FINDINGS:
            more = len(findings) - _MAX_FINDINGS
            findings = [*findings[:_MAX_FINDINGS], f'and {more} more findings of this kind']
        return Facts(
            dict(total.counts),
            dict(total.malformed),
            self._sequencer.late,
            tuple(findings),
            self._complete,
        )

    def _batches(self) -> Generator[Batch, None, None]:
        mcap = all(isinstance(member.index, McapIndex) for member in self._members)
        with closing(self._mcap() if mcap else self._foreign()) as parts:
            for work, until in parts:
                self._add(work)
                columns, end = self._up_to_end(work.columns, until)
                if batch := self._sequencer.push(columns, end):
                    yield batch
                if end is None:
                    break
        self._conclude()

    def _up_to_end(
        self, columns: list[Columns], until: int | None
    ) -> tuple[list[Columns], int | None]:
        """Return columns and the log time (ns) of what comes next, without what is not wanted."""
        if self._until is None:
            return columns, until
        kept = [part for whole in columns for part in _split(whole, self._until + 1)[0]]
        return kept, None if until is None or until > self._until else until

    def _add(self, work: Piecework) -> None:
        for topic, count in work.counts.items():
            self._total.counts[topic] += count
        for topic, (count, reason) in work.malformed.items():
            before, first = self._total.malformed.get(topic, (0, reason))
            self._total.malformed[topic] = (before + count, first)
        self._total.findings += work.findings

    def _conclude(self) -> None:
        for topic, count in self._total.counts.items():
            if self._until is None and count != self._expected.get(topic, 0):
                self._total.findings.append(
                    f'{topic}: the index counts {self._expected.get(topic, 0)} messages, '
                    f'{count} were read'
                )
        for topic, (count, reason) in self._total.malformed.items():
            self._total.findings.append(
                f'{topic}: {count} of {self._total.counts[topic]} messages are malformed; '
                f'the first: {reason}'
            )
        if self._sequencer.late:
            self._total.findings.append(
                f'{self._sequencer.late} messages dropped: logged before the start of their chunk'
            )
        self._complete = True

    def _foreign(self) -> Generator[tuple[Piecework, int | None], None, None]:
        spans = [member.span() or (0, 0) for member in self._members]
        order = sorted(range(len(spans)), key=lambda i: spans[i])
        for place, i in enumerate(order):
            member = self._members[i]
            later = [spans[j][0] for j in order[place + 1 :]]
            blocks = foreign_blocks(
                member.storage, member.content, member.name, member.wanted(self._topics)
            )
            for work, last in blocks:
                yield work, min([last, *later])
        yield Piecework(), None

    def _mcap(self) -> Generator[tuple[Piecework, int | None], None, None]:
        """Yield each piece's decoded work by first log time, with that of the next piece (ns)."""
        with ExitStack() as stack:
            sources = []
            for member in self._members:
                if isinstance(member.index, McapIndex):
                    wanted = member.wanted(self._topics)
                    source = McapSource(member.content, member.name, member.index, wanted)
                    stack.callback(source.close)
                    sources.append(source)
            jobs = [(piece, source) for source in sources for piece in source.pieces]
            jobs.sort(key=lambda job: job[0].first)
            firsts: list[int | None] = [piece.first for piece, _ in jobs[1:]]
            results = _inline(jobs) if self._workers == 1 else _ahead(jobs)
            # Ended before the files are closed: its thread would open them again.
            stack.enter_context(closing(results))
            yield from zip(results, [*firsts, None], strict=False)
            if not jobs:
                yield Piecework(), None


_Job = tuple[Piece, McapSource]


def _inline(jobs: list[_Job]) -> Generator[Piecework, None, None]:
    buffers = Buffers()
    for piece, source in jobs:
        yield source.decode(source.unpack(piece, buffers))


def _ahead(jobs: list[_Job]) -> Generator[Piecework, None, None]:
    """Unpack pieces in a thread while this one decodes the one before, in the order of the jobs.

    A thread that decoded as well would contend for the interpreter at every step of it.
    """
    spare: SimpleQueue[Buffers | None] = SimpleQueue()
    ready: SimpleQueue[tuple[Unpacked, Buffers] | BaseException] = SimpleQueue()
    for _ in range(_AHEAD):
        spare.put(Buffers())

    def unpack() -> None:
        try:
            for piece, source in jobs:
                buffers = spare.get()
                if buffers is None:
                    return
                ready.put((source.unpack(piece, buffers), buffers))
        except BaseException as error:  # noqa: BLE001 (raised again where it is waited for)
            ready.put(error)

    thread = Thread(target=unpack, name='bag', daemon=True)
    thread.start()
    try:
        for _, source in jobs:
            found = ready.get()
            if isinstance(found, BaseException):
                raise found
            unpacked, buffers = found
            yield source.decode(unpacked)
            spare.put(buffers)
    finally:
        spare.put(None)
        thread.join()
