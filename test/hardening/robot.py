"""A robot's driver as a process of its own: publishes both inputs as it is told, counts them.

The one argument is a Task as JSON. It prints "ready" and the time (ns) once its publishers are
there, "joined" and the time once it is listened to, and at the end a Sent as JSON. On stdin it
takes the name of a kind of fault, which then lasts, or "end".
"""

import json
import math
import struct
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from threading import Thread
from typing import Any

import rclpy
from geometry_msgs.msg import InertiaStamped
from sensor_msgs.msg import Imu, JointState

from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr
from ugv_acceptance.bag.raw import Offered
from ugv_acceptance.nodes.bag_player import qos_of
from ugv_acceptance.nodes.executor import end

NAMES = ('turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint')
# Folded; the arm stretched out, which with LOAD (kg) in the hand is too much for the shoulder.
CALM, REACH = (0.0, 2.0, -2.5, 2.0), (0.0, 0.0, 0.0, 0.0)
LOAD = 2.2
STAMP = struct.Struct('<iI')
NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Task:
    """What to publish: rates (Hz), how long (s; 0: until told), faults (start, end, kind) in s.

    It begins when each input has so many `listeners`.
    """

    name: str = 'robot'
    joints_hz: float = 100.0
    imu_hz: float = 100.0
    seconds: float = 0.0
    faults: tuple[tuple[float, float, str], ...] = ()
    reliable: bool = True
    listeners: int = 0


@dataclass
class Sent:
    """Messages of each input, when (ns) each fault's first one was published, and the last one."""

    joints: int = 0
    imu: int = 0
    load: int = 0
    ended: int = 0
    began: list[tuple[str, int]] = field(default_factory=list)


def joints_of(kind: str) -> bytearray | None:
    """Return the joint states while something goes wrong; None: none."""
    if kind in ('silent joints', 'mute'):
        return None
    names: tuple[str, ...] = NAMES
    q: tuple[float, ...] = REACH if kind in ('overload', 'jolt') else CALM
    if kind == 'half':
        names, q = NAMES[:2], CALM[:2]
    if kind == 'nan':
        q = (math.nan, *CALM[1:])
    data = bytearray(joint_state_cdr(0, 'base_link', names, q, [0.0] * len(q), ()))
    return data[:-9] if kind == 'garbage' else data


def imu_of(kind: str) -> bytearray | None:
    """Return the IMU message while something goes wrong; None: none."""
    if kind in ('silent imu', 'mute'):
        return None
    force = (-0.196, 0.392, 9.8)
    return bytearray(imu_cdr(0, 'imu_link', (0.02, 0.01, 0.0, 0.99975), (0.0,) * 3, force))


def load_of(kind: str) -> bytearray | None:
    """Return the message of the load in the hand."""
    return None if kind == 'mute' else bytearray(inertia_cdr(0, 'gripper_link', LOAD, (0.0,) * 3))


@dataclass
class Stream:
    """One input; `due` is when the next message goes out (ns since the start)."""

    publish: Callable[[bytes], None]
    make: Callable[[str], bytearray | None]
    period: float
    due: float = 0.0
    sent: int = 0
    _made: dict[str, bytearray | None] = field(default_factory=dict)

    def publish_until(self, elapsed: float, kind: str) -> None:
        """Publish what is due, stamped with the time of publishing."""
        while self.due <= elapsed:
            self.due += self.period
            if kind not in self._made:
                self._made[kind] = self.make(kind)
            data = self._made[kind]
            if data is not None:
                stamp = 0 if kind == 'clock' else time.time_ns()
                STAMP.pack_into(data, 4, stamp // NS, stamp % NS)
                self.publish(bytes(data))
                self.sent += 1


def main() -> None:
    """Publish until the time is over or stdin says so."""
    words = json.loads(sys.argv[1])
    task = Task(**(words | {'faults': tuple(map(tuple, words['faults']))}))
    rclpy.init()
    node = rclpy.create_node(task.name)
    qos = qos_of(Offered('reliable' if task.reliable else 'best_effort'))
    publishers: list[Any] = [
        node.create_publisher(JointState, 'joint_states', qos),
        node.create_publisher(Imu, 'imu/data', qos),
    ]
    load = node.create_publisher(InertiaStamped, 'payload', 10)
    say(f'ready {time.time_ns()}')
    while min(p.get_subscription_count() for p in publishers) < task.listeners:
        time.sleep(0.01)
    say(f'joined {time.time_ns()}')
    streams = [
        Stream(publishers[0].publish, joints_of, NS / task.joints_hz),
        Stream(publishers[1].publish, imu_of, NS / task.imu_hz),
        Stream(load.publish, load_of, NS),
    ]
    sent = Sent()
    publish_all(task, streams, sent)
    sent.ended = time.time_ns()
    time.sleep(3.0 if task.seconds else 0.0)  # what is on its way arrives
    sent.joints, sent.imu, sent.load = (stream.sent for stream in streams)
    say(json.dumps(asdict(sent)))
    end(node)
    rclpy.shutdown()


def say(text: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f'{text}\n')
    sys.stdout.flush()


def publish_all(task: Task, streams: list[Stream], sent: Sent) -> None:
    """Publish at the rates until the end, with the faults planned and those told."""
    told = ['']
    Thread(target=lambda: told.extend(map(str.strip, sys.stdin)), daemon=True).start()
    start, last = time.monotonic_ns(), ''
    while told[-1] != 'end':
        elapsed = time.monotonic_ns() - start
        if task.seconds and elapsed >= task.seconds * NS:
            return
        planned = [k for a, b, k in task.faults if a * NS <= elapsed < b * NS]
        kind = planned[0] if planned else told[-1]
        if kind != last:
            last = kind
            sent.began.append((kind, time.time_ns()))
        for stream in streams:
            stream.publish_until(elapsed, kind)
        wait = min(stream.due for stream in streams) - (time.monotonic_ns() - start)
        if wait > 20_000:
            time.sleep((wait - 10_000) * 1e-9)


if __name__ == '__main__':
    main()
