"""Finds what a recording tells of its robot: the texts on /robot_description, names of joints."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

from ugv_acceptance import BadBag, BadSample
from ugv_acceptance.bag.description import TYPE, string_of
from ugv_acceptance.bag.encode import string_message
from ugv_acceptance.bag.mcap_index import McapIndex
from ugv_acceptance.bag.raw import Logged, messages_of
from ugv_acceptance.bag.reader import Bag, Topics
from ugv_acceptance.bag.reading import Member
from ugv_acceptance.bag.recording import Recording

# Different texts that are kept; a robot has one.
MOST_TEXTS = 8
# A larger message (bytes) is not a robot's description.
LARGEST = 20_000_000


@dataclass(frozen=True, slots=True)
class Described:
    """The different texts of a recording's descriptions, in the order in which they came.

    `topics` are where they were found, `unreadable` why messages could not be read.
    """

    topics: tuple[str, ...] = ()
    texts: tuple[bytes, ...] = ()
    unreadable: tuple[str, ...] = ()

    @property
    def where(self) -> str:
        """The topics as text."""
        return ' and '.join(self.topics)


def description_message(urdf: bytes) -> bytes:
    """Return a URDF as a serialised std_msgs/String, as robots tell it on /robot_description."""
    return string_message(urdf.decode('utf-8', 'replace'))


def description_of(data: bytes) -> str:
    """Return the text of a robot's description; BadSample if the message holds none."""
    if len(data) > LARGEST:
        raise BadSample(f'expected a URDF below {LARGEST // 10**6} MB, got {len(data)} bytes')
    return string_of(data)


def descriptions_in(recording: Recording, name: str) -> Described:
    """Return the descriptions that a recording holds on the topic `name`.

    Without that topic: on the one of the same last name in the namespace of the joint states, else
    on every topic of that last name.
    """
    bag = recording.bag
    topics = _topics(recording, name)
    seen: set[bytes] = set()
    texts: list[bytes] = []
    wrong: list[str] = []
    for message in messages_of_few(bag, topics):
        if message.data in seen:
            continue
        if len(seen) == MOST_TEXTS:
            wrong.append(f'more than {MOST_TEXTS} different texts, of which no more were read')
            break
        seen.add(message.data)
        try:
            texts.append(description_of(message.data).encode())
        except BadSample as error:
            wrong.append(str(error))
    return Described(topics, tuple(dict.fromkeys(texts)), tuple(wrong))


def _topics(recording: Recording, name: str) -> tuple[str, ...]:
    last = name.rpartition('/')[2]
    held = [
        topic
        for topic, of in recording.topics.items()
        if of.type == TYPE and of.count and topic.rpartition('/')[2] == last
    ]
    exact = [topic for topic in held if topic.lstrip('/') == name.lstrip('/')]
    if exact or len(held) < 2:
        return tuple(exact or held)
    joints = None
    with suppress(BadBag):  # said where the joint states are read
        joints = recording.chosen(imu_required=False).joint_states
    space = (joints or '').rpartition('/')[0]
    near = [topic for topic in held if joints and topic.rpartition('/')[0] == space]
    return tuple(near or held)


def messages_of_few(bag: Bag, topics: Iterable[str]) -> Iterator[Logged]:
    """Yield the messages of a few topics, by the files' indexes where these can be believed."""
    wanted = set(topics)
    if not wanted:
        return
    for member in sorted(bag.members, key=lambda member: member.span() or (0, 0)):
        held, expected = _only(member, wanted)
        count = 0
        for count, message in enumerate(messages_of(held, wanted), 1):  # noqa: B007 - used below
            yield message
        if held is not member and count < expected:  # its index has left some out
            yield from messages_of(member, wanted)


def _only(member: Member, wanted: set[str]) -> tuple[Member, int]:
    """Return a file with only the chunks that hold `wanted` topics, and how many messages those."""
    index = member.index
    if not isinstance(index, McapIndex):
        return member, 0
    channels = {c.id for c in index.channels.values() if c.topic in wanted}
    pieces = [p for p in index.pieces if p.indexes is None or channels & p.indexes.keys()]
    expected = sum(index.counts.get(channel, 0) for channel in channels)
    return replace(member, index=replace(index, pieces=pieces)), expected


def joint_names_in(recording: Recording, wanted: Iterable[str]) -> set[str]:
    """Return the names on the topic of joint states; reading ends when all `wanted` were told.

    Raises BadBag if the choice of topics is ambiguous.
    """
    topics = recording.chosen(imu_required=False)
    missing, found = set(wanted), set[str]()
    reading = recording.bag.batches(Topics(topics.joint_states, None, None), workers=1)
    for batch in reading:
        for columns in batch.joints:
            found.update(columns.names)
        if missing <= found:
            break
    reading.close()
    return found
