"""The headline: one thing at a time, the most urgent, and never a margin from dead data."""

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.config import load
from ugv_acceptance.console.headline import Headline, headline_of, view_of
from ugv_acceptance.console.headline_words import order_of, what_of
from ugv_acceptance.console.snapshot import AlertRow, LastKnown, Memory, Snapshot
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR, TIPPED
from ugv_acceptance.evaluation.alerts.messages import ALERTS
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE, WARN
from ugv_acceptance.evaluation.settings import CONTACTS, PAYLOAD_LINK
from ugv_acceptance.model.stability import SIDES, STANDING

SETTINGS = load().settings
RIGHT = SIDES.index('right')
NOW = 20_000_000_000
BRING = 'lower the elbow by 16 deg: 11 deg further from tipping to the right, in 0.5 s'


def tilted(degrees: float, **changes: Any) -> Snapshot:
    """Return a robot with so much tilt left to the right, and more to the other sides."""
    angle = tuple(math.radians(degrees if side == 'right' else 45.0) for side in SIDES)
    fine = Snapshot(NOW, OK, known=True, torque=(0.0, -21.5, 5.0, 0.1), angle=angle, state=STANDING)
    return replace(fine, **changes)


def row(code: str, subject: str, level: int = ERROR, **changes: Any) -> AlertRow:
    """Return an active alert."""
    key = f'{code}-{subject}-{level}'
    made = AlertRow(key, code, subject, level, 'active', f'{code} it is', 'do that; then this', 1)
    return replace(made, **changes)


def said(snapshot: Snapshot, **settings: Any) -> Headline:
    """Return the headline of a snapshot of the PackBot."""
    return headline_of(view_of(snapshot, replace(SETTINGS, **settings)))


def words_of(headline: Headline) -> str:
    """Return all that a headline says."""
    one = (headline.what, headline.number, headline.action, headline.detail, headline.cause)
    return ' | '.join([*one, *headline.notes])


def test_nothing_wrong_asks_for_nothing() -> None:
    """All margins kept: the least tilt left, and no action."""
    head = said(tilted(23.49))
    assert (head.what, head.number, head.action) == ('ALL MARGINS KEPT', '23 deg', '')
    assert head.notes == ('23 deg to tipping: RIGHT, shoulder 43 %',)


@pytest.mark.parametrize(
    ('degrees', 'what', 'number'),
    [
        (6.0, 'TO TIPPING: RIGHT', '6 deg'),
        (0.04, 'TO TIPPING: RIGHT', '0 deg'),
        (0.0, 'TIPPING RIGHT', '0 deg'),
        (-1.4, 'TIPPING RIGHT', '-1.4 deg'),
    ],
)
def test_before_the_edge_and_past_it(degrees: float, what: str, number: str) -> None:
    """The direction is in the words; from the edge on it tips."""
    alert = row('TIP_OVER', 'right', advice=BRING)
    head = said(tilted(degrees, level=ERROR, alerts=(alert,)))
    assert (head.what, head.number) == (what, number)
    assert head.action == 'LOWER THE ELBOW'
    assert head.detail == 'by 16 deg: 11 deg further from tipping to the right, in 0.5 s'
    assert head.cause == 'TIP_OVER it is'
    # The number stands above, and is not said again.
    assert head.notes == ('shoulder 43 %',)
    assert head.margins.endswith('tipping: RIGHT, shoulder 43 %')


@pytest.mark.parametrize(
    ('newton_metres', 'what', 'number'),
    [
        (49.8, 'SHOULDER NEAR ITS LIMIT', '99 %'),
        (50.0, 'SHOULDER AT ITS LIMIT', '100 %'),
        (56.0, 'SHOULDER AT ITS LIMIT', '112 %'),
    ],
)
def test_a_joint_is_named_with_its_share(newton_metres: float, what: str, number: str) -> None:
    """A joint is at its limit only at 100 %; less is never rounded to it."""
    alert = row('TORQUE_LIMIT', 'shoulder_joint')
    torque = (0.0, -newton_metres, 5.0, 0.1)
    head = said(tilted(40.0, level=ERROR, alerts=(alert,), torque=torque))
    assert (head.what, head.number) == (what, number)
    assert head.notes == ('40 deg to tipping: RIGHT',)


