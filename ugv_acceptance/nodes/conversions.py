"""Numbers to the messages that are published; JointStates are made as CDR bytes from a template."""

import struct
from collections.abc import Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from ugv_acceptance.bag.encode import joint_state_cdr
from ugv_acceptance.nodes.status import Status

_NS = 1_000_000_000


class JointStateBytes:
    """Serialised JointStates of fixed names with position and effort: only numbers are written.

    rclpy takes the bytes as they are; filling a template costs a third of a message object.
    """

    def __init__(self, names: Sequence[str], frame_id: str = '') -> None:
        zeros = [0.0] * len(names)
        self._data = bytearray(joint_state_cdr(0, frame_id, names, zeros, (), zeros))
        self._stamp = struct.Struct('<iI')
        self._floats = struct.Struct(f'<{len(names)}d')
        # CDR (little endian) ends: positions, two counts of four bytes, efforts.
        self._effort_at = len(self._data) - self._floats.size
        self._position_at = self._effort_at - 8 - self._floats.size

    def fill(self, stamp: int, position: Sequence[float], effort: Sequence[float]) -> bytes:
        """Return the message with header `stamp` (ns), `position` and `effort` (one a name)."""
        data = self._data
        self._stamp.pack_into(data, 4, stamp // _NS, stamp % _NS)
        self._floats.pack_into(data, self._position_at, *position)
        self._floats.pack_into(data, self._effort_at, *effort)
        return bytes(data)


def key_values(values: Mapping[str, object]) -> list[KeyValue]:
    """Return values as texts; floats with six digits."""
    return [
        KeyValue(key=key, value=f'{value:.6g}' if isinstance(value, float) else str(value))
        for key, value in values.items()
    ]


def status_message(status: Status, name: str, hardware_id: str) -> DiagnosticStatus:
    """Return a status as a message; `name` comes before the status's own name."""
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
