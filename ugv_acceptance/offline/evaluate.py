"""Evaluates a recording: reads it once into margins, alerts and a verdict.

The command line, campaigns, maps, the console and Python programs all use `evaluate`.
"""

import platform
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
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
from ugv_acceptance.evaluation.criteria.criteria import CriteriaSet, default_criteria
from ugv_acceptance.evaluation.criteria.measurement import CriteriaMeasurement
from ugv_acceptance.evaluation.criteria.uncertainty import Bounds, Source, margin_bounds
from ugv_acceptance.evaluation.criteria.verdict import Findings, judge_criteria
from ugv_acceptance.evaluation.effort.model_check import ModelCheck
from ugv_acceptance.evaluation.effort.plateaus import EffortComparison
from ugv_acceptance.evaluation.inputs.payload import payload_from
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.permitted_limits import limits_hash, relaxed
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.samples import Batch
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.summary import Summary, ordered, result_of
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.offline.acknowledgements import add_acknowledgements
from ugv_acceptance.offline.evaluation import Evaluation, Judgement
from ugv_acceptance.type_aliases import Json

# Version of the result's layout; it changes when programs that read results must change.
RESULT_VERSION = 1

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
    result, judgement = judge(opened, settings, demanded, sources_from(robot), options)
    result |= _circumstances(opened, robot, identity)
    if payload is not None:
        carried = settings.robot.payload
        result['declared_payload'] = {'mass_kg': carried.mass, 'cog_m': list(carried.cog)}
    add_acknowledgements(result, opened.bag)
    if options.compare_effort:
        result['effort'] = effort.result(opened.start_ns)
    return Evaluation(opened, robot, result, judgement)


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
    return replace(settings, robot=replace(settings.robot, payload=known))


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
    summary, check = Summary(settings), ModelCheck(settings)
    measurements = [limits] if asked is limits else [limits, asked]
    told = AlertAdvice(settings, evaluator.watch.log, limits.payloads.at)
    takers = [
        summary.add, check.add, told.add, *(e.add for e in measurements), *options.takers
    ]  # fmt: skip
    evaluator.start(bag.start_ns)
    reading = bag.batches(topics, workers=options.readers)
    for batch in _stretches(reading):
        for measurement in measurements:
            measurement.payloads.take(batch.payload)
        rows = evaluator.batch(batch)
        for take in takers:
            take(rows)
        if len(rows.time):
            options.progress(int(rows.time[-1]))
    evaluator.finish(bag.end_ns)
    for finish in (summary.finish, *(e.finish for e in measurements)):
        finish(bag.end_ns)
    log, length = evaluator.watch.log, bag.end_ns - bag.start_ns
    data = {
        **result_of(summary, log, bag.start_ns, length, told.sentences()),
        'bag': _bag_result(bag, topics, reading.facts),
        'inputs': _inputs_result(evaluator, topics, reading.facts, bag.start_ns),
        'model_check': check.result(),
    }
    findings = Findings(asked, ordered(log), data, Bounds(settings, sources))
    margin_bounds(data, limits, findings.bounds)
    result = {'version': RESULT_VERSION, **judge_criteria(findings), **_limits(settings), **data}
    return result, Judgement(settings, topics, evaluator, reading.facts, asked)


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
