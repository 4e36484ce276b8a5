"""The monitor's publishers: conversion of results to messages, what they rest on, and markers."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PointStamped, PolygonStamped
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from ugv_acceptance.bag.encode import JointStateBytes
from ugv_acceptance.bag.encode_views import markers_cdr, point_cdr, polygon_cdr
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.monitoring.diagnostics import Status
from ugv_acceptance.monitoring.drawing import (
    LIFETIME,
    PERIOD,
    Figure,
    figure_of,
    shapes_of,
    skeleton_of,
)
from ugv_acceptance.monitoring.footprint import TILTS, footprint_of
from ugv_acceptance.monitoring.session import Session

_NS = 1_000_000_000


def key_values(values: Mapping[str, object]) -> list[KeyValue]:
    """Return values as KeyValue messages; floats with six digits."""
    return [
        KeyValue(key=key, value=f'{value:.6g}' if isinstance(value, float) else str(value))
        for key, value in values.items()
    ]


def status_message(status: Status, name: str, hardware_id: str) -> DiagnosticStatus:
    """Return a status as a DiagnosticStatus; `name` is put before the status's own name."""
    full = f'{name}: {status.name}' if status.name else name
    return DiagnosticStatus(
        level=bytes([status.level]),
        name=full,
        message=status.message,
        hardware_id=hardware_id,
        values=key_values(status.values),
    )


def diagnostic_array(
    stamp: int, statuses: Sequence[Status], name: str, hardware_id: str
) -> DiagnosticArray:
    """Return statuses as an array with header `stamp` (ns)."""
    message = DiagnosticArray()
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, _NS)
    message.status = [status_message(status, name, hardware_id) for status in statuses]
    return message


LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
MARGIN_TOPICS = ('~/static_torque', '~/torque_margin', '~/stability')
FOOTPRINT_TOPICS = (('~/support_polygon', PolygonStamped), ('~/center_of_mass', PointStamped))


class StatusOutput:
    """Publishes verdict, alerts and diagnostics, in every state of the lifecycle."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self.name = node.get_fully_qualified_name().lstrip('/')
        self.hardware_id = ''
        self._verdict = node.create_publisher(DiagnosticStatus, '~/verdict', LATCHED)
        self._alerts = node.create_publisher(DiagnosticArray, '~/alerts', 50)
        self._diagnostics = node.create_publisher(DiagnosticArray, '/diagnostics', 10)

    def verdict(self, status: Status) -> None:
        """Publish the verdict, latched: a late subscriber gets the last one."""
        self._verdict.publish(status_message(status, self.name, self.hardware_id))

    def alerts(self, statuses: Sequence[Status]) -> DiagnosticArray:
        """Publish changes of alerts; return what was published."""
        message = self._array(statuses)
        self._alerts.publish(message)
        return message

    def diagnostics(self, statuses: Sequence[Status]) -> None:
        """Publish the state of all parts as diagnostics."""
        self._diagnostics.publish(self._array(statuses))

    def _array(self, statuses: Sequence[Status]) -> DiagnosticArray:
        stamp = self._node.get_clock().now().nanoseconds
        return diagnostic_array(stamp, statuses, self.name, self.hardware_id)


class MarginOutput:
    """Publishes the three margin topics and the two of what tip-over margins rest on.

    Once in `period` (ns; 0: for every message) at most; those that somebody subscribes.
    """

    def __init__(
        self, node: Node, settings: Settings, session: Callable[[], Session | None]
    ) -> None:
        self._node, self._session = node, session
        names = settings.robot.joint_names
        kinds: list[tuple[str, Any]] = [(topic, JointState) for topic in MARGIN_TOPICS]
        self._publishers: list[Publisher] = [
            node.create_publisher(kind, topic, 10) for topic, kind in (*kinds, *FOOTPRINT_TOPICS)
        ]
        self._joints, self._sides = JointStateBytes(names), JointStateBytes(TILTS)
        self._wanted = [False] * len(self._publishers)
        self._due = 0
        self.period = 0
        self.limits = settings.limits.torque

    def look_for_listeners(self) -> None:
        """Update which topics have subscribers; messages of the others are not built."""
        self._wanted = [p.get_subscription_count() > 0 for p in self._publishers]
        if not any(self._wanted):
            self._due = 1 << 62
        elif self._due == 1 << 62:
            self._due = 0

    def publish(self, stamp: int, margins: Margins) -> None:
        """Publish margins with a header stamp (ns), unless the last are too recent."""
        if margins.time < self._due:
            return
        late = margins.time - self._due > self.period
        self._due = (margins.time if late else self._due) + self.period
        torque, margin, tip, polygon, center = self._wanted
        if torque:
            self._publishers[0].publish(self._joints.fill(stamp, margins.q, margins.torque))
        if margin:
            pairs = zip(self.limits, margins.torque, strict=True)
            left = [limit - abs(tau) if limit < math.inf else math.inf for limit, tau in pairs]
            self._publishers[1].publish(self._joints.fill(stamp, margins.q, left))
        if tip:
            found = margins.stability
            angle, moment = map(float, found.angle), map(float, found.moment)
            self._publishers[2].publish(self._sides.fill(stamp, tuple(angle), tuple(moment)))
        if polygon or center:
            self._stand(stamp, polygon=polygon, center=center)

    def _stand(self, stamp: int, *, polygon: bool, center: bool) -> None:
        """Publish what the margins in hand rest on."""
        session = self._session()
        found = None if session is None else footprint_of(session.evaluator)
        if session is None or found is None:
            return
        frame = session.settings.frame
        if polygon:
            self._publishers[3].publish(polygon_cdr(stamp, frame, found.polygon))
        if center:
            self._publishers[4].publish(point_cdr(stamp, frame, found.center))

    def destroy(self) -> None:
        """Destroy the publishers."""
        for publisher in self._publishers:
            self._node.destroy_publisher(publisher)


class MarkerOutput:
    """Publishes the markers of a node's session on a timer of its own."""

    def __init__(self, node: Node, session: Callable[[], Session | None]) -> None:
        self._node, self._session = node, session
        self._publisher = node.create_publisher(MarkerArray, '~/markers', 1)
        self._figure: Figure | None = None
        node.create_timer(PERIOD, self._draw, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _draw(self) -> None:
        session = self._session()
        if session is None or not self._publisher.get_subscription_count():
            return
        settings, margins = session.settings, session.evaluator.margins
        if margins is None or session.evaluator.joints.doubted:
            return
        if self._figure is None or self._figure.mechanics.robot is not settings.robot:
            self._figure = figure_of(settings.robot)
        load = session.evaluator.payload
        skeleton = skeleton_of(self._figure, margins.q, margins.gravity, load)
        if skeleton is not None:
            stamp = self._node.get_clock().now().nanoseconds
            shapes = shapes_of(skeleton, margins, settings)
            self._publisher.publish(markers_cdr(stamp, settings.frame, LIFETIME, shapes))
