"""One topic that is recorded: subscriptions that fit its publishers, and what came of it.

A subscription is made before a publisher is there, so that its first message is heard. Where what
publishers offer does not fit it, another one is made before the first is given up; messages that
come by both are taken once.
"""

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from inspect import Parameter, Signature
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from ugv_acceptance import BadBag
from ugv_acceptance.bag.recorder import Key, Recorder
from ugv_acceptance.bag.writer import Qos, definition_of
from ugv_acceptance.monitoring.receipt_clock import ReceiptClock
from ugv_acceptance.nodes.bag_player import message_type
from ugv_acceptance.nodes.offers import differing, offer_of, profile_of, publishers, requests_for

# Messages that wait in each subscription: seconds of a fast topic.
DEPTH = 5000
# Seconds in which a new subscription finds its publishers and the old one is kept beside it.
OVERLAP = 3.0
# Messages that are remembered, to know one that comes twice.
_REMEMBERED = 5_000
# What is asked for where nobody is known to offer anything yet.
ANY = Qos()


@dataclass(frozen=True, slots=True)
class Wanted:
    """A topic to record: `type` '' is that of its publishers, `request` what to ask for at first.

    `needed`: it is said where nobody publishes it. `key` says which earlier message a new one
    replaces, on a topic whose messages last. `also` is called with each message.
    """

    name: str
    type: str = ''
    request: Qos = ANY
    needed: bool = True
    key: Key | None = None
    also: Callable[[bytes], None] | None = None


