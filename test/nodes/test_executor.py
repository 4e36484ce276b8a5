"""The process of a node: which transports of Fast DDS it opens."""

import json
import os
import subprocess
import sys

import pytest

from ugv_acceptance.nodes.executor import (
    LOOPBACK,
    PROFILES,
    RANGE,
    TRANSPORT,
    UDP,
    choose_transport,
)

# Says which files of shared memory a node's process holds open, and where its sockets listen.
PROGRAM = """
import json, os, rclpy
from ugv_acceptance.nodes.executor import ros
with ros():
    node = rclpy.create_node('looked_at')
    held = [os.readlink(entry.path) for entry in os.scandir('/proc/self/fd') if entry.is_symlink()]
    sockets = [line.split() for line in open('/proc/net/udp')][1:]
    bound = [words[1].split(':')[0] for words in sockets if f'socket:[{words[9]}]' in held]
    shared = [path for path in held if path.startswith('/dev/shm/fast')]
    print(json.dumps({'shared': shared, 'bound': bound}))
"""
# 127.0.0.1 as /proc/net/udp writes it.
LOOPBACK_ADDRESS = f'{int.from_bytes(bytes([127, 0, 0, 1]), sys.byteorder):08X}'


def opened(**choice: str) -> dict[str, list[str]]:
    """Return what a process of ours opens that is told so: `shared` memory, `bound` addresses."""
    chosen = {TRANSPORT, *PROFILES, RANGE, '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    environment = {k: v for k, v in os.environ.items() if k not in chosen} | choice
    done = subprocess.run(
        [sys.executable, '-c', PROGRAM], capture_output=True, text=True, check=True, env=environment
    )
    found: dict[str, list[str]] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize('discovery', ['LOCALHOST', 'SUBNET'])
def test_no_node_of_ours_shares_memory_with_others(discovery: str) -> None:
    """A process that stops inside a shared queue cannot hold up a monitor that opens none."""
    assert not opened(**{RANGE: discovery})['shared']


@pytest.mark.parametrize('discovery', ['LOCALHOST', 'SUBNET'])
def test_shared_memory_is_there_for_who_asks(discovery: str) -> None:
    """A user who chooses shared memory gets it; this also shows that the check finds it."""
    assert opened(**{TRANSPORT: 'DEFAULT', RANGE: discovery})['shared']


@pytest.mark.parametrize('name', [TRANSPORT, *PROFILES])
def test_a_choice_that_was_made_is_kept(name: str) -> None:
    """Transports or profiles that somebody set stay as they are, and so does the range."""
    given = {name: 'theirs', RANGE: 'LOCALHOST'}
    environment = dict(given)
    choose_transport(environment)
    assert environment == given


def test_who_names_peers_on_other_machines_reaches_them() -> None:
    """If peers on other machines are named, the range is not limited to this machine."""
    given = {RANGE: 'LOCALHOST', 'ROS_STATIC_PEERS': '192.0.2.7'}
    environment = dict(given)
    choose_transport(environment)
    assert environment == given | {TRANSPORT: UDP}


def test_the_range_asked_for_later_is_taken() -> None:
    """A process that begins anew on a domain of its own machine leaves shared memory out again."""
    environment = {RANGE: 'LOCALHOST'}
    choose_transport(environment)
    environment[RANGE] = 'LOCALHOST'
    choose_transport(environment)
    assert environment == dict.fromkeys(PROFILES, LOOPBACK) | {RANGE: 'SUBNET'}


def test_only_the_addresses_of_this_machine_are_heard() -> None:
    """With discovery range LOCALHOST a node binds no address that other machines can reach."""
    assert set(opened(**{RANGE: 'LOCALHOST'})['bound']) == {LOOPBACK_ADDRESS}


def test_other_machines_are_heard_by_default() -> None:
    """Without a discovery range a node binds every address, as the same check shows."""
    assert '00000000' in opened()['bound']
