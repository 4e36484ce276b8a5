"""Reads a recording message by message, still serialised, for replay and copying."""

import heapq
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, zip_longest
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import yaml
from numpy.typing import NDArray
from zstandard import FRAME_HEADER

from ugv_acceptance import BadBag, BadSample
from ugv_acceptance.bag.blocks import Block, Message, block_of, joined, record_heads
from ugv_acceptance.bag.chunks import MESSAGE, Buffers, indexed, walk
from ugv_acceptance.bag.foreign import foreign_messages
from ugv_acceptance.bag.gather import HEAD, LEAD, SLACK, Bytes, Offsets
from ugv_acceptance.bag.mcap_index import Channel, Piece
from ugv_acceptance.bag.metadata import NAME
from ugv_acceptance.bag.packed import plain
from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.bag.reading import Member, normal_type

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

# Most messages, and about as many bytes, of an SQLite or ROS 1 file that are held at a time.
_MESSAGES, _BYTES = 4096, 1 << 20
# What YAML that is none of QoS raises.
_ODD = (yaml.YAMLError, LookupError, TypeError, ValueError, AttributeError, RecursionError)


class Logged(NamedTuple):
    """A serialised message: log time (ns), topic, CDR content, publish time (ns), channel id."""

    log_time: int
    topic: str
    data: bytes
    published: int
    channel: int


@dataclass(frozen=True, slots=True)
class Offered:
    """The QoS a topic's publisher offered: reliable/best_effort, volatile/transient_local."""

    reliability: str = 'reliable'
    durability: str = 'volatile'


def messages(bag: Bag, topics: Iterable[str]) -> Iterator[Logged]:
    """Yield the messages of `topics` in order of log time; ROS 1 messages are converted to CDR.

    Unreadable messages are left out, as in `Bag.batches`, and compressed ones decompressed. Raises
    BadBag where an SQLite or ROS 1 file breaks off.
    """
    wanted = set(topics)
    streams = [
        chain.from_iterable(messages_of(member, wanted) for member in lane)
        for lane in lanes(bag.members)
    ]
    return heapq.merge(*streams, key=lambda message: message.log_time)


def lanes(members: Sequence[Member]) -> list[list[Member]]:
    """Group files so that in a group each begins when the one before it ends, or later.

    Of a recording that was split this is one group, read with one file open at a time. Groups are
    in the order of the first of their files; files without messages are left out.
    """
    spans = [(span, k) for k, member in enumerate(members) if (span := member.span())]
    found: list[list[tuple[tuple[int, int], int]]] = []
    for span, k in sorted(spans):
        free = (lane for lane in found if lane[-1][0][1] <= span[0])
        lane = next(free, None)
        if lane is None:
            found.append([(span, k)])
        else:
            lane.append((span, k))
    numbers = sorted(([k for _, k in lane] for lane in found), key=min)
    return [[members[k] for k in lane] for lane in numbers]


def messages_of(member: Member, wanted: set[str]) -> Iterator[Logged]:
    """Yield the messages of one file, as `messages` does."""
    topics = {c.id: c.topic for c in member.index.channels.values()}
    for block in blocks_of(member, wanted):
        for log_time, published, channel, data in block.messages():
            yield Logged(log_time, topics[channel], data, published, channel)


def blocks_of(member: Member, wanted: set[str]) -> Iterator[Block]:
    """Yield the messages of one file as `messages` does, many at a time, by channel id."""
    channels = [c for c in member.index.channels.values() if c.topic in wanted]
    packed = np.array([c.id for c in channels if c.encoding == 'cdr'], np.int64)
    for block in (_mcap if member.storage == 'mcap' else _foreign)(member, channels):
        yield _plain(block, packed)


def _plain(block: Block, packed: NDArray[np.int64]) -> Block:
    """Return messages decompressed that rosbag2 compressed one by one, on channels `packed`."""
    long = np.flatnonzero(block.length >= len(FRAME_HEADER))
    if not len(long):
        return block
    every = np.ndarray(block.data.size - 3, '<u4', block.data, strides=(1,))
    looks = every[block.start[long]] == int.from_bytes(FRAME_HEADER, 'little')
    if not looks.any() or not np.isin(block.channel[long[looks]], packed).any():
        return block
    found = list[Message]()
    for message, undo in zip(block.messages(), np.isin(block.channel, packed), strict=True):
        with suppress(BadSample):
            found.append((*message[:3], plain(message[3]) if undo else message[3]))
    return block_of(found)


def _mcap(member: Member, wanted: Sequence[Channel]) -> Iterator[Block]:
    """Yield an MCAP file's messages by log time, held back until no earlier one can come."""
    index: Any = member.index
    channels = {c.id for c in wanted}
    buffers, held, places = Buffers(), block_of(()), np.zeros(0, np.int64)
    held_in = [p for p in index.pieces if p.indexes is None or channels & p.indexes.keys()]
    pieces = sorted(held_in, key=lambda piece: piece.first)
    with member.content.open('rb') as file:
        for piece, after in zip_longest(pieces, pieces[1:]):
            found = _piece(file.fileno(), piece, buffers, channels)
            places = np.concatenate((places, piece.start + found.start))
            held = joined((held, found))
            order = np.lexsort((places, held.log_time))
            held, places = held.take(order), places[order]
            ready = len(held) if after is None else held.log_time.searchsorted(after.first)
            yield held.take(slice(ready))
            held, places = held.take(slice(ready, None)), places[ready:]


