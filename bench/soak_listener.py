"""The listener of bench_soak.py: hears the monitor as a console does, and acts as the operator."""

import struct
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from ugv_acceptance.nodes.monitor.publishers import LATCHED, key_values

NS = 1_000_000_000
STAMP = struct.Struct('<iI')
AT = 'acceptance_monitor'
# Seconds until the operator acknowledges what was raised.
SEEN = 6.0


@dataclass(slots=True)
class Window:
    """What was heard since the last sample: lateness (ms) of margins, seconds between verdicts."""

    late: list[float] = field(default_factory=list)
    gap: float = 0.0
    raised: int = 0
    unexpected: int = 0
    acknowledged: int = 0
    refused: int = 0


class Listener(Node):
    """Subscribes to every output; `expects` says whether an alert may be raised now.

    `counted` are the monitor's messages of an input, whole and malformed; `behind` is how many
    more were sent at that time, by `sent`. `log` is given each change of an alert.
    """

    def __init__(
        self,
        expects: Callable[[str], bool],
        sent: Callable[[], tuple[int, int]],
        log: Callable[[tuple[object, ...]], None],
        *,
        operator: bool,
        markers: bool,
    ) -> None:
        super().__init__('soak')
        self.window, self.behind, self.verdict = Window(), 0, ''
        self._expects, self._sent, self._log, self._operator = expects, sent, log, operator
        self._heard = 0.0
        self._seen: list[tuple[float, dict[str, str]]] = []
        self._hand = self.create_publisher(DiagnosticStatus, f'{AT}/operator', 10)
        take = self.create_subscription
        take(JointState, f'{AT}/static_torque', self._take_margin, 50, raw=True)
        for name in ('torque_margin', 'stability'):
            take(JointState, f'{AT}/{name}', lambda _: None, 10, raw=True)
        if markers:
            take(MarkerArray, f'{AT}/markers', lambda _: None, 10, raw=True)
        take(DiagnosticStatus, f'{AT}/verdict', self._take_verdict, LATCHED)
        take(DiagnosticArray, f'{AT}/alerts', self._take_alerts, 50)
        take(DiagnosticStatus, f'{AT}/operator_answer', self._take_answer, 10)
        take(DiagnosticArray, '/diagnostics', self._take_diagnostics, 50)

    def _take_margin(self, data: bytes) -> None:
        sec, nanosec = STAMP.unpack_from(data, 4)
        self.window.late.append((time.time_ns() - sec * NS - nanosec) / 1e6)

    def _take_verdict(self, status: DiagnosticStatus) -> None:
        now = time.monotonic()
        if self._heard:
            self.window.gap = max(self.window.gap, now - self._heard)
        self._heard, self.verdict = now, status.message

    def _take_alerts(self, message: DiagnosticArray) -> None:
        for status in message.status:
            of = {pair.key: pair.value for pair in status.values}
            expected = True
            if of['state'] == 'raised':
                expected = self._expects(of['code'])
                self.window.raised += 1
                self.window.unexpected += not expected
                if self._operator:
                    self._seen.append((time.monotonic() + SEEN, of))
            told = (of['state'], of['level'], of['code'], of['subject'], status.message)
            self._log((*told, '' if expected else 'UNEXPECTED'))

    def _take_answer(self, status: DiagnosticStatus) -> None:
        done = any(pair.key == 'result' and pair.value == 'done' for pair in status.values)
        self.window.acknowledged += done
        self.window.refused += not done

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        sent, counted = sum(self._sent()), 0
        for status in message.status:
            if status.name in (f'{AT}: Input joint_states', f'{AT}: Input imu'):
                of = {pair.key: pair.value for pair in status.values}
                counted += int(of['messages']) + int(of['malformed'])
        self.behind = sent - counted

    def acknowledge(self) -> None:
        """Acknowledge what was raised some seconds ago."""
        now = time.monotonic()
        due = [of for when, of in self._seen if when <= now]
        self._seen = [(when, of) for when, of in self._seen if when > now]
        for of in due:
            values = {name: of[name] for name in ('code', 'subject', 'level')}
            values['id'] = str(time.time_ns())
            message = DiagnosticStatus(
                name='acknowledge', hardware_id='soak', values=key_values(values)
            )
            self._hand.publish(message)
