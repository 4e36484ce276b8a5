"""A criterion on a value, over hand-made rows: its numbers, and allowances at their end."""

import json
import math
from dataclasses import replace
from typing import Any

import pytest
from evaluation.hand_made import alert, findings, made, seconds
from evaluation.streams import settings

from ugv_acceptance.evaluation.criteria.criteria import ANY, Value
from ugv_acceptance.evaluation.criteria.findings import Outcome
from ugv_acceptance.evaluation.criteria.uncertainty import Source
from ugv_acceptance.evaluation.criteria.verdict import judge_value
from ugv_acceptance.evaluation.settings import Limits

TOLD = settings(limits=Limits((45.0, math.inf)))
BELOW = Value('torque', 'lift', below=True, limit=25.0)
# 10 N m for a second, 30 for two, 20 for three, -40 for the last four.
RUN = made(
    seconds(0, 1, 3, 6),
    until=seconds(1, 3, 6, 10),
    torque=[(10.0, 1.0), (30.0, 2.0), (20.0, 3.0), (-40.0, 4.0)],
    angle=[(0.4, 0.5, 0.6, 0.7), (0.4, 0.2, 0.6, 0.7), (0.1, 0.5, 0.6, 0.7), (0.4,) * 4],
    q=[(0.0, 0.0), (0.1, 0.01), (0.2, 0.02), (0.3, 0.03)],
)
DEG = 180.0 / math.pi


def judged(demand: Value, *parts: Any, **options: Any) -> Outcome:
    """Return what becomes of a demand on the run, or on other rows."""
    return judge_value(*findings(TOLD, demand, parts or (RUN,), **options))


def test_a_violation_is_told_with_all_its_numbers() -> None:
    """Seconds since the start; the limit, the worst and the way between them in one unit."""
    found = judged(BELOW)
    assert found.verdict == 'FAIL'
    assert found.reason == (
        'static torque (magnitude) of lift was 40 N m at 6.00 s; must stay below 25 N m '
        '(6.00 s in violation)'
    )
    told = found.measured
    assert (told['signal'], told['of'], told['unit']) == ('torque', 'lift', 'N m')
    assert (told['limit'], told['must_be'], told['worst']) == (25.0, 'below', 40.0)
    assert (told['worst_of'], told['at_s'], told['distance']) == ('lift', 6.0, -15.0)
    assert told['moment']['joints']['lift']['position'] == pytest.approx(0.3 * DEG)
    assert told['first_violation']['joints']['lift']['position'] == pytest.approx(0.1 * DEG)
    assert (told['uncertainty'], told['inside_bound']) == (None, False)
    assert (told['evaluated_s'], told['evaluated_share']) == (10.0, 1.0)
    assert (told['time_in_violation_s'], told['share_in_violation']) == (6.0, 0.6)
    assert (told['violations'], told['longest_violation_s']) == (2, 4.0)
    assert told['first_violations_s'] == [[1.0, 3.0], [6.0, 10.0]]
    assert told['longest_kept_s'] is None


def test_a_tilt_is_told_in_degrees() -> None:
    """Of any side the one that has least left; above its limit it is met."""
    demand = Value('tip_angle', ANY, below=False, limit=0.05)
    told = judged(demand).measured
    assert (told['must_be'], told['worst_of'], told['unit']) == ('above', 'front', 'deg')
    assert told['limit'] == pytest.approx(0.05 * DEG)
    assert told['worst'] == pytest.approx(0.1 * DEG)
    assert told['distance'] == pytest.approx(0.05 * DEG)
    assert told['at_s'] == 3.0
    assert told['first_violation'] is None


def test_a_window_takes_its_share_of_what_holds() -> None:
    """From 2 s to 8 s: one second of 30 N m, three of 20, two of 40."""
    told = judged(BELOW, window=(2.0, 8.0)).measured
    assert (told['evaluated_s'], told['evaluated_share']) == (6.0, 1.0)
    assert (told['time_in_violation_s'], told['share_in_violation']) == (3.0, 0.5)
    assert told['first_violations_s'] == [[2.0, 3.0], [6.0, 8.0]]


