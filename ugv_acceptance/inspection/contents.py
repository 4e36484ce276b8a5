"""What a recording holds: files, damage, topics with rates, gaps and QoS, a monitor's alerts."""

from collections.abc import Iterator, Mapping
from datetime import datetime, timezone

from ugv_acceptance.bag.log_times import LogTimes
from ugv_acceptance.bag.mcap_index import McapIndex
from ugv_acceptance.bag.raw import Offered, offered_by_all
from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.bag.reading import Member
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.bag.statuses import alert_topics, statuses
from ugv_acceptance.type_aliases import Json

STORAGES = {'mcap': 'MCAP', 'sqlite3': 'SQLite', 'ros1': 'ROS 1 bag'}


def recording_contents(recording: Recording) -> Json:
    """Return what a recording is: files, size, time, compression, checksums, damage."""
    bag = recording.bag
    start = bag.start_ns
    began = datetime.fromtimestamp(start // 10**9, timezone.utc) if start else None
    return {
        'paths': [str(path) for path in bag.paths],
        'storage': bag.members[0].storage,
        'compression': sorted({word for member in bag.members for word in _packed(member)}),
        'size_bytes': sum(path.stat().st_size for path in bag.paths),
        'start_ns': start,
        'start': began.strftime('%Y-%m-%d %H:%M:%S UTC') if began else None,
        'duration_s': bag.duration_s,
        'messages': sum(topic.count for topic in bag.topics.values()),
        'protected': bag.protected if bag.members[0].storage == 'mcap' else None,
        'salvaged': bag.salvaged,
        'simulated': bag.simulated,
        'findings': list(bag.findings),
    }


def _packed(member: Member) -> Iterator[str]:
    """Yield the compressions of a file and of its chunks; nothing where there is none."""
    if member.keep is not None:
        yield 'zstd file'
    if isinstance(member.index, McapIndex):
        heads = (piece.head for piece in member.index.pieces)
        yield from {head.compression for head in heads if head and head.compression}


def topic_contents(
    recording: Recording, times: Mapping[str, LogTimes], used: Mapping[str, str | None]
) -> list[Json]:
    """Return the topics: those taken for an input first, then those with the most messages.

    `used` gives the topic taken for each input.
    """
    bag, qos = recording.bag, offered_by_all(recording.bag)
    inputs = {topic: name for name, topic in used.items() if topic is not None}
    order = sorted(bag.topics, key=lambda name: (name not in inputs, -bag.topics[name].count, name))
    return [
        {
            'name': name,
            'type': bag.topics[name].type,
            'encoding': bag.topics[name].encoding,
            'messages': bag.topics[name].count,
            **_times_of(times.get(name), bag.start_ns),
            'qos': [_qos_of(one) for one in qos.get(name, ())],
            'used_as': inputs.get(name),
        }
        for name in order
    ]


def _qos_of(one: Offered) -> Json:
    return {'reliability': one.reliability, 'durability': one.durability}


def _times_of(found: LogTimes | None, start: int) -> Json:
    held = found if found is not None and found.count else None
    return {
        'rate_hz': held.rate if held else None,
        'first_s': (held.first - start) / 1e9 if held else None,
        'last_s': (held.last - start) / 1e9 if held else None,
        'longest_gap_s': held.gap / 1e9 if held and held.count > 1 else None,
        'gap_at_s': (held.gap_from - start) / 1e9 if held and held.gap else None,
        'back_by_s': held.backwards / 1e9 if held else 0.0,
    }


def monitors_in(bag: Bag) -> list[Json]:
    """Return the monitors whose alerts were recorded: how many were raised, by which limits."""
    found = []
    for topic in alert_topics(bag):
        told = list(statuses(bag, [topic]))
        hashes = dict.fromkeys(values['limits_hash'] for values in told if 'limits_hash' in values)
        raised = sum(values.get('state') == 'raised' for values in told)
        found.append({'topic': topic, 'raised': raised, 'limits_hash': list(hashes)})
    return found
