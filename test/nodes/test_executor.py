"""The process of a node: the transports of Fast DDS it opens, and how its messages are taken."""

import gc
import json
import os
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from nodes.live_case import Live

import ugv_acceptance
from ugv_acceptance.config import load
from ugv_acceptance.nodes.console_feed import ConsoleNode
from ugv_acceptance.nodes.executor import (
    LOOPBACK,
    PROFILES,
    RANGE,
    TRANSPORT,
    UDP,
    Stop,
    choose_transport,
    spin,
    spun_by_thread,
    take_what_came,
)
from ugv_acceptance.nodes.monitor.node import Monitor

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


def test_all_that_is_due_is_taken_in_one_go(live: Live) -> None:
    """What is due runs in its order; what that asks for waits for the next time."""
    ran: list[int] = []

    def work(number: int) -> None:
        ran.append(number)
        if number < 3:
            live.executor.create_task(work, number + 3)

    for number in range(3):
        live.executor.create_task(work, number)
    take_what_came(live.executor)
    assert ran == [0, 1, 2]
    take_what_came(live.executor)
    assert ran == [0, 1, 2, 3, 4, 5]


def test_a_monitor_that_is_deactivated_while_a_driver_comes_goes_on(live: Live) -> None:
    """What DDS said of an input waits for its turn when the input ends: the monitor spins on."""
    monitor: Any = Monitor(lambda *_: None)
    monitor.bring_up()
    turns, drivers = 0, list[Any]()

    def until() -> bool:
        nonlocal turns
        turns += 1
        if turns == 2:
            drivers.append(live.driver('late'))
            while not drivers[0].connected() or not monitor.count_publishers('joint_states'):
                time.sleep(0.01)
            time.sleep(0.5)  # the executor, which waits for this callback, is told a little later
            monitor.trigger_deactivate()
        if turns == 4:
            monitor.trigger_activate()
        return turns == 6

    try:
        spin(monitor, Stop(), until)
        assert monitor.session is not None
        take_what_came(live.executor)
    finally:
        monitor.destroy_node()


def test_a_thread_that_takes_messages_ends_with_its_block(live: Live) -> None:
    """A thread that was told to wait an hour for messages ends as soon as it is not needed."""
    driver = live.driver()
    live.executor.remove_node(driver)
    with spun_by_thread(driver):
        pass
    live.executor.add_node(driver)


def test_a_console_that_is_open_for_weeks_needs_no_more_memory() -> None:
    """Frames leave no objects behind: of some hundreds in turn, those that nothing else filled."""
    console = ConsoleNode(load())
    try:
        held = [objects_after(console, 300) for _ in range(6)]
        assert min(after - before for before, after in pairwise(held)) < 100
    finally:
        console.close()


def objects_after(console: Any, frames: int) -> int:
    """Return how many blocks of memory Python holds after so many frames."""
    for _ in range(frames):
        console.snapshot()
    gc.collect()
    return sys.getallocatedblocks()


def test_only_the_executor_makes_the_call_that_leaks() -> None:
    """Each spin_until_future_complete of EventsExecutor leaks; one module makes it, seldom."""
    code = Path(ugv_acceptance.__file__).parent
    calling = [
        path.name
        for path in code.rglob('*.py')
        if 'spin_until_future_complete(' in path.read_text(encoding='utf-8')
    ]
    assert calling == ['executor.py']
