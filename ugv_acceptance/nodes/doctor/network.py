"""Findings about the network: transport, room in the kernel's buffers, discovery, middlewares."""

from collections.abc import Iterator

from ugv_acceptance.inspection.heard import OK, WARN, Finding, Heard
from ugv_acceptance.nodes.doctor.probe import Surroundings
from ugv_acceptance.nodes.transport import Transport, vendor_of

# Room (s) for messages that come while this process stands still, below which it is small.
LEAST = 1.0
# net.core.rmem_max (bytes) that a message takes, measured: docs/decisions/0005-transport.md.
TAKEN = 710
# What the sockets ask for (bytes), and what gives it to them.
ASKED = 4_194_304
ENLARGE = f'sysctl -w net.core.rmem_max={ASKED}, and put it into /etc/sysctl.d'


def network(around: Surroundings) -> Iterator[Finding]:
    """Yield the findings about the network; none of a recording."""
    if around.transport is None:
        return
    inputs = [heard for heard in (around.joint_states, around.imu) if heard is not None]
    yield _room(around.transport, sum(map(_rate, inputs)))
    yield _discovery(around)
    yield from _middlewares(around.transport, inputs)


def _rate(heard: Heard) -> float:
    times = heard.times
    return (len(times) - 1) * 1e9 / (times[-1] - times[0]) if len(times) > 1 else 0.0


def _room(transport: Transport, rate: float) -> Finding:
    """Return whether the kernel's buffers are large enough for `rate` messages a second."""
    how, room = f'{transport.rmw}: {transport.transport}', transport.rmem_max
    if room is None:
        return Finding(OK, 'transport', f'{how}; net.core.rmem_max is not known here')
    seen = f'{how}; net.core.rmem_max {room}'
    if rate == 0.0 or 'UDP' not in transport.transport:
        return Finding(OK, 'transport', seen)
    seconds = min(room, ASKED) / (TAKEN * rate)
    seen += f': room for about {seconds:.1f} s of {rate:.0f} messages a second'
    if seconds >= LEAST or room >= ASKED:
        return Finding(OK, 'transport', seen)
    return Finding(WARN, 'transport', seen, ENLARGE)


def _discovery(around: Surroundings) -> Finding:
    """Return who can find whom: every node has to have the same settings."""
    seen = f'ROS_DOMAIN_ID {around.domain}, range {around.discovery}'
    seen += f', peers {around.peers}' if around.peers else ''
    if around.server:
        seen += f', ROS_DISCOVERY_SERVER {around.server}'
        return Finding(OK, 'discovery', seen, 'let every node name the same server')
    if around.discovery == 'OFF':
        do = 'set ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET, or ROS_STATIC_PEERS'
        return Finding(OK if around.peers else WARN, 'discovery', seen, '' if around.peers else do)
    return Finding(OK, 'discovery', seen)


def _middlewares(transport: Transport, inputs: list[Heard]) -> Iterator[Finding]:
    """Yield the publishers of inputs whose middleware is another than this one."""
    own = vendor_of(transport.rmw)
    for heard in inputs:
        others = {node: vendor for node, vendor in heard.vendors.items() if vendor != own}
        if own and others:
            named = ', '.join(f'{node} ({vendor})' for node, vendor in sorted(others.items()))
            seen = f'this is {own}; {heard.topic} comes from {named}'
            yield Finding(WARN, 'middleware', seen, 'set one RMW_IMPLEMENTATION for all nodes')
