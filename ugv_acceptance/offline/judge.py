"""Judges a recording: reads it once, and makes the part of a result that needs no files but it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from ugv_acceptance.bag.reader import Bag, Topics
from ugv_acceptance.bag.reading import Facts
from ugv_acceptance.bag.recording import NAMES, Names, Recording
from ugv_acceptance.evaluation.advice.recorded import AlertAdvice
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.carrying import CarryingJoints, name_measured
from ugv_acceptance.evaluation.chassis.examination import ChassisExamination
from ugv_acceptance.evaluation.criteria.assumptions import assumptions, unknown_load
from ugv_acceptance.evaluation.criteria.criteria import (
    CriteriaSet,
    default_criteria,
)
from ugv_acceptance.evaluation.criteria.findings import Findings
from ugv_acceptance.evaluation.criteria.ground_statement import GroundExamination
from ugv_acceptance.evaluation.criteria.imu_mounting import MountExamination
from ugv_acceptance.evaluation.criteria.imu_statement import ImuExamination
from ugv_acceptance.evaluation.criteria.measurement import CriteriaMeasurement
from ugv_acceptance.evaluation.criteria.not_judged import absent_imu, untold_joints
from ugv_acceptance.evaluation.criteria.statement import Examination, Statement
from ugv_acceptance.evaluation.criteria.uncertainty import Bounds, Source, margin_bounds
from ugv_acceptance.evaluation.criteria.verdict import judge_criteria
from ugv_acceptance.evaluation.dynamic_bound import DynamicBound
from ugv_acceptance.evaluation.effort.model_check import ModelCheck
from ugv_acceptance.evaluation.ground_contact import TouchExamination
from ugv_acceptance.evaluation.holding_back import HeldMargins
from ugv_acceptance.evaluation.input_times import InputTimes
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.permitted_limits import limits_hash, relaxed
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.reported_rates import ReportedRates
from ugv_acceptance.evaluation.samples import Batch
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.summary import Summary, ordered, result_of
from ugv_acceptance.offline.evaluation import Judgement
from ugv_acceptance.offline.recorded_transforms import with_transforms
from ugv_acceptance.offline.stretches import stretches
from ugv_acceptance.offline.told_load import disputed_load, unread_load
from ugv_acceptance.offline.training import TrainingRecord
from ugv_acceptance.type_aliases import Json

# Version of the result's layout; it changes when programs that read results must change.
RESULT_VERSION = 2

Taker = Callable[[MarginRows], None]


@dataclass(frozen=True, slots=True)
class Options:
    """How a recording is read, and what else is done with its margins.

    Each of `takers` is called with the margins of every part of the recording in order; they hold
    moments, energies and ZMP if `detail` asks for them. `progress` is called with the log time (ns)
    reached. With `compare_effort` the result compares measured efforts at rest. With two
    `readers` a thread unpacks ahead: it takes more CPU, and saves time only where the disk is slow.
    `training` are records of operators' drills: they change a verdict only where the criteria
    require one.
    """

    takers: tuple[Taker, ...] = ()
    progress: Callable[[int], None] = lambda _: None
    detail: bool = False
    compare_effort: bool = False
    readers: int = 1
    training: tuple[TrainingRecord, ...] = ()


DEFAULTS = Options()


def judge(
    recording: Recording,
    settings: Settings,
    criteria: CriteriaSet | None = None,
    sources: tuple[Source, ...] = (),
    options: Options = DEFAULTS,
    statements: Sequence[Statement] = (),
) -> tuple[Json, Judgement]:
    """Read a recording once; return its result for JSON and the objects it was made from.

    The result holds what follows from margins, alerts and data, without robot, software and
    identity. `criteria` None means the limits of `settings`; `sources` are sources of uncertainty;
    `statements` are about the recording as a whole, found before it is read.
    """
    bag, topics = recording.bag, recording.chosen(imu_required=False)
    settings = with_transforms(settings, bag)
    span = bag.start_ns, bag.end_ns
    limits = CriteriaMeasurement(default_criteria(settings), settings, *span)
    asked = CriteriaMeasurement(criteria, settings, *span) if criteria else limits
    evaluator = RecordedEvaluator(settings, options.detail or asked.detail)
    reading = _Reading(settings, sources, evaluator, limits, asked, options)
    batches = bag.batches(topics, workers=options.readers)
    evaluator.start(bag.start_ns)
    for batch in stretches(batches):
        reading.take(batch)
    evaluator.finish(bag.end_ns)
    reading.finish(bag.end_ns)
    log, length = evaluator.watch.log, bag.end_ns - bag.start_ns
    _explain_silence(log, topics, batches.facts)
    data = {
        **result_of(reading.summary, log, bag.start_ns, length, reading.told.sentences()),
        'bag': _bag_result(recording, topics, batches.facts),
        'inputs': _inputs_result(evaluator, topics, batches.facts, bag.start_ns),
    }
    statements = [*statements, *(e.statement(*span) for e in reading.examinations)]
    statements.append(absent_imu(settings, topics.imu))
    configured = recording.names or NAMES
    statements.append(unread_load(bag, topics, configured[-1], batches.facts))
    statements.append(disputed_load(asked.payloads))
    statements.append(untold_joints(settings, evaluator.joints.never_told))
    statements.append(assumptions(settings, sources, asked, evaluator.first_payload))
    for statement in statements:
        data |= statement.result
    name_measured(data, statements)
    findings = Findings(
        asked, ordered(log), data, Bounds(settings, sources), statements, reading.held.doubtful
    )
    for entry, alert in zip(data['alerts'], findings.alerts, strict=True):
        entry['doubtful'] = findings.in_doubt(alert)
    margin_bounds(data, limits, findings.bounds)
    result = {'version': RESULT_VERSION, **judge_criteria(findings), **_limits(settings), **data}
    return result, Judgement(settings, topics, evaluator, batches.facts, asked)


def _examinations(
    settings: Settings,
    sources: tuple[Source, ...],
    evaluator: RecordedEvaluator,
    limits: CriteriaMeasurement,
    criteria: CriteriaSet,
) -> tuple[Examination, ...]:
    """Return what looks at a run beside its criteria."""
    return (
        ModelCheck(settings, sources, lambda: evaluator.carrying),
        ImuExamination(evaluator.imu),
        MountExamination(evaluator.mount, evaluator.imu),
        ChassisExamination(),
        DynamicBound(settings, limits.payloads.at),
        InputTimes(),
        CarryingJoints(settings, limits.payloads.at, lambda: evaluator.carrying),
        TouchExamination(),
        ReportedRates(settings.robot, lambda: evaluator.rates),
        GroundExamination(settings, criteria, evaluator.watch.trend, evaluator.watch.log),
    )


@dataclass(slots=True)
class _Reading:
    """Gives each part of a recording's margins to all that needs them, while it is read.

    What decides gets them held back: without the margins that a later contradiction reaches.
    """

    settings: Settings
    sources: tuple[Source, ...]
    evaluator: RecordedEvaluator
    limits: CriteriaMeasurement
    asked: CriteriaMeasurement
    options: Options
    summary: Summary = field(init=False)
    told: AlertAdvice = field(init=False)
    held: HeldMargins = field(init=False)
    examinations: tuple[Examination, ...] = field(init=False)
    _load_told: bool = False

    def __post_init__(self) -> None:
        self.summary = Summary(self.settings, self.limits.start)
        of = self.evaluator, self.limits, self.asked.criteria
        self.examinations = _examinations(self.settings, self.sources, *of)
        log = self.evaluator.watch.log
        self.told = AlertAdvice(self.settings, log, self.limits.payloads.at)
        self.held = HeldMargins(log)

    def take(self, batch: Batch) -> None:
        """Take the messages of the next part of the recording."""
        for measurement in self._measurements:
            measurement.payloads.take(batch.payload)
        rows = self.evaluator.batch(batch)
        for take in (self.told.add, *self.options.takers):
            take(rows)
        self._distrust_first_load(rows)
        for believed in self.held.add(rows):
            self._judge(believed)
        if len(rows.time):
            self.options.progress(int(rows.time[-1]))

    def finish(self, now: int) -> None:
        """Finish at the end of the recording, `now` (ns)."""
        for believed in self.held.finish():
            self._judge(believed)
        for finish in (self.summary.finish, *(e.finish for e in self._measurements)):
            finish(now)

    def _distrust_first_load(self, rows: MarginRows) -> None:
        """Distrust the margins before a load that was told at once: they rest on another one."""
        span = unknown_load(self.settings, self.evaluator.first_payload, self.limits)
        if span is None or self._load_told:
            return
        used = rows.pairs.joints.time[rows.pairs.of_joints] >= span[1]
        self._load_told = bool(used.any())
        until = int(rows.time[used.argmax()]) if self._load_told else span[1]
        self.held.distrust((span[0], until))

    @property
    def _measurements(self) -> list[CriteriaMeasurement]:
        return [self.limits] if self.asked is self.limits else [self.limits, self.asked]

    def _judge(self, rows: MarginRows) -> None:
        parts = (self.summary.add, *(e.add for e in self._measurements))
        for take in (*parts, *(e.add for e in self.examinations)):
            take(rows)


def _limits(settings: Settings) -> dict[str, Any]:
    """Return the hash of the limits in force, and which are wider than permitted, and why."""
    found = [breach.words for breach in relaxed(settings)]
    told = {'reason': settings.unsafe, 'limits': found} if found else None
    return {'limits_hash': limits_hash(settings), 'limits_relaxed': told}


def _explain_silence(log: Sequence[Alert], topics: Topics, facts: Facts) -> None:
    """Say in the alerts about silent inputs where messages came, but were malformed."""
    names = {'joint_states': topics.joint_states, 'imu': topics.imu}
    for alert in log:
        if alert.rule.code == 'INPUT_STALE' and not alert.detail:
            topic = names.get(alert.rule.subject) or ''
            count, reason = facts.malformed.get(topic, (0, ''))
            if count:
                total = facts.counts[topic]
                alert.detail = f'{count} of {total} are malformed; the first: {reason}'


def _bag_result(recording: Recording, topics: Topics, facts: Facts) -> dict[str, Any]:
    bag, names = recording.bag, recording.names or NAMES
    return {
        'path': [str(path) for path in bag.paths],
        'sha256': bag.sha256(),
        'duration_s': bag.duration_s,
        'messages': {name: topic.count for name, topic in bag.topics.items()},
        'protected': bag.protected,
        'salvaged': bag.salvaged,
        'lost_messages': _lost(bag, topics, names, facts),
        'findings': [*bag.findings, *facts.findings],
    }


def _lost(bag: Bag, topics: Topics, configured: Names, facts: Facts) -> int:
    """Return how many messages metadata.yaml or the index of the file counts that were not read.

    Only of the topics read here: losing a camera's messages does not affect the verdict. Of those
    that are not in the files at all, by the `configured` names. Where only the beginning was asked
    for, those that metadata.yaml counts and the index does not.
    """
    meant = {name.lstrip('/') for name in configured if name is not None}
    absent = {name: count for name, count in bag.promised.items() if name not in bag.topics}
    gone = sum(count for name, count in absent.items() if name.lstrip('/') in meant)
    names = (topics.joint_states, topics.imu, topics.payload)
    held = {name: bag.topics[name].count for name in names if name in bag.topics}
    counted = {name: max(bag.promised.get(name, 0), count) for name, count in held.items()}
    read = facts.counts if bag.until_ns is None else held
    return gone + sum(max(0, count - read.get(name, 0)) for name, count in counted.items())


def _inputs_result(
    evaluator: RecordedEvaluator, topics: Topics, facts: Facts, start: int
) -> dict[str, Any]:
    names = {'joint_states': topics.joint_states, 'imu': topics.imu}
    result: dict[str, Any] = {}
    for which, (key, topic) in enumerate(names.items()):
        period, gaps = evaluator.fresh[which].period, evaluator.gaps[which]
        lengths = [(end - begin) / 1e9 for begin, end in gaps]
        faults = {a.rule.code for a in evaluator.watch.log if a.rule.subject == key}
        malformed = facts.malformed.get(topic or '', (0, ''))
        result[key] = {
            'topic': topic,
            'messages': facts.counts.get(topic or '', 0),
            'rate_hz': 1e9 / period if period > 0 else None,
            'malformed': malformed[0],
            'malformed_reason': malformed[1] or None,
            'gaps': len(gaps),
            'longest_gap_s': max(lengths, default=0.0),
            'first_gaps_s': [[(a - start) / 1e9, (b - start) / 1e9] for a, b in gaps[:20]],
            'faults': sorted(faults),
        }
    result['imu']['orientation'] = evaluator.orientations
    result['late_messages'] = facts.late
    return result
