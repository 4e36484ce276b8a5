"""A noisy margin about its limit calls the operator once, and hides nothing by it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.alerts.state_machine import Alert, Rule, Signal

PERIOD = 20_000_000  # ns: 50 Hz
PACKBOT = RuleSet(load().settings)
RULES = [signal.rule for pair in (*PACKBOT.tip, *PACKBOT.torque) for signal in pair]


def alerts(rule: Rule, values: list[float]) -> list[Alert]:
    """Return the alerts of values at 50 Hz."""
    log: list[Alert] = []
    signal = Signal(rule, log)
    for k, value in enumerate(values):
        signal.step(k * PERIOD, value)
    return log


@pytest.mark.parametrize('swings', [0.0, 0.5, 2.0, 5.0, 12.0, 40.0])
@pytest.mark.parametrize('rule', PACKBOT.tip[0], ids=lambda s: f'level{s.rule.level}')
def test_a_margin_hovering_about_its_limit_calls_once(rule: Signal, swings: float) -> None:
    """Ten minutes of +/-1 deg with 0.5 deg of noise: one alert; a bare threshold gives 3000."""
    time = np.arange(0.0, 600.0, 0.02)
    noise = np.random.default_rng(6).normal(0.0, math.radians(0.5), len(time))
    swing = math.radians(1.0) * np.sin(2.0 * math.pi * swings / 60.0 * time)
    values = (rule.rule.on + swing + noise).tolist()
    bare = Rule('X', 'x', 1, rule.rule.on, rule.rule.on, 0, 0)
    assert len(alerts(rule.rule, values)) <= 1
    assert len(alerts(bare, values)) > 1000


@given(
    st.sampled_from([r for r in RULES if math.isfinite(r.on)]),
    st.lists(st.floats(-2.0, 0.99), max_size=60),
    st.integers(1, 30),
    st.lists(st.floats(-2.0, 0.99), max_size=60),
)
def test_no_true_excursion_longer_than_the_on_delay_is_hidden(
    rule: Rule, before: list[float], length: int, after: list[float]
) -> None:
    """Whatever is before or after, an alert is active when an excursion's on-delay is over."""
    span = abs(rule.on - rule.off) or 1.0
    calm = [[rule.on + (x - 1.0) * span for x in part] for part in (before, after)]
    values = [*calm[0], *[rule.on + span] * length, *calm[1]]
    begin, end = len(before) * PERIOD, (len(before) + length - 1) * PERIOD
    if end - begin < rule.on_delay:
        return
    due = begin + rule.on_delay
    assert any(a.start <= due and (a.end is None or a.end > due) for a in alerts(rule, values))
