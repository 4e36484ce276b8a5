"""Node `acceptance_recorder`: records what `evaluate` needs of a running robot. docs/record.md.

Messages are taken as bytes and handed to bag/recorder.py, whose thread writes.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import InvalidTopicNameException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.node import Node
from rclpy.validate_full_topic_name import validate_full_topic_name

from ugv_acceptance import BadConfig, BadSample
from ugv_acceptance.bag.description import TYPE as STRING
from ugv_acceptance.bag.recorder import Key, Recorder
from ugv_acceptance.bag.told_parameters import TOPIC as PARAMETERS
from ugv_acceptance.bag.told_parameters import TYPE as STATUS
from ugv_acceptance.bag.transforms import TOPIC as TF_STATIC
from ugv_acceptance.bag.transforms import TYPE as TF
from ugv_acceptance.bag.transforms import transforms_of
from ugv_acceptance.bag.writer import Qos
from ugv_acceptance.config import Topic, Topics
from ugv_acceptance.monitoring.receipt_clock import ReceiptClock
from ugv_acceptance.nodes.parameters_in_force import ParametersInForce
from ugv_acceptance.nodes.recorded_topic import RecordedTopic, Wanted, one

NAME, MONITOR = 'acceptance_recorder', 'acceptance_monitor'
ARRAY, CLOCK = 'diagnostic_msgs/msg/DiagnosticArray', 'rosgraph_msgs/msg/Clock'
# What the monitor says, and what is asked of it, beside its verdict.
SAID = (
    ('alerts', ARRAY),
    ('ok', 'std_msgs/msg/Bool'),
    ('operator', STATUS),
    ('operator_answer', STATUS),
    ('check', 'trajectory_msgs/msg/JointTrajectory'),
    ('check_result', STATUS),
)
LATCHED, BEST_EFFORT = Qos(durability='transient_local'), Qos('best_effort')
# Seconds between looks at the publishers where nothing is known to have changed, and else.
LOOK, SOON = 1.0, 0.1


@dataclass(frozen=True, slots=True)
class TopicState:
    """What came of a topic: messages, those lost, messages a second, and what is wrong with it.

    `rate` is the present one, `mean` that from its first message to its last. `why_not` is why it
    is not recorded, `needed` whether it is missed where nobody publishes it.
    """

    name: str
    messages: int
    lost: int
    rate: float
    mean: float
    publishers: int
    why_not: str
    needed: bool

    @property
    def missing(self) -> str:
        """What is missing of a topic that is needed, in words; empty where nothing is."""
        if self.why_not:
            return f'{self.name} is not recorded: {self.why_not}'
        if not self.needed or self.messages:
            return ''
        who = 'no message yet on' if self.publishers else 'nobody publishes'
        return f'{who} {self.name}'


class RecorderNode(Node):
    """Subscribes to the robot's topics and the monitor's, and hands what comes to `recorder`.

    `extra` are names of further topics. `tell` is called with what is odd, once each.
    """

    def __init__(
        self,
        recorder: Recorder,
        topics: Topics,
        extra: Iterable[str] = (),
        tell: Callable[[str], None] = lambda _text: None,
        **node: Any,  # noqa: ANN401 - handed on to rclpy
    ) -> None:
        super().__init__(NAME, **node)
        self.recorder, self._tell, self._told = recorder, tell, set[str]()
        self.clock = ReceiptClock()
        self._monitor = self.resolve_topic_name(MONITOR)
        self._in_force = ParametersInForce(self, self._monitor, self._on_parameters)
        self._declared = False
        wanted = {one.name: one for one in self._wanted(topics)}
        for name in extra:
            check_topic(name)
            full = self.resolve_topic_name(name)
            wanted.setdefault(full, Wanted(full))
        self.topics = [
            RecordedTopic(self, one, recorder, self.clock, self._once, self._look_soon)
            for one in wanted.values()
        ]
        self._waited = LOOK
        # Steady: a frozen /clock must not stop the looks.
        self.steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(SOON, self._tick, clock=self.steady)
        self.create_timer(1.0, self._measure, clock=self.steady)

    def _wanted(self, topics: Topics) -> Iterable[Wanted]:
        resolve = self.resolve_topic_name
        for key, topic in topics.used.items():
            lasts: Key | None = one if key == 'payload' else None
            yield Wanted(resolve(topic.name), topic.type, _request(topic), key=lasts)
        own = resolve(topics.robot_description)
        yield Wanted(own, STRING, LATCHED, key=lambda data: data)
        yield Wanted(TF_STATIC, TF, LATCHED, key=_frames)
        monitor = self._monitor
        yield Wanted(f'{monitor}/verdict', STATUS, LATCHED, key=one, also=self._in_force.hear)
        for name, type_ in SAID:
            yield Wanted(f'{monitor}/{name}', type_, needed=False)
        yield Wanted('/diagnostics', ARRAY, needed=False)
        yield Wanted('/clock', CLOCK, BEST_EFFORT, needed=False)

    def _on_parameters(self, message: bytes) -> None:
        name = f'{self._monitor}/{PARAMETERS}'
        if not self._declared:
            self._declared = True
            self.recorder.declare(name, STATUS, [LATCHED], one)
        self.recorder.put(name, self.clock.now(), message)

    def _once(self, text: str) -> None:
        if text not in self._told:
            self._told.add(text)
            self._tell(text)

    def _look_soon(self) -> None:
        self._waited = LOOK

    def _tick(self) -> None:
        self._waited += SOON
        try:
            if self._waited >= LOOK:
                self._waited = 0.0
                for topic in self.topics:
                    topic.look()
            self._in_force.look()
        except Exception as error:  # noqa: BLE001 - a fault in our code must not end the recording
            self._once(f'a fault in our code: {error!r}')

    def _measure(self) -> None:
        for topic in self.topics:
            topic.measure()

    @property
    def heard(self) -> Sequence[TopicState]:
        """What came of each topic so far."""
        return [*map(_state, self.topics), self._parameters_state()]

    def _parameters_state(self) -> TopicState:
        name, number, state = f'{self._monitor}/{PARAMETERS}', self._in_force.told, ''
        if not number and any(t.messages for t in self.topics if t.name.endswith('/verdict')):
            state = f'{self._monitor} has not answered what they are'
        return TopicState(name, number, 0, 0.0, 0.0, 1, state, needed=False)

    def close(self) -> None:
        """Take no more messages."""
        for topic in self.topics:
            topic.close()


def check_topic(name: str) -> None:
    """Raise BadConfig unless this can be the name of a topic: to be asked before files are made."""
    try:
        validate_full_topic_name(expand_topic_name(name, NAME, '/'))
    except (InvalidTopicNameException, RuntimeError, ValueError) as error:
        why = ' '.join(str(error).split()).partition(', at /')[0]
        raise BadConfig(f'--topics {name}: expected the name of a topic: {why}') from None


def _state(topic: RecordedTopic) -> TopicState:
    seconds = (topic.last - topic.first) / 1e9
    mean = (topic.messages - 1) / seconds if seconds > 0.0 else 0.0
    return TopicState(
        topic.name,
        topic.messages,
        topic.lost,
        topic.rate,
        mean,
        topic.publishers,
        topic.why_not,
        topic.wanted.needed,
    )


def _request(topic: Topic) -> Qos:
    reliable, latched = topic.reliability == 'reliable', topic.durability == 'transient_local'
    return Qos(
        'reliable' if reliable else 'best_effort', 'transient_local' if latched else 'volatile'
    )


def _frames(data: bytes) -> object:
    """Return the frames that a message of /tf_static places: a later one of the same counts."""
    try:
        return tuple(transform.child for transform in transforms_of(data))
    except BadSample:
        return data
