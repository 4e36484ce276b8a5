"""What RViz and Foxglove draw of the margins: `~/markers`, made only while somebody listens."""

import math
from collections.abc import Callable, Sequence

from geometry_msgs.msg import Point
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from ugv_acceptance.console.skeleton import Figure, Skeleton, figure_of, skeleton_of
from ugv_acceptance.evaluation.live import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Vector
from ugv_acceptance.nodes.session import Session

FRAME = 'base_link'
# Seconds between drawings; a dead monitor's markers vanish after LIFETIME.
PERIOD, LIFETIME = 0.1, 0.5
NAMES = ('support', 'worst_edge', 'cog', 'plumb', 'limbs', 'words')
_GREEN, _AMBER, _RED, _BLUE = (
    ColorRGBA(r=r, g=g, b=b, a=1.0)
    for r, g, b in ((0.1, 0.6, 0.2), (1.0, 0.75, 0.0), (0.8, 0.0, 0.1), (0.0, 0.3, 0.8))
)
# Outward direction in `base_link` of each of SIDES.
_OUTWARD = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))


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
            stamp = self._node.get_clock().now().to_msg()
            markers = markers_of(skeleton, margins, settings)
            for marker in markers:
                marker.header.stamp = stamp
            self._publisher.publish(MarkerArray(markers=markers))


def markers_of(skeleton: Skeleton, margins: Margins, settings: Settings) -> list[Marker]:
    """Return the markers of one posture, one a name of NAMES, without stamps."""
    angles = [float(a) for a in margins.stability.angle]
    colour = _tip_colour(min(angles), settings)
    outline = [*skeleton.polygon, *skeleton.polygon[:1]]
    under = [] if skeleton.plumb is None else [skeleton.cog, skeleton.plumb]
    limbs = [point for limb in skeleton.limbs for point in (limb.start, limb.end)]
    edge = _edge_towards(skeleton.polygon, angles)
    found = [
        _lines('support', Marker.LINE_STRIP, outline, 0.01, _BLUE),
        _lines('worst_edge', Marker.LINE_LIST, edge, 0.03, colour),
        _lines('cog', Marker.SPHERE_LIST, [skeleton.cog], 0.06, colour),
        _lines('plumb', Marker.LINE_LIST, under, 0.01, colour),
        _lines('limbs', Marker.LINE_LIST, limbs, 0.03, _BLUE),
        _words(angles, skeleton.cog, colour),
    ]
    found[4].colors = [
        c for limb in skeleton.limbs for c in [_use(limb.joint, margins, settings)] * 2
    ]
    return found


def _marker(name: str, kind: int, colour: ColorRGBA) -> Marker:
    marker = Marker(ns=name, id=0, type=kind, color=colour)
    marker.header.frame_id = FRAME
    marker.pose.orientation.w = 1.0
    marker.lifetime = Duration(seconds=LIFETIME).to_msg()
    return marker


def _lines(
    name: str, kind: int, points: Sequence[Vector], width: float, colour: ColorRGBA
) -> Marker:
    marker = _marker(name, kind, colour)
    marker.action = Marker.ADD if points else Marker.DELETE
    marker.scale.x = marker.scale.y = marker.scale.z = width
    marker.points = [Point(x=x, y=y, z=z) for x, y, z in points]
    return marker


def _words(angles: Sequence[float], at: Vector, colour: ColorRGBA) -> Marker:
    marker = _marker('words', Marker.TEXT_VIEW_FACING, colour)
    least = min(angles)
    marker.text = (
        f'{math.degrees(least):.1f} deg left' if math.isfinite(least) else 'no tilt margin'
    )
    marker.scale.z = 0.08
    marker.pose.position.x, marker.pose.position.y = at[0], at[1]
    marker.pose.position.z = at[2] + 0.3
    return marker


def _edge_towards(polygon: Sequence[Vector], angles: Sequence[float]) -> list[Vector]:
    """Return both ends of the edges that lie on the side with the least tilt left."""
    x, y = _OUTWARD[min(range(len(angles)), key=lambda k: angles[k])]
    points: list[Vector] = []
    for a, b in zip(polygon, [*polygon[1:], *polygon[:1]], strict=True):
        outward = (b[1] - a[1], a[0] - b[0])
        if outward[0] * x + outward[1] * y > 0.7 * math.hypot(*outward):
            points += [a, b]
    return points


def _tip_colour(least: float, settings: Settings) -> ColorRGBA:
    limits = settings.limits
    # NaN is no margin.
    if not least > limits.tip_error:
        return _RED
    return _AMBER if least <= limits.tip_warn else _GREEN


def _use(joint: str, margins: Margins, settings: Settings) -> ColorRGBA:
    j, limits = settings.robot.joint_names.index(joint), settings.limits
    use = abs(margins.torque[j]) / limits.torque[j]
    if not use < limits.torque_error:
        return _RED
    return _AMBER if use >= limits.torque_warn else _GREEN
