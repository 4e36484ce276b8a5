"""Margins that become unknown neither raise nor hold the alerts of the robot."""

import math
from typing import Any

import pytest
from evaluation.streams import (
    MS,
    T0,
    Imu,
    Message,
    S,
    live,
    recorded,
    run_of,
    settings,
    split,
    tilted,
    upright,
)

from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.settings import Delays

OVER = tilted(math.radians(60.0))


def toppled(until: float, *, start: float = 1.0, seconds: float = 12.0) -> list[Message]:
    """Return a run in which the robot lies from `start` to `until` (s), then the IMU is silent."""
    messages: list[Message] = []
    for m in run_of(seconds):
        at = (m.time - T0) / S
        if isinstance(m, Imu) and at > until:
            continue
        lies = isinstance(m, Imu) and at >= start
        messages.append(Imu(m.time, OVER, acceleration=upright(OVER)) if lies else m)
    return messages


def both(
    messages: list[Message], end: int, delays: Delays | None = None
) -> tuple[list[Any], list[Any]]:
    """Return the alerts about tipping, live (with ticks) and recorded (cut into parts)."""
    ticks, by = range(T0, end, 50 * MS), settings(delays=delays)
    _, told = live(by, messages, end, ticks)
    _, evaluator = recorded(by, split(messages, range(0, len(messages), 37)), end)
    return facts(told), facts(evaluator.watch.log)


def facts(log: list[Alert]) -> list[Any]:
    """Return rule, begin and end (ms after T0) of the alerts about tipping, in order."""
    return sorted(
        (a.rule.code, a.rule.subject, a.rule.level, (a.start - T0) // MS,
         None if a.end is None else (a.end - T0) // MS)
        for a in log if a.rule.code in ('TIP_OVER', 'NO_SUPPORT')
    )  # fmt: skip


def test_an_alert_is_not_held_by_an_imu_that_is_silent() -> None:
    """It ends as if the robot stood: its latch is the alarm's, NO DATA the input's business."""
    told, found = both(toppled(3.0), T0 + 12 * S)
    assert told == found
    assert told
    assert all(end is not None and 8_000 <= end <= 8_200 for *_, end in told)


@pytest.mark.parametrize('until', [1.05, 1.2, 1.35])
def test_no_alert_is_raised_by_margins_of_before(until: float) -> None:
    """A robot that lay for less than the delay, and was not seen after, raises nothing."""
    told, found = both(toppled(until, seconds=3.0), T0 + 3 * S, Delays(tip_on=0.5))
    assert told == found == []


def test_a_gap_shorter_than_the_off_delay_keeps_one_alert() -> None:
    """A silence of a second in between does not end it."""
    lying = toppled(9.0, seconds=10.0)
    messages = [m for m in lying if not (isinstance(m, Imu) and 4 * S < m.time - T0 < 5 * S)]
    told, found = both(messages, T0 + 10 * S)
    assert told == found
    assert {end for *_, end in told} == {None}