def _piece(file: int, piece: Piece, buffers: Buffers, channels: set[int]) -> Block:
    total = piece.length + piece.index_length
    room = np.zeros(LEAD + total + SLACK, np.uint8)
    try:
        if piece.head is None:
            size, records = piece.length, room
            os.preadv(file, [room.data[LEAD : LEAD + size]], piece.start)
        else:
            os.preadv(file, [room.data[:total]], piece.start)
            size, records = piece.head.size, buffers.records(piece.head, room)
    except BadBag:
        return block_of(())
    data = records[LEAD : LEAD + size].copy()  # the next piece overwrites the buffer
    found = _indexed(data, room, piece) or walk(data.data).messages
    held = {c: at for c, at in found.items() if c in channels}
    if not held:
        return block_of(())
    at = np.concatenate(list(held.values()))
    head = record_heads(data)[at]
    log_time, published = (head[name].astype(np.int64) for name in ('log_time', 'published'))
    channel = np.repeat(list(held), [len(offsets) for offsets in held.values()])
    length = head['length'].astype(np.int64) - (HEAD - 9)
    return Block(log_time, published, channel, at + HEAD, length, data)


def _indexed(data: Bytes, room: Bytes, piece: Piece) -> dict[int, Offsets] | None:
    """Return the messages' places in a chunk by channel, as its index tells them.

    None unless the records at these places fill the chunk without a gap, and are of these channels:
    then a walk over the records would find the same.
    """
    if not piece.indexes or len(data) < HEAD:
        return None
    found = dict[int, Offsets]()
    for channel, place in piece.indexes.items():
        offsets = indexed(room.data[place - piece.start :], channel)
        if offsets is None:
            return None
        found[channel] = offsets
    at = np.concatenate(list(found.values()))
    if not len(at) or at.max() > len(data) - HEAD:
        return None
    head = record_heads(data)[at]
    of = np.repeat(list(found), [len(offsets) for offsets in found.values()])
    ends = at + 9 + head['length'].astype(np.int64)
    right = (head['opcode'] == MESSAGE) & (head['length'] >= HEAD - 9) & (head['channel'] == of)
    order = np.argsort(at)
    whole = np.array_equal(np.append(0, ends[order]), np.append(at[order], len(data)))
    return found if whole and right.all() else None


def _foreign(member: Member, wanted: Sequence[Channel]) -> Iterator[Block]:
    channels = {c.id: c for c in wanted}
    # ROS 2's types: their headers have no sequence number, and ROS 1's is left out.
    store = _ros2_types() if member.storage == 'ros1' else None
    if store is not None:
        channels = {k: c for k, c in channels.items() if normal_type(c.type) in store.types}
    found = foreign_messages(member.storage, member.content, str(member.path), channels)
    held, size, broken = list[Message](), 0, None
    while True:
        try:
            channel, now, data = next(found)
        except (StopIteration, BadBag) as error:
            broken = error
            break
        content: bytes | None = data
        if store is not None:
            content = _cdr(store, data, normal_type(channels[channel].type))
        if content is not None:
            held.append((now, now, channel, content))
            size += len(content)
        if len(held) >= _MESSAGES or size >= _BYTES:
            yield block_of(held)
            held, size = [], 0
    yield block_of(held)
    if isinstance(broken, BadBag):
        raise broken


def _ros2_types() -> 'Typestore':
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - for ROS 1 alone

    return get_typestore(Stores.ROS2_JAZZY)


def _cdr(store: 'Typestore', data: bytes, kind: str) -> bytes | None:
    """Convert a ROS 1 message to CDR; None if it does not fit its type."""
    try:
        return bytes(store.ros1_to_cdr(data, kind))
    except Exception:  # noqa: BLE001 (rosbags raises anything for garbled bytes)
        return None


def offered(bag: Bag) -> dict[str, Offered]:
    """Return the recorded QoS by topic, that of the first of its publishers if there were several.

    Topics of which neither the file nor metadata.yaml tells it are missing.
    """
    return {topic: profiles[0] for topic, profiles in offered_by_all(bag).items()}


def offered_by_all(bag: Bag) -> dict[str, tuple[Offered, ...]]:
    """Return the recorded QoS by topic: one of each publisher; metadata.yaml before the file."""
    found: dict[str, tuple[Offered, ...]] = {}
    for channel in (c for member in bag.members for c in member.index.channels.values()):
        with suppress(*_ODD):
            if profiles := _all_offered(channel.qos):
                found[channel.topic] = profiles
    for folder in {path.parent for path in bag.paths}:
        path = folder / NAME
        if path.is_file():
            found |= _profiles(path.read_text(encoding='utf-8', errors='replace'))
    return found


def _profiles(text: str) -> dict[str, tuple[Offered, ...]]:
    found = {}
    # The reader has reported what is wrong with it.
    with suppress(*_ODD):
        info = yaml.safe_load(text)['rosbag2_bagfile_information']
        for topic in info.get('topics_with_message_count') or ():
            metadata = topic['topic_metadata']
            if profiles := _all_offered(metadata.get('offered_qos_profiles')):
                found[str(metadata['name'])] = profiles
    return found


def _all_offered(profiles: Any) -> tuple[Offered, ...]:  # noqa: ANN401 - YAML's
    held = yaml.safe_load(profiles) if isinstance(profiles, str) else profiles
    return tuple(_offered(profile) for profile in held or ())


def _offered(profile: dict[str, Any]) -> Offered:
    """Return the QoS of a profile; versions before 9 write the numbers of rmw, later ones names."""
    best_effort = str(profile.get('reliability')) in {'2', 'best_effort'}
    latched = str(profile.get('durability')) in {'1', 'transient_local'}
    return Offered(
        'best_effort' if best_effort else 'reliable', 'transient_local' if latched else 'volatile'
    )
