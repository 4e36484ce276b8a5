"""Makes the messages that the live monitor would have published for a recording.

Margins and alerts are those of the offline evaluation; verdict and sentences come from the live
monitor's own functions, which are called for the recording's moments one after another.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile

import numpy as np

from ugv_acceptance.bag.blocks import Block, Message, block_of, joined
from ugv_acceptance.bag.encode import JointStateBytes
from ugv_acceptance.bag.encode_views import (
    Diagnosis,
    diagnoses_cdr,
    diagnosis_cdr,
    markers_cdr,
    point_cdr,
    polygon_cdr,
)
from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.summary import ordered
from ugv_acceptance.model.stability import NO_CONTACT, SIDES
from ugv_acceptance.monitoring.alarm_tracker import Event, events_of
from ugv_acceptance.monitoring.diagnostics import Status, alert_status, margin_statuses, verdict_of
from ugv_acceptance.monitoring.drawing import (
    LIFETIME,
    PERIOD,
    Figure,
    figure_of,
    shapes_of,
    skeleton_of,
)
from ugv_acceptance.monitoring.footprint import TILTS, in_frame
from ugv_acceptance.offline.evaluation import Evaluation, Judgement
from ugv_acceptance.offline.margins import margin_rows
from ugv_acceptance.offline.replayed_advice import AdviceBook, moment_of
from ugv_acceptance.offline.replayed_session import PastClock, Replay, ReplayedSession

MONITOR, OTHER = 'acceptance_monitor', 'acceptance_evaluation'
_JOINT_STATE = 'sensor_msgs/msg/JointState'
_ARRAY = 'diagnostic_msgs/msg/DiagnosticArray'
# Type of each topic that the monitor publishes, by the last word of the topic's name. Not `ok`: a
# recording that is played must not tell a robot's gate that it may open.
TYPES = {
    'static_torque': _JOINT_STATE,
    'torque_margin': _JOINT_STATE,
    'stability': _JOINT_STATE,
    'verdict': 'diagnostic_msgs/msg/DiagnosticStatus',
    'alerts': _ARRAY,
    'diagnostics': _ARRAY,
    'markers': 'visualization_msgs/msg/MarkerArray',
    'support_polygon': 'geometry_msgs/msg/PolygonStamped',
    'center_of_mass': 'geometry_msgs/msg/PointStamped',
}
# A topic is named in a message by its number.
_NUMBERS = {word: number for number, word in enumerate(TYPES)}
# Nanoseconds between verdicts, and between drawings.
SECOND, DRAWING = 1_000_000_000, round(PERIOD * 1e9)


def topic_names(bag: Bag) -> dict[str, str]:
    """Return a topic name for each of TYPES: the monitor's, or another if that was recorded."""
    usual = {word: f'/{MONITOR}/{word}' for word in TYPES} | {'diagnostics': '/diagnostics'}
    return {
        word: f'/{OTHER}/{word}' if topic in bag.topics else topic for word, topic in usual.items()
    }


