"""How messages reach a node: told in diagnostics and judged by the doctor."""

import os
from dataclasses import replace
from typing import Any

import pytest
from nodes.live_case import Live
from nodes.test_doctor import healthy
from rclpy.utilities import get_rmw_implementation_identifier

from ugv_acceptance.inspection.heard import OK, WARN, Finding
from ugv_acceptance.nodes.doctor.network import network
from ugv_acceptance.nodes.doctor.probe import Surroundings
from ugv_acceptance.nodes.executor import LOOPBACK, PROFILES, RANGE, TRANSPORT, choose_transport
from ugv_acceptance.nodes.transport import (
    LOCALHOST_ONLY,
    RMEM_MAX,
    Transport,
    transport_of,
    vendor_by,
)

FAST, CYCLONE = 'rmw_fastrtps_cpp', 'rmw_cyclonedds_cpp'


@pytest.mark.parametrize(
    ('rmw', 'environment', 'words'),
    [
        (FAST, {}, 'UDP and shared memory'),
        (FAST, {TRANSPORT: ''}, 'UDP and shared memory'),
        (FAST, {TRANSPORT: 'SHM'}, 'shared memory'),
        (FAST, {TRANSPORT: 'UDPv4?sockets_size=4MB&non_blocking=true'}, 'UDP'),
        (FAST, {TRANSPORT: 'UDPv4', RANGE: 'LOCALHOST'}, 'UDP and shared memory'),
        (FAST, {TRANSPORT: 'UDPv4', LOCALHOST_ONLY: '1'}, 'UDP and shared memory'),
        (FAST, {TRANSPORT: 'LARGE_DATA'}, 'UDP, TCP and shared memory'),
        (FAST, {TRANSPORT: 'NEW'}, f'unknown: {TRANSPORT}=NEW'),
        (FAST, {PROFILES[0]: LOOPBACK, TRANSPORT: 'SHM'}, 'UDP on 127.0.0.1'),
        (FAST, {PROFILES[1]: '/etc/mine.xml'}, 'unknown: as /etc/mine.xml says'),
        (CYCLONE, {TRANSPORT: 'UDPv4'}, f'unknown: as {CYCLONE} is configured'),
        ('rmw_zenoh_cpp', {}, 'unknown: as rmw_zenoh_cpp is configured'),
    ],
)
def test_the_transport_is_what_the_environment_says(
    rmw: str, environment: dict[str, str], words: str
) -> None:
    """What a middleware other than Fast DDS does, or a file of profiles, is not guessed."""
    assert transport_of(rmw, environment) == words


@pytest.mark.skipif(
    not get_rmw_implementation_identifier().startswith('rmw_fastrtps'), reason='of Fast DDS only'
)
@pytest.mark.parametrize(
    ('before', 'words'), [({}, 'UDP'), ({RANGE: 'LOCALHOST'}, 'UDP on 127.0.0.1')]
)
def test_what_this_package_chooses_is_told(before: dict[str, str], words: str) -> None:
    """Our choice is no shared memory, and it is named as such."""
    environment = dict(before)
    choose_transport(environment)
    assert transport_of(FAST, environment) == words


def test_the_diagnostics_say_how_messages_come(live: Live) -> None:
    """The status Monitor has middleware, transport and the kernel's limit, active or not."""
    live.monitor(autostart=False)
    driver, name = live.driver(), 'acceptance_monitor: Monitor'
    live.until(lambda: name in driver.diagnostics)
    values = {pair.key: pair.value for pair in driver.diagnostics[name].values}
    rmw = get_rmw_implementation_identifier()
    room = RMEM_MAX.read_text(encoding='ascii').strip() if RMEM_MAX.exists() else 'unknown'
    told = values['rmw'], values['transport'], values['rmem_max']
    assert told == (rmw, transport_of(rmw, os.environ), room)


def around(**changes: Any) -> Surroundings:
    """Return a healthy set-up that gets 700 messages a second by UDP, with changes."""
    return replace(healthy(), **{'transport': Transport(FAST, 'UDP', 4_194_304), **changes})


def of(about: str, where: Surroundings) -> Finding:
    """Return the finding about something."""
    (found,) = [finding for finding in network(where) if finding.about == about]
    return found


@pytest.mark.parametrize(
    ('how', 'room', 'level', 'seen'),
    [
        ('UDP', 212_992, WARN, 'room for about 0.4 s of 700 messages a second'),
        ('UDP and shared memory', 212_992, WARN, 'room for about 0.4 s'),
        ('UDP', 4_194_304, OK, 'room for about 8.4 s'),
        ('UDP', 26_214_400, OK, 'room for about 8.4 s'),
        ('shared memory', 212_992, OK, 'shared memory; net.core.rmem_max 212992'),
        ('UDP', None, OK, 'net.core.rmem_max is not known here'),
    ],
)
def test_room_for_messages_is_held_against_their_rate(
    how: str, room: int | None, level: str, seen: str
) -> None:
    """Less than a second of them is CAUTION, with the command that enlarges it."""
    found = of('transport', around(transport=Transport(FAST, how, room)))
    assert (found.level, seen in found.seen) == (level, True)
    assert found.do.startswith('sysctl -w net.core.rmem_max=4194304') == (level == WARN)


@pytest.mark.parametrize(
    ('changes', 'level', 'seen'),
    [
        ({'domain': '42'}, OK, 'ROS_DOMAIN_ID 42, range SUBNET'),
        ({'discovery': 'OFF'}, WARN, 'range OFF'),
        ({'discovery': 'OFF', 'peers': '10.0.0.2'}, OK, 'range OFF, peers 10.0.0.2'),
        ({'server': '10.0.0.1:11811'}, OK, 'ROS_DISCOVERY_SERVER 10.0.0.1:11811'),
    ],
)
def test_who_can_find_whom_is_told(changes: dict[str, Any], level: str, seen: str) -> None:
    """Domain, range, peers and server, which all nodes have to share."""
    found = of('discovery', around(**changes))
    assert (found.level, seen in found.seen) == (level, True)


def test_a_driver_with_another_middleware_is_named() -> None:
    """By the vendor's number in its publisher's GID; nothing is said of one that is alike."""
    where = around()
    assert where.imu is not None
    where.imu.vendors = {'/driver': vendor_by(b'\x01\x0f' + bytes(14))}
    assert [f for f in network(where) if f.about == 'middleware'] == []
    where.imu.vendors = {'/driver': vendor_by(b'\x01\x10' + bytes(14))}
    found = of('middleware', where)
    assert (found.level, found.do) == (WARN, 'set one RMW_IMPLEMENTATION for all nodes')
    assert 'this is Fast DDS; /imu/data comes from /driver (Cyclone DDS)' in found.seen


def test_of_a_recording_no_network_is_judged() -> None:
    """Where nobody listened, nothing is said."""
    assert list(network(around(transport=None))) == []
