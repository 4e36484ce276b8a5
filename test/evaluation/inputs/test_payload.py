"""Demands and violations in words, and loads: declared, remembered, weighed by the motors."""

import math
from typing import Any

import numpy as np
import pytest
from evaluation.streams import settings
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    AlertDemand,
    Criterion,
    DataDemand,
    Demand,
    MapDemand,
    Value,
)
from ugv_acceptance.evaluation.criteria.messages import demand_words
from ugv_acceptance.evaluation.inputs.payload import PayloadHistory, payload_fault, payload_from
from ugv_acceptance.model.robot import Payload, Robot

TOLD = settings()
DOWN = (0.0, 0.0, -9.81)
LIFT = 9.81 * 1.1  # what a kg in the hand is to the level lift, N m


def value(**chosen: Any) -> Value:
    """Return a demand on the lift's torque."""
    return Value('torque', 'lift', below=True, limit=30.0, **chosen)


BELOW = 'static torque (magnitude) of lift below 30 N m'


@pytest.mark.parametrize(
    ('demand', 'words'),
    [
        (value(), f'{BELOW} at all times'),
        (value(dwell=2.5), f'{BELOW} for 2.5 s without a break'),
        (value(time_in_violation=0.5), f'{BELOW} except for at most 0.5 s in total'),
        (value(longest_violation=0.2, share_in_violation=0.05),
         f'{BELOW} except for at most 0.2 s at a time and 5 % of the time'),
        (Value('tip_angle', ANY, below=False, limit=math.radians(5.0)), 'above 5 deg at all times'),
        (Value('torque_utilisation', 'lift', below=True, limit=0.8), 'below 80 % at all times'),
        (Value('torque', 'slide', below=True, limit=30.0), 'of slide below 30 N at all times'),
        (AlertDemand(raised=True, code='TIP_OVER', of='left', level='WARN'),
         'at least one CAUTION TIP_OVER alert of left'),
        (AlertDemand(raised=False), 'no alert'),
        (AlertDemand(raised=False, level='ERROR'), 'no DANGER alert'),
        (AlertDemand(raised=True), 'at least one alert'),
        (DataDemand('coverage', least=0.9), 'at least 90 %'),
        (DataDemand('rate', of='imu', least=10.0, most=90.0),
         'rate of imu: at least 10 and at most 90 Hz'),
        (DataDemand('longest_gap', most=0.2), 'at most 0.2 s'),
        (MapDemand(('lift', 'slide'), ((0.0, 1.0), (0.0, 1.0)), (0.1, 0.1), 0.25),
         'at least 25 % of the map of lift and slide visited'),
    ],
)  # fmt: skip
def test_a_demand_in_words(demand: Demand, words: str) -> None:
    """A demand is told in words with its unit and its window."""
    assert demand_words(Criterion('c', demand), TOLD).endswith(words)
    windowed = demand_words(Criterion('c', demand, window=(1.5, 4.0)), TOLD)
    assert windowed.endswith(f'{words}, from 1.5 to 4 s')


@pytest.mark.parametrize(
    ('mass', 'com', 'frame', 'known'),
    [
        (2.0, (0.1, 0.0, 0.0), 'hand', True), (2.0, (0.1, 0.0, 0.0), '/hand', True),
        (2.0, (0.1, 0.0, 0.0), '', True), (2.0, (0.1, 0.0, 0.0), 'arm', False),
        (0.0, (0.0, 0.0, 0.0), 'hand', True), (-0.001, (0.0, 0.0, 0.0), 'hand', False),
        (1e5, (0.0, 0.0, 0.0), 'hand', True), (1.001e5, (0.0, 0.0, 0.0), 'hand', False),
        (1.0, (0.0, 1e3, 0.0), 'hand', True), (1.0, (0.0, 0.0, -1001.0), 'hand', False),
        (1.0, (800.0, 800.0, 0.0), 'hand', False), (math.nan, (0.0, 0.0, 0.0), 'hand', False),
        (1.0, (math.nan, 0.0, 0.0), 'hand', False), (math.inf, (0.0, 0.0, 0.0), 'hand', False),
    ],
)  # fmt: skip
def test_only_a_load_that_can_be_is_taken(
    mass: float,
    com: tuple[float, float, float],
    frame: str,
    known: bool,  # noqa: FBT001
) -> None:
    """A payload is taken only in the gripper's frame, from 0 to 100 t, within a kilometre."""
    found = payload_from(TOLD.robot, mass, com, frame)
    assert found == (Payload(mass, com) if known else None)


@pytest.mark.parametrize('frame', ['hand', '/hand', 'ra/hand', '/ra/hand', 'a/b/hand', ''])
def test_a_tf_prefix_makes_no_other_frame(frame: str) -> None:
    """A namespace before the payload link's name, or no frame at all, is that link."""
    assert payload_from(TOLD.robot, 1.0, (0.0, 0.0, 0.0), frame) == Payload(1.0)


@pytest.mark.parametrize('frame', ['hand2', 'left_hand', 'hand/base', 'base', 'ra/', ' hand'])
def test_what_only_looks_like_the_frame_is_another(frame: str) -> None:
    """A frame whose last part is not the payload link's name is another frame."""
    assert payload_from(TOLD.robot, 1.0, (0.0, 0.0, 0.0), frame) is None


def test_a_robot_without_a_hand_carries_nothing() -> None:
    """A robot without a payload link takes no payload but 0 kg, whatever the frame."""
    robot = Robot('r', TOLD.robot.links[:1], (), ())
    assert payload_from(robot, 1.0, (0.0, 0.0, 0.0), '') is None
    assert payload_from(robot, 0.0, (0.0, 0.0, 0.0), 'hand') == Payload()


def test_a_long_frame_is_told_in_one_short_line() -> None:
    """A frame of any length or letters stays one readable line in an alert."""
    words = payload_fault(TOLD.robot, 1.0, (0.0, 0.0, 0.0), 'x\n' * 500)
    assert words.isprintable()
    assert len(words) < 200


@given(st.lists(st.integers(0, 50), max_size=6), st.lists(st.integers(0, 50), min_size=1))
def test_a_load_is_in_force_from_its_moment_on(declared: list[int], asked: list[int]) -> None:
    """A payload is in force from its declaration on; of several at one time the last counts."""
    history, times = PayloadHistory(Payload(0.5)), sorted(asked)
    for k, when in enumerate(sorted(declared)):
        history.declare(when, Payload(float(k + 1), (0.1 * k, 0.0, 0.0)))
    expected = [sum(when <= t for when in declared) or 0.5 for t in times]
    half = len(times) // 2
    found: list[float] = []
    for part in (times[:half], times[half:]):
        if part:
            mass = history.at(np.array(part, np.int64))[0]
            found += np.broadcast_to(np.asarray(mass), len(part)).tolist()
    assert found == expected
