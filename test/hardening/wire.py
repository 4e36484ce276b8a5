"""Real processes joined by real DDS: a robot's driver, the monitor, and who listens to both."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from hardening.outcome import memory
from hardening.robot import STAMP, Task
from nodes.live_case import WARN, Live, live_nodes, ros_context
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState

from ugv_acceptance.bag.raw import Offered
from ugv_acceptance.nodes.bag_player import qos_of
from ugv_acceptance.nodes.monitor.publishers import LATCHED

HERE = Path(__file__).parents[1]
MONITOR = 'from ugv_acceptance.nodes.monitor.node import main; main()'
NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Heard:
    """A change of an alert: when the monitor said so (ns, its stamp), and when that was heard (ns).

    `values` are the status's, by key.
    """

    time: int
    heard: int
    message: str
    values: dict[str, str]

    def says(self, how: str, code: str, subject: str = '') -> bool:
        """Return whether an alert of this code and subject (any) was raised or cleared."""
        of = self.values
        return of['state'] == how and of['code'] == code and of['subject'].startswith(subject)


class Ears(Node):
    """A node that records what robot and monitor publish. `last` are the newest stamps (ns)."""

    def __init__(self, namespace: str = '', *, inputs: bool = True) -> None:
        super().__init__('ears', namespace=namespace)
        self.alerts: list[Heard] = []
        self.verdicts: list[DiagnosticStatus] = []
        self.diagnostics: dict[str, dict[str, str]] = {}
        self.last = {'joint_states': 0, 'imu': 0}
        at, quick = 'acceptance_monitor', qos_of(Offered('best_effort'))
        self.create_subscription(DiagnosticStatus, f'{at}/verdict', self.verdicts.append, LATCHED)
        self.create_subscription(DiagnosticArray, f'{at}/alerts', self._take_alerts, 50)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._take_diagnostics, 50)
        kinds: tuple[tuple[str, Any, str], ...] = (
            ('joint_states', JointState, 'joint_states'),
            ('imu', Imu, 'imu/data'),
        )
        for name, kind, topic in kinds if inputs else ():
            self.create_subscription(kind, topic, self._stamped(name), quick, raw=True)

    def _stamped(self, name: str) -> Callable[[bytes], None]:
        def take(data: bytes) -> None:
            sec, nanosec = STAMP.unpack_from(data, 4)
            self.last[name] = sec * NS + nanosec

        return take

    def _take_alerts(self, message: DiagnosticArray) -> None:
        when = message.header.stamp.sec * NS + message.header.stamp.nanosec
        for status in message.status:
            values = {v.key: v.value for v in status.values}
            self.alerts.append(Heard(when, time.time_ns(), status.message, values))

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.diagnostics[status.name] = {v.key: v.value for v in status.values}

    def of_input(self, name: str) -> dict[str, str]:
        """Return the newest diagnostics of an input; empty before any came."""
        return self.diagnostics.get(f'acceptance_monitor: Input {name}', {})

    def first(self, how: str, code: str, subject: str = '') -> Heard | None:
        """Return the first change of an alert that says so."""
        return next((heard for heard in self.alerts if heard.says(how, code, subject)), None)

    def open(self, code: str, subject: str) -> Heard | None:
        """Return the last change of an alert if it raised it: it has not been cleared since."""
        said = [h for h in self.alerts if h.says('raised', code, subject)]
        over = [h for h in self.alerts if h.says('cleared', code, subject)]
        return said[-1] if said and (not over or over[-1].time < said[-1].time) else None


def environment() -> dict[str, str]:
    """Return the environment of children: the wheels' loader must start anew in each."""
    found = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    return found | {'PYTHONPATH': os.pathsep.join([str(HERE), found.get('PYTHONPATH', '')])}


@contextmanager
def child(*words: str) -> Iterator['subprocess.Popen[str]']:
    """Run Python with these words for a while, its stdin and stdout joined to us."""
    pipe = subprocess.PIPE
    process = subprocess.Popen(
        [sys.executable, *words], env=environment(), stdin=pipe, stdout=pipe, text=True
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


@contextmanager
def monitor(**parameters: object) -> Iterator['subprocess.Popen[str]']:
    """Run the monitor with these parameters; `__` in a name stands for a dot."""
    words = [
        word
        for name, value in parameters.items()
        for word in ('-p', f'{name.replace("__", ".")}:={value}')
    ]
    with child('-c', MONITOR, '--ros-args', *words, '--') as process:
        yield process


@contextmanager
def robot(task: Task) -> Iterator['subprocess.Popen[str]']:
    """Run a driver as the task says."""
    with child('-m', 'hardening.robot', json.dumps(asdict(task))) as process:
        yield process


def tell(process: 'subprocess.Popen[str]', word: str) -> int:
    """Say a word to a process; return when (ns)."""
    assert process.stdin is not None
    process.stdin.write(f'{word}\n')
    process.stdin.flush()
    return time.time_ns()


def line_of(process: 'subprocess.Popen[str]') -> str:
    """Return the next line that a process prints."""
    assert process.stdout is not None
    return process.stdout.readline()


@contextmanager
def listening(*, inputs: bool = True) -> Iterator[tuple[Live, Ears]]:
    """Give an executor and who listens on it, also to the `inputs` unless told otherwise."""
    with ros_context(), live_nodes() as live:
        ears: Ears = live.add(Ears(inputs=inputs))
        yield live, ears


def running(live: Live, ears: Ears) -> None:
    """Wait until the monitor has margins and nothing is wrong; what was may be unacknowledged."""
    live.until(lambda: ears.verdicts and ears.verdicts[-1].level[0] <= WARN)


def memory_of(process: 'subprocess.Popen[str]') -> float:
    """Return the memory of a process (MB, resident)."""
    return memory(process.pid)
