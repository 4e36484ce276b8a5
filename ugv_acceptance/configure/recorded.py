"""What a recording tells of its robot beside the margins: URDF, fixed frames, joints, IMUs.

Of joint states and IMUs the first minute of each topic is read, of URDFs and fixed frames all.
"""

from collections.abc import Iterator

from ugv_acceptance import BadBag
from ugv_acceptance.bag.cdr import IMU, JOINT_STATE
from ugv_acceptance.bag.layout import Wire
from ugv_acceptance.bag.raw import messages_of
from ugv_acceptance.bag.reader import Bag, open_bag
from ugv_acceptance.bag.reading import Member, normal_type, wire_of
from ugv_acceptance.bag.recording import Paths, Recording
from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.collector import Collector, is_wanted
from ugv_acceptance.configure.evidence import Evidence

# So much of joint states and IMUs is read (ns).
FIRST = 60_000_000_000


def evidence_of(recording: Recording | Paths, urdf: Urdf | None = None) -> Evidence:
    """Return what a recording tells of its robot.

    With `urdf` the joint states are those that fit it, else those that fit /robot_description.
    Raises BadBag if nothing can be read; where a file breaks off, what came before is used.
    """
    bag = recording.bag if isinstance(recording, Recording) else open_bag(recording)
    collector = Collector(str(bag.paths[0]))
    collector.doubts += [bag.salvaged] if bag.salvaged else []
    for name, topic in bag.topics.items():
        rate = topic.count / bag.duration_s if bag.duration_s > 0.0 else 0.0
        collector.topic(name, topic.type, topic.count, rate)
        if not is_wanted(name, topic.type) or not topic.count:
            continue
        if topic.encoding in {'cdr', 'ros1'}:
            _read(bag, name, topic.type, collector)
        else:
            collector.doubts.append(f'{name} is encoded as {topic.encoding}, which is not read')
    return collector.evidence(urdf)


def _read(bag: Bag, name: str, kind: str, collector: Collector) -> None:
    """Let the collector take the messages of one topic, of a fast one those of a minute."""
    until = None
    for now, data, wire in _messages(bag, name, kind, collector.doubts):
        if until is None and kind in {JOINT_STATE.type, IMU.type}:
            until = now + FIRST
        if until is not None and now > until:
            return
        collector.take(now, name, data, wire)


def _messages(
    bag: Bag, name: str, kind: str, doubts: list[str]
) -> Iterator[tuple[int, bytes, Wire]]:
    """Yield log time (ns), content and its encoding of the messages of a topic, file by file."""
    for member in sorted(bag.members, key=lambda member: member.span() or (0, 0)):
        try:
            yield from _messages_of(member, name, kind)
        except BadBag as error:  # noqa: PERF203 (a file that breaks off spoils no other)
            doubts.append(str(error))


def _messages_of(member: Member, name: str, kind: str) -> Iterator[tuple[int, bytes, Wire]]:
    channels = member.index.channels
    for message in messages_of(member, {name}):
        channel = channels[message.channel]
        wire = wire_of(channel)
        if wire is not None and normal_type(channel.type) == kind:
            # A ROS 1 bag's messages come as CDR, an MCAP's as they are.
            yield message.log_time, message.data, 'cdr' if member.storage != 'mcap' else wire