@pytest.mark.parametrize(
    ('allowed', 'verdict'),
    [
        ({'time_in_violation': 6.0}, 'PASS'), ({'time_in_violation': 5.999}, 'FAIL'),
        ({'longest_violation': 4.0}, 'PASS'), ({'longest_violation': 3.999}, 'FAIL'),
        ({'share_in_violation': 0.6}, 'PASS'), ({'share_in_violation': 0.599}, 'FAIL'),
        ({'time_in_violation': 6.0, 'longest_violation': 3.0}, 'FAIL'),
        ({'dwell': 3.0}, 'PASS'), ({'dwell': 3.001}, 'FAIL'),
    ],
    ids=str,
)  # fmt: skip
def test_an_allowance_may_be_used_up(allowed: dict[str, Any], verdict: str) -> None:
    """A violation may use up its whole allowance, and no more."""
    found = judged(replace(BELOW, **allowed))
    assert found.verdict == verdict
    assert found.measured['longest_kept_s'] == (3.0 if 'dwell' in allowed else None)


@pytest.mark.parametrize(
    ('demand', 'verdict'),
    [
        (replace(BELOW, limit=40.0), 'FAIL'),
        (replace(BELOW, limit=40.001), 'PASS'),
        (Value('tip_angle', ANY, below=False, limit=0.1), 'FAIL'),
        (Value('tip_angle', ANY, below=False, limit=0.0999), 'PASS'),
    ],
    ids=str,
)
def test_the_limit_itself_is_not_kept(demand: Value, verdict: str) -> None:
    """A value equal to its limit does not keep it: below and above are strict."""
    assert judged(demand).verdict == verdict


def test_a_dwell_that_was_not_seen_may_have_been_where_data_are_missing() -> None:
    """A dwell not seen is INCONCLUSIVE where data are missing; a broken limit still fails."""
    assert judged(replace(BELOW, dwell=5.0), end=40.0).verdict == 'INCONCLUSIVE'
    assert judged(replace(BELOW, dwell=3.0), end=40.0).verdict == 'INCONCLUSIVE'
    assert judged(BELOW, end=40.0).verdict == 'FAIL'
    assert judged(replace(BELOW, limit=50.0), end=40.0).verdict == 'INCONCLUSIVE'


def test_what_is_never_known_or_never_holds_decides_nothing() -> None:
    """A value that is never known, is infinite, or holds for no time is INCONCLUSIVE."""
    unknown = made(seconds(0, 1), known=[False, False])
    found = judged(BELOW, unknown)
    assert (found.verdict, found.reason) == ('INCONCLUSIVE', 'it: no value could be computed')
    assert (found.measured['worst'], found.measured['share_in_violation']) == (None, 0.0)
    free = judged(Value('torque_margin', 'slide', below=False, limit=0.0)).measured
    assert (free['worst'], free['worst_of'], free['at_s'], free['moment']) == (None,) * 4
    last = made(seconds(10), torque=[(30.0, 0.0)])
    assert judged(replace(BELOW, share_in_violation=0.5), last).verdict == 'INCONCLUSIVE'
    none = judged(BELOW, made(seconds(0), torque=[(9.0, 0.0)]), end=0.0)
    assert (none.verdict, none.measured['evaluated_share']) == ('INCONCLUSIVE', 0.0)


def test_a_side_without_an_edge_keeps_what_must_stay_above() -> None:
    """Its tilt is infinite, also where other rows are not known, and is told in words."""
    rear = [(0.4, 0.5, math.inf, 0.7)] * 2
    angle = [(math.nan,) * 4, *rear]
    rows = made(seconds(0, 1, 2), angle=angle, until=seconds(1, 2, 10))
    kept = judged(Value('tip_angle', 'rear', below=False, limit=0.1), rows, coverage=0.5)
    assert kept.verdict == 'PASS'
    assert (kept.measured['worst'], kept.measured['worst_of']) == (None, 'rear')
    broken = judged(Value('tip_angle', 'rear', below=True, limit=0.1), rows, coverage=0.5)
    assert (broken.verdict, broken.reason) == (
        'FAIL',
        'tilt left of rear was infinite at 1.00 s; must stay below 5.73 deg (9.00 s in violation)',
    )
    json.dumps(broken.measured, allow_nan=False)


