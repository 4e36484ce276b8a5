"""What a recording tells of its robot beside the margins: URDF, fixed frames, joints, IMUs.

Of joint states and IMUs the first minute is read, of URDFs and fixed frames all.
"""

from collections.abc import Iterator, Mapping

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
_FAST = frozenset({JOINT_STATE.type, IMU.type})


def evidence_of(recording: Recording | Paths, urdf: Urdf | None = None) -> Evidence:
    """Return what a recording tells of its robot.

    With `urdf` the joint states are those that fit it, else those that fit /robot_description.
    Raises BadBag if nothing can be read; where a file breaks off, what came before is used.
    """
    bag = recording.bag if isinstance(recording, Recording) else open_bag(recording)
    collector = Collector(str(bag.paths[0]))
    collector.doubts += [bag.salvaged] if bag.salvaged else []
    wanted = {}
    for name, topic in bag.topics.items():
        rate = topic.count / bag.duration_s if bag.duration_s > 0.0 else 0.0
        collector.topic(name, topic.type, topic.count, rate)
        if not is_wanted(name, topic.type) or not topic.count:
            continue
        if topic.encoding in {'cdr', 'ros1'}:
            wanted[name] = topic.type
        else:
            collector.doubts.append(f'{name} is encoded as {topic.encoding}, which is not read')
    fast = {name: kind for name, kind in wanted.items() if kind in _FAST}
    rest = {name: kind for name, kind in wanted.items() if kind not in _FAST}
    _read(bag, rest, collector)
    heard = _read(bag, fast, collector, FIRST)
    for name in fast.keys() - heard:  # it begins later than the others
        _read(bag, {name: fast[name]}, collector, FIRST)
    return collector.evidence(urdf)


def _read(
    bag: Bag, wanted: Mapping[str, str], collector: Collector, most: int | None = None
) -> set[str]:
    """Let the collector take the messages of topics (name, type); return which have some.

    Of at most so much (ns) from the first message on.
    """
    until, heard = None, set()
    for now, name, data, wire in _messages(bag, wanted, collector.doubts) if wanted else ():
        if until is None and most is not None:
            until = now + most
        if until is not None and now > until:
            break
        heard.add(name)
        collector.take(now, name, data, wire)
    return heard


_Message = tuple[int, str, bytes, Wire]


def _messages(bag: Bag, wanted: Mapping[str, str], doubts: list[str]) -> Iterator[_Message]:
    """Yield log time (ns), topic, content and its encoding of messages, file by file."""
    for member in sorted(bag.members, key=lambda member: member.span() or (0, 0)):
        try:
            yield from _messages_of(member, wanted)
        except BadBag as error:  # noqa: PERF203 (a file that breaks off spoils no other)
            doubts.append(str(error))


def _messages_of(member: Member, wanted: Mapping[str, str]) -> Iterator[_Message]:
    channels = member.index.channels
    for message in messages_of(member, set(wanted)):
        channel = channels[message.channel]
        wire = wire_of(channel)
        if wire is not None and normal_type(channel.type) == wanted[message.topic]:
            # A ROS 1 bag's messages come as CDR, an MCAP's as they are.
            encoding: Wire = wire if member.storage == 'mcap' else 'cdr'
            yield message.log_time, message.topic, message.data, encoding
