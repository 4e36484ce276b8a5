"""Opens a recording and finds its files, topics, checksums and damage.

`Bag.batches` (reading.py) then reads its messages.
"""

import filecmp
import hashlib
import json
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import zstandard

from ugv_acceptance import BadBag
from ugv_acceptance.bag.cdr import IMU, JOINT_STATE, PAYLOAD, Kind
from ugv_acceptance.bag.chunks import MAX_CHUNK_BYTES
from ugv_acceptance.bag.foreign import ForeignIndex, open_ros1, open_sqlite
from ugv_acceptance.bag.mcap_index import SIMULATED, Channel, McapIndex
from ugv_acceptance.bag.mcap_source import open_mcap
from ugv_acceptance.bag.metadata import NAME as METADATA
from ugv_acceptance.bag.metadata import Found, Metadata, files_of
from ugv_acceptance.bag.missing_parts import missing_parts
from ugv_acceptance.bag.reading import Member, Reading, normal_type, wire_of

_BLOCK = 1 << 20
# A compressed file may unpack to this many times its size, or to as much as a chunk may: no real
# recording compresses better, and a decompression bomb of a few kB must not fill the disk.
_MAX_RATIO = 200
# Types that hold much the same as an input, but are not read.
_UNREAD = {
    'joint_states': (
        'control_msgs/msg/DynamicJointState',
        'control_msgs/msg/JointTrajectoryControllerState',
    )
}
_MAGIC = {b'\x89MCAP0\r\n': 'mcap', b'SQLite f': 'sqlite3', b'#ROSBAG ': 'ros1'}


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic's ROS 2 type ('' if not known), number of messages, and their encoding."""

    type: str
    count: int
    encoding: str = 'cdr'


@dataclass(frozen=True, slots=True)
class Topics:
    """The names of the topics to read; None: that input is not read."""

    joint_states: str | None
    imu: str | None
    payload: str | None


@dataclass(frozen=True, slots=True)
class Bag:
    """A recording: one or several files of one storage format, as found when it was opened.

    `start_ns` and `end_ns` are the first and last log time. `protected` says whether all, part or
    none of its chunks have a checksum; `salvaged` is a sentence if the recording is not whole (a
    file breaks off, a part of it is missing), else None; `findings` are sentences about what is
    odd. What only reading can find is in `Reading.facts`.
    `promised` is the number of messages by topic according to metadata.yaml. Of a `beginning`,
    `until_ns` is the last log time that is read.
    """

    paths: tuple[Path, ...]
    start_ns: int
    end_ns: int
    topics: dict[str, Topic]
    protected: str
    salvaged: str | None
    findings: tuple[str, ...]
    members: tuple[Member, ...] = field(repr=False)
    _hash: list[str] = field(default_factory=list, repr=False, compare=False)
    promised: dict[str, int] = field(default_factory=dict)
    until_ns: int | None = None

    @property
    def duration_s(self) -> float:
        """Seconds from the first to the last log time."""
        return (self.end_ns - self.start_ns) * 1e-9

    @property
    def simulated(self) -> bool:
        """Whether the recording itself says of any of its topics that it was simulated."""
        channels = (c for m in self.members for c in m.index.channels.values())
        return any(channel.origin == SIMULATED for channel in channels)

    def sha256(self) -> str:
        """Return the SHA-256 of the file; of several, that of their digests in order of `paths`.

        metadata.yaml is not included, since it adds nothing to the files. Computed once.
        """
        if not self._hash:
            digests = [_sha256(path) for path in self.paths]
            one = digests[0] if len(digests) == 1 else hashlib.sha256(b''.join(digests)).digest()
            self._hash.append(one.hex())
        return self._hash[0]

    def identity(self) -> str:
        """Return 64 hexadecimal digits that differ where what is read, or is missing, differs.

        The SHA-256 of a whole recording. Where metadata.yaml counts messages that are not there, or
        a part is known to be missing, another number: so much may change while the files do not.
        """
        held = {name: topic.count for name, topic in self.topics.items()}
        short = sorted((k, n) for k, n in self.promised.items() if n > held.get(k, 0))
        if self.salvaged is None and not short:
            return self.sha256()
        text = json.dumps([self.sha256(), self.salvaged is not None, short])
        return hashlib.sha256(text.encode()).hexdigest()

    def beginning(self, until_ns: int) -> 'Bag':
        """Return the recording as if it ended at a log time (ns); nothing after it is read.

        Its numbers of messages and findings are those of the whole. Its SHA-256 is '', since that
        would read all of it.
        """
        cut = None if until_ns >= self.end_ns else until_ns
        return replace(self, end_ns=min(until_ns, self.end_ns), until_ns=cut, _hash=[''])

    def batches(self, topics: Topics, *, workers: int = 1) -> Reading:
        """Read the messages of `topics` as an iterator of batches in order of log time.

        Memory is bounded by the size of a chunk. With two `workers` a thread unpacks ahead of the
        caller's, which decodes: that takes more CPU, and saves time only where the disk is slow.
        """
        chosen = ((JOINT_STATE, topics.joint_states), (IMU, topics.imu), (PAYLOAD, topics.payload))
        wanted = {name: kind for kind, name in chosen if name is not None}
        counts = {name: topic.count for name, topic in self.topics.items()}
        return Reading(self.members, wanted, counts, workers, self.until_ns)


