"""The console's live feed: the monitor's verdict and the inputs behind it.

Verdict and alerts are the monitor's: while it is silent the console shows NO DATA. The numbers are
computed here from the same inputs by the same code, so that a page costs the monitor nothing.
Messages are taken in bursts, just before a frame: a thread that wakes for each message would cost
twice as much and show it no sooner.
"""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

from ugv_acceptance.config import Config
from ugv_acceptance.console import latest_messages as hearing
from ugv_acceptance.console.alert_list import AlertBook, row_of
from ugv_acceptance.console.monitor_values import countdown_of, number_of
from ugv_acceptance.console.snapshot import (
    NO_LOAD,
    NO_PAYLOAD,
    AlertRow,
    Awaited,
    InputRow,
    Memory,
    Snapshot,
)
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR
from ugv_acceptance.evaluation.alerts.messages import advice
from ugv_acceptance.evaluation.alerts.state_machine import OK, STALE, Alert
from ugv_acceptance.monitoring.receipt_clock import StampShift
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.console_operator import ConsoleOperator
from ugv_acceptance.nodes.executor import Stop, keep_objects, ros, take_what_came
from ugv_acceptance.nodes.monitor.publishers import LATCHED
from ugv_acceptance.nodes.monitor.subscriptions import Inputs
from ugv_acceptance.nodes.operator_client import MONITOR

# Seconds without a verdict (it comes each second), and without margins while inputs arrive, until
# the monitor counts as silent.
VERDICT_SILENCE = 2.5
MARGIN_SILENCE = 0.5
# Messages of an input that may wait for the next snapshot.
_DEPTH = 400
# Seconds between checks of the inputs by the console itself. Silence is checked in each snapshot
# for which nothing new came.
_LOOK = 0.5


