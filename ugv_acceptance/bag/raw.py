"""Reads a recording message by message, still serialised, for replay and copying."""

import heapq
import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import yaml
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from ugv_acceptance import BadBag, BadSample
from ugv_acceptance.bag.chunks import Buffers, log_times, walk
from ugv_acceptance.bag.foreign import foreign_messages
from ugv_acceptance.bag.gather import LEAD, SLACK
from ugv_acceptance.bag.mcap_index import Piece
from ugv_acceptance.bag.metadata import NAME
from ugv_acceptance.bag.packed import plain
from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.bag.reading import Member, normal_type

_HEADER = 31  # bytes of a Message record before its content
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
    streams = [messages_of(member, wanted) for member in bag.members]
    return heapq.merge(*streams, key=lambda message: message.log_time)


def messages_of(member: Member, wanted: set[str]) -> Iterator[Logged]:
    """Yield the messages of one file, as `messages` does."""
    channels = member.index.channels
    for message in (_mcap if member.storage == 'mcap' else _foreign)(member, wanted):
        content = message.data
        if channels[message.channel].encoding == 'cdr':
            try:
                content = plain(content)
            except BadSample:
                continue
        yield message if content is message.data else message._replace(data=content)


def _mcap(member: Member, wanted: set[str]) -> Iterator[Logged]:
    """Yield an MCAP file's messages by log time, held back until no earlier one can come."""
    index: Any = member.index
    channels = {c.id: c.topic for c in index.channels.values() if c.topic in wanted}
    buffers, held = Buffers(), list[tuple[int, int, Logged]]()
    held_in = [p for p in index.pieces if p.indexes is None or channels.keys() & p.indexes]
    pieces = sorted(held_in, key=lambda piece: piece.first)
    with member.content.open('rb') as file:
        for k, piece in enumerate(pieces):
            held += _piece(file.fileno(), piece, buffers, channels)
            held.sort(key=lambda item: item[:2])
            until = pieces[k + 1].first if k + 1 < len(pieces) else None
            ready = [item for item in held if until is None or item[0] < until]
            del held[: len(ready)]
            yield from (message for _, _, message in ready)


def _piece(
    file: int, piece: Piece, buffers: Buffers, channels: dict[int, str]
) -> list[tuple[int, int, Logged]]:
    room = np.zeros(LEAD + piece.length + SLACK, np.uint8)
    try:
        if piece.head is None:
            size, records = piece.length, room
            os.preadv(file, [room.data[LEAD : LEAD + size]], piece.start)
        else:
            os.preadv(file, [room.data[: piece.length]], piece.start)
            size, records = (
                piece.head.size,
                buffers.records(piece.head, room[: piece.length + SLACK]),
            )
    except BadBag:
        return []
    data = records.data[LEAD : LEAD + size]
    found = []
    for channel, offsets in walk(data).messages.items():
        topic = channels.get(channel)
        if topic is not None:
            times = log_times(np.asarray(data), offsets).tolist()
            for at, time in zip(offsets.tolist(), times, strict=True):
                length = int.from_bytes(data[at + 1 : at + 9], 'little')
                content = bytes(data[at + _HEADER : at + 9 + length])
                published = int.from_bytes(data[at + 23 : at + _HEADER], 'little')
                logged = Logged(time, topic, content, published, channel)
                found.append((time, piece.start + at, logged))
    return found


def _foreign(member: Member, wanted: set[str]) -> Iterator[Logged]:
    channels = {c.id: c for c in member.index.channels.values() if c.topic in wanted}
    # ROS 2's types: their headers have no sequence number, and ROS 1's is left out.
    store = get_typestore(Stores.ROS2_JAZZY) if member.storage == 'ros1' else None
    if store is not None:
        channels = {k: c for k, c in channels.items() if normal_type(c.type) in store.types}
    found = foreign_messages(member.storage, member.content, str(member.path), channels)
    for channel, now, data in found:
        content: bytes | None = data
        if store is not None:
            content = _cdr(store, data, normal_type(channels[channel].type))
        if content is not None:
            yield Logged(now, channels[channel].topic, content, now, channel)


def _cdr(store: Typestore, data: bytes, kind: str) -> bytes | None:
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
