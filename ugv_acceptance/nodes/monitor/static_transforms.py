"""Listens to /tf_static while only that can tell where the IMU is."""

from contextlib import suppress
from dataclasses import replace
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from ugv_acceptance import BadSample
from ugv_acceptance.bag.transforms import TOPIC, TransformSample, transforms_of
from ugv_acceptance.monitoring.session import Session

# Each of several publishers sends its own transforms once: as tf2's listener does.
_QOS = QoSProfile(
    depth=100,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
_MISSING = 'the ROS package tf2_msgs is not installed, so {topic} is not heard'


class StaticTransforms:
    """Subscribes to /tf_static when the IMU's frame is no link of the URDF, until it is found."""

    def __init__(self, node: Node, session: Session) -> None:
        self._node, self._session = node, session
        self._subscription: Subscription | None = None
        self._told: dict[str, TransformSample] = {}
        self._asked = False

    def look(self) -> None:
        """Subscribe or unsubscribe, as it is needed now; to be called once a second."""
        seeks = self._session.evaluator.mount.seeks
        if seeks and not self._asked:
            self._asked = True
            self._subscribe()
        elif not seeks:
            self.destroy()

    def _subscribe(self) -> None:
        try:
            from tf2_msgs.msg import TFMessage  # noqa: PLC0415 - not in every installation
        except ImportError:
            self._session.on_problem(_MISSING.format(topic=TOPIC))
            return
        kind: Any = TFMessage
        self._subscription = self._node.create_subscription(kind, TOPIC, self.take, _QOS, raw=True)

    def take(self, data: bytes) -> None:
        """Take a serialised TFMessage: the newest transform of each frame counts."""
        with suppress(BadSample):  # one that cannot be read tells nothing
            for transform in transforms_of(data):
                self._told[transform.child] = transform
        session = self._session
        if session.evaluator.mount.seeks:
            imu = replace(session.settings.imu, transforms=tuple(self._told.values()))
            session.adopt(replace(session.settings, imu=imu))

    def destroy(self) -> None:
        """Unsubscribe."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        self._subscription, self._asked = None, False
