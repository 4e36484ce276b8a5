"""Criteria measured in pieces of a recording, against a loop over its rows."""

import math
from dataclasses import replace

import hypothesis
import numpy as np
import pytest
from evaluation.streams import (
    MS,
    T0,
    Carry,
    Joints,
    Message,
    S,
    batch_of,
    run_of,
    settings,
    split,
    streams,
)
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    AlertDemand,
    CriteriaSet,
    Criterion,
    MapDemand,
    Value,
    Window,
)
from ugv_acceptance.evaluation.criteria.measurement import (
    CriteriaMeasurement,
    KnownTime,
    MapMeasure,
    ValueMeasure,
)
from ugv_acceptance.evaluation.criteria.quantities import columns_of
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.settings import Delays, Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import static_torque

TOLD = settings(delays=Delays(stale_after=0.05))


def examined(
    criteria: list[Criterion],
    messages: list[Message],
    cuts: list[int],
    end: int,
    told: Settings = TOLD,
) -> tuple[CriteriaMeasurement, list[MarginRows]]:
    """Return criteria measured over a recording handed over in pieces, and its rows."""
    measurement = CriteriaMeasurement(CriteriaSet('', 1, tuple(criteria), ''), told, T0, end)
    evaluator = RecordedEvaluator(told, measurement.detail)
    evaluator.start(T0)
    found = []
    for part in split(messages, cuts):
        batch = batch_of(part)
        measurement.payloads.take(batch.payload)
        found.append(evaluator.batch(batch))
        measurement.add(found[-1])
    evaluator.finish(end)
    measurement.finish(end)
    return measurement, found


def measure_of(measurement: CriteriaMeasurement, name: str) -> ValueMeasure:
    """Return what was measured for a criterion on a value."""
    measure = measurement.measures[name]
    assert isinstance(measure, ValueMeasure)
    return measure


def held(
    rows: list[MarginRows], demand: Value, span: tuple[int, int], end: int
) -> tuple[int, int, list[float]]:
    """Return time evaluated and in violation (ns), and the values of samples, row by row."""
    table: list[tuple[int, int, float]] = []
    for part in rows:
        if len(part.time):
            values = columns_of(demand.signal, demand.of, part, TOLD, largest=demand.below)
            table += zip(part.time.tolist(), part.until.tolist(), values.tolist(), strict=True)
    evaluated = violated = 0
    seen = []
    for k, (time, until, value) in enumerate(table):
        after = table[k + 1][0] if k + 1 < len(table) else end
        start, stop = max(time, span[0]), min(until, after, span[1])
        if math.isnan(value):
            continue
        if span[0] <= time <= span[1]:
            seen.append(value)
        spent = max(0, stop - start)
        evaluated += spent
        if (value >= demand.limit) if demand.below else (value <= demand.limit):
            violated += spent
    return evaluated, violated, seen


values = st.sampled_from(
    [
        Value('torque_utilisation', 'lift', below=True, limit=0.9),
        Value('torque', ANY, below=True, limit=30.0),
        Value('torque_margin', 'slide', below=False, limit=5.0),
        Value('tip_angle', ANY, below=False, limit=0.3),
        Value('tip_angle', 'front', below=False, limit=0.6),
        Value('position', 'lift', below=True, limit=0.4),
        Value('tilt', 'robot', below=True, limit=0.2),
        Value('tip_energy', ANY, below=False, limit=20.0),
        Value('zmp', 'robot', below=False, limit=0.1),
    ]
)
windows = st.one_of(st.none(), st.sampled_from([(0.0, 0.3), (0.1, 0.5), (0.2, 9.0)]))


@hypothesis.settings(max_examples=80)
@given(streams(), st.lists(st.integers(0, 120), max_size=4), st.integers(0, 200), values, windows)
def test_a_value_is_measured_as_by_a_loop_over_the_rows(
    messages: list[Message], cuts: list[int], rest: int, demand: Value, window: Window | None
) -> None:
    """Time evaluated, time in violation and worst value, whatever the pieces and the window."""
    end = messages[-1].time + rest * MS
    measurement, _ = examined([Criterion('c', demand, window=window)], messages, cuts, end)
    _, rows = examined([Criterion('c', demand)], messages, [], end)
    measure = measure_of(measurement, 'c')
    span = measurement.span_of(window)
    evaluated, violated, seen = held(rows, demand, span, end)
    assert (measure.evaluated, measure.violation.total) == (evaluated, violated)
    assert measure.samples == len(seen)
    if seen:
        # In pieces NumPy's vector loops end elsewhere, and round the last digits otherwise.
        worst = max(seen) if demand.below else min(seen)
        assert measure.worst[0].value == pytest.approx(worst, rel=1e-9, abs=1e-12)
    else:
        assert not measure.worst
    broken = [v for v in seen if (v >= demand.limit if demand.below else v <= demand.limit)]
    first = measure.first.value if measure.first else None
    assert first == (pytest.approx(broken[0], rel=1e-9, abs=1e-12) if broken else None)