@pytest.mark.parametrize(
    ('advice', 'action', 'detail'),
    [
        (BRING, 'LOWER THE ELBOW', 'by 16 deg: 11 deg further from tipping to the right, in 0.5 s'),
        (
            'turn the robot slowly by 30 deg to the left, to face downhill: 5 deg further, in 9 s',
            'TURN THE ROBOT SLOWLY TO THE LEFT',
            'by 30 deg, to face downhill: 5 deg further, in 9 s',
        ),
        ('extend the lift by 20 cm: 4 N m less', 'EXTEND THE LIFT', 'by 20 cm: 4 N m less'),
        ('set the load of 4.0 kg down: 3 deg more', 'SET THE LOAD OF 4.0 KG DOWN', '3 deg more'),
        ('stop smoothly; lower the arm', 'STOP SMOOTHLY', 'lower the arm'),
        ('stop, and drive back', 'STOP', 'and drive back'),
        ('stop the motion', 'STOP THE MOTION', ''),
        (STAND_CLEAR, 'STAND CLEAR', 'do not move the arm; switch it off before anyone comes near'),
        ('', '', ''),
    ],
)
def test_the_action_is_the_first_clause(advice: str, action: str, detail: str) -> None:
    """What to do, with its direction, stands in capitals; how much and what for behind it."""
    assert order_of(advice) == (action, detail)


@pytest.mark.parametrize('code', sorted(ALERTS))
def test_every_alert_has_a_short_name(code: str) -> None:
    """No code of the program stands in a headline, and what stands there is short."""
    for subject in ('right', 'upper_arm_joint'):
        what, _ = what_of(row(code, subject), tilted(6.0), SETTINGS)
        assert what == what.upper()
        assert '_' not in what
        assert '{' not in what
        assert len(what) <= 40
        if code not in {'SLIDE', 'CLOCK', 'NO_CLOCK', 'ARM_ON_GROUND'}:
            assert what != code.replace('_', ' ')


@pytest.mark.parametrize(
    ('text', 'side'),
    [
        ('the robot begins to tip: the tilt left to the right shrinks by 9 degrees', 'RIGHT'),
        ('the robot begins to tip: 4 deg to tipping: REAR, shrinking', 'REAR'),
        ('the robot begins to tip', 'FRONT'),
    ],
)
def test_a_trend_is_told_with_its_side(text: str, side: str) -> None:
    """The side of an alert about the robot is that in its text; "tilt left" is no side."""
    angle = tuple(math.radians(5.0 if at == 'front' else 45.0) for at in SIDES)
    rough = tilted(0.0, angle=angle, rough=True)
    alert = row('TIP_TREND', 'robot', text=text)
    assert what_of(alert, rough, SETTINGS)[0] == f'BEGINS TO TIP {side}'


def test_the_most_urgent_decides() -> None:
    """A contradicted IMU comes before tip-over, and that before motors; the others are counted."""
    motor, tip = row('TORQUE_LIMIT', 'elbow_joint', start=9), row('TIP_OVER', 'right')
    imu = row('IMU_INCONSISTENT', 'imu')
    head = said(tilted(2.0, level=ERROR, alerts=(motor, tip)))
    assert (head.what, head.more) == ('TO TIPPING: RIGHT', 1)
    head = said(tilted(2.0, level=ERROR, alerts=(motor, tip, imu)))
    assert (head.what, head.action, head.more) == ('IMU NOT TO BE TRUSTED', 'STOP', 2)
    assert head.detail == 'do not move on these numbers'
    assert 'for the integrator: do that' in words_of(head)


def test_a_caution_for_the_integrator_stops_nobody() -> None:
    """What no operator can mend, and no danger, is passed on with what is to be done about it."""
    head = said(tilted(30.0, level=WARN, alerts=(row('INPUT_SLOW', 'imu', WARN),)))
    assert (head.what, head.action) == ('IMU: SLOW', 'TELL THE INTEGRATOR')
    assert head.detail == 'do that; then this'


def dead(**changes: Any) -> Snapshot:
    """Return a robot of which nothing is known now, and 6 deg to tipping 4.2 s ago."""
    last = LastKnown(NOW - 4_200_000_000, tilted(6.0).angle, (0.0, -21.5, 5.0, 0.1))
    return replace(Snapshot(NOW, STALE), **({'last': last} | changes))


def test_without_data_the_first_word_is_stop() -> None:
    """NO DATA: stop; what was known last, and when; then the cause for the integrator."""
    text, advice = 'no message from imu', 'check that its driver is running'
    silent = row('INPUT_STALE', 'imu', STALE, text=text, advice=advice)
    head = said(dead(alerts=(silent,)))
    assert (head.what, head.number, head.action) == ('NO DATA', '', 'STOP')
    assert head.detail == 'do not move on these numbers'
    assert head.notes == ('last known 4.2 s ago: 6 deg to tipping: RIGHT, shoulder 43 %',)
    assert head.cause == 'no message from imu: check that its driver is running'
    assert head.more == 0