@dataclass(slots=True)
class RecordedTopic:
    """A topic on a node, recorded by `recorder`; `tell` is called with what is odd, once each.

    `why_not` is why it is not recorded (empty: it is), `publishers` their number. `lost` are
    messages that were sent and did not come, by their numbers where one node publishes; `first` and
    `last` the times of receipt (ns).
    """

    node: Node
    wanted: Wanted
    recorder: Recorder
    clock: ReceiptClock
    tell: Callable[[str], None]
    on_change: Callable[[], None]
    messages: int = 0
    lost: int = 0
    rate: float = 0.0
    first: int = 0
    last: int = 0
    publishers: int = 0
    why_not: str = ''
    _type: str = ''
    _declared: tuple[Qos, ...] = ()
    _subscriptions: dict[Qos, Subscription] = field(default_factory=dict)
    _requests: tuple[Qos, ...] = ()
    _changed: float = 0.0
    _number: int = 0
    _before: tuple[float, int] = (0.0, 0)
    _seen: set[tuple[int, int | None]] = field(default_factory=set)
    _order: 'deque[tuple[int, int | None]]' = field(default_factory=deque)

    def __post_init__(self) -> None:
        if self.wanted.type:
            self._adopt(self.wanted.type)
        self._before = (time.monotonic(), 0)

    @property
    def name(self) -> str:
        """The full name of the topic."""
        return self.wanted.name

    def look(self) -> None:
        """Fit the subscriptions to the publishers there are now."""
        infos = publishers(self.node, self.name)
        kinds = sorted({info.topic_type for info in infos})
        if kinds and not self._type and not self.why_not:
            self._adopt(kinds[0])
        others = [kind for kind in kinds if kind != self._type]
        if others and self._type:
            self.tell(f'{self.name}: published as {" and ".join(others)}, not only {self._type}')
        mine = [info for info in infos if info.topic_type == self._type]
        self.publishers = len(infos)
        if mine and not self.why_not:
            self._fit(mine)
        self._give_up_old()

    def _adopt(self, type_: str) -> None:
        """Begin to record the topic as messages of a type, or know why that cannot be."""
        self._type = type_
        package = type_.partition('/')[0]
        if message_type(type_) is None:
            self.why_not = (
                f'the ROS package {package} is not installed, or has no type {type_} '
                f'(ros-jazzy-{package.replace("_", "-")})'
            )
            return
        try:
            definition_of(type_)
        except BadBag as error:
            self.why_not = str(error)
            return
        self._ask((self.wanted.request,))

    def _fit(self, infos: Sequence[TopicEndpointInfo]) -> None:
        offers = tuple(dict.fromkeys(offer_of(info) for info in infos))
        self._declare(offers)
        if how := differing(infos):
            asked = ' and '.join(request.reliability for request in requests_for(offers))
            self.tell(f'{self.name}: {how}; recorded as {asked.replace("_", " ")}')
        self._ask(requests_for(offers))

    def _declare(self, offers: Sequence[Qos]) -> None:
        """Declare the topic to the recorder, with all that was ever offered."""
        both = tuple(dict.fromkeys((*self._declared, *offers)))
        if both == self._declared:
            return
        self._declared, key = both, self.wanted.key
        if any(offer.durability == 'transient_local' for offer in offers):
            key = key or one
        self.recorder.declare(self.name, self._type, both, key)

    def _ask(self, requests: tuple[Qos, ...]) -> None:
        if requests == self._requests:
            return
        self._requests, self._changed = requests, time.monotonic()
        kind: Any = message_type(self._type)
        for request in requests:
            if request not in self._subscriptions:
                self._subscriptions[request] = self.node.create_subscription(
                    kind,
                    self.name,
                    self._taker(),
                    profile_of(request, DEPTH),
                    event_callbacks=self._events(),
                    raw=True,
                )

    def _give_up_old(self) -> None:
        old = [request for request in self._subscriptions if request not in self._requests]
        if old and time.monotonic() - self._changed >= OVERLAP:
            for request in old:
                self.node.destroy_subscription(self._subscriptions.pop(request))

    def _events(self) -> SubscriptionEventCallbacks:
        def lost(event: Any) -> None:  # noqa: ANN401 - rclpy's, without a type
            if self.publishers != 1:
                self.lost += event.total_count_change

        def changed(_: object) -> None:
            self.on_change()

        return SubscriptionEventCallbacks(
            incompatible_qos=changed, message_lost=lost, matched=changed
        )

    def _taker(self) -> Callable[..., None]:
        put, clock, name, also = self.recorder.put, self.clock, self.name, self.wanted.also
        comes_again = self._comes_again

        # An executor hands message and information on as two arguments, or as a pair.
        def take(*given: Any) -> None:  # noqa: ANN401 - bytes and a dict, or both as a tuple
            now = clock.now()
            data, information = given if len(given) == 2 else given[0]
            number = information.get('publication_sequence_number')
            if comes_again(information.get('source_timestamp'), number):
                return
            self._count(now, number)
            if not self._declared:
                self._declare_first()
            put(name, now, data)
            if also is not None:
                also(data)

        # By its signature rclpy knows that the information is wanted.
        both = [Parameter(word, Parameter.POSITIONAL_ONLY) for word in ('data', 'information')]
        take.__signature__ = Signature(both)  # type: ignore[attr-defined]
        return take

    def _count(self, now: int, number: int | None) -> None:
        self.messages += 1
        self.first, self.last = self.first or now, now
        if number is None:
            return
        if self.publishers == 1 and 0 < self._number < number:
            self.lost += number - self._number - 1
        self._number = number

    def _declare_first(self) -> None:
        """Declare the topic because of its first message, which came before a look at it."""
        infos = publishers(self.node, self.name)
        offers = [offer_of(info) for info in infos if info.topic_type == self._type]
        self._declare(offers or [self.wanted.request])

    def _comes_again(self, stamp: int | None, number: int | None) -> bool:
        """Return whether a message has come by another subscription; without a stamp: no."""
        if not stamp:
            return False
        mark = (stamp, number)
        if mark in self._seen:
            return True
        self._seen.add(mark)
        self._order.append(mark)
        if len(self._order) > _REMEMBERED:
            self._seen.discard(self._order.popleft())
        return False

    def measure(self) -> None:
        """Measure the rate (messages a second) since the last time; to be called now and then."""
        now, (since, before) = time.monotonic(), self._before
        if now > since:
            self.rate = (self.messages - before) / (now - since)
        self._before = (now, self.messages)

    def close(self) -> None:
        """Take no more messages."""
        for subscription in self._subscriptions.values():
            self.node.destroy_subscription(subscription)
        self._subscriptions.clear()


def one(_: bytes) -> str:
    """Let each message replace the one before."""
    return ''
