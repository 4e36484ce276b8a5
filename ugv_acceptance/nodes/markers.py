"""What RViz and Foxglove draw of the margins: `~/markers`, made only while somebody listens."""

from collections.abc import Callable

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from ugv_acceptance.bag.encode_views import markers_cdr
from ugv_acceptance.console.shapes import FRAME, LIFETIME, PERIOD, shapes_of
from ugv_acceptance.console.skeleton import Figure, figure_of, skeleton_of
from ugv_acceptance.nodes.session import Session


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
        if margins is None:
            return
        if self._figure is None or self._figure.mechanics.robot is not settings.robot:
            self._figure = figure_of(settings.robot)
        load = session.evaluator.payload
        skeleton = skeleton_of(self._figure, margins.q, margins.gravity, load)
        if skeleton is not None:
            stamp = self._node.get_clock().now().nanoseconds
            shapes = shapes_of(skeleton, margins, settings)
            self._publisher.publish(markers_cdr(stamp, FRAME, LIFETIME, shapes))
