"""Margins are held back until no contradiction can reach them any more."""

import math

import numpy as np
from evaluation.hand_made import BEGIN, S, made, seconds

from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Alert, Rule
from ugv_acceptance.evaluation.holding_back import LONGEST_REACH, HeldMargins
from ugv_acceptance.model.stability import UNKNOWN


def contradiction(start: float, reach: float) -> Alert:
    """Return an alert at `start` that makes the `reach` before it doubtful (s)."""
    rule = Rule('IMU_INCONSISTENT', 'imu', ERROR, 0.5, 0.5, 0, 0, reach=round(reach * S))
    return Alert(rule, BEGIN + round(start * S), 1.0)


def test_a_contradiction_blanks_what_it_reaches_and_nothing_else() -> None:
    """From its reach before the alert to the alert: what is known at both came before it."""
    held = HeldMargins([contradiction(5.0, 2.0)])
    rows = made(seconds(2.9, 3.0, 4.9, 5.0, 5.01))
    assert not list(held.add(rows))
    (found,) = held.finish()
    assert found.known.tolist() == [True, False, False, False, True]
    assert np.isnan(found.angle[1:4]).all()
    assert np.isnan(found.torque[1:4]).all()
    assert found.angle[[0, 4]].tolist() == rows.angle[[0, 4]].tolist()
    assert found.state.tolist() == [0, UNKNOWN, UNKNOWN, UNKNOWN, 0]


def test_an_alert_of_a_later_part_reaches_an_earlier_one() -> None:
    """Parts wait for as long as anything can reach them, and come in their order."""
    log: list[Alert] = []
    held = HeldMargins(log)
    longest = LONGEST_REACH / S
    assert not list(held.add(made(seconds(0, 1, 2))))
    log.append(contradiction(3.0, 1.5))
    found = list(held.add(made(seconds(3, 2.5 + longest))))
    assert [part.known.tolist() for part in found] == [[True, True, False]]
    assert [len(part.time) for part in held.finish()] == [2]


def test_distrusted_spans_are_blank_as_well() -> None:
    """Such as the time before the load was told; told twice it counts once."""
    held = HeldMargins([])
    for _ in range(2):
        held.distrust((BEGIN, BEGIN + S))
    held.distrust(None)
    assert held.doubtful == [(BEGIN, BEGIN + S)]
    assert not list(held.add(made(seconds(0.0, 0.5, 1.0))))
    (found,) = held.finish()
    assert found.known.tolist() == [False, False, True]


def test_what_nothing_contradicts_is_passed_on_as_it_is() -> None:
    """The same object, without a copy; an empty part is dropped."""
    held = HeldMargins([contradiction(90.0, 2.0)])
    rows = made(seconds(0, 1))
    assert not list(held.add(made([])))
    assert not list(held.add(rows))
    (found,) = held.finish()
    assert found is rows
    assert math.isfinite(found.angle[0, 0])