def open_bag(
    paths: Path | str | Sequence[Path | str], *, max_chunk_bytes: int = MAX_CHUNK_BYTES
) -> Bag:
    """Open a recording: rosbag2 folders, MCAP (also .zstd), SQLite or ROS 1 files.

    Several paths are the parts of one recording. A chunk that claims to unpack to more than
    `max_chunk_bytes` is not read. Raises BadBag if nothing can be read.
    """
    given = [paths] if isinstance(paths, (str, Path)) else paths
    if not given:
        raise BadBag('expected at least one bag, got none')
    members: list[Member] = []
    findings: list[str] = []
    promised: Counter[str] = Counter()
    missing: list[str] = []
    single: list[Path] = []
    for path in given:
        try:
            found = files_of(Path(path))
            part = [_member(file, max_chunk_bytes) for file in found.files]
            single += [file for file in found.files if file == Path(path)]
        except OSError as error:
            raise BadBag(f'{path}: cannot be read ({error})') from error
        topics, odd = _topics(part)
        gone = _not_there(Path(path), found, topics)
        missing += gone
        findings += _told(found, topics, gone)
        promised.update(found.metadata.counts or {})
        members += part
    _refuse_unfit(members)
    missing += missing_parts(single)
    if len(given) > 1:
        topics, odd = _topics(members)
    ranges = [span for member in members if (span := member.span())]
    findings += [f'{m.name}: {text}' for m in members for text in m.findings()] + odd
    salvaged = [f'{m.name}: {text}' for m in members if (text := m.index.salvaged)] + missing
    return Bag(
        tuple(member.path for member in members),
        min((first for first, _ in ranges), default=0),
        max((last for _, last in ranges), default=0),
        topics,
        _protected(members),
        '; '.join(salvaged) or None,
        tuple(findings),
        tuple(members),
        promised=dict(promised),
    )


def _told(found: Found, held: dict[str, Topic], gone: Sequence[str]) -> list[str]:
    """Return the findings about a part's files, but for what is `gone`."""
    rest = [text for text in found.missing if text not in gone]
    return [*found.findings, *_compared(found.metadata, held), *rest]


def _not_there(path: Path, found: Found, held: dict[str, Topic]) -> list[str]:
    """Return sentences about parts of the recording at `path` that are not there.

    A file that metadata.yaml lists may be, where every message that it counts is in the others.
    """
    if not found.listed:
        return list(missing_parts(found.files, path)) if path.is_dir() else []
    counts, total = found.metadata.counts, found.metadata.message_count or 0
    here = sum(topic.count for topic in held.values())
    if not counts and total > here:
        return [*found.missing, f'{METADATA} says {total} messages, found {here}']
    short = any(n > (held[name].count if name in held else 0) for name, n in (counts or {}).items())
    return found.missing if short or not counts else []


