"""Decodes what monitors tell of themselves: the statuses of diagnostic_msgs/DiagnosticArray."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from typing import TYPE_CHECKING, Any

from ugv_acceptance import BadBag
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import Bag

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

TYPE = 'diagnostic_msgs/msg/DiagnosticArray'


def alert_topics(bag: Bag) -> list[str]:
    """Return the topics on which a monitor told its alerts."""
    return [n for n, t in bag.topics.items() if t.type == TYPE and n.endswith('/alerts')]


def statuses(bag: Bag, topics: Iterable[str]) -> Iterator[dict[str, str]]:
    """Yield the values of every status on the topics, by log time.

    Unreadable messages are left out, as is what follows where a file breaks off.
    """
    with suppress(BadBag):
        for message in messages(bag, topics):
            yield from _values(message.data)


def _values(data: bytes) -> Iterator[dict[str, str]]:
    try:
        array: Any = _store().deserialize_cdr(data, TYPE)
        found = [{pair.key: pair.value for pair in status.values} for status in array.status]
    except Exception:  # noqa: BLE001 - rosbags raises anything for garbled bytes
        return
    yield from found


@cache
def _store() -> 'Typestore':
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - few recordings have them

    return get_typestore(Stores.ROS2_JAZZY)