def test_dead_data_give_no_advice() -> None:
    """The advice of an alert that was raised by margins is not said once they are dead."""
    tip = row('TIP_OVER', 'right', advice=BRING, text='1 deg to tipping')
    head = said(dead(problem='the monitor is silent', alerts=(tip,)))
    assert (head.action, head.cause, head.more) == ('STOP', 'the monitor is silent', 1)
    assert 'elbow' not in words_of(head).lower()
    assert said(dead(alerts=(tip,))).cause == 'margins are not known'


def test_a_verdict_of_no_data_hides_the_numbers_there_are() -> None:
    """Where the monitor says NO DATA, numbers that seem to be known are none of now."""
    head = said(tilted(6.0, level=STALE))
    assert head.what == 'NO DATA'
    assert 'deg' not in words_of(head)


def test_what_was_known_last_is_kept_while_nothing_is() -> None:
    """A feed's memory holds the newest margins until there are newer ones."""
    memory = Memory()
    assert memory.keep(Snapshot(1)).last is None
    memory.keep(tilted(9.0))
    memory.keep(tilted(6.0))
    for _ in range(2):
        last = memory.keep(Snapshot(NOW + 1)).last
        assert last == LastKnown(NOW, tilted(6.0).angle, tilted(6.0).torque)
    assert memory.keep(tilted(7.0)).last is None


def test_numbers_beside_an_alert_of_no_data_are_not_remembered() -> None:
    """What comes while an input is said to be silent was not known."""
    memory = Memory(LastKnown(1, tilted(6.0).angle, ()))
    silent = row('INPUT_STALE', 'imu', STALE)
    last = memory.keep(tilted(30.0, level=STALE, alerts=(silent,))).last
    assert last is not None
    assert last.time == 1


def test_unknown_values_of_the_configuration_are_asked_for() -> None:
    """Margins that are known are told beside what keeps them from being OK: nothing is dead."""
    head = said(tilted(23.0), unknown=(PAYLOAD_LINK,))
    assert (head.what, head.action) == ('NOT ALL IS CHECKED', 'COMPLETE THE CONFIGURATION')
    assert 'the configuration does not know payload.link' in head.cause
    assert head.notes[0].startswith('23 deg to tipping: RIGHT')


def test_a_silent_input_is_no_data_for_a_configuration_with_gaps() -> None:
    """That the configuration leaves something open makes no dead number alive."""
    silent = row('INPUT_STALE', 'imu', STALE, text='no message from imu')
    lost = tilted(23.0, level=STALE, alerts=(silent,))
    view = view_of(lost, replace(SETTINGS, unknown=(CONTACTS,)))
    assert view.dead
    assert said(lost, unknown=(CONTACTS,)).action == 'STOP'


def test_after_a_fall_nobody_moves_anything() -> None:
    """It has tipped: stand clear, in place of every margin's advice."""
    rows = (row('TIP_OVER', 'right', advice=BRING), row('TORQUE_LIMIT', 'elbow_joint'))
    head = said(tilted(-35.0, level=ERROR, alerts=rows))
    assert (head.what, head.number, head.action) == ('IT HAS TIPPED RIGHT', '', 'STAND CLEAR')
    assert head.detail == 'do not move the arm; switch it off before anyone comes near'
    assert (head.more, head.margins, 'elbow' in words_of(head)) == (1, '', False)


def test_a_robot_that_sways_is_told_how_to_come_back() -> None:
    """Up to where no robot comes back, past its edge, the advice is that for its margin."""
    far = math.degrees(TIPPED)
    assert said(tilted(-far - 0.1)).action == 'STAND CLEAR'
    tip = row('TIP_OVER', 'right', advice=BRING, peak=TIPPED - 0.01)
    assert said(tilted(0.1 - far, level=ERROR, alerts=(tip,))).action == 'LOWER THE ELBOW'


def test_a_fall_is_a_danger_before_its_alert() -> None:
    """The word beside IT HAS TIPPED is never OK."""
    assert view_of(tilted(-25.0), SETTINGS).level == ERROR


@pytest.mark.parametrize('end', [None, NOW - 1])
def test_a_fall_is_said_until_its_alert_is_reset(end: int | None) -> None:
    """While the alert waits for a person, numbers that look well do not end it."""
    fell = row('TIP_OVER', 'right', peak=math.radians(35.0), end=end, offers=('reset',))
    head = said(tilted(30.0, level=WARN, alerts=(fell,)))
    assert (head.what, head.action) == ('IT HAS TIPPED RIGHT', 'STAND CLEAR')
    assert 'reset the alert' in words_of(head)
    caught = replace(fell, peak=math.radians(3.0))
    assert said(tilted(30.0, level=WARN, alerts=(caught,))).action != 'STAND CLEAR'