def _refuse_unfit(members: Sequence[Member]) -> None:
    """Raise BadBag if files have other formats, or two hold the same: it would count twice."""
    kinds = sorted({member.storage for member in members})
    if len(kinds) > 1:
        raise BadBag(f'expected files of one format, got {" and ".join(kinds)}')
    known: dict[int, list[Member]] = {}
    for member in filter(Member.span, members):  # those with messages
        alike = known.setdefault(member.content.stat().st_size, [])
        for other in alike:
            if filecmp.cmp(other.content, member.content, shallow=False):
                names = ' and '.join(dict.fromkeys((str(other.path), str(member.path))))
                raise BadBag(f'expected each file once, got the same twice: {names}')
        alike.append(member)


def _member(path: Path, max_chunk_bytes: int) -> Member:
    local: tempfile._TemporaryFileWrapper[bytes] | None = None
    content = path
    with path.open('rb') as file:
        magic = file.read(8)
    if magic[:4] == zstandard.FRAME_HEADER:
        local = _unzstd(path)
        content = Path(local.name)
        with content.open('rb') as file:
            magic = file.read(8)
    storage = _MAGIC.get(magic)
    if storage is None:
        size = path.stat().st_size
        raise BadBag(f'{path}: expected MCAP, SQLite or ROS 1 bag, got {size} bytes, {magic!r}...')
    index: McapIndex | ForeignIndex
    if storage == 'mcap':
        with content.open('rb') as file:
            index = open_mcap(file, str(path), max_chunk_bytes)
    else:
        index = {'sqlite3': open_sqlite, 'ros1': open_ros1}[storage](content, str(path))
    return Member(path, content, storage, index, local)


def _unzstd(path: Path) -> 'tempfile._TemporaryFileWrapper[bytes]':
    """Decompress a file into a temporary one, which exists as long as the returned object."""
    local = tempfile.NamedTemporaryFile(prefix='bag-')  # noqa: SIM115 (the member keeps it)
    most = max(MAX_CHUNK_BYTES, _MAX_RATIO * path.stat().st_size)
    try:
        with path.open('rb') as file, zstandard.ZstdDecompressor().stream_reader(file) as stream:
            while block := stream.read(_BLOCK):
                local.write(block)
                if local.tell() > most:
                    raise BadBag(f'{path}: expected at most {most >> 20} MiB unpacked, got more')
    except zstandard.ZstdError as error:
        raise BadBag(f'{path}: its zstd data is broken ({error})') from error
    local.flush()
    return local


def _sha256(path: Path) -> bytes:
    digest, block = hashlib.sha256(), memoryview(bytearray(_BLOCK))
    with path.open('rb', buffering=0) as file:
        while count := file.readinto(block):
            digest.update(block[:count])
    return digest.digest()


def _compared(metadata: Metadata, held: dict[str, Topic]) -> list[str]:
    """Return findings where metadata.yaml and the files disagree on numbers of messages."""
    findings = []
    said = metadata.counts or {}
    for name in sorted(said):
        count = held[name].count if name in held else 0
        if count != said[name]:
            findings.append(f'metadata.yaml says {said[name]} messages of {name}, found {count}')
    total = sum(topic.count for topic in held.values())
    if not findings and metadata.message_count not in (None, total):
        findings.append(f'metadata.yaml says {metadata.message_count} messages, found {total}')
    return findings


def _topics(members: Iterable[Member]) -> tuple[dict[str, Topic], list[str]]:
    """Return the topics of all files, and a finding for each topic with several types."""
    held: dict[str, dict[tuple[str, str], int]] = {}
    for member in members:
        for channel in member.index.channels.values():
            alike = normal_type(channel.type), channel.encoding
            same = held.setdefault(channel.topic, {})
            same[alike] = same.get(alike, 0) + member.index.counts.get(channel.id, 0)
    topics, findings = {}, []
    for name in sorted(held):
        kinds = list(held[name])
        if len(kinds) > 1:
            kinds.sort(key=lambda k: (not wire_of(Channel(0, '', *k)), -held[name][k]))
            listed = ', '.join(f'{t} ({e}, {held[name][t, e]} messages)' for t, e in kinds)
            findings.append(f'{name} has channels of several types: {listed}')
        topics[name] = Topic(kinds[0][0], held[name][kinds[0]], kinds[0][1])
    return topics, findings


