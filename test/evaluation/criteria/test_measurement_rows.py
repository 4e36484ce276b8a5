"""Criteria measured over hand-made rows: windows, limits and cells at their very bounds."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from evaluation.margin_rows import S, rows
from evaluation.streams import settings

from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    AlertDemand,
    CriteriaSet,
    Criterion,
    DataDemand,
    Demand,
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
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.model.robot import Payload

TOLD = settings()
BELOW = Value('torque', 'lift', below=True, limit=5.0)
ABOVE = Value('position', 'lift', below=False, limit=0.5)


def measured(
    demand: Demand, parts: Sequence[MarginRows], window: Window | None = None, end: float = 100.0
) -> Any:
    """Return what a demand's measure comes to over the parts of a recording from 0 s."""
    criterion = Criterion('c', demand, window=window)
    found = CriteriaMeasurement(CriteriaSet('', 1, (criterion,), ''), TOLD, 0, round(end * S))
    for part in parts:
        found.add(part)
    found.finish(round(end * S))
    return found.measures['c']


def value(*args: Any, **options: Any) -> ValueMeasure:
    """Return the measure of a value."""
    found = measured(*args, **options)
    assert isinstance(found, ValueMeasure)
    return found


@pytest.mark.parametrize(
    ('window', 'evaluated', 'violated', 'samples'),
    [
        (None, 4.0, 2.0, 4),
        ((0.0, 4.0), 4.0, 2.0, 4),
        ((1.0, 3.0), 2.0, 2.0, 3),  # rows at both ends of the window are samples
        ((1.5, 2.5), 1.0, 1.0, 1),
        ((2.5, 3.5), 1.0, 0.5, 1),
        ((0.25, 0.75), 0.5, 0.0, 0),
        ((5.0, 9.0), 0.0, 0.0, 0),
    ],
)
def test_time_is_counted_within_the_window(
    window: Window | None, evaluated: float, violated: float, samples: int
) -> None:
    """Time evaluated and in violation counts only inside a criterion's window."""
    found = value(BELOW, [rows((0, 1, 2, 3), (1.0, 6.0, 7.0, 2.0))], window)
    assert (found.evaluated / S, found.violation.total / S) == (evaluated, violated)
    assert found.samples == samples


@pytest.mark.parametrize(('demand', 'at'), [(BELOW, (5.0, 4.999)), (ABOVE, (0.5, 0.501))])
def test_the_limit_itself_is_a_violation(demand: Value, at: tuple[float, float]) -> None:
    """A value equal to its limit violates the criterion, from either side."""
    told = rows((0, 1), torque=at, q=[(x, 0.0) for x in at])
    assert value(demand, [told]).violation.total == S


@pytest.mark.parametrize(
    ('until', 'end', 'held'), [(2.5, 9.0, 2.5), (2.5, 2.2, 2.2), (2.5, 1.5, 1.5), (2.0, 9.0, 2.0)]
)
def test_the_last_row_holds_until_the_deadline_or_the_end(
    until: float, end: float, held: float
) -> None:
    """The row at 2 s until its input is stale or the recording ends; none holds after that."""
    found = value(BELOW, [rows((0, 1, 2), until=(1, 2, until))], end=end)
    assert found.evaluated == round(held * S)


@pytest.mark.parametrize(('later', 'held'), [(1.5, 2.5), (3.0, 3.5)])
def test_the_last_row_of_a_part_holds_until_the_next(later: float, held: float) -> None:
    """A part ends with a row at 1 s that is stale at 2.5 s; the next begins at `later`."""
    parts = [rows((0, 1), until=(1, 2.5)), rows(()), rows((later,))]
    assert value(BELOW, parts).evaluated == round(held * S)


def test_what_is_not_known_takes_no_time() -> None:
    """Rows with NaN or without margins add no evaluated time."""
    told = rows((0, 1, 2), (9.0, math.nan, 1.0), known=(False, True, True))
    found = value(BELOW, [told])
    assert (found.evaluated, found.samples, found.violation.total) == (S, 1, 0)
    nothing = value(BELOW, [rows((0, 1), (math.nan, math.nan))])
    assert (nothing.worst, nothing.first, nothing.samples) == ([], None, 0)


def test_the_first_violation_is_the_first_row_beyond_the_limit() -> None:
    """The first violation is the first row beyond the limit, not the worst; later ones stay out."""
    found = value(BELOW, [rows((0, 1, 2), (1.0, 5.5, 9.0)), rows((3, 4), (8.0, 9.5))])
    assert found.first is not None
    assert (found.first.time, found.first.value) == (S, 5.5)
    late = value(BELOW, [rows((0, 1), (1.0, 2.0)), rows((2, 3), (3.0, 6.0))])
    assert late.first is not None
    assert late.first.time == 3 * S


