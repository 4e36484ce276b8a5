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
from ugv_acceptance.console.snapshot import AlertRow, Countdown, InputRow, Snapshot
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE
from ugv_acceptance.evaluation.ground import CARRIED
from ugv_acceptance.evaluation.settings import CONTACTS, LEVEL
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
    assert (found['word'], found['headline']['action']) == ('NO DATA', 'STOP')


@pytest.mark.parametrize('changes', [{'known': False}, {'level': STALE}])
def test_without_data_no_number_is_one_of_now(changes: dict[str, Any]) -> None:
    """NO DATA is believed though numbers seem to be there: dashes, no level, no countdown."""
    soon = replace(FINE, countdown=Countdown(tips=True, subject='right', seconds=1.2), **changes)
    found = frame(soon)
    assert {row['words'] for row in found['tilt']} == {'-'}
    assert {row['words'] for row in found['torque']} == {'-', 'no limit'}
    assert {row['level'] for row in (*found['tilt'], *found['torque'])} == {''}
    assert (found['worst_joint'], found['seconds'], found['seconds_to']) == (None, None, '')
    assert 'deg' not in ' '.join(found['headline']['notes'])


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


def test_hints_stand_with_the_margins() -> None:
    """What else the operator should know follows the margins."""
    hint = 'measured efforts suggest a payload of 3 kg'
    assert frame(replace(FINE, hints=(hint,)))['headline']['notes'][1:] == [hint]


@pytest.mark.parametrize(
    ('degrees', 'words', 'level'),
    [
        (22.99, '22.9', 'OK'),
        (10.04, '10.0', 'OK'),
        (10.0, '10.0', 'WARN'),
        (6.0, '6.0', 'WARN'),
        (5.0, '5.0', 'ERROR'),
        (-1.41, '-1.5', 'ERROR'),
        (math.inf, 'no edge', 'OK'),
        (math.nan, '-', ''),
    ],
)
def test_the_tilt_left_has_words_and_a_level(degrees: float, words: str, level: str) -> None:
    """One place says what stands in a box, cut and never rounded up, and in which colour."""
    row = frame(replace(FINE, angle=(math.radians(degrees), 0.6, 0.6, 0.6)))['tilt'][0]
    assert (row['words'], row['level']) == (words, level)


@pytest.mark.parametrize(
    ('share', 'words', 'level'),
    [(0.43, '43 %', 'OK'), (0.996, '99 %', 'WARN'), (1.0, '100 %', 'ERROR'), (math.nan, '-', '')],
)
def test_a_torque_has_words_and_a_level(share: float, words: str, level: str) -> None:
    """99.6 % is no 100 %, and CAUTION; a joint without a limit has no share and no colour."""
    found = frame(replace(FINE, torque=(70.0, -50.0 * share, 5.0, 0.1)))
    free, row, *_ = found['torque']
    assert (row['words'], row['level']) == (words, level)
    assert (free['words'], free['level']) == ('no limit', '')
    # The elbow at 10 % where the shoulder is not known.
    assert found['worst_joint'] == (2 if math.isnan(share) else 1)


@pytest.mark.parametrize(
    ('countdown', 'seconds', 'what'),
    [
        (Countdown(tips=True, subject='right', seconds=4.23), 4.2, 'tipping RIGHT'),
        (Countdown(tips=False, subject='shoulder_joint', seconds=0.7), 0.7, 'shoulder limit'),
        (Countdown(tips=True, subject='right', seconds=0.0), None, ''),
        (None, None, ''),
    ],
)
def test_the_time_to_a_limit_is_a_number(
    countdown: Countdown | None, seconds: float | None, what: str
) -> None:
    """It counts to what is reached first, and is gone when that is reached."""
    found = frame(replace(FINE, countdown=countdown))
    assert (found['seconds'], found['seconds_to']) == (seconds, what)


