"""Alerts in words: every number that a sentence holds, in its unit, with its limit."""

import math
from pathlib import Path

import numpy as np
import pytest
from evaluation.streams import T0, settings
from foreign_files import mobile_arm, rover

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts.messages import ALERTS, advice, describe
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Alert, Rule
from ugv_acceptance.evaluation.alerts.tipping_watch import trend_words
from ugv_acceptance.evaluation.settings import Limits
from ugv_acceptance.evaluation.tipping_trend import Trend

TOLD = settings(limits=Limits((45.0, 30.0)))
RAD = math.radians(1.0)


@pytest.mark.parametrize(
    ('code', 'subject', 'level', 'on', 'peak', 'said'),
    [
        ('TORQUE_LIMIT', 'lift', WARN, 36.0, 40.04,
         'lift 88 % of its limit: it needs 40.0 of 45.0 N m'),
        ('TORQUE_LIMIT', 'slide', ERROR, 30.0, 31.0,
         'slide 103 % of its limit: it needs 31.0 of 30.0 N'),
        ('TIP_OVER', 'left', WARN, -10 * RAD, -8 * RAD,
         '8 deg to tipping: LEFT; CAUTION from 10 deg on'),
        ('TIP_OVER', 'rear', ERROR, -5 * RAD, 3 * RAD,
         '3 deg past tipping: REAR; DANGER from 5 deg on'),
        ('STATIC_MODEL', 'lift', WARN, 0.6, 0.75,
         'lift moves at 42 deg/s; margins are valid only up to 34 deg/s'),
        ('STATIC_MODEL', 'slide', WARN, 0.1, 0.25,
         'slide moves at 0.25 m/s; margins are valid only up to 0.10 m/s'),
        ('SLIDE', 'robot', WARN, -10 * RAD, -4 * RAD,
         'the tracks will slide before the robot tips: 4 deg of slope left'),
        ('SLIDE', 'robot', WARN, -10 * RAD, 2 * RAD,
         'the tracks will slide before the robot tips: 0 deg of slope left'),
        ('TIP_AHEAD', 'front', WARN, -1.5, -0.3,
         'it tips within 1.5 s if this motion continues: FRONT'),
        ('TORQUE_AHEAD', 'lift', WARN, -2.0, -0.3,
         'lift is at its limit within 2.0 s if this motion continues'),
        ('EFFORT_LIMIT', 'lift', WARN, 0.9, 44.0,
         'the measured effort of lift is 97 % of its limit: 44.0 of 45.0 N m'),
        ('EFFORT_LIMIT', 'slide', WARN, 0.9, 29.0,
         'the measured effort of slide is 96 % of its limit: 29.0 of 30.0 N'),
        ('POSITION_LEAP', 'lift', ERROR, 20.0, 57.3,
         'implausible jump of lift: 3283 deg/s, over ten times the speed it can move at'),
        ('POSITION_LEAP', 'slide', ERROR, 10.0, 12.0,
         'implausible jump of slide: 12.00 m/s, over ten times the speed it can move at'),
        ('IMU_GRAVITY', 'imu', ERROR, 0.15, 0.9,
         ('while it does not turn, the acceleration of imu differs from gravity by '
          '90 %: it is in g')),
        ('IMU_INCONSISTENT', 'imu', ERROR, 0.1, 28.6 * RAD,
         'orientation and acceleration of the IMU disagree by 29 deg while it does not turn'),
        ('INPUT_STALE', 'imu', ERROR, 0.5, 1.0, 'no message from imu'),
    ],
)  # fmt: skip
def test_an_alert_is_one_sentence_with_its_numbers(
    code: str, subject: str, level: int, on: float, peak: float, said: str
) -> None:
    """Newtons and metres of what slides, newton metres and radians of what turns."""
    assert describe(Alert(Rule(code, subject, level, on, on, 0, 0), T0, peak), TOLD) == said


def test_a_worst_value_stands_beside_its_own_time() -> None:
    """In a recording, not beside the time at which the alert was raised; live it is now."""
    alert = Alert(Rule('TIP_OVER', 'right', ERROR, -5 * RAD, 0.0, 0, 0), T0, 35 * RAD)
    alert.worst_at = T0 + 28_150_000_000
    assert describe(alert, TOLD, T0).startswith('35 deg past tipping: RIGHT at 28.15 s;')
    assert describe(alert, TOLD).startswith('35 deg past tipping: RIGHT;')
    alert.worst_at = None
    assert describe(alert, TOLD, T0) == describe(alert, TOLD)


@pytest.mark.parametrize('code', ALERTS)
@pytest.mark.parametrize('peak', [0.0, -1e-9, 1e308, math.inf, -math.inf, math.nan])
def test_no_value_is_too_odd_for_a_sentence(code: str, peak: float) -> None:
    """Whatever a sensor makes of a value, the alert is still a sentence."""
    for subject in ('lift', 'right', 'imu'):
        rule = Rule(code, subject, WARN, peak, peak, 0, 0)
        assert describe(Alert(rule, T0, peak, detail='why', worst_at=T0), TOLD, T0)


def test_what_helps_is_told_beside_what_happened() -> None:
    """Each alert code has its advice, whatever the subject."""
    assert advice('INPUT_STALE').startswith('check that its driver is running')


@pytest.mark.parametrize(
    ('slope', 'left', 'told'),
    [
        (-20.0, 0.8, 'the robot begins to tip: LEFT, by 20 deg/s, 0.8 s until nothing is left'),
        (0.0, math.inf, 'little is left to tipping, taken cautiously'),
        (math.nan, math.nan, 'little is left to tipping, taken cautiously'),
    ],
)
def test_a_trend_is_told_by_its_cause(slope: float, left: float, told: str) -> None:
    """A margin that shrinks says how fast and how long it lasts, one that is small that it is."""
    one = Trend(
        np.array([WARN], np.int8), np.array([1], np.int8), np.radians([slope]), np.array([left])
    )
    assert trend_words(one, 0).startswith(told)


def test_a_rover_is_told_of_its_wheels_and_of_no_arm(tmp_path: Path) -> None:
    """What to do names what the robot has; a tracked one with an arm is told as ever."""
    robot = load(rover(tmp_path)).settings.robot
    told = [advice(code, robot) for code in ALERTS]
    assert not [text for text in told if 'track' in text or 'lower the arm' in text]
    assert advice('TIP_OVER', robot) == 'face the slope; if the robot stands well, check the IMU'
    assert advice('NO_SUPPORT', robot) == 'stop; check that the robot stands on its wheels'
    packbot = load().settings.robot
    assert all(advice(code, packbot) == advice(code) for code in ALERTS)
    armed = load(mobile_arm(tmp_path)).settings.robot
    assert advice('TIP_OVER', armed).startswith('lower the arm over the wheels, face the slope')
