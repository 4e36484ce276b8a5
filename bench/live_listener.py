"""One of the listeners compared by bench_live.py; prints CPU, latencies and counts as JSON.

Arguments: which listener, and the checkout whose code it is to run.
"""

import json
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState

sys.path.insert(0, str(Path(sys.argv[2]).resolve()))
from bench.naive_monitor import NaiveMonitor, best_effort
from ugv_acceptance.nodes.executor import end, ros, spin
from ugv_acceptance.nodes.monitor.node import Monitor

STAMP = struct.Struct('<iI')
DEPTH = 1000
# Time (ns) left out at the start: first calls compile, fill caches and raise alerts, and what the
# efforts mean is worked out for the first time.
WARM = 4_000_000_000


class Tally:
    """Latencies (ns) of the messages, and since the warm-up their number and the CPU time.

    `heard` are all messages handled; `cpu` is the process's time (s) at its end, `began` when the
    first message was sent (ns).
    """

    def __init__(self) -> None:
        self.latencies: list[int] = []
        self.cpu = 0.0
        self.heard = self.began = 0

    def seen(self, stamp: int) -> None:
        """Record the latency of a handled message by its stamp (ns)."""
        self.heard += 1
        self.began = self.began or stamp
        if self.cpu:
            self.latencies.append(time.time_ns() - stamp)
        elif stamp - self.began > WARM:
            self.cpu = time.process_time()

    def raw(self, data: bytes) -> None:
        """Take a message as bytes."""
        sec, nanosec = STAMP.unpack_from(data, 4)
        self.seen(sec * 1_000_000_000 + nanosec)

    def decoded(self, message: Any) -> None:  # noqa: ANN401 - of either type
        """Take a message object."""
        self.seen(message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec)


def empty(tally: Tally, *, raw: bool) -> Node:
    """Return a node that only subscribes."""
    node = rclpy.create_node('empty')
    qos = best_effort(DEPTH)
    take = tally.raw if raw else tally.decoded
    node.create_subscription(JointState, 'joint_states', take, qos, raw=raw)
    node.create_subscription(Imu, 'imu/data', take, qos, raw=raw)
    return node


def monitor(tally: Tally) -> Node:
    """Return the monitor, which publishes every margin."""
    node = Monitor()
    node.bring_up()
    session = node.session
    if session is None:
        sys.exit('expected an active monitor')
    publish = session.on_margins

    def margins(stamp: int, found: Any) -> None:  # noqa: ANN401 - of any version
        tally.seen(stamp)
        publish(stamp, found)

    session.on_margins = margins
    return node


MODES: dict[str, Callable[[Tally], Any]] = {
    'raw': lambda tally: empty(tally, raw=True),
    'decoded': lambda tally: empty(tally, raw=False),
    'monitor': monitor,
    'naive': lambda tally: NaiveMonitor(tally.seen, DEPTH),
}


def main() -> None:
    """Listen until SIGINT."""
    mode = sys.argv[1]
    tally = Tally()
    with ros() as stop:
        node = MODES[mode](tally)
        if mode == 'naive':
            executor: Any = SingleThreadedExecutor()
            executor.add_node(node)
            while not stop.asked:
                executor.spin_once(timeout_sec=0.5)
        else:
            spin(node, stop)
        cpu = time.process_time() - tally.cpu
        # The monitor's first messages cannot have margins: the other input has not come yet.
        taken = tally.heard
        if isinstance(node, Monitor) and node.session is not None:
            taken = sum(count.taken for count in node.session.counts.values())
        told = {'cpu': cpu, 'taken': taken, 'latencies': tally.latencies}
        print(json.dumps(told), flush=True)
        end(node)


main()
