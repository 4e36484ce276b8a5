"""Evaluates a recording: reads it once into margins, alerts and a verdict.

The command line, campaigns, maps, the console and Python programs all use `evaluate`.
"""

import platform
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

from ugv_acceptance import BadConfig, __version__
from ugv_acceptance.bag.reader import Bag, Topics
from ugv_acceptance.bag.reading import Facts
from ugv_acceptance.bag.recording import Paths, Recording, open_recording
from ugv_acceptance.config import Config, load
from ugv_acceptance.config.criteria import load_criteria
from ugv_acceptance.config.uncertain import sources_from
from ugv_acceptance.evaluation.advice.recorded import AlertAdvice
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.criteria.assumptions import assumptions, unknown_load
from ugv_acceptance.evaluation.criteria.criteria import (
    INCONCLUSIVE,
    CriteriaSet,
    default_criteria,
)
from ugv_acceptance.evaluation.criteria.measurement import CriteriaMeasurement
from ugv_acceptance.evaluation.criteria.safeguards import with_objection
from ugv_acceptance.evaluation.criteria.statement import Examination, Objection
from ugv_acceptance.evaluation.criteria.uncertainty import Bounds, Source, margin_bounds
from ugv_acceptance.evaluation.criteria.verdict import Findings, judge_criteria
from ugv_acceptance.evaluation.dynamic_bound import DynamicBound
from ugv_acceptance.evaluation.effort.model_check import ModelCheck
from ugv_acceptance.evaluation.effort.plateaus import EffortComparison
from ugv_acceptance.evaluation.holding_back import HeldMargins
from ugv_acceptance.evaluation.input_times import InputTimes
from ugv_acceptance.evaluation.inputs.payload import payload_from
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.permitted_limits import limits_hash, relaxed
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.reported_rates import ReportedRates
from ugv_acceptance.evaluation.samples import Batch
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.summary import Summary, ordered, result_of
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.offline.acknowledgements import add_acknowledgements
from ugv_acceptance.offline.evaluation import Evaluation, Judgement
from ugv_acceptance.type_aliases import Json

# Version of the result's layout; it changes when programs that read results must change.
RESULT_VERSION = 2

# Messages evaluated at a time, so that the arrays of a kernel stay in the processor's cache.
STRETCH = 16384


Taker = Callable[[MarginRows], None]


@dataclass(frozen=True, slots=True)
class Options:
    """How a recording is read, and what else is done with its margins.

    Each of `takers` is called with the margins of every part of the recording in order; they hold
    moments, energies and ZMP if `detail` asks for them. `progress` is called with the log time (ns)
    reached. With `compare_effort` the result compares measured efforts at rest. `readers` is the
    number of threads that read, by default two if there is more than one core.
    """

    takers: tuple[Taker, ...] = ()
    progress: Callable[[int], None] = lambda _: None
    detail: bool = False
    compare_effort: bool = False
    readers: int | None = None


def evaluate(
    recording: Recording | Paths,
    *,
    config: Config | Path | str | None = None,
    criteria: CriteriaSet | Path | str | None = None,
    payload: Payload | float | None = None,
    identity: Mapping[str, str] | None = None,
    options: Options = Options(),
) -> Evaluation:
    """Evaluate a recording: margins, alerts and a verdict with its reasons.

    Parameters
    ----------
    recording
        An opened recording, or its path: a rosbag2 folder, MCAP, SQLite or ROS 1 file; a list of
        paths are the parts of one recording.
    config
        The robot: a configuration, its YAML file, or the name of one that ships (packbot, the
        default).
    criteria
        The acceptance criteria or their YAML file; by default the limits of `config`.
    payload
        The payload carried until a message declares another: kg at the origin of the payload link,
        or a Payload; by default that of `config`.
    identity
        What a person enters for the report: operator, robot_serial, place, ...
    options
        How the recording is read, and what else is done with its margins.

    Raises
    ------
    BadBag, BadConfig
        If the recording, the configuration or the criteria cannot be used.

    Examples
    --------
    >>> import ugv_acceptance as ugv
    >>> result = ugv.evaluate('bags/packbot_fail')
    >>> result.verdict
    'FAIL'
    >>> sorted({alert.code for alert in result.alerts if alert.level == 'ERROR'})
    ['TIP_OVER', 'TORQUE_LIMIT']
    >>> result.margins.sides
    ('front', 'left', 'rear', 'right')
    """
    robot = config if isinstance(config, Config) else load(config)
    settings = _carrying(robot, payload)
    opened = recording if isinstance(recording, Recording) else open_recording(recording)
    opened = replace(opened, names=opened.names or robot.topics.names)
    demanded = _criteria(criteria, settings)
    effort = EffortComparison(settings)
    if options.compare_effort:
        options = replace(options, takers=(effort.add, *options.takers))
    sources = sources_from(robot)
    result, judgement = judge(opened, settings, demanded, sources, options)
    result |= _both_loads(opened, judgement, demanded, sources, result)
    result |= _circumstances(opened, robot, identity)
    if payload is not None:
        carried = settings.robot.payload
        result['declared_payload'] = {'mass_kg': carried.mass, 'cog_m': list(carried.cog)}
    add_acknowledgements(result, opened.bag)
    if options.compare_effort:
        result['effort'] = effort.result(opened.start_ns)
    return Evaluation(opened, robot, result, judgement)


