"""Columns of messages: what both DDS and recordings are decoded into.

All arrays have one row a message, in the order in which the messages were received.
`log_time` is when the message was received (live: the node's clock; bag: the recorded log time),
`stamp` what its header says; both int64 nanoseconds. Everything else is in the units of the
message definitions (SI, radians) and in the message's own joint order and sign.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from ugv_acceptance.type_aliases import Floats, Times


@dataclass(frozen=True, slots=True)
class JointStateColumns:
    """Messages of sensor_msgs/JointState that all carry the same `names`.

    `position`, `velocity`, `effort` have shape (n, len(names)), or (n, 0) where the messages
    leave that array empty. Velocities and efforts of any other length count as not given; messages
    whose positions have another length are left out: the decoder counts them as malformed.
    """

    names: tuple[str, ...]
    log_time: Times
    stamp: Times
    position: Floats
    velocity: Floats
    effort: Floats


@dataclass(frozen=True, slots=True)
class ImuColumns:
    """Messages of sensor_msgs/Imu with one `frame_id`; a quaternion is x, y, z, w.

    `*_covariance_0` (n,) is element 0 of each covariance: -1 says "not measured" (REP-145).
    """

    frame_id: str
    log_time: Times
    stamp: Times
    orientation: Floats
    angular_velocity: Floats
    linear_acceleration: Floats
    orientation_covariance_0: Floats
    angular_velocity_covariance_0: Floats
    linear_acceleration_covariance_0: Floats


@dataclass(frozen=True, slots=True)
class PayloadColumns:
    """Messages of geometry_msgs/InertiaStamped: `mass` (n,) kg and `com` (n, 3) m in `frame_id`."""

    frame_id: str
    log_time: Times
    stamp: Times
    mass: Floats
    com: Floats


@dataclass(frozen=True, slots=True)
class Batch:
    """A part of a recording: no message of the next batch was logged before the last of this."""

    joints: Sequence[JointStateColumns] = field(default=())
    imu: Sequence[ImuColumns] = field(default=())
    payload: Sequence[PayloadColumns] = field(default=())