def test_a_violation_before_the_window_is_none() -> None:
    """A violation before a criterion's window does not count; the first inside it does."""
    found = value(BELOW, [rows((0, 1, 2), (9.0, 1.0, 6.0))], (0.5, 9.0))
    assert found.first is not None
    assert found.first.time == 2 * S


def test_a_row_at_the_end_of_the_window_takes_no_time() -> None:
    """A row exactly at the window's end is a sample but adds no time and no violation."""
    found = value(BELOW, [rows((0, 1, 2), (1.0, 6.0, 1.0))], (0.0, 1.0))
    assert (found.samples, found.violation.count, found.violation.total) == (2, 0, 0)


@pytest.mark.parametrize('scale', [1.0, 0.125])
@pytest.mark.parametrize('demand', [BELOW, ABOVE])
def test_the_worst_rows_of_the_four_worst_parts_are_kept(demand: Value, scale: float) -> None:
    """The worst first; of equal ones the earlier; a row that is no worse than these is not."""
    worst = (3.0, 8.0, 1.0, 8.0, 6.0, 3.0, 4.0, 2.0)
    parts = [
        rows((2 * k, 2 * k + 1), (0.0, x * scale), q=[(9.0, 0.0), (-x * scale, 0.0)])
        for k, x in enumerate(worst)
    ]
    found = value(demand, parts)
    sign = 1.0 if demand.below else -1.0
    assert [m.value * sign / scale for m in found.worst] == [8.0, 8.0, 6.0, 4.0]
    assert [m.time // S for m in found.worst] == [3, 7, 9, 13]


def test_a_moment_is_a_row_in_full() -> None:
    """A moment keeps value, joint, posture, attitude and the payload of when the joints came."""
    demand = Value('torque', ANY, below=True, limit=5.0)
    criterion = Criterion('c', demand)
    found = CriteriaMeasurement(CriteriaSet('', 1, (criterion,), ''), TOLD, 0, 9 * S)
    later = Payload(3.0, (0.0, 0.0, 0.0))
    found.payloads.since.append(3 * S // 2 + 1)
    found.payloads.payloads.append(later)
    told = rows((0, 1, 2, 3), ((1.0, 2.0), (3.0, -9.0), (4.0, 0.0), (-8.0, 7.0)),
                q=[(0.0, 0.1), (1.0, 1.1), (2.0, 2.1), (3.0, 3.1)])  # fmt: skip
    found.add(told)
    measure = found.measures['c']
    assert isinstance(measure, ValueMeasure)
    (worst,) = measure.worst
    assert (worst.time, worst.value, worst.subject) == (S, 9.0, 'slide')
    assert (worst.q, worst.gravity) == ((1.0, 1.1), (0.0, 0.0, -2.0))
    assert worst.payload == TOLD.robot.payload
    found.add(rows((4,), ((-10.0, 7.0),), q=[(3.0, 3.1)]))
    worst = measure.worst[0]
    assert (worst.value, worst.subject, worst.payload) == (10.0, 'lift', later)


def test_dwell_is_looked_for_only_where_it_is_asked() -> None:
    """The longest dwell beyond a limit is measured only for criteria that ask for it."""
    told = rows((0, 1, 2, 3), q=[(0.6, 0.0), (0.7, 0.0), (0.5, 0.0), (0.6, 0.0)])
    found = value(Value('position', 'lift', below=False, limit=0.5, dwell=0.0), [told])
    assert (found.kept.total, found.kept.longest) == (3 * S, (0, 2 * S))
    assert value(ABOVE, [told]).kept.total == 0


def visited(
    at: Sequence[tuple[float, float]], window: Window | None = None, known: Sequence[bool] = ()
) -> list[tuple[int, int]]:
    """Return the cells that positions (lift, slide) are in, a second apart."""
    demand = MapDemand(('slide', 'lift'), ((0.0, 0.3), (-1.0, 1.0)), (0.1, 0.5), 0.5)
    found = measured(demand, [rows(range(len(at)), q=at, known=known)], window)
    assert isinstance(found, MapMeasure)
    return [(int(x), int(y)) for x, y in np.argwhere(found.visited)]


@pytest.mark.parametrize(
    ('lift', 'slide', 'cells'),
    [
        (-1.0, 0.0, [(0, 0)]),
        (1.0, 0.3, [(2, 3)]),  # the ends belong to the outermost cells
        (-0.5, 0.05, [(0, 1)]),
        (0.2, 0.15, [(1, 2)]),
        (0.7, 0.25, [(2, 3)]),
        (-1.001, 0.1, []),
        (1.001, 0.1, []),
        (0.0, -0.001, []),
        (0.0, 0.301, []),
    ],
)
def test_a_position_is_in_the_cell_it_falls_into(
    lift: float, slide: float, cells: list[tuple[int, int]]
) -> None:
    """A position falls into the cell that holds it: cells of 0.1 m and 0.5 rad here."""
    assert visited([(lift, slide)]) == cells


@pytest.mark.parametrize(
    ('high', 'cell', 'count'), [(0.3, 0.1, 3), (0.31, 0.1, 4), (0.05, 0.1, 1), (0.0, 0.1, 1)]
)
def test_a_range_has_as_many_cells_as_it_takes(high: float, cell: float, count: int) -> None:
    """A range of 0.3 in cells of 0.1 has three, despite rounding; a tiny range has one."""
    demand = MapDemand(('lift', 'slide'), ((0.0, high), (0.2, 0.9)), (cell, 0.2), 0.5)
    assert measured(demand, []).visited.shape == (count, 4)


def test_cells_are_visited_within_the_window_where_margins_are_known() -> None:
    """A cell counts as visited only by rows in the window, ends included, with known margins."""
    path = [(-0.9, 0.05), (-0.4, 0.05), (0.1, 0.05), (0.6, 0.05)]
    assert visited(path, (1.0, 2.0)) == [(0, 1), (0, 2)]
    assert visited(path, (0.5, 2.5)) == [(0, 1), (0, 2)]
    assert visited(path, known=(True, False, True, True)) == [(0, 0), (0, 2), (0, 3)]


ALERT = AlertDemand(raised=False)


@pytest.mark.parametrize(
    ('window', 'evaluated'),
    [(None, 3.0), ((0.5, 9.0), 2.5), ((0.0, 0.25), 0.25), ((2.5, 3.5), 1.0), ((5.0, 9.0), 0.0)],
)
def test_the_time_in_which_alerts_could_come_is_that_of_known_rows(
    window: Window | None, evaluated: float
) -> None:
    """Rows at 0, 1, 2 and 3 s, of which that at 1 s is not known; the last is stale at 4 s."""
    known = measured(ALERT, [rows((0, 1, 2, 3), known=(True, False, True, True))], window)
    assert isinstance(known, KnownTime)
    assert known.evaluated == round(evaluated * S)


def test_the_known_time_of_a_last_row_ends_with_what_comes_next() -> None:
    """The next part, staleness, the end; none where the last row is not known."""
    first = rows((0, 1), until=(1, 2.5))
    assert measured(ALERT, [first, rows(()), rows((1.5,), until=(1.5,))]).evaluated == 3 * S // 2
    assert measured(ALERT, [first, rows((3,), until=(3,))]).evaluated == 5 * S // 2
    assert measured(ALERT, [first], end=2.0).evaluated == 2 * S
    assert measured(ALERT, [first], end=0.5).evaluated == S // 2
    unknown = rows((0, 1), until=(1, 2.5), known=(True, False))
    assert measured(ALERT, [unknown]).evaluated == S
    early = measured(ALERT, [rows((0,), until=(0.5,)), rows((2, 3), known=(False, False))])
    assert early.evaluated == S // 2


def test_a_window_counts_from_the_start_of_the_recording() -> None:
    """A window is given in seconds from the recording's start; without one all of it counts."""
    found = CriteriaMeasurement(CriteriaSet('', 1, (), ''), TOLD, 7 * S, 20 * S)
    assert found.span_of(None) == (7 * S, 20 * S)
    assert found.span_of((0.5, 2.25)) == (15 * S // 2, 37 * S // 4)


@pytest.mark.parametrize(
    ('signal', 'detail'),
    [('torque', False), ('tip_angle', False), ('tip_energy', True), ('zmp', True)],
)
def test_energies_and_zmp_need_detail(signal: str, *, detail: bool) -> None:
    """Energies and the ZMP are computed only if a criterion needs them."""
    other = Criterion('b', DataDemand('gaps'))
    demand = Criterion('c', Value(signal, ANY, below=False, limit=1.0))
    found = CriteriaMeasurement(CriteriaSet('', 1, (other, demand), ''), TOLD, 0, S)
    assert found.detail is detail
    assert list(found.measures) == ['c']  # what is demanded of the data is not measured here