HEAVY = Source('arm.mass_kg', 'arm', 'mass', 0.5)
LEVER = 0.5 * 9.81 * 0.5  # what 0.5 kg at half a metre are to the level lift, N m


@pytest.mark.parametrize(
    ('room', 'method', 'verdict'),
    [
        (LEVER - 0.01, 'rss', 'INCONCLUSIVE'),
        (LEVER + 0.01, 'rss', 'PASS'),
        (LEVER - 0.01, 'ignored', 'PASS'),
        (-0.01, 'rss', 'FAIL'),
    ],
)
def test_a_limit_met_by_less_than_the_bound_is_not_met_for_sure(
    room: float, method: str, verdict: str
) -> None:
    """A limit met by less than the uncertainty bound is INCONCLUSIVE, and the bound is told."""
    level = made(seconds(0), until=seconds(10), torque=[(20.0, 0.0)])
    demand = replace(BELOW, limit=20.0 + room)
    found = judged(demand, level, sources=[HEAVY], method=method)
    assert found.verdict == verdict
    assert found.measured['uncertainty']['bound'] == pytest.approx(LEVER)
    assert found.measured['inside_bound'] == (0.0 < room < LEVER)
    allowed = replace(demand, time_in_violation=99.0)
    assert judged(allowed, level, sources=[HEAVY], method=method).verdict == 'PASS'


def test_how_little_was_left_is_told_beside_the_bound() -> None:
    """A pass within its uncertainty tells what was left and the bound, with their unit."""
    level = made(seconds(0), until=seconds(10), torque=[(20.0, 0.0)])
    found = judged(replace(BELOW, limit=21.0), level, sources=[HEAVY])
    assert found.reason == 'it: met by 1 N m, less than its uncertainty of 2.45 N m'
    share = Value('torque_utilisation', 'lift', below=True, limit=20.0 / 45.0 + 0.01)
    found = judged(share, level, sources=[HEAVY])
    assert found.reason.startswith('it: met by 0.01, less than its uncertainty of 0.0545')


@pytest.mark.parametrize(
    ('code', 'subject', 'start', 'end', 'related'),
    [
        ('TORQUE_LIMIT', 'lift', 3.0, 4.0, True), ('TORQUE_LIMIT', 'slide', 3.0, 4.0, False),
        ('TIP_OVER', 'lift', 3.0, 4.0, False), ('TORQUE_LIMIT', 'lift', 0.0, 2.0, True),
        ('TORQUE_LIMIT', 'lift', 0.0, 1.99, False), ('TORQUE_LIMIT', 'lift', 8.0, None, True),
        ('TORQUE_LIMIT', 'lift', 8.01, None, False), ('TORQUE_LIMIT', 'lift', 0.0, None, True),
    ],
)  # fmt: skip
def test_alerts_of_the_same_margin_in_the_window_are_evidence(
    code: str,
    subject: str,
    start: float,
    end: float | None,
    related: bool,  # noqa: FBT001
) -> None:
    """The evidence of a violation lists alerts about the same margin within the window."""
    one = alert(code, subject, start, end)
    found = judged(BELOW, window=(2.0, 8.0), alerts=[one])
    assert len(found.evidence) == related
    every = judged(replace(BELOW, of=ANY), window=(2.0, 8.0), alerts=[one])
    assert len(every.evidence) == (related or subject == 'slide')
    if related:
        until = 'the end' if end is None else f'{end:.2f} s'
        assert found.evidence[0].startswith(f'CAUTION TORQUE_LIMIT from {start:.2f} s to {until}: ')
