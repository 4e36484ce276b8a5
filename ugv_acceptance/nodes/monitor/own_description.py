"""The robot's own description as the monitor hears it on /robot_description.

It is heard in every state of the lifecycle. As the robot's URDF it is taken once, from exactly one
publisher; a URDF in force is held against all that is heard, for as long as it is published.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from std_msgs.msg import String

from ugv_acceptance import BadConfig, BadSample
from ugv_acceptance.bag.told_robot import description_of
from ugv_acceptance.config import Config, description_topic, load
from ugv_acceptance.config.same_robot import difference_of
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.executor import ros

# The subject of its alert.
NAME = 'robot_description'
# As robot_state_publisher publishes it; several publishers must find room.
QOS = QoSProfile(
    depth=10,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# Seconds that a lifecycle manager's configure waits for a description, and between two looks.
WAIT, LOOK = 5.0, 0.05
# Seconds after the first description in which a second publisher is discovered.
SETTLED = 1.0
# Different descriptions that are remembered.
MOST = 8


class OwnDescription:
    """What the robot tells of itself; `on_new` is called with each message that was not known.

    `heard` are the messages that count, the newest last, with their texts or why they have none.
    """

    def __init__(self, node: Node, on_new: Callable[[bytes], None]) -> None:
        self._node, self._on_new = node, on_new
        self.topic = ''
        self.heard: dict[bytes, str | BadSample] = {}
        self._last = 0.0
        self._publishers: frozenset[bytes] = frozenset()
        self._compared: dict[tuple[str, bytes], str] = {}
        self._tried: bytes | None = None
        self._subscription: Subscription | None = None

    def is_needed(self, path: Path, urdf: Path | None) -> bool:
        """Return whether these files name no URDF; it then listens for the robot's.

        Raises BadConfig where the files cannot be used.
        """
        topic = description_topic(path, urdf=urdf)
        if topic is not None:
            self.listen(topic)
        return topic is not None

    def complete(
        self,
        path: Path,
        urdf: Path | None,
        *,
        wait: bool,
        asked: Callable[[], bool] = lambda: False,
    ) -> Config:
        """Load a robot's files, with the robot's own description where they name no URDF.

        With `wait` it waits for the description, until it is `asked` to end. Raises BadConfig where
        there is none to take.
        """
        if self.is_needed(path, urdf):
            if wait:
                self._wait(asked)
            return load(path, urdf_text=self._take())
        config = load(path, urdf=urdf)
        self.listen(config.topics.robot_description)
        return config

    def listen(self, topic: str) -> None:
        """Listen to a topic from now on."""
        name = self._node.resolve_topic_name(topic)
        if name != self.topic:
            self.topic, self._publishers = name, frozenset()
            self._ask_anew()

    def _ask_anew(self) -> None:
        """Subscribe again: whoever publishes a description tells it to a new subscriber."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        self.heard = {}
        create = self._node.create_subscription
        self._subscription = create(String, self.topic, self._hear, QOS, raw=True)

    def _hear(self, data: Any) -> None:  # noqa: ANN401 - bytes, for it is raw
        data = bytes(data)
        known = self.heard.pop(data, None)
        self.heard[data] = _told(data) if known is None else known
        self._last = time.monotonic()
        if known is None:
            while len(self.heard) > MOST:
                del self.heard[next(iter(self.heard))]
            self._on_new(data)

    def look(self) -> None:
        """Forget what counts no longer: told by publishers that are gone, or told anew since."""
        if not self.topic:
            return
        infos = self._node.get_publishers_info_by_topic(self.topic)
        present = frozenset(bytes(info.endpoint_gid) for info in infos)
        if present and self._publishers - present:
            self._ask_anew()
        self._publishers = present
        if len(present) == 1 and len(self.heard) > 1 and self._settled:
            newest = next(reversed(self.heard))
            self.heard = {newest: self.heard[newest]}

    def obstacle(self) -> str:
        """Return why the description cannot be taken now; empty if it can."""
        infos = self._node.get_publishers_info_by_topic(self.topic)
        nodes = sorted({f'{i.node_namespace.rstrip("/")}/{i.node_name}' for i in infos})
        if not self.heard:
            who = f'{" and ".join(nodes)} has told none yet' if nodes else 'nobody publishes it'
            return f'no URDF is configured, so the robot must tell it on {self.topic}: {who}'
        if len(nodes) > 1 or len(self.heard) > 1:
            return (
                f'expected one publisher of {self.topic}, whose URDF is to be taken, got '
                f'{len(self.heard)} different descriptions from {" and ".join(nodes) or "nobody"}: '
                'stop all but one'
            )
        (told,) = self.heard.values()
        return f'{self.topic}: {told}' if isinstance(told, BadSample) else ''

    @property
    def _settled(self) -> bool:
        """Whether a description came, and the last long enough ago for others to be known."""
        return bool(self.heard) and time.monotonic() - self._last >= SETTLED

    def untried(self) -> bool:
        """Return whether a description can be taken that was not the last time this was true."""
        if not self._settled or self.obstacle() or self._take() == self._tried:
            return False
        self._tried = self._take()
        return True

    def _wait(self, asked: Callable[[], bool]) -> None:
        """Wait until a description can be taken or it is `asked` to end, at most WAIT.

        Blocks the node's executor.
        """
        # Taken by hand, since the executor waits for this function.
        probe = self._node.create_subscription(String, self.topic, _nothing, QOS, raw=True)
        end = time.monotonic() + WAIT
        while time.monotonic() < end and not (asked() or (self._settled and not self.obstacle())):
            with probe.handle:
                got = probe.handle.take_message(String, True)
            if got is None:
                time.sleep(LOOK)
            else:
                self._hear(got[0])
        self._node.destroy_subscription(probe)

    def _take(self) -> bytes:
        """Return the one description that is told; BadConfig says why there is none."""
        obstacle = self.obstacle()
        if obstacle:
            raise BadConfig(obstacle)
        (told,) = self.heard.values()
        return str(told).encode()

    def is_newer(self, config: Config) -> bool:
        """Return whether a configuration's URDF was the robot's, and the robot tells another."""
        mine = config.description != 'file' and not self.obstacle()
        return mine and bool(self._differs(config))

    def compare(self, config: Config, session: Session) -> None:
        """Tell, for as long as it lasts, that what was heard is not the URDF in force."""
        now, how = session.clock.now(), self._differs(config)
        if how:
            session.faults.set(now, 'CONFIG_DIFFERS', NAME, 1.0, how)
        else:
            session.faults.clear(now, 'CONFIG_DIFFERS', NAME)

    def _differs(self, config: Config) -> str:
        """Return how a description that was heard differs from the URDF in force; empty: none."""
        for data in self.heard:
            key = (config.urdf_sha256, data)
            if key not in self._compared:
                self._compared[key] = difference_of(config, self.heard[data], self.topic)
            if self._compared[key]:
                return self._compared[key]
        return ''


def load_live(config: Path | None, urdf: Path | None, args: list[str]) -> Config:
    """Load a robot's files; where they name no URDF, with the one the robot tells over ROS.

    `args` are ROS arguments. Raises BadConfig where the robot tells none that can be taken, and
    SystemExit where a signal asks the process to end meanwhile.
    """
    if description_topic(config, urdf=urdf) is None:
        return load(config, urdf=urdf)
    with ros(args) as stop:
        node = Node('robot_description_reader')
        try:
            own = OwnDescription(node, _nothing)
            return own.complete(config or Path(), urdf, wait=True, asked=lambda: stop.asked)
        finally:
            node.destroy_node()
            stop.leave()


def _told(data: bytes) -> str | BadSample:
    try:
        return description_of(data)
    except BadSample as error:
        return error
    except Exception as error:  # noqa: BLE001 - no message may end the node
        return BadSample(repr(error))


def _nothing(_: bytes) -> None:
    """Take nothing: messages are taken by hand."""
