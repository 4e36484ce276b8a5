"""A recording judged: read once, stretch by stretch, into margins, alerts, a summary, a result."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from ugv_acceptance.bag.reader import Bag, Topics
from ugv_acceptance.bag.reading import Facts
from ugv_acceptance.evaluation.advice.recorded import AlertAdvice
from ugv_acceptance.evaluation.criteria.criteria import CriteriaSet, default_criteria
from ugv_acceptance.evaluation.criteria.measurement import Examination
from ugv_acceptance.evaluation.criteria.uncertainty import Bounds, Source, margin_bounds
from ugv_acceptance.evaluation.criteria.verdict import Findings, judge_criteria
from ugv_acceptance.evaluation.effort.model_check import ModelCheck
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.permitted_limits import limits_hash, relaxed
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.samples import Batch
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.summary import Summary, ordered, result_of

# Version of the result's layout; changes where a reader of results must change.
RESULT_VERSION = 1

# Messages judged at a time: what a kernel works on then stays in the processor's cache.
STRETCH = 16384

Sink = Callable[[MarginRows], None]


@dataclass(frozen=True, slots=True)
class Terms:
    """What a run is judged by: criteria (None: the limits of the configuration), what is uncertain.

    With `detail` the sinks get moments, energies and ZMP too. `readers` are the threads that read,
    by default two where there is more than one core.
    """

    criteria: CriteriaSet | None = None
    sources: tuple[Source, ...] = ()
    detail: bool = False
    readers: int | None = None


@dataclass(frozen=True, slots=True)
class Judgement:
    """The result, ready for JSON, and what it was made from."""

    result: dict[str, Any]
    evaluator: RecordedEvaluator
    facts: Facts
    examination: Examination


def judge(
    bag: Bag,
    topics: Topics,
    settings: Settings,
    sinks: Sequence[Sink] = (),
    progress: Callable[[int], None] = lambda _: None,
    terms: Terms = Terms(),
) -> Judgement:
    """Return the judgement of a recording.

    Each sink takes every stretch of margins in order; `progress` takes the log time (ns) reached.
    """
    span = bag.start_ns, bag.end_ns
    limits = Examination(default_criteria(settings), settings, *span)
    asked = Examination(terms.criteria, settings, *span) if terms.criteria else limits
    evaluator, summary = (
        RecordedEvaluator(settings, terms.detail or asked.detail),
        Summary(settings),
    )
    examinations = [limits] if asked is limits else [limits, asked]
    check = ModelCheck(settings)
    told = AlertAdvice(settings, evaluator.watch.log, limits.payloads.at)
    takers = [summary.add, check.add, told.add, *(e.add for e in examinations), *sinks]
    evaluator.start(bag.start_ns)
    reading = bag.batches(topics, workers=terms.readers)
    for batch in _stretches(reading):
        for examination in examinations:
            examination.payloads.take(batch.payload)
        rows = evaluator.batch(batch)
        for take in takers:
            take(rows)
        if len(rows.time):
            progress(int(rows.time[-1]))
    evaluator.finish(bag.end_ns)
    for finish in (summary.finish, *(e.finish for e in examinations)):
        finish(bag.end_ns)
    log, length = evaluator.watch.log, bag.end_ns - bag.start_ns
    data = {
        **result_of(summary, log, bag.start_ns, length, told.sentences()),
        'bag': _bag_result(bag, topics, reading.facts),
        'inputs': _inputs_result(evaluator, topics, reading.facts, bag.start_ns),
        'model_check': check.result(),
    }
    findings = Findings(asked, ordered(log), data, Bounds(settings, terms.sources))
    margin_bounds(data, limits, findings.bounds)
    result = {'version': RESULT_VERSION, **judge_criteria(findings), **_limits(settings), **data}
    return Judgement(result, evaluator, reading.facts, asked)


def _limits(settings: Settings) -> dict[str, Any]:
    """Return by what limits was judged, and which of them are wider than permitted, and why."""
    found = [breach.words for breach in relaxed(settings)]
    told = {'reason': settings.unsafe, 'limits': found} if found else None
    return {'limits_hash': limits_hash(settings), 'limits_relaxed': told}


def _stretches(batches: Iterable[Batch]) -> Iterator[Batch]:
    """Yield batches put together until each has STRETCH messages: calls cost more than messages."""
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
        # Of those read here: a recording without its pictures has all that is judged.
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