class ConsoleNode(Node):
    """A node without a thread: takes messages of robot and monitor when a snapshot is asked for."""

    def __init__(self, config: Config, **node: Any) -> None:  # noqa: ANN401 - handed on to rclpy
        super().__init__('acceptance_console', **node)
        self.config, self.settings = config, config.settings
        self.book, self.memory = AlertBook(), Memory()
        self.verdict: DiagnosticStatus | None = None
        self.said: dict[str, str] = {}
        self.heard, self.margins = hearing.Heartbeat(), hearing.Heartbeat()
        self.session = Session(
            self.settings,
            lambda _stamp, _margins: None,
            self._take_own,
            self._complain,
            stamps=StampShift(bool(self.get_parameter('use_sim_time').value)),
        )
        session = self.session
        joints = hearing.Newest(session.take_joint_state, hearing.newest_of_joints())
        imu = hearing.Newest(session.take_imu, hearing.newest_attitude(self.settings.imu))
        session.take_joint_state, session.take_imu = joints, imu
        both = {'joint_states': joints, 'imu': imu}
        self._heard = {name: newest for name, newest in both.items() if name in session.counts}
        self._inputs = Inputs(self, config.topics, session, _DEPTH)
        self._due = self._look_due = 0.0
        self._own: dict[str, AlertRow] = {}
        self._rows: tuple[InputRow, ...] = ()
        self._known_since: float | None = None
        self.create_subscription(DiagnosticStatus, f'{MONITOR}/verdict', self._on_verdict, LATCHED)
        self.create_subscription(DiagnosticArray, f'{MONITOR}/alerts', self._on_alerts, 50)
        self.create_subscription(
            JointState, f'{MONITOR}/stability', self._beat, qos_profile_sensor_data, raw=True
        )
        self._executor = EventsExecutor()
        self._operator = ConsoleOperator(self, config, session, self.book)
        self._executor.add_node(self)

    def describe(self) -> dict[str, Any]:
        """Return the source of the numbers: the live robot, and its namespace."""
        where = self.get_namespace()
        return {'source': 'live', 'title': 'live' if where == '/' else f'live {where}'}

    def extra(self) -> dict[str, Any]:
        """Return nothing, because a live robot adds nothing to a frame."""
        return {}

    def snapshot(self) -> Snapshot:
        """Process the messages that came since the last call and return the present state."""
        take_what_came(self._executor)
        silent = not all(newest.waiting for newest in self._heard.values())
        for name, newest in self._heard.items():
            # The count is read after what is handed on was counted, never before.
            left_out = newest.hand_on()
            self.session.counts[name].taken += left_out
        now, stamps = time.monotonic(), self.session.stamps
        if stamps.simulated:
            stamps.follow(self.session.clock.now(), self.get_clock().now().nanoseconds)
        if now >= self._due:
            self._due = now + 1.0
            self._every_second()
        if silent or now >= self._look_due:
            self._look_due = now + _LOOK
            self._look_around()
        return self.memory.keep(self._look(now))

    def command(self, do: str, values: dict[str, Any]) -> Awaited:
        """Ask the monitor for what an operator wants; snapshots bring the answer."""
        return self._operator.command(do, values)

    def _beat(self, _: bytes) -> None:
        self.margins.beat(time.monotonic())

    def _on_verdict(self, status: DiagnosticStatus) -> None:
        self.verdict = status
        self.heard.beat(time.monotonic())
        self.said = values = {pair.key: pair.value for pair in status.values}
        none = values.get('alerts_active') == values.get('alerts_unacknowledged') == '0'
        if none and 'code' not in values:
            self.book.clear()
        self._operator.follow_load(self.said)

    def _on_alerts(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            self.book.take(values, status.message)

    def _take_own(self) -> None:
        self.session.alarm_tracker.take()

    def _complain(self, text: str) -> None:
        self.get_logger().warning(text, throttle_duration_sec=5.0)

    def _every_second(self) -> None:
        self._inputs.look_around([])
        self.session.measure_rates()
        self._operator.say_load()

    def _look_around(self) -> None:
        """Advance the evaluation's time, and update active alerts and the state of the inputs."""
        self.session.tick()
        active = self.session.active
        say = self.session.faults.sentence
        rows = [
            row_of(a, say(a, self.settings), advice(a.rule.code, self.settings.robot))
            for a in active
        ]
        self._own = {row.key: row for row in rows}
        self._rows = tuple(self._input(name, active) for name in self.session.counts)

    def _problem(self, now: float) -> str:
        """Return why the margins are not to be trusted; '' while the monitor is alive."""
        margins = self.session.evaluator.margins
        if margins is None:
            self._known_since = None
        elif self._known_since is None:
            self._known_since = now
        if self.verdict is None:
            return 'no monitor is heard: start `ugv-acceptance monitor`'
        since = now - (self.heard.last or 0.0)
        if since > VERDICT_SILENCE:
            return f'the monitor has been silent for {since:.0f} s'
        arriving = self._known_since is not None and now - self._known_since > MARGIN_SILENCE
        if arriving and self.margins.silent(now, MARGIN_SILENCE):
            return 'the monitor is silent although its inputs arrive'
        level = ord(self.verdict.level) if isinstance(self.verdict.level, bytes) else STALE
        # A verdict from before margins were lost says that they are kept: it is no reason. If there
        # is an alert, it says better what is missing and what to do.
        told = any(row.level == STALE and row.end is None for row in self.book.rows.values())
        if told or level != STALE:
            return ''
        return hearing.problem_of(self.verdict.message, self.said, self.settings)

    def _look(self, now: float) -> Snapshot:
        evaluator, problem = self.session.evaluator, self._problem(now)
        margins, joints = evaluator.margins, evaluator.joints
        alerts = tuple(map(self._newest, self.book.also(self._own.values())))
        told = () if problem and self.verdict is None else alerts
        moment, rows = self.session.clock.now(), self._rows
        lamps = self._lamps(now)
        if margins is None or problem or self.verdict is None:
            q = tuple(joints.q)
            load = evaluator.payload or NO_LOAD
            known = Snapshot(moment, STALE, problem, q=q, payload=load, alerts=told, inputs=rows)
            return replace(known, **lamps)
        return Snapshot(
            moment,
            self.verdict.level[0],
            '',
            known=True,
            q=margins.q,
            effort=tuple(joints.effort),
            gravity=margins.gravity,
            torque=margins.torque,
            angle=tuple(float(a) for a in margins.angle),
            state=int(margins.state),
            payload=evaluator.payload,
            alerts=told,
            inputs=rows,
            hints=hearing.hints_of(self.said),
            stamp=margins.stamp,
            rough='trend' in self.said,
            cautious=math.radians(number_of(self.said, 'cautious_deg')),
            carried='trend' not in self.said and evaluator.carried,
            countdown=countdown_of(self.said, now - (self.heard.last or now)),
            **lamps,
        )

    def _lamps(self, now: float) -> dict[str, Any]:
        """Return what the verdict tells beside the margins: of a monitor that is alive."""
        if self.heard.last is None or now - self.heard.last > VERDICT_SILENCE:
            return {}
        return {
            'ground': self.said.get('ground', ''),
            'black_box': self.said.get('black_box', ''),
            'running': number_of(self.said, 'active_s'),
        }

    def _newest(self, row: AlertRow) -> AlertRow:
        """Return an active alert with its worst value until now and the newest advice."""
        if row.end is not None:
            return row
        about = (self.said.get('code'), self.said.get('subject')) == (row.code, row.subject)
        advice = self.said.get('do', row.advice) if about else row.advice
        advice = STAND_CLEAR if self.session.advisory.tipped else advice
        own = self._own.get(row.key, row)
        return replace(row, text=own.text, advice=advice, worst=own.worst, peak=own.peak)

    def _input(self, name: str, active: list[Alert]) -> InputRow:
        count, now = self.session.counts[name], self.session.clock.now()
        unknown = float('nan') if count.taken else 0.0
        mine = [a for a in active if a.rule.subject == name]
        silent = STALE if not count.taken and name != 'payload' else OK
        sentences = [self.session.faults.sentence(a, self.settings) for a in mine]
        optional = NO_PAYLOAD if name == 'payload' and not count.taken else ''
        return InputRow(
            name,
            self._inputs.subscriptions[name].topic_name,
            max([a.rule.level for a in mine], default=silent),
            self.session.rates.get(name, unknown),
            (now - count.last) / 1e9 if count.taken else float('nan'),
            tuple(self._inputs.publishers.get(name, ())),
            '; '.join(sentences) or optional,
        )

    def close(self) -> None:
        """Destroy the node and its executor."""
        self._executor.remove_node(self)
        self._executor.shutdown()
        self.destroy_node()


@contextmanager
def live_feed(config: Config, args: list[str] | None = None) -> Iterator[tuple[ConsoleNode, Stop]]:
    """Run the console's node; yield it, and the object that says when to stop."""
    with ros(args) as stop:
        node = ConsoleNode(config)
        keep_objects()
        try:
            yield node, stop
        finally:
            node.close()
