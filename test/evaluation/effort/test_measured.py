"""Measured saturation and residuals: how long they must last, and what they are worth."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from evaluation.margin_rows import S, rows
from evaluation.streams import settings
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.criteria.statement import Objection
from ugv_acceptance.evaluation.effort.facts import (
    CONSTANT,
    NONE,
    OTHER_SIGN,
    SATURATED,
    SCALED,
    TORQUE,
    UNKNOWN,
    JointMeaning,
    Ratio,
)
from ugv_acceptance.evaluation.effort.lasting import Lasting, Spell
from ugv_acceptance.evaluation.effort.measured import MeasuredLimits
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Limits

TOLD = settings(limits=Limits((50.0, 30.0)))
SLIDE = JointMeaning('slide', 'N', NONE)


def objections(
    effort: Sequence[float],
    meaning: JointMeaning,
    torque: float = 20.0,
    apart: float = 0.05,
    other: JointMeaning = SLIDE,
) -> list[Objection]:
    """Return what is objected to rows so many seconds apart with an effort of the lift."""
    n = len(effort)
    ends = [apart * (k + 1) for k in range(n)]
    told = rows([apart * k for k in range(n)], torque=[torque] * n, until=ends)
    joints = replace(told.pairs.joints, effort=np.column_stack((effort, np.full(n, np.nan)))[::-1])
    found = MeasuredLimits(TOLD)
    found.add(replace(told, pairs=replace(told.pairs, joints=joints)))
    return list(found.objections((meaning, other), 0))


def lift(meaning: str, **more: Any) -> JointMeaning:
    """Return a meaning of the lift."""
    return JointMeaning('lift', 'N m', meaning, **more)


@pytest.mark.parametrize(
    ('meaning', 'verdicts'),
    [
        (lift(TORQUE), ['FAIL', 'INCONCLUSIVE']),
        (lift(OTHER_SIGN), ['FAIL', 'INCONCLUSIVE']),
        (lift(SATURATED, below=TORQUE), ['FAIL', 'INCONCLUSIVE']),
        (lift(SATURATED, below=UNKNOWN), ['INCONCLUSIVE']),
        (lift(UNKNOWN), ['INCONCLUSIVE']),
        (lift(SCALED, ratio=Ratio(3.0, 2.9, 3.1)), ['INCONCLUSIVE']),
        (lift(CONSTANT), []),
        (lift(NONE), []),
    ],
)
def test_an_effort_beyond_the_limit_counts_by_its_meaning(
    meaning: JointMeaning, verdicts: list[str]
) -> None:
    """70 of 50 N m: a torque fails, an unknown effort is INCONCLUSIVE, a constant is neither."""
    found = objections([20.0] * 20 + [70.0] * 20 + [20.0] * 20, meaning)
    assert [x.verdict for x in found if x.safeguard == 'measured_effort'] == verdicts[:1]
    assert all('lift' in x.reason for x in found)


@pytest.mark.parametrize(('count', 'told'), [(1, False), (2, True), (3, True)])
def test_a_limit_must_be_reached_for_as_long_as_an_alert_needs(count: int, *, told: bool) -> None:
    """A tenth of a second; one wild number is none."""
    effort = [20.0] * 10 + [50.0] * count + [20.0] * 10
    found = [x for x in objections(effort, lift(TORQUE)) if x.safeguard == 'measured_effort']
    assert bool(found) is told


def test_efforts_of_one_other_unit_are_held_against_the_limit_in_it() -> None:
    """In percent 70 is no torque; two joints of one unit tell where the limit of 50 N m lies."""
    unit = Ratio(2.0, 1.9, 2.1)
    other = JointMeaning('slide', 'N', SCALED, ratio=unit)
    fine = objections([70.0] * 20, lift(SCALED, ratio=unit), other=other)
    assert not fine
    (beyond,) = objections([120.0] * 20, lift(SCALED, ratio=unit), other=other)
    assert (beyond.safeguard, beyond.verdict) == ('measured_effort', 'INCONCLUSIVE')


@pytest.mark.parametrize(
    ('effort', 'torque', 'count', 'told'),
    [
        (35.0, 40.0, 20, False),  # 5 of 10 N m
        (29.0, 40.0, 20, True),  # 11 of 10 N m
        (29.0, 40.0, 9, False),  # for less than half a second
        (-29.0, -40.0, 20, True),
        (0.0, 51.0, 20, False),  # beyond the limit by the model already
    ],
)
def test_a_difference_larger_than_the_margin_left_is_no_pass(
    effort: float, torque: float, count: int, *, told: bool
) -> None:
    """The model is not believed over the measurement where that could be the difference."""
    found = objections([effort] * count, lift(TORQUE), torque=torque)
    assert [x.safeguard for x in found] == ['residual'] * told
    turned = objections([-effort] * count, lift(OTHER_SIGN), torque=torque)
    assert [x.safeguard for x in turned] == ['residual'] * told
    assert not objections([effort] * count, lift(UNKNOWN), torque=torque)


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.lists(st.integers(0, 60), max_size=5))
def test_spells_are_the_same_however_a_recording_is_cut(bad: list[bool], cuts: list[int]) -> None:
    """Rows a second apart that hold for a second, against a count by hand; least two seconds."""
    n = len(bad)
    time, value = np.arange(n) * S, np.arange(n, dtype=np.float64)
    parted = Lasting(2 * S)
    edges = sorted({0, n, *(min(cut, n) for cut in cuts)})
    for a, b in pairwise(edges):
        parted.add(time[a:b], time[a:b] + S, np.array(bad[a:b]), value[a:b])
    expected, first = [], None
    for k, one in enumerate([*bad, False]):
        if one and first is None:
            first = k
        if not one and first is not None:
            if k - first >= 2:
                expected.append(Spell(first * S, k * S, k - 1.0))
            first = None
    assert parted.spells() == expected


# Efforts and torques at, just below and far beyond limits and margins, or not known.
NUMBERS = st.sampled_from(
    [0.0, 9.99, 10.01, -20.0, 25.0, 29.97, 30.0, -49.9, 49.95, 50.0, 70.0, math.nan, math.inf]
)
PAIRS = st.tuples(NUMBERS, NUMBERS)
ROW = st.tuples(PAIRS, PAIRS, st.booleans(), st.sampled_from([1.0, 0.0, -0.1]))


def part(some: list[Any], first: int) -> MarginRows:
    """Return rows of a tenth of a second from effort, torque, known, least tilt left."""
    efforts, torques, known, tilt = zip(*some, strict=True)
    times = [0.1 * (first + k) for k in range(len(some))]
    ends = [0.1 * (first + k + 1) for k in range(len(some))]
    told = rows(times, torque=torques, until=ends, known=known)
    joints = replace(told.pairs.joints, effort=np.array(efforts)[::-1])
    angle = np.column_stack((np.ones((len(some), 3)), tilt))
    return replace(told, angle=angle, pairs=replace(told.pairs, joints=joints))


@pytest.mark.parametrize('limits', [(50.0, 30.0), (50.0, math.inf)])
@given(some=st.lists(ROW, min_size=1, max_size=40), cuts=st.lists(st.integers(1, 39), max_size=4))
def test_joints_with_nothing_to_tell_are_left_out_and_nothing_else(
    limits: tuple[float, float], some: list[Any], cuts: list[int]
) -> None:
    """Part by part the same spells and sizes as of every row and joint, one after the other."""
    found, limit = MeasuredLimits(settings(limits=Limits(limits))), np.array(limits)
    edges = sorted({0, *(cut for cut in cuts if cut < len(some)), len(some)})
    parts = [part(some[a:b], a) for a, b in pairwise(edges)]
    over = [Lasting(found._over[0].least) for _ in limit]
    apart = {sign: [Lasting(found._apart[sign][0].least) for _ in limit] for sign in (1.0, -1.0)}
    most = np.zeros(2)
    for told in parts:
        found.add(told)
        effort, torque = told.effort, told.torque
        with np.errstate(invalid='ignore'):
            size, left = np.abs(effort), limit - np.abs(torque)
            judged = (told.known & ~(told.angle.min(axis=1) <= 0.0))[:, None]
            judged = judged & (left > 0.0) & np.isfinite(left)
            for j in range(2):
                over[j].add(told.time, told.until, size[:, j] >= 0.999 * limit[j], size[:, j])
                for sign, lasting in apart.items():
                    off = np.abs(sign * effort - torque)
                    bad = ((off > left) & judged)[:, j]
                    lasting[j].add(told.time, told.until, bad, off[:, j])
            twice = np.fmin(size[1:], size[:-1])
        most = np.fmax(most, np.nan_to_num(np.fmax.reduce(twice, axis=0, initial=0.0)))
    assert found._over == over
    assert found._apart == apart
    assert found.most.tolist() == most.tolist()
