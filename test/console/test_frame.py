"""The frame: strict JSON of a snapshot that never says more than is known."""

import json
import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.config import load
from ugv_acceptance.console.frame import describe_robot, frame_of
from ugv_acceptance.console.snapshot import AlertRow, InputRow, Snapshot
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE, WARN
from ugv_acceptance.evaluation.ground import CARRIED
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import STANDING
from ugv_acceptance.monitoring.drawing import figure_of

SETTINGS = load().settings
FIGURE = figure_of(SETTINGS.robot)
FINE = Snapshot(
    5_000_000_000,
    OK,
    known=True,
    q=(0.0, 2.0, -2.5, 2.0),
    effort=(0.0, 10.0, math.nan, 0.0),
    gravity=(0.0, 0.0, -9.81),
    torque=(0.0, -20.0, 5.0, 0.1),
    angle=(0.5, 0.6, math.inf, 0.4),
    state=STANDING,
    payload=Payload(2.0, (0.0, 0.0, 0.0)),
)
any_float = st.floats()
four = st.tuples(any_float, any_float, any_float, any_float)


def frame(snapshot: Snapshot) -> dict[str, Any]:
    """Return a frame as a page reads it."""
    made = frame_of(snapshot, SETTINGS, FIGURE)
    read: dict[str, Any] = json.loads(json.dumps(made, allow_nan=False))
    return read


def alert(code: str = 'TIP_OVER', subject: str = 'front', **changes: Any) -> AlertRow:
    """Return an active, unseen alert."""
    row = AlertRow(
        f'{code}-{subject}',
        code,
        subject,
        ERROR,
        'active',
        f'{code} it is',
        'do that',
        1,
        unseen=True,
    )
    return replace(row, **changes)


@given(four, four, four, st.tuples(any_float, any_float, any_float), st.integers(0, 3))
def test_every_frame_is_strict_json(
    q: tuple[float, ...],
    torque: tuple[float, ...],
    angle: tuple[float, ...],
    gravity: tuple[float, float, float],
    level: int,
) -> None:
    """Whatever numbers come, a frame has no NaN or infinity in it."""
    strange = replace(FINE, q=q, torque=torque, angle=angle, gravity=gravity, level=level)
    frame(strange)


@given(st.integers(0, 3))
def test_what_is_not_known_is_no_data(level: int) -> None:
    """Where margins are not known the word is NO DATA, whatever level is claimed."""
    found = frame(replace(FINE, level=level, known=False))
    assert (found['word'], found['left']) == ('NO DATA', '')


def test_without_data_nothing_is_said_to_be_left() -> None:
    """A monitor that says NO DATA is believed, though the numbers seem to be known here."""
    assert frame(replace(FINE, level=STALE))['left'] == ''


def test_a_fine_robot_is_ok() -> None:
    """Nothing wrong: OK, and the least margins in words."""
    found = frame(FINE)
    head = found['headline']
    assert (found['word'], head['what'], head['number']) == ('OK', 'ALL MARGINS KEPT', '22 deg')
    assert head['notes'] == ['22 deg to tipping: RIGHT, shoulder 40 %']
    assert (head['action'], head['cause'], found['cards']) == ('', '', [])


def test_degrees_stand_at_the_edge() -> None:
    """Tilt left is in degrees, null where no edge lies on a side."""
    tilt = {row['side']: row['left_deg'] for row in frame(FINE)['tilt']}
    assert tilt['rear'] is None
    assert tilt['front'] == pytest.approx(math.degrees(0.5), abs=1e-5)


def test_roll_and_pitch_have_their_signs() -> None:
    """Gravity to the robot's right and front: right side down is positive roll, nose down pitch."""
    found = frame(replace(FINE, gravity=(0.0, -9.81 * math.sin(0.1), -9.81 * math.cos(0.1))))
    assert found['attitude']['roll_deg'] == pytest.approx(math.degrees(0.1), abs=1e-5)
    found = frame(replace(FINE, gravity=(9.81 * math.sin(0.2), 0.0, -9.81 * math.cos(0.2))))
    assert found['attitude']['pitch_deg'] == pytest.approx(math.degrees(0.2), abs=1e-5)


