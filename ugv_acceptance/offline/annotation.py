"""Makes the messages that the live monitor would have published for a recording.

Margins and alerts are those of the offline evaluation; verdict and sentences come from the live
monitor's own functions, which are called for the recording's moments one after another.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ugv_acceptance.bag.annotated import Said
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
from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.alerts.tipping_watch import TippingWatch
from ugv_acceptance.evaluation.ground import KINDS
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.summary import ordered
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import NO_CONTACT, SIDES, Stability
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
from ugv_acceptance.offline.replayed_session import PastClock, ReplayedSession, moment_of

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
    _until: int = 0
    _stamp: int = 0
    _trend: TippingWatch = field(init=False)

    def __post_init__(self) -> None:
        self.names = topic_names(self.bag)
        log, results = ordered(self._judgement.evaluator.watch.log), self.evaluation.alerts
        told = {moment_of(a): r.advice for a, r in zip(log, results, strict=True)}
        nothing = (lambda _stamp, _margins: None, lambda: None, lambda _text: None)
        self._session = ReplayedSession(self.settings, *nothing, self._clock, told=told)
        self._trend = RuleSet(self.settings).trend
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

    def said(self) -> Iterator[Said]:
        """Yield all messages in order of log time; the recording is read once more."""
        for rows in margin_rows(self.bag, self._judgement.topics, self.settings, detail=True):
            yield from self._stretch(rows)
        yield from self._up_to(self.bag.end_ns + 1)

    def _stretch(self, rows: MarginRows) -> Iterator[Said]:
        payloads, heard = self._judgement.measurement.payloads, rows.pairs.joints.time
        of, until = rows.pairs.of_joints.tolist(), rows.until.tolist()
        felt = (rows.pairs.joints.qd, rows.pairs.joints.effort)
        measured = list(zip(*(map(tuple, table.tolist()) for table in felt), strict=True))
        for k, (now, stamp, margins) in enumerate(_margins(rows)):
            yield from self._up_to(now)
            self._until, self._stamp = until[k], stamp
            j = of[k]
            load = payloads.at(int(heard[j]))
            self._session.take(margins, load, measured[j])
            if len(rows.ground.kind):
                self._stand_on(int(rows.ground.kind[k]), margins, load)
            if margins is not None:
                yield from self._margins(now, stamp, margins)

    def _stand_on(self, number: int, margins: Margins | None, load: Payload) -> None:
        """Let the session stand on a kind of ground (a number in KINDS), with the trend so far."""
        session, trend = self._session, self._trend
        if session.settings.ground.taken != KINDS[number]:
            ground = replace(self.settings.ground, kind=KINDS[number])
            settings = replace(self.settings, ground=ground)
            session.settings = session.evaluator.settings = settings
            trend.adopt(settings)
        if margins is not None and margins.time >= trend.due:
            angle: Any = margins.stability.angle
            trend.keep(margins.time, angle, margins.q, margins.gravity, load)
            trend.judge()
        session.evaluator.watch.trend.level = trend.level
        session.evaluator.watch.trend.cautious = trend.cautious

    def _margins(self, now: int, stamp: int, margins: Margins) -> Iterator[Said]:
        joints, sides = self._bytes
        torque, stability = margins.torque, margins.stability
        pairs = zip(self.settings.limits.torque, torque, strict=True)
        left = [limit - abs(tau) for limit, tau in pairs]
        angle, moment = map(float, stability.angle), map(float, stability.moment)
        for word, data in (
            ('static_torque', joints.fill(stamp, margins.q, torque)),
            ('torque_margin', joints.fill(stamp, margins.q, left)),
            ('stability', sides.fill(stamp, tuple(angle), tuple(moment))),
        ):
            yield Said(now, self.names[word], data)

    def _up_to(self, end: int) -> Iterator[Said]:
        """Yield the alerts, verdicts and drawings due before `end` (ns), at their margins."""
        while True:
            verdict, drawing = self._due
            event = self._events[-1].time if self._events else end
            now = min(verdict, drawing, event)
            if now >= end:
                return
            if now > self._until:
                self._session.evaluator.margins = None
            self._clock.at = now
            if event == now:
                yield from self._change(self._events.pop())
            elif verdict == now:
                self._due[0] += SECOND
                self._session.advisory.feel()
                yield from self._verdict(now)
            else:
                self._due[1] += DRAWING
                yield from self._draw(now)

    def _change(self, event: Event) -> Iterator[Said]:
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
        yield Said(now, self.names['alerts'], self._array(now, statuses))
        yield from self._verdict(now)

    def _peak(self, alert: Alert) -> tuple[float, int | None]:
        """Return an alert's value when it was raised, and its time: no later peak was known."""
        margins, rule = self._session.evaluator.margins, alert.rule
        if margins is None or rule.code not in {'TIP_OVER', 'TORQUE_LIMIT'}:
            return alert.peak, alert.worst_at
        if rule.code == 'TIP_OVER':
            return -float(margins.stability.angle[SIDES.index(rule.subject)]), margins.time
        joint = self.settings.robot.joint_names.index(rule.subject)
        return abs(margins.torque[joint]), margins.time

    def _verdict(self, now: int) -> Iterator[Said]:
        session, status = self._session, verdict_of(self._session)
        yield Said(now, self.names['verdict'], diagnosis_cdr(self._diagnosis(status)))
        of = margin_statuses(session.evaluator, session.active)
        monitor = replace(status, name='Monitor')
        yield Said(now, self.names['diagnostics'], self._array(now, [monitor, *of]))

    def _draw(self, now: int) -> Iterator[Said]:
        margins = self._session.evaluator.margins
        if margins is None:
            return
        load = self._session.evaluator.payload
        skeleton = skeleton_of(self._figure, margins.q, margins.gravity, load)
        if skeleton is not None:
            shapes = shapes_of(skeleton, margins, self.settings)
            stamp, frame = self._stamp, self.settings.frame
            stands = margins.stability.state < NO_CONTACT
            found = in_frame(self.settings, skeleton.polygon if stands else (), skeleton.cog)
            for word, data in (
                ('markers', markers_cdr(stamp, frame, LIFETIME, shapes)),
                ('support_polygon', polygon_cdr(stamp, frame, found.polygon)),
                ('center_of_mass', point_cdr(stamp, frame, found.center)),
            ):
                yield Said(now, self.names[word], data)

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


def _margins(rows: MarginRows) -> Iterator[tuple[int, int, Margins | None]]:
    """Yield time and header stamp (ns) of each row, and its margins, None if not known."""
    lists = [np.asarray(x).tolist() for x in (rows.q, rows.gravity, rows.torque)]
    stable = (rows.angle, rows.moment, rows.energy, rows.zmp, rows.state)
    lists += [np.asarray(x).tolist() for x in stable]
    known = zip(rows.time.tolist(), rows.stamp.tolist(), rows.known.tolist(), strict=True)
    for (now, stamp, there), line in zip(known, zip(*lists, strict=True), strict=True):
        if not there:
            yield now, stamp, None
            continue
        q, gravity, torque, angle, moment, energy, zmp, state = line
        angles = tuple(angle)
        stability = Stability(angles, tuple(moment), tuple(energy), zmp, state)
        given = now, stamp, tuple(q), tuple(gravity), tuple(torque), angles, state, stability
        yield now, stamp, Margins(*given)