def test_a_fall_is_said_after_data_die() -> None:
    """It lies there as it lay when it was last known: stand clear, and why there are no data."""
    last = LastKnown(NOW - 2_000_000_000, tilted(-60.0).angle, ())
    head = said(dead(last=last, problem='no monitor is heard'))
    assert (head.what, head.action) == ('IT HAS TIPPED RIGHT', 'STAND CLEAR')
    assert head.notes == ('last known 2.0 s ago: 60 deg past tipping: RIGHT',)
    assert head.cause == 'no monitor is heard'


def test_a_fall_by_a_contradicted_imu_is_looked_at() -> None:
    """Whichever of the two is true, nobody moves and nobody comes near."""
    rows = (row('TIP_OVER', 'right'), row('IMU_CONTRADICTION', 'imu'))
    head = said(tilted(-60.0, level=ERROR, alerts=rows))
    assert (head.what, head.action) == ('IMU NOT TO BE TRUSTED', 'STAND CLEAR')
    assert 'it has tipped RIGHT' in head.detail


def test_an_arm_on_the_ground_is_not_lifted_after_a_fall() -> None:
    """No alert asks for a motion of the arm of a robot that has tipped."""
    head = said(tilted(-60.0, level=ERROR, alerts=(row('ARM_ON_GROUND', 'arm'),)))
    assert head.action == 'STAND CLEAR'


def test_what_is_over_asks_for_its_button() -> None:
    """A latched alert asks to be reset, one nobody saw to be acknowledged."""
    over = row('TIP_OVER', 'right', end=2, state='over, latched until reset', offers=('reset',))
    head = said(tilted(30.0, level=WARN, alerts=(over,)))
    assert (head.what, head.action) == ('OVER, NOT RESET', 'RESET IT')
    assert head.cause == 'over, latched until reset: TIP_OVER it is'
    unseen = replace(over, offers=('acknowledge',))
    assert said(tilted(30.0, level=WARN, alerts=(unseen,))).action == 'ACKNOWLEDGE IT'
    assert said(tilted(30.0, alerts=(over,))).what == 'ALL MARGINS KEPT'


def test_a_caution_nobody_explains_is_no_ok() -> None:
    """A console that joined late says that it does not know why."""
    head = said(tilted(30.0, level=WARN))
    assert head.what == 'NOT ALL IS WELL'
    assert 'not told this console' in head.cause


def test_on_stairs_no_number_says_that_all_is_well() -> None:
    """Where the ground is not flat the number is a bound, and the sentence says so."""
    head = said(tilted(23.0, rough=True, cautious=0.1))
    assert (head.what, head.number) == ('NOT BEGUN TO TIP', '<= 23 deg')
    assert 'not known on this ground' in head.cause
    assert head.notes[0].startswith('at most 23 deg to tipping: RIGHT (upper bound, 5.7 deg taken')


def test_on_stairs_a_bound_is_said_in_full() -> None:
    """That a number is a bound, and what it is cautiously, stands beside its alert too."""
    tip = row('TIP_OVER', 'right')
    head = said(tilted(3.0, level=ERROR, alerts=(tip,), rough=True, cautious=0.02))
    assert head.number == '<= 3 deg'
    assert head.notes[0].startswith('at most 3 deg to tipping: RIGHT (upper bound, 1.1 deg taken')


any_float = st.floats()


@given(
    st.tuples(any_float, any_float, any_float, any_float),
    st.tuples(any_float, any_float, any_float, any_float),
    st.integers(0, 3),
    st.booleans(),
    st.sampled_from([*SIDES, 'robot', 'elbow_joint', 'imu', '']),
    st.sampled_from(sorted(ALERTS)),
)
def test_whatever_comes_has_a_headline(
    angle: Any, torque: Any, level: int, known: Any, subject: str, code: str
) -> None:
    """No number and no alert leaves the header empty, or without anything to do in danger."""
    strange = replace(tilted(0.0), angle=angle, torque=torque, level=level, known=known)
    head = said(replace(strange, alerts=(row(code, subject, ERROR),)))
    assert head.what
    assert head.action
    if not known:
        assert head.action in {'STOP', 'STAND CLEAR'}
        assert '%' not in words_of(head)


@pytest.mark.parametrize('angle', [math.nan, math.inf])
def test_nothing_is_ok_where_no_tilt_is_known(angle: float) -> None:
    """In free fall, or on no edge, no margin is kept, whatever the verdict of a moment ago."""
    view = view_of(tilted(45.0, angle=(angle,) * 4), SETTINGS)
    assert (view.level, headline_of(view).action) == (STALE, 'STOP')