@dataclass(slots=True)
class Annotation:
    """Generates the monitor's messages for one evaluated recording."""

    evaluation: Evaluation
    names: dict[str, str] = field(init=False)
    _clock: PastClock = field(default_factory=PastClock)
    _session: ReplayedSession = field(init=False)
    _figure: Figure = field(init=False)
    _bytes: tuple[JointStateBytes, JointStateBytes] = field(init=False)
    _events: list[Event] = field(init=False)
    _open: dict[int, Alert] = field(default_factory=dict)
    _due: list[int] = field(init=False)
    _replay: Replay = field(init=False)
    _advice: AdviceBook = field(init=False)

    def __post_init__(self) -> None:
        self.names = topic_names(self.bag)
        log, results = ordered(self._judgement.evaluator.watch.log), self.evaluation.alerts
        told = {moment_of(a): r.advice for a, r in zip(log, results, strict=True)}
        loads = self._judgement.measurement.payloads.at
        self._advice = AdviceBook(self.settings, loads, log)
        nothing = (lambda _stamp, _margins: None, lambda: None, lambda _text: None)
        self._session = ReplayedSession(
            self.settings, *nothing, self._clock, told=told, book=self._advice.found
        )
        self._replay = Replay(self._session, loads)
        self._figure = figure_of(self.settings.robot)
        names = self.settings.robot.joint_names
        self._bytes = JointStateBytes(names), JointStateBytes(TILTS)
        # The next is the last of the list; of alike ones the last of the log.
        self._events = events_of(log[::-1], log[::-1])[::-1]
        self._due = [self.bag.start_ns, self.bag.start_ns]

    @property
    def bag(self) -> Bag:
        """The recording's files."""
        return self.evaluation.recording.bag

    @property
    def settings(self) -> Settings:
        """The settings that the recording was judged by."""
        return self._judgement.settings

    @property
    def _judgement(self) -> Judgement:
        return self.evaluation.judgement

    @property
    def types(self) -> dict[str, str]:
        """The type of each topic that messages are generated for."""
        return {self.names[word]: kind for word, kind in TYPES.items()}

    def said(self) -> Iterator[Block]:
        """Yield all messages in order of log time; the recording is read once more.

        The channel of a message is its topic's place in `types`.
        """
        for rows in margin_rows(self.bag, self._judgement.topics, self.settings, detail=True):
            if len(rows.time):
                yield self._part(rows)
        yield block_of(list(self._up_to(self.bag.end_ns + 1)))

    def _part(self, rows: MarginRows) -> Block:
        """Return the messages of the next part: of every row, and what is due before its last."""
        end = int(rows.time[-1])
        changes = list(takewhile(lambda time: time < end, (e.time for e in self._events[::-1])))
        judged = sorted([*range(self._due[0], end, SECOND), *changes])
        self._replay.part(rows, [*judged, *range(self._due[1], end, DRAWING)])
        self._advice.look_up(rows, judged)
        told = joined((self._of_rows(rows), block_of(list(self._up_to(end)))))
        return told.take(np.argsort(told.log_time, kind='stable')).packed()

    def _of_rows(self, rows: MarginRows) -> Block:
        """Return the messages of every row whose margins are known."""
        at, (joints, sides) = np.flatnonzero(rows.known), self._bytes
        stamp, q, torque = rows.stamp[at], rows.q[at], rows.torque[at]
        left = np.array(self.settings.limits.torque) - np.abs(torque)
        tables = {
            'static_torque': joints.table(stamp, q, torque),
            'torque_margin': joints.table(stamp, q, left),
            'stability': sides.table(stamp, rows.angle[at], rows.moment[at]),
        }
        sizes = np.array([table.shape[1] for table in tables.values()])
        # Of each row one after the other, though each table lies in one piece.
        first = np.cumsum(sizes * len(at)) - sizes * len(at)
        time = np.repeat(rows.time[at], len(tables))
        numbers = [_NUMBERS[word] for word in tables]
        return Block(
            time,
            time,
            np.tile(numbers, len(at)),
            (first + np.arange(len(at))[:, None] * sizes).reshape(-1),
            np.tile(sizes, len(at)),
            np.concatenate([table.reshape(-1) for table in tables.values()]),
        )

    def _up_to(self, end: int) -> Iterator[Message]:
        """Yield the alerts, verdicts and drawings due before `end` (ns), at their margins."""
        while True:
            verdict, drawing = self._due
            event = self._events[-1].time if self._events else end
            now = min(verdict, drawing, event)
            if now >= end:
                return
            self._clock.at = now
            self._replay.to(now)
            if event == now:
                yield from self._change(self._events.pop())
            elif verdict == now:
                self._due[0] += SECOND
                self._session.advisory.feel()
                yield from self._verdict(now)
            else:
                self._due[1] += DRAWING
                yield from self._draw(now)

    def _change(self, event: Event) -> Iterator[Message]:
        """Yield the messages of an alert's beginning (`which` is 1) or end, and the new verdict."""
        session, now, alert = self._session, event.time, event.alert
        if event.begins:
            peak, at = self._peak(alert)
            self._open[id(alert)] = replace(alert, end=None, peak=peak, worst_at=at)
            changes = session.raise_alert(self._open[id(alert)])
        else:
            mine = self._open.pop(id(alert))
            mine.end, mine.peak, mine.worst_at = alert.end, alert.peak, alert.worst_at
            changes = session.alarm_tracker.take()
        session.advisory.renew(now, session.active)
        statuses = [alert_status(change, session) for change in changes]
        yield _message(now, 'alerts', self._array(now, statuses))
        yield from self._verdict(now)

    def _peak(self, alert: Alert) -> tuple[float, int | None]:
        """Return an alert's value when it was raised, and its time: no later peak was known."""
        margins, rule = self._session.evaluator.margins, alert.rule
        if margins is None or rule.code not in {'TIP_OVER', 'TORQUE_LIMIT'}:
            return alert.peak, alert.worst_at
        if rule.code == 'TIP_OVER':
            return -float(margins.angle[SIDES.index(rule.subject)]), margins.time
        joint = self.settings.robot.joint_names.index(rule.subject)
        return abs(margins.torque[joint]), margins.time

    def _verdict(self, now: int) -> Iterator[Message]:
        session, status = self._session, verdict_of(self._session)
        yield _message(now, 'verdict', diagnosis_cdr(self._diagnosis(status)))
        of = margin_statuses(session.evaluator, session.active)
        monitor = replace(status, name='Monitor')
        yield _message(now, 'diagnostics', self._array(now, [monitor, *of]))

    def _draw(self, now: int) -> Iterator[Message]:
        margins = self._session.evaluator.margins
        if margins is None:
            return
        load = self._session.evaluator.payload
        skeleton = skeleton_of(self._figure, margins.q, margins.gravity, load)
        if skeleton is not None:
            shapes = shapes_of(skeleton, margins, self.settings)
            stamp, frame = self._replay.stamp, self.settings.frame
            stands = margins.stability.state < NO_CONTACT
            found = in_frame(self.settings, skeleton.polygon if stands else (), skeleton.cog)
            for word, data in (
                ('markers', markers_cdr(stamp, frame, LIFETIME, shapes)),
                ('support_polygon', polygon_cdr(stamp, frame, found.polygon)),
                ('center_of_mass', point_cdr(stamp, frame, found.center)),
            ):
                yield _message(now, word, data)

    def _array(self, now: int, statuses: Sequence[Status]) -> bytes:
        return diagnoses_cdr(now, [self._diagnosis(status) for status in statuses])

    def _diagnosis(self, status: Status) -> Diagnosis:
        name = f'{MONITOR}: {status.name}' if status.name else MONITOR
        values = {
            key: f'{value:.6g}' if isinstance(value, float) else str(value)
            for key, value in status.values.items()
        }
        config = self.evaluation.config
        robot = config.serial or config.name
        return Diagnosis(status.level, name, status.message, robot, values)


def _message(now: int, word: str, data: bytes) -> Message:
    return now, now, _NUMBERS[word], data
