"""What the nodes say to the messages that are published."""

from collections.abc import Mapping, Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from ugv_acceptance.nodes.status import Status

_NS = 1_000_000_000


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