def _both_loads(
    opened: Recording,
    judged: Judgement,
    criteria: CriteriaSet | None,
    sources: tuple[Source, ...],
    result: Json,
) -> Json:
    """Return the changes to a result if the verdict depends on a load told only later.

    The run is judged again as if the first payload that was declared had been carried all along.
    """
    first, settings = judged.evaluator.first_payload, judged.settings
    if first is None or settings.payload_known or first[1] == settings.robot.payload:
        return {}
    if unknown_load(settings, first, judged.measurement) or first[0] <= judged.measurement.start:
        return {}
    carried = replace(settings, robot=replace(settings.robot, payload=first[1]))
    other, _ = judge(opened, carried, criteria, sources)
    if other['verdict'] == result['verdict']:
        return {}
    seconds = (first[0] - judged.measurement.start) / 1e9
    reason = (
        f'the load was told only after {seconds:.2f} s: with {settings.robot.payload.mass:g} kg '
        f'until then (the configuration) {result["verdict"]}, with {first[1].mass:g} kg (told '
        f'first) {other["verdict"]}; declare it from the start, or set payload.known'
    )
    return with_objection(result, Objection('payload', INCONCLUSIVE, reason))


def _carrying(config: Config, payload: Payload | float | None) -> Settings:
    """Return the settings with another payload (kg or Payload), unchanged if None."""
    settings = config.settings
    if payload is None:
        return settings
    carried = payload if isinstance(payload, Payload) else Payload(float(payload))
    link = settings.robot.payload_link or ''
    known = payload_from(settings.robot, carried.mass, carried.cog, link)
    if known is None:
        raise BadConfig(
            f'payload: expected kg from 0 on, for a robot with a payload link, got {payload!r}'
        )
    robot = replace(settings.robot, payload=known)
    return replace(settings, robot=robot, payload_known=True)


def _criteria(criteria: CriteriaSet | Path | str | None, settings: Settings) -> CriteriaSet | None:
    if criteria is None or isinstance(criteria, CriteriaSet):
        return criteria
    return load_criteria(Path(criteria), settings)


def judge(
    recording: Recording,
    settings: Settings,
    criteria: CriteriaSet | None = None,
    sources: tuple[Source, ...] = (),
    options: Options = Options(),
) -> tuple[Json, Judgement]:
    """Read a recording once; return its result for JSON and the objects it was made from.

    The result holds what follows from margins, alerts and data, without robot, software and
    identity. `criteria` None means the limits of `settings`; `sources` are sources of uncertainty.
    """
    bag, topics = recording.bag, recording.chosen()
    span = bag.start_ns, bag.end_ns
    limits = CriteriaMeasurement(default_criteria(settings), settings, *span)
    asked = CriteriaMeasurement(criteria, settings, *span) if criteria else limits
    evaluator = RecordedEvaluator(settings, options.detail or asked.detail)
    reading = _Reading(settings, evaluator, limits, asked, options)
    batches = bag.batches(topics, workers=options.readers)
    evaluator.start(bag.start_ns)
    for batch in _stretches(batches):
        reading.take(batch)
    evaluator.finish(bag.end_ns)
    reading.finish(bag.end_ns)
    log, length = evaluator.watch.log, bag.end_ns - bag.start_ns
    _explain_silence(log, topics, batches.facts)
    data = {
        **result_of(reading.summary, log, bag.start_ns, length, reading.told.sentences()),
        'bag': _bag_result(bag, topics, batches.facts),
        'inputs': _inputs_result(evaluator, topics, batches.facts, bag.start_ns),
        'model_check': reading.check.result(),
    }
    statements = [e.statement(*span) for e in reading.examinations]
    statements.append(assumptions(settings, sources, asked, evaluator.first_payload))
    for statement in statements:
        data |= statement.result
    findings = Findings(
        asked, ordered(log), data, Bounds(settings, sources), statements, reading.held.doubtful
    )
    margin_bounds(data, limits, findings.bounds)
    result = {'version': RESULT_VERSION, **judge_criteria(findings), **_limits(settings), **data}
    return result, Judgement(settings, topics, evaluator, batches.facts, asked)