def _protected(members: Iterable[Member]) -> str:
    guarded = [
        m.index.protected or bool(piece.head and piece.head.crc)
        for m in members
        if isinstance(m.index, McapIndex)
        for piece in m.index.pieces
    ]
    if not any(guarded):
        return 'none'
    return 'all' if all(guarded) else 'part'


def choose_topics(
    bag: Bag,
    joint_states: str | None = 'joint_states',
    imu: str | None = 'imu/data',
    payload: str = 'payload',
    *,
    imu_required: bool = True,
) -> Topics:
    """Choose the topics to read: by configured name, else by type if exactly one topic has it.

    A leading slash in a name does not matter; an input whose name is None is not read. Raises
    BadBag, which lists the topics, if the choice is ambiguous. Without `imu_required` the IMU is
    None for a bag without an IMU topic.
    """
    joints = None if joint_states is None else _choice(bag, JOINT_STATE, joint_states)
    if joints is None and joint_states is not None:
        raise _no_topic(bag, JOINT_STATE, joint_states)
    measured = None if imu is None else _choice(bag, IMU, imu)
    if measured is None and imu is not None and (imu_required or _typed(bag, IMU)):
        raise _no_topic(bag, IMU, imu)
    return Topics(joints, measured, _choice(bag, PAYLOAD, payload))


def _typed(bag: Bag, kind: Kind[Any]) -> list[str]:
    """Return the topics of a type, in whatever encoding."""
    return [name for name, topic in bag.topics.items() if topic.type == kind.type]


def _candidates(bag: Bag, kind: Kind[Any]) -> list[str]:
    """Return the topics of a type that can be read."""
    of = bag.topics
    return [n for n in _typed(bag, kind) if wire_of(Channel(0, n, kind.type, of[n].encoding))]


def _choice(bag: Bag, kind: Kind[Any], configured: str) -> str | None:
    found = _candidates(bag, kind)
    named = [name for name in found if name.lstrip('/') == configured.lstrip('/')]
    if named:
        return named[0]
    held = [name for name in found if bag.topics[name].count] or found
    return held[0] if len(held) == 1 else None


def _no_topic(bag: Bag, kind: Kind[Any], configured: str) -> BadBag:
    listed = '; '.join(
        f'{name} {topic.type or "(no type)"}{"" if topic.encoding == "cdr" else " as "}'
        f'{"" if topic.encoding == "cdr" else repr(topic.encoding)} {topic.count}'
        for name, topic in bag.topics.items()
    )
    return BadBag(
        f'{bag.paths[0]}: expected topic {configured!r} or exactly one of type {kind.type}; '
        f'{_way_out(bag, kind)}; the bag holds: {listed or "no topics"}'
    )


def _way_out(bag: Bag, kind: Kind[Any]) -> str:
    """Return what is in the way of reading an input, and what to do about it."""
    key = 'imu' if kind is IMU else 'joint_states'
    several = _candidates(bag, kind)
    if several:
        return (
            f'got {" and ".join(several)}: set topics.{key}.name in the configuration to one of '
            'them' + (', and the other topics to those of the same robot' if _robots(bag) else '')
        )
    encodings = sorted({bag.topics[name].encoding for name in _typed(bag, kind)})
    if encodings:
        return f'got it encoded as {" and ".join(encodings)}, which is not read: record it as cdr'
    names = [n for n, t in bag.topics.items() if t.type in _UNREAD.get(key, ())]
    if names:
        types = ' and '.join(sorted({bag.topics[name].type for name in names}))
        return f'got {types} on {" and ".join(names)}, which is not read: record {kind.type} too'
    return f'got none: record a topic of type {kind.type}'


def _robots(bag: Bag) -> bool:
    """Return whether several topics of both inputs are held, as when two robots were recorded."""
    return all(len(_candidates(bag, kind)) > 1 for kind in (JOINT_STATE, IMU))
