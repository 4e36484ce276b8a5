"""A recording looked at: its index in whole, and judged as far as reading it is cheap."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from ugv_acceptance import AcceptanceError, BadBag
from ugv_acceptance.bag.cdr import IMU, JOINT_STATE, PAYLOAD
from ugv_acceptance.bag.mcap_index import McapIndex
from ugv_acceptance.bag.reader import Bag, Topics, choose_topics
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.config import Config
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.offline.evaluation import Evaluation
from ugv_acceptance.offline.judge import Options

# Messages of the inputs, and bytes of a file, that are read unless all is asked for.
MESSAGES, BYTES = 200_000, 256 << 20


@dataclass(frozen=True, slots=True)
class Look:
    """A recording, and what an evaluation of its beginning came to.

    `until_s` is where reading stopped (s since the start), None: all was read. `judged` is None if
    nothing could be judged: `obstacle` then says why.
    """

    whole: Recording
    until_s: float | None
    judged: Evaluation | None
    obstacle: str = ''


def look(
    recording: Recording,
    config: Config | Path | str | None,
    *,
    everything: bool = False,
    reached: Callable[[float], None] = lambda _: None,
) -> Look:
    """Judge a recording, or its beginning where it is long; `reached` gets seconds of it."""
    bag = recording.bag
    until = bag.end_ns if everything else min(until_cheap(bag), bag.end_ns)
    part = replace(recording, bag=bag.beginning(until))
    until_s = None if until >= bag.end_ns else (until - bag.start_ns) / 1e9
    options = Options(progress=lambda now: reached((now - bag.start_ns) / 1e9))
    try:
        return Look(recording, until_s, evaluate(part, config=config, options=options))
    except AcceptanceError as error:
        return Look(recording, until_s, None, str(error))


def until_cheap(bag: Bag, messages: int = MESSAGES, most: int = BYTES) -> int:
    """Return the log time (ns) up to which about so many messages of inputs, and bytes, are read.

    Only what holds messages of an input counts, as nothing else is read.
    """
    topics = _inputs(bag)
    held = sum(bag.topics[name].count for name in topics)
    share = messages / held if held > messages else 1.0
    span = bag.end_ns - bag.start_ns
    end = bag.end_ns if share >= 1.0 else bag.start_ns + round(share * span)
    return min(end, _until_bytes(bag, topics, most))


def _inputs(bag: Bag) -> list[str]:
    """Return the topics of the kinds that an evaluation reads."""
    kinds = {kind.type for kind in (JOINT_STATE, IMU, PAYLOAD)}
    return [name for name, topic in bag.topics.items() if topic.type in kinds]


def _until_bytes(bag: Bag, topics: list[str], most: int) -> int:
    pieces = []
    for member in bag.members:
        if not isinstance(member.index, McapIndex):
            size, span = member.content.stat().st_size, bag.end_ns - bag.start_ns
            return bag.end_ns if size <= most else bag.start_ns + round(span * most / size)
        wanted = {c.id for c in member.index.channels.values() if c.topic in topics}
        held = member.index.pieces
        pieces += [p for p in held if p.indexes is None or wanted & p.indexes.keys()]
    total = 0
    for piece in sorted(pieces, key=lambda piece: piece.first):
        total += piece.length
        if total > most and piece.first > bag.start_ns:
            return piece.first
    return bag.end_ns


@dataclass(frozen=True, slots=True)
class Chosen:
    """The topic taken for an input, and why; without a topic `why` says what is in the way."""

    topic: str | None
    why: str


def chosen(recording: Recording, config: Config) -> dict[str, Chosen]:
    """Return which topic of a recording is taken for each input of a configuration, and why."""
    joints, imu, payload = config.topics.names
    return {
        'joint_states': _chosen(recording, joints, lambda bag: choose_topics(bag, joints, None)),
        'imu': _chosen(recording, imu, lambda bag: choose_topics(bag, None, imu)),
        'payload': _chosen(recording, payload, lambda bag: choose_topics(bag, None, None, payload)),
    }


def _chosen(recording: Recording, name: str | None, choose: Callable[[Bag], Topics]) -> Chosen:
    if name is None:
        return Chosen(None, 'the configuration uses none')
    try:
        topics = choose(recording.bag)
    except BadBag as error:
        text = str(error).removeprefix(f'{recording.bag.paths[0]}: ')
        return Chosen(None, text.partition('; the bag holds:')[0])
    topic = topics.joint_states or topics.imu or topics.payload
    if topic is None:
        return Chosen(None, f'there is no topic {name}')
    same = topic.lstrip('/') == name.lstrip('/')
    return Chosen(topic, 'by its name' if same else 'the only topic of its type')
