"""Live looks are judged one at a time, those of a recording in arrays: the same values."""

import math

import numpy as np
from evaluation.streams import settings
from hypothesis import example, given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.alerts.prediction import foresight_of
from ugv_acceptance.evaluation.alerts.prediction_limits import SPACING
from ugv_acceptance.evaluation.alerts.prediction_live import LivePrediction, Look
from ugv_acceptance.evaluation.alerts.state_machine import WARN, Rule, Signal
from ugv_acceptance.evaluation.settings import Limits

SIDES, JOINTS = 4, 2
LIMITS = st.tuples(*[st.sampled_from([20.0, 0.5, math.inf])] * JOINTS)
# Steps from one look to the next: none, noise, steady, a jump.
STEPS = st.sampled_from([0.0, 0.0, 1e-4, -1e-4, -0.02, 0.05, -0.9, 1.5])
ODD = st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -0.0])


@st.composite
def looks(draw: st.DrawFn) -> list[tuple[int, list[float]]]:
    """Return looks: times (ns), and angle, torque, effort and position that mostly go on evenly."""
    width = SIDES + 3 * JOINTS
    row = [draw(st.sampled_from([0.1, 0.4, 5.0, 15.0])) for _ in range(width)]
    steps = [draw(STEPS) for _ in range(width)]
    time, found = 10**18, []
    for _ in range(draw(st.integers(1, 30))):
        time += SPACING * draw(st.sampled_from([1, 1, 1, 1, 1, 3, 20]))
        if draw(st.integers(0, 6)) == 0:
            steps = [draw(STEPS) for _ in range(width)]
        row = [a + b for a, b in zip(row, steps, strict=True)]
        told = list(row)
        if draw(st.integers(0, 9)) == 0:
            told[draw(st.integers(0, width - 1))] = draw(ODD)
        found.append((time, told))
    return found


# A tilt that was not known, and then is past any limit.
LOST = [
    (10**18 + SPACING * k, [told, *[0.1] * (SIDES + 3 * JOINTS - 1)])
    for k, told in enumerate([0.1, math.nan, math.nan, math.nan, math.nan, 0.1, -math.inf])
]


@example(LOST, (20.0, 20.0))
@given(looks(), LIMITS)
def test_one_at_a_time_says_what_arrays_say(
    rows: list[tuple[int, list[float]]], limit: tuple[float, ...]
) -> None:
    """Each rule has the same value at each look, to the last bit, also of NaN and infinities."""

    def signal(code: str, subject: str, at: tuple[float, float], delay: float) -> Signal:
        return Signal(Rule(code, subject, WARN, *at, round(delay), 0), [])

    arrays = foresight_of(settings(limits=Limits(limit)), signal)
    time = np.array([at for at, _ in rows], np.int64)
    expected = arrays.values(time, np.array([row for _, row in rows]), np.array(limit))
    live = LivePrediction(JOINTS)
    for k, (at, row) in enumerate(rows):
        parts = np.split(np.array(row), [SIDES, SIDES + JOINTS, SIDES + 2 * JOINTS])
        found = live.step(Look(at, *(tuple(part.tolist()) for part in parts)), limit)
        for rule, values, table in zip(found._fields, found, expected, strict=True):
            np.testing.assert_array_equal(values, table[k], err_msg=f'{rule} at look {k}')