def _examinations(
    settings: Settings, evaluator: RecordedEvaluator, limits: CriteriaMeasurement
) -> tuple[Examination, ...]:
    """Return what looks at a run beside its criteria."""
    names = settings.robot.joint_names
    return (
        DynamicBound(settings, limits.payloads.at),
        InputTimes(),
        ReportedRates(names, lambda: evaluator.rates),
    )


@dataclass(slots=True)
class _Reading:
    """Gives each part of a recording's margins to all that needs them, while it is read.

    What decides gets them held back: without the margins that a later contradiction reaches.
    """

    settings: Settings
    evaluator: RecordedEvaluator
    limits: CriteriaMeasurement
    asked: CriteriaMeasurement
    options: Options
    summary: Summary = field(init=False)
    check: ModelCheck = field(init=False)
    told: AlertAdvice = field(init=False)
    held: HeldMargins = field(init=False)
    examinations: tuple[Examination, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.summary = Summary(self.settings, self.limits.start)
        self.check = ModelCheck(self.settings)
        self.examinations = _examinations(self.settings, self.evaluator, self.limits)
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
        self.held.distrust(unknown_load(self.settings, self.evaluator.first_payload, self.limits))
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

    @property
    def _measurements(self) -> list[CriteriaMeasurement]:
        return [self.limits] if self.asked is self.limits else [self.limits, self.asked]

    def _judge(self, rows: MarginRows) -> None:
        takers = (self.summary, self.check, *self._measurements, *self.examinations)
        for taker in takers:
            taker.add(rows)


def _circumstances(
    recording: Recording, config: Config, identity: Mapping[str, str] | None
) -> Json:
    """Return the part of a result about its origin: robot, software, identity, recording time."""
    start = recording.start_ns
    began = datetime.fromtimestamp(start // 10**9, timezone.utc)
    return {
        'identity': dict(identity or {}),
        'robot': {
            'name': config.name,
            'serial': config.serial,
            'config': str(config.path),
            'urdf': str(config.urdf_path),
            'sha256': config.sha256,
            'warnings': list(config.warnings),
        },
        'software': {
            'version': __version__,
            'numpy': np.__version__,
            'python': platform.python_version(),
        },
        'recorded': began.strftime('%Y-%m-%d %H:%M:%S UTC') if start else None,
    }


def _limits(settings: Settings) -> dict[str, Any]:
    """Return the hash of the limits in force, and which are wider than permitted, and why."""
    found = [breach.words for breach in relaxed(settings)]
    told = {'reason': settings.unsafe, 'limits': found} if found else None
    return {'limits_hash': limits_hash(settings), 'limits_relaxed': told}


def _stretches(batches: Iterable[Batch]) -> Iterator[Batch]:
    """Yield batches merged to at least STRETCH messages each, to save calls."""
    held: list[Batch] = []
    count = 0
    for batch in batches:
        held.append(batch)
        count += sum(len(s.log_time) for s in batch.joints)
        count += sum(len(s.log_time) for s in batch.imu)
        if count >= STRETCH:
            yield _together(held)
            held, count = [], 0
    if held:
        yield _together(held)


def _together(batches: Sequence[Batch]) -> Batch:
    return Batch(
        [s for b in batches for s in b.joints],
        [s for b in batches for s in b.imu],
        [s for b in batches for s in b.payload],
    )


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


def _bag_result(bag: Bag, topics: Topics, facts: Facts) -> dict[str, Any]:
    names = (topics.joint_states, topics.imu, topics.payload)
    held = {name: bag.topics[name].count for name in names if name in bag.topics}
    return {
        'path': [str(path) for path in bag.paths],
        'sha256': bag.sha256(),
        'duration_s': bag.duration_s,
        'messages': {name: topic.count for name, topic in bag.topics.items()},
        'protected': bag.protected,
        'salvaged': bag.salvaged,
        # Only of the topics read here: losing a camera's messages does not affect the verdict.
        'lost_messages': sum(max(0, bag.promised.get(n, 0) - k) for n, k in held.items()),
        'findings': [*bag.findings, *facts.findings],
    }


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
