"""How messages reach this process: middleware, transport, and room in the kernel's buffers.

What cannot be known is said so: only of Fast DDS is told here which transports it opens.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rclpy.utilities import get_rmw_implementation_identifier

from ugv_acceptance.nodes.executor import LOOPBACK, PROFILES, RANGE, TRANSPORT

RMEM_MAX = Path('/proc/sys/net/core/rmem_max')
LOCALHOST_ONLY = 'ROS_LOCALHOST_ONLY'
UNKNOWN = 'unknown'
# Names of Fast DDS's own sets of transports, in words.
_BUILTIN = {
    'DEFAULT': 'UDP and shared memory',
    'DEFAULTv6': 'UDP and shared memory',
    'SHM': 'shared memory',
    'UDPv4': 'UDP',
    'UDPv6': 'UDP',
    'LARGE_DATA': 'UDP, TCP and shared memory',
    'LARGE_DATAv6': 'UDP, TCP and shared memory',
}
# DDS by the begin of a middleware's name, and by the number that RTPS gave its vendor.
_OF_RMW = {
    'rmw_fastrtps': 'Fast DDS',
    'rmw_cyclonedds': 'Cyclone DDS',
    'rmw_connextdds': 'Connext DDS',
}
_VENDORS = {
    b'\x01\x0f': 'Fast DDS',
    b'\x01\x10': 'Cyclone DDS',
    b'\x01\x01': 'Connext DDS',
}


@dataclass(frozen=True, slots=True)
class Transport:
    """The middleware (`rmw`), its transport in words, and net.core.rmem_max in bytes, if known."""

    rmw: str
    transport: str
    rmem_max: int | None

    def values(self) -> dict[str, object]:
        """Return them as values of diagnostics."""
        room = UNKNOWN if self.rmem_max is None else self.rmem_max
        return {'rmw': self.rmw, 'transport': self.transport, 'rmem_max': room}


def transport_now() -> Transport:
    """Return how messages reach this process; rclpy must be initialised by `executor.ros`."""
    rmw = get_rmw_implementation_identifier()
    return Transport(rmw, transport_of(rmw, os.environ), _rmem_max())


def transport_of(rmw: str, environment: Mapping[str, str]) -> str:
    """Return the transports that a middleware opens by the environment, in words."""
    if not rmw.startswith('rmw_fastrtps'):
        return f'{UNKNOWN}: as {rmw} is configured'
    profiles = next((environment[name] for name in PROFILES if environment.get(name)), '')
    if profiles == LOOPBACK:
        return 'UDP on 127.0.0.1'
    if profiles:
        return f'{UNKNOWN}: as {profiles} says'
    chosen = environment.get(TRANSPORT) or 'DEFAULT'
    words = _BUILTIN.get(chosen.partition('?')[0], f'{UNKNOWN}: {TRANSPORT}={chosen}')
    local = environment.get(RANGE) == 'LOCALHOST' or environment.get(LOCALHOST_ONLY) == '1'
    if local and 'shared memory' not in words:
        return f'{words} and shared memory'  # which this range adds
    return words


def vendor_of(rmw: str) -> str:
    """Return the name of the DDS behind a middleware; '' where it is none that is known."""
    return next((name for start, name in _OF_RMW.items() if rmw.startswith(start)), '')


def vendor_by(gid: bytes) -> str:
    """Return the name of the DDS of an endpoint by its GID, which begins with its vendor's number.

    '' where it is none that is known.
    """
    return _VENDORS.get(gid[:2], '')


def _rmem_max() -> int | None:
    try:
        return int(RMEM_MAX.read_text(encoding='ascii'))
    except (OSError, ValueError):
        return None
