"""After a fall: whether a robot has tipped, and that nothing but to stand clear is said then."""

import math
from dataclasses import replace

import numpy as np
import pytest
from evaluation.margin_rows import S, rows
from evaluation.streams import settings
from hypothesis import given
from hypothesis import settings as effort
from hypothesis import strategies as st

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.advice.recorded import AlertAdvice
from ugv_acceptance.evaluation.advice.search import advise, advise_each, margin_names
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR, TIPPED, has_tipped
from ugv_acceptance.evaluation.alerts.state_machine import WARN, Alert, Rule
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import margins

PACKBOT = load('packbot').settings


@pytest.mark.parametrize(
    ('left', 'tipped'),
    [
        ((5.0, 5.0, 5.0, 5.0), False),
        ((5.0, -19.9, 5.0, 5.0), False),
        ((5.0, -20.0, 5.0, 5.0), True),
        ((math.inf, -35.0, math.nan, 80.0), True),
        ((math.nan,) * 4, False),
        ((math.inf,) * 4, False),
        ((), False),
    ],
)
def test_it_has_tipped_from_so_far_past_on(left: tuple[float, ...], *, tipped: bool) -> None:
    """One side twenty degrees past tipping is a fall; what is not known or has no edge is none."""
    assert math.degrees(TIPPED) == pytest.approx(20.0)
    assert has_tipped([math.radians(x) for x in left]) is tipped


@effort(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.floats(-3.0, 3.0)] * 4),
    st.floats(-math.pi, math.pi),
    st.floats(0.0, math.pi),
    st.floats(0.0, 8.0),
    st.sampled_from([None, *margin_names(PACKBOT)]),
)
def test_a_robot_that_has_tipped_is_only_told_to_stand_clear(
    q: tuple[float, ...], around: float, tilt: float, mass: float, of: str | None
) -> None:
    """No motion, no turn, no load to set down, whatever the margin and the posture."""
    flat = math.sin(tilt)
    down = 9.81 * np.array((flat * math.cos(around), flat * math.sin(around), -math.cos(tilt)))
    load_ = Payload(mass)
    tipped = has_tipped(margins(PACKBOT.robot, q, down, load_).angle)
    told = advise(PACKBOT, q, down.tolist(), load_, of)
    assert (STAND_CLEAR in {a.sentence for a in told}) is tipped
    if tipped:
        assert [(a.kind, a.enough) for a in told] == [('stand_clear', False)]


def test_a_fall_beside_others_is_told_apart() -> None:
    """Of two situations asked at once only the one that has tipped is told to stand clear."""
    q = (0.0, 0.3, 0.2, 2.0)
    standing, lying = (0.0, 0.0, -9.81), (0.0, -9.81, -1.0)
    told = advise_each(PACKBOT, [q, q], [standing, lying], Payload(4.0), [None, 'elbow_joint'])
    assert {a.kind for a in told[0]} >= {'joint', 'payload'}
    assert [a.sentence for a in told[1]] == [STAND_CLEAR]
    assert told[0] == advise(PACKBOT, q, standing, Payload(4.0))


@pytest.mark.parametrize('code', ['TORQUE_LIMIT', 'NO_SUPPORT', 'TIP_AHEAD', 'IMU_RATES'])
def test_what_is_raised_after_a_fall_says_to_stand_clear(code: str) -> None:
    """An alert of a recording keeps the advice of its moment; after the fall none moves it."""
    rule = Rule(code, 'lift', WARN, 36.0, 34.0, 0, 0)
    log = [Alert(rule, 1 * S, 40.0)]
    gathered = AlertAdvice(settings(), log, lambda _: Payload(2.0, (0.0, 0.0, 0.0)))
    before, after = rows((0, 1), gravity=((0.0, 0.0, -9.81),) * 2), rows((2,))
    gathered.add(before)
    log += [Alert(rule, 2 * S, 40.0), Alert(rule, 3 * S, 40.0)]
    gathered.add(replace(after, angle=np.array([[1.0, math.inf, math.nan, -TIPPED]])))
    log.append(Alert(rule, 9 * S, 40.0))
    told = gathered.sentences()
    assert [told.get(id(alert)) == STAND_CLEAR for alert in log] == [False, True, True, True]