def test_tipping_comes_before_a_motor() -> None:
    """Of two alerts of one level, the one about tipping is the cause; the other is counted."""
    rows = (alert('TORQUE_LIMIT', 'elbow', start=9), alert())
    found = frame(replace(FINE, level=ERROR, alerts=rows))
    head = found['headline']
    assert (found['word'], head['cause'], head['more']) == ('DANGER', 'TIP_OVER it is', 1)
    assert head['action'] == 'DO THAT'


def test_what_is_over_and_unseen_is_said() -> None:
    """A failure that is over stays the cause until a person has dealt with it."""
    row = alert(end=2, state='over, latched until reset', offers=('reset',))
    found = frame(replace(FINE, level=WARN, alerts=(row,)))
    assert found['cause'] == 'over, latched until reset: TIP_OVER it is'
    assert found['advice'].startswith('reset it')


def test_a_lesser_thing_that_is_over_leaves_ok() -> None:
    """Where the monitor says OK, what is over stays in the list and is no cause."""
    found = frame(replace(FINE, alerts=(alert(end=2, level=WARN),)))
    assert (found['word'], found['cause']) == ('OK', 'all margins kept')
    assert len(found['alerts']) == 1


def test_hints_stand_with_what_is_left() -> None:
    """What else the operator should know follows the margins."""
    found = frame(replace(FINE, hints=('it tips to the left in 3 s at this rate',)))
    assert found['left'].endswith('; it tips to the left in 3 s at this rate')


def test_a_problem_comes_before_old_alerts() -> None:
    """A silent monitor is the cause, not what it said before."""
    silent = replace(FINE, level=STALE, known=False, problem='the monitor is silent')
    found = frame(replace(silent, alerts=(alert(),)))
    assert found['cause'] == 'the monitor is silent'


def test_inputs_are_passed_on() -> None:
    """An input's row holds its age, null where nothing came."""
    rows = (InputRow('imu', '/imu/data', STALE, 0.0, math.nan, ('/driver',), 'silent'),)
    (found,) = frame(replace(FINE, inputs=rows))['inputs']
    assert (found['age_s'], found['level'], found['publishers']) == (None, 'STALE', ['/driver'])


def test_the_robot_is_described_once() -> None:
    """Limits that are not known are null, not infinite."""
    found = json.loads(json.dumps(describe_robot(SETTINGS), allow_nan=False))
    assert [joint['limit'] for joint in found['joints']] == [None, 50.0, 50.0, None]


def test_on_stairs_the_degrees_are_an_upper_bound() -> None:
    """Neither cause nor numbers then say that the tilt left is enough."""
    stairs = replace(FINE, ground='stairs', rough=True, cautious=0.1)
    made = frame(stairs)
    assert made['ground'] == {'words': 'stairs', 'rough': True, 'cautious_deg': 5.729578}
    assert 'not begun to tip' in made['headline']['cause']
    assert made['headline']['number'] == '<= 22 deg'
    assert 'at most 22 deg to tipping: RIGHT (upper bound, 5.7 deg' in made['headline']['notes'][0]
    flat = frame(replace(FINE, ground='flat'))
    assert flat['ground'] == {'words': 'flat', 'rough': False, 'cautious_deg': None}
    assert flat['cause'] == 'all margins kept'
    assert 'upper bound' not in flat['left']


def test_raised_flippers_are_named_beside_the_tilt_left() -> None:
    """What carries the body on flat ground only is a word of its own, and no alert."""
    assert CARRIED in frame(replace(FINE, carried=True))['left']
    assert CARRIED not in frame(FINE)['left']
    assert CARRIED not in frame(replace(FINE, carried=True, rough=True))['left']