def test_nothing_counts_down_to_a_fall_that_is_over() -> None:
    """A robot that has tipped has no time left, nor one whose IMU is contradicted."""
    soon = replace(FINE, countdown=Countdown(tips=False, subject='elbow_joint', seconds=2.0))
    assert frame(replace(soon, angle=(0.5, 0.5, -0.5, 0.5)))['seconds'] is None
    doubt = alert('IMU_INCONSISTENT', 'imu')
    assert frame(replace(soon, level=ERROR, alerts=(doubt,)))['seconds'] is None


def test_what_is_assumed_stands_in_one_line() -> None:
    """The ground that nobody entered, and what no verdict covers; nothing where all is known."""
    unchecked = 'NOT CHECKED: torque of turret, flipper (no limit known)'
    guessed = frame(replace(FINE, ground='flat (not entered)'))['assumed']
    assert guessed == f'ground taken as flat; {unchecked}'
    assert frame(replace(FINE, ground='flat'))['assumed'] == unchecked
    stairs = frame(replace(FINE, ground='stairs', rough=True))['assumed']
    assert stairs == f'ground: stairs; {unchecked}'
    limits = replace(SETTINGS.limits, torque=(50.0,) * 4)
    known = frame_of(replace(FINE, ground='flat'), replace(SETTINGS, limits=limits), FIGURE)
    assert known['assumed'] == ''
    bare = replace(SETTINGS, limits=limits, imu=replace(SETTINGS.imu, attitude=LEVEL))
    assert frame_of(FINE, bare, FIGURE)['assumed'] == 'NOT CHECKED: tip-over (no IMU)'
    keys = replace(SETTINGS, limits=limits, unknown=(CONTACTS, 'joints.elbow_joint.limit'))
    asked = frame_of(FINE, keys, FIGURE)['assumed']
    assert asked == (
        'NOT CHECKED: tip-over (not in the configuration),'
        ' torque of elbow (not in the configuration)'
    )


def test_without_an_imu_no_tilt_is_told() -> None:
    """The degrees of a base that was declared level are nobody's measurement."""
    bare = replace(SETTINGS, imu=replace(SETTINGS.imu, attitude=LEVEL))
    found = frame_of(replace(FINE, angle=(-0.5, 0.5, 0.5, 0.5)), bare, FIGURE)
    assert {(row['words'], row['level']) for row in found['tilt']} == {('-', '')}
    head = found['headline']
    assert (head['what'], head['number']) == ('ALL TORQUE MARGINS KEPT', '40 %')
    assert head['notes'][0].startswith('tip-over not checked')


def test_lamps_say_what_records_and_since_when() -> None:
    """The black box, the time since the start, and where the numbers come from."""
    lamps = frame(replace(FINE, black_box='disk full', running=12.5, source='bag'))['lamps']
    assert lamps == {'black_box': 'disk full', 'running_s': 12.5, 'source': 'bag'}
    assert frame(FINE)['lamps'] == {'black_box': '', 'running_s': None, 'source': 'live'}


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
    assert made['headline']['number'] == '<= 22 deg'
    assert {(row['words'], row['level']) for row in made['tilt']} >= {('<= 22.9', '')}
    close = frame(replace(stairs, angle=(0.05, 0.6, 0.6, 0.6)))['tilt'][0]
    assert (close['words'], close['level']) == ('<= 2.8', 'ERROR')
    flat = frame(replace(FINE, ground='flat'))
    assert flat['ground'] == {'words': 'flat', 'rough': False, 'cautious_deg': None}
    assert flat['headline']['what'] == 'ALL MARGINS KEPT'
    assert 'at most' not in flat['headline']['notes'][0]


def test_raised_flippers_are_named_beside_the_tilt_left() -> None:
    """What carries the body on flat ground only is a word of its own, and no alert."""
    assert CARRIED in frame(replace(FINE, carried=True))['headline']['notes'][0]
    assert CARRIED not in frame(FINE)['headline']['notes'][0]
    assert CARRIED not in frame(replace(FINE, carried=True, rough=True))['headline']['notes'][0]
