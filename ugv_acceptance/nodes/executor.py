"""Runs a node on the events executor until it is interrupted, and shuts it down cleanly.

EventsExecutor notices a signal only when a callback runs, so a timer fires twice a second. Its
`spin_until_future_complete` leaks 32 bytes a call, so only this module calls it, once an hour;
its `spin_once` leaks nothing.
"""

import gc
import os
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, MutableMapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import InvalidHandle, InvalidParameterTypeException
from rclpy.executors import Executor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future
from rclpy.utilities import get_rmw_implementation_identifier, ok, try_shutdown

from ugv_acceptance import AcceptanceError, BadConfig
from ugv_acceptance.nodes.ros_arguments import initialise

BAD_INPUT = 2
# Longest time (s) until a signal is noticed.
PATIENCE = 0.5
# Seconds that the executor is given; without a limit it never ends.
LONG = 3600.0
# New objects after which the garbage collector looks while messages come: Python's own number.
_COLLECT_OFTEN = 700
# Seconds after which a thread gives the interpreter to one that waits.
TURN = 0.0002
# Fast DDS takes its transports from this, or from a file of profiles under its new or old name.
TRANSPORT = 'FASTDDS_BUILTIN_TRANSPORTS'
PROFILES = ('FASTDDS_DEFAULT_PROFILES_FILE', 'FASTRTPS_DEFAULT_PROFILES_FILE')
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
# A second of a fast robot's messages finds room, if net.core.rmem_max allows it.
UDP = 'UDPv4?sockets_size=4MB&non_blocking=true'
LOOPBACK = str(Path(__file__).with_name('loopback.xml'))


@dataclass(slots=True)
class Stop:
    """Whether the process was asked to end, and by which signal."""

    asked: bool = False
    signal: int = 0

    def leave(self) -> None:
        """End the process without a result if it was asked to end: see cli/termination.py."""
        if self.asked:
            raise SystemExit(128 + self.signal)


def run(make: Callable[[], Any], args: list[str] | None = None) -> int:
    """Build a node, start it, spin it until SIGINT or SIGTERM; return the exit code."""
    try:
        with ros(args) as stop:
            node = make()
            try:
                node.bring_up()
                spin(node, stop)
            finally:
                end(node)
    except AcceptanceError as error:
        sys.stderr.write(f'ugv-acceptance: {error}\n')
        return BAD_INPUT
    return 0


@contextmanager
def ros(args: list[str] | None = None) -> Iterator[Stop]:
    """Initialise rclpy with signals that only set `asked`, and always shut it down at the end.

    `args` are those behind a program's name: ROS arguments such as remaps among them.
    """
    if not {'HOME', 'ROS_HOME', 'ROS_LOG_DIR'} & set(os.environ):
        os.environ['ROS_LOG_DIR'] = str(Path(tempfile.gettempdir(), 'ros_log'))
    choose_transport(os.environ)
    stop = Stop()

    def ask(number: int, _: object) -> None:
        stop.asked, stop.signal = True, number

    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        initialise(args)
        yield stop
    except InvalidParameterTypeException as error:
        raise BadConfig(f'ROS arguments: {str(error).rpartition(":")[0]}') from None
    finally:
        try_shutdown()
        # Once asked to end, a second Ctrl-C must not break off what is left of it.
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if stop.asked else handler)


def choose_transport(environment: MutableMapping[str, str]) -> None:
    """Switch Fast DDS's shared memory off unless the user chose: docs/decisions/0005-transport.md.

    Its queues are locked between processes: one that stops or dies blocks every publisher.
    """
    chosen = {environment[name] for name in (TRANSPORT, *PROFILES) if name in environment}
    fast_dds = get_rmw_implementation_identifier().startswith('rmw_fastrtps')
    if chosen - {UDP, LOOPBACK} or not fast_dds:
        return
    if environment.get(RANGE) == 'LOCALHOST' and not environment.get('ROS_STATIC_PEERS'):
        # This range brings shared memory of its own, whatever the transports are.
        environment.update(dict.fromkeys(PROFILES, LOOPBACK), **{RANGE: 'SUBNET'})
    elif not chosen:
        environment[TRANSPORT] = UDP


def end(node: Node) -> None:
    """Destroy a node."""
    node.destroy_node()


def _nothing() -> None:
    """Do nothing: its turn shows that those before it had theirs."""


def take_what_came(executor: Executor) -> None:
    """Run every callback that is due now, none that comes meanwhile."""
    last = executor.create_task(_nothing)
    # Where ROS was shut down nothing has its turn any more.
    while not last.done() and ok():
        take_one(executor, 0.0)


def take_one(executor: Executor, seconds: float) -> None:
    """Run one callback, of what is due within some seconds.

    The turn of what was destroyed meanwhile is left out, as rclpy's other executors do: a driver
    may come or go in the moment in which its subscription ends.
    """
    with suppress(InvalidHandle):
        executor.spin_once(timeout_sec=seconds)


def _take_until(executor: Executor, over: Future) -> None:
    """Run callbacks until `over` is done, without those of what was destroyed meanwhile."""
    while not over.done() and ok():
        with suppress(InvalidHandle):
            executor.spin_until_future_complete(over, timeout_sec=LONG)


@contextmanager
def spun_by_thread(node: Node) -> Iterator[None]:
    """Take a node's messages on a thread of its own until the block is left."""
    executor, over = EventsExecutor(), Future()
    executor.add_node(node)

    thread = threading.Thread(target=_take_until, args=(executor, over), daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set_result(None)
        thread.join()
        executor.remove_node(node)
        executor.shutdown()


def keep_objects() -> None:
    """Let the garbage collector look only at objects that come from now on, at few at a time.

    Messages wait while it looks.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(_COLLECT_OFTEN)


def spin(node: Node, stop: Stop, until: Callable[[], bool] = lambda: False) -> None:
    """Spin until the process is asked to stop or `until` returns true (called twice a second)."""
    executor, over = EventsExecutor(), Future()

    def look() -> None:
        if stop.asked or not ok() or until():
            over.set_result(None)

    # Steady: a frozen /clock must not keep the process from ending.
    timer = node.create_timer(PATIENCE, look, clock=Clock(clock_type=ClockType.STEADY_TIME))
    executor.add_node(node)
    keep_objects()
    # A message must not wait the usual 5 ms for a thread that works out advice.
    sys.setswitchinterval(TURN)
    try:
        _take_until(executor, over)
    finally:
        executor.remove_node(node)
        executor.shutdown()
        node.destroy_timer(timer)