@hypothesis.settings(max_examples=40)
@given(streams(), st.lists(st.integers(0, 120), max_size=4))
def test_the_worst_moment_gives_its_value_again(messages: list[Message], cuts: list[int]) -> None:
    """Posture, attitude and payload of a moment are those its torque was computed from."""
    demand = Value('torque', ANY, below=True, limit=1.0)
    measurement, _ = examined([Criterion('c', demand)], messages, cuts, messages[-1].time)
    for moment in measure_of(measurement, 'c').worst:
        torque = static_torque(TOLD.robot, moment.q, moment.gravity, moment.payload)
        j = TOLD.robot.joint_names.index(moment.subject)
        np.testing.assert_allclose(abs(torque[j]), moment.value, rtol=1e-9, atol=1e-9)


def test_a_payload_counts_from_the_next_joint_state_on() -> None:
    """The moment before a declaration has the robot's payload, the moment after it the new one."""
    messages: list[Message] = [*run_of(1.0), Carry(T0 + S // 2, 3.0)]
    messages.sort(key=lambda m: m.time)
    measurement, _ = examined([], messages, [], T0 + S)
    assert measurement.payloads.at(T0 + S // 2 - 1) == TOLD.robot.payload
    assert measurement.payloads.at(T0 + S // 2) == Payload(3.0, (0.0, 0.0, 0.0))


@pytest.mark.parametrize('cuts', [[], [10], [20, 60, 61]])
def test_dwell_is_the_longest_stretch_within_the_limit(cuts: list[int]) -> None:
    """An arm down for 0.4 s, up for 0.8 s and down again dwells above for 0.8 s."""
    run: list[Message] = []
    for message in run_of(2.0):
        if isinstance(message, Joints) and 400 * MS <= message.time - T0 < 1200 * MS:
            message = replace(message, position=(-0.9, 0.0))  # noqa: PLW2901
        run.append(message)
    demand = Value('position', 'lift', below=False, limit=0.5, dwell=0.5)
    measurement, _ = examined([Criterion('up', demand)], run, cuts, T0 + 2 * S)
    longest = measure_of(measurement, 'up').kept.longest
    assert longest == (T0 + 400 * MS, T0 + 1200 * MS)


@hypothesis.settings(max_examples=40)
@given(streams(), st.lists(st.integers(0, 120), max_size=4), windows)
def test_known_time_does_not_depend_on_the_pieces(
    messages: list[Message], cuts: list[int], window: Window | None
) -> None:
    """The time of known margins does not depend on how a recording is cut into parts."""
    criteria = [
        Criterion('alert', AlertDemand(raised=False), window=window),
        Criterion('value', Value('position', 'lift', below=True, limit=9.0), window=window),
    ]
    measurement, _ = examined(criteria, messages, cuts, messages[-1].time)
    known = measurement.measures['alert']
    assert isinstance(known, KnownTime)
    assert known.evaluated == measure_of(measurement, 'value').evaluated


def test_visited_cells_are_those_the_run_was_in() -> None:
    """A sweep through half of one joint's range at one position of the other fills half a row."""
    demand = MapDemand(('lift', 'slide'), ((0.0, 1.0), (-0.2, 0.4)), (0.1, 0.1), 0.5)
    sweep: list[Message] = []
    for k, message in enumerate(run_of(1.0)):
        if isinstance(message, Joints):
            # The lift counts downwards from 0.1: messages of 0.1 .. -0.35 are 0 .. 0.45 rad.
            message = replace(message, position=(0.1 - 0.46 * k / 150, 0.05))  # noqa: PLW2901
        sweep.append(message)
    measurement, _ = examined([Criterion('map', demand)], sweep, [7, 50], T0 + S)
    measure = measurement.measures['map']
    assert isinstance(measure, MapMeasure)
    expected = np.zeros((10, 6), np.bool_)
    expected[:5, 2] = True
    np.testing.assert_array_equal(measure.visited, expected)
