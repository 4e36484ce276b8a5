"""The cards: one a cause at its worst level, and nothing worse behind what was acknowledged."""

import math
from dataclasses import replace
from typing import Any

import pytest

from ugv_acceptance.config import load
from ugv_acceptance.console.alert_cards import CAUSES, TITLES, card_of, cause_of, groups_of
from ugv_acceptance.console.frame import frame_of
from ugv_acceptance.console.snapshot import AlertRow, Snapshot
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR
from ugv_acceptance.evaluation.alerts.messages import ALERTS
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, LEVELS, OK, STALE, WARN
from ugv_acceptance.model.stability import SIDES, STANDING
from ugv_acceptance.monitoring.drawing import figure_of

SETTINGS = load().settings
FIGURE = figure_of(SETTINGS.robot)
NOW = 40_000_000_000


def row(code: str, subject: str, level: int = WARN, **changes: Any) -> AlertRow:
    """Return an active alert that was acknowledged."""
    key = f'{code}-{subject}-{LEVELS[level]}'
    made = AlertRow(key, code, subject, level, 'active, acknowledged', f'{code} is', 'do', 1)
    return replace(made, **changes)


def called(code: str, subject: str, level: int = WARN, **changes: Any) -> AlertRow:
    """Return an active alert that nobody has seen."""
    state = 'active, not acknowledged'
    offers = ('acknowledge', *('shelve',) * (level == WARN))
    return replace(row(code, subject, level, state=state, unseen=True, offers=offers), **changes)


def cards(*rows: AlertRow, **changes: Any) -> list[dict[str, Any]]:
    """Return the cards of alerts, active ones first."""
    made = Snapshot(NOW, ERROR, known=True, angle=(0.5,) * 4, state=STANDING, alerts=rows)
    found = frame_of(replace(made, **changes), SETTINGS, FIGURE)
    return [*found['cards'], *found['past']]


def test_one_tip_event_is_one_card() -> None:
    """All alerts of tipping to one side are one card at the worst level, with all their keys."""
    codes = ('TIP_AHEAD', 'TIP_MOVING', 'ACCELERATION', 'TRACK_LIFT', 'TIP_OVER')
    rows = [row(code, 'right') for code in codes] + [row('TIP_OVER', 'right', ERROR)]
    (card,) = cards(*rows)
    assert (card['code'], card['level'], card['title']) == ('TIP_OVER', 'ERROR', 'TIPPING: RIGHT')
    assert sorted(card['keys']) == sorted(one.key for one in rows)
    # The caution under the danger of the same limit says nothing new.
    assert card['parts'] == [f'{code} is' for code in sorted(codes[:4])]


@pytest.mark.parametrize(('peak', 'told'), [(-0.02, ['TIP_AHEAD is']), (0.02, [])])
def test_what_has_come_is_no_longer_foretold(peak: float, told: list[str]) -> None:
    """A robot past its edge is not said to tip within a second; one before it is."""
    over = row('TIP_OVER', 'left', ERROR, peak=peak)
    (card,) = cards(over, row('TIP_AHEAD', 'left'))
    assert card['parts'] == told


def test_two_sides_are_two_cards() -> None:
    """Sides are never merged, whatever they share."""
    rows = [row(code, side) for side in SIDES for code in ('TIP_OVER', 'TIP_MOVING')]
    found = cards(*rows)
    assert [card['subject'] for card in found] == [*dict.fromkeys(c['subject'] for c in found)]
    assert {card['subject'] for card in found} == set(SIDES)


def test_the_torques_of_one_joint_are_one_card() -> None:
    """What a joint must hold is one cause; another joint is another."""
    codes = ('TORQUE_LIMIT', 'TORQUE_AHEAD', 'EFFORT_LIMIT', 'MOTOR_WEAK', 'MARGIN_UNCERTAIN')
    found = cards(
        *(row(code, joint) for code in codes for joint in ('elbow_joint', 'turret_joint'))
    )
    assert sorted(card['title'] for card in found) == ['ELBOW: TORQUE', 'TURRET: TORQUE']


@pytest.mark.parametrize('code', sorted(ALERTS))
def test_every_cause_has_a_title(code: str) -> None:
    """No code of the program and no empty word stands above a card."""
    (group,) = groups_of((row(code, 'imu'),))
    card = card_of(group, Snapshot(NOW), SETTINGS, None)
    assert card['title'] == card['title'].upper()
    assert not set('_{') & set(card['title'])


def test_the_table_of_causes_names_alerts() -> None:
    """A code that is renamed does not fall out of its cause unseen."""
    assert set(CAUSES) <= set(ALERTS)
    assert set(CAUSES.values()) == set(TITLES)
    assert cause_of(row('MARGIN_UNCERTAIN', 'left'))[0] == CAUSES['TIP_OVER']
    assert cause_of(row('MARGIN_UNCERTAIN', 'elbow_joint'))[0] == CAUSES['TORQUE_LIMIT']


def test_the_worst_order() -> None:
    """Cards come as urgent as the alerts in them: NO DATA, a contradicted IMU, tip-over, motors."""
    rows = (
        row('TORQUE_LIMIT', 'elbow_joint', ERROR, start=9),
        row('TIP_AHEAD', 'left'),
        row('TIP_OVER', 'right', ERROR),
        row('IMU_FROZEN', 'imu', ERROR),
        row('INPUT_STALE', 'joint_states', STALE),
    )
    order = ['INPUT_STALE', 'IMU_FROZEN', 'TIP_OVER', 'TORQUE_LIMIT', 'TIP_AHEAD']
    assert [card['code'] for card in cards(*rows)] == order


def test_a_worse_alert_is_not_behind_an_acknowledged_one() -> None:
    """A danger that comes behind an acknowledged caution calls, and is what the card says."""
    (card,) = cards(row('TIP_OVER', 'right'), called('TIP_AHEAD', 'right', ERROR))
    assert (card['level'], card['unseen'], card['text']) == ('ERROR', True, 'TIP_AHEAD is')
    assert card['state'] == 'active, not acknowledged'


def test_an_equal_alert_is_not_behind_an_acknowledged_one() -> None:
    """A new alert at the level of the acknowledged one calls again, though it is less urgent."""
    (card,) = cards(row('TIP_OVER', 'right', ERROR), called('TIP_MOVING', 'right', ERROR))
    assert (card['unseen'], card['state']) == (True, 'active, not acknowledged')
    assert 'acknowledge' in card['offers']


def test_a_lesser_alert_calls_nobody() -> None:
    """A caution behind an acknowledged danger of its cause does not flash; it can be seen off."""
    (card,) = cards(row('TIP_OVER', 'right', ERROR), called('TIP_AHEAD', 'right'))
    assert (card['level'], card['unseen']) == ('ERROR', False)
    assert card['offers'] == ['acknowledge']


def test_a_danger_is_not_shelved_with_its_caution() -> None:
    """Shelving is offered for a card of cautions alone."""
    (card,) = cards(called('TIP_OVER', 'right'), called('TIP_AHEAD', 'right'))
    assert card['offers'] == ['acknowledge', 'shelve']
    (card,) = cards(called('TIP_OVER', 'right', ERROR), called('TIP_AHEAD', 'right'))
    assert card['offers'] == ['acknowledge']


def over(code: str, subject: str, level: int = ERROR, **changes: Any) -> AlertRow:
    """Return an alert that is over and latched."""
    state = 'over, latched until reset'
    return row(code, subject, level, state=state, end=2, offers=('reset',), **changes)


def test_what_is_over_is_past_and_advises_nothing() -> None:
    """An ended cause has a card of its own, also while it is there again."""
    found = frame_of(
        Snapshot(NOW, alerts=(over('TIP_OVER', 'right'), row('TIP_OVER', 'right'))),
        SETTINGS,
        FIGURE,
    )
    (now,), (past,) = found['cards'], found['past']
    assert (now['active'], past['active']) == (True, False)
    assert (past['advice'], past['offers'], past['level']) == ('', ['reset'], 'ERROR')
    assert now['key'] != past['key']


def test_what_is_over_and_done_is_left_out_while_its_cause_is_there() -> None:
    """A lesser alert of a cause that has ended says nothing beside the card of that cause."""
    done = row('EFFORT_LIMIT', 'elbow_joint', end=2)
    assert len(cards(done)) == 1
    (card,) = cards(done, row('TORQUE_LIMIT', 'elbow_joint', ERROR))
    assert card['code'] == 'TORQUE_LIMIT'


def test_the_worst_stands_beside_its_own_time() -> None:
    """In a recording the position, live how long ago; degrees past or left, or the share."""
    tip = row('TIP_OVER', 'right', peak=math.radians(35.0), worst=NOW - 3_000_000_000, start=5)
    caution = replace(tip, key='w', level=WARN)
    (card,) = cards(tip, caution, source='bag', running=31.1)
    assert card['worst'] == '35 deg past at 28.1 s'
    assert cards(tip, running=31.1)[0]['worst'] == '35 deg past 3 s ago'
    near = replace(tip, peak=math.radians(-6.0))
    assert cards(near, running=31.1)[0]['worst'] == '6 deg left 3 s ago'
    joint = row('TORQUE_LIMIT', 'elbow_joint', peak=49.9, worst=NOW)
    assert cards(joint)[0]['worst'] == '99 % now'
    assert cards(row('TIP_OVER', 'right'))[0]['worst'] == ''
    assert cards(replace(tip, worst=None))[0]['worst'] == '35 deg past'


def test_dead_data_advise_nothing() -> None:
    """Without data no card has advice; after a fall each has the one sentence."""
    rows = (row('TIP_OVER', 'right'), row('TORQUE_LIMIT', 'elbow_joint'))
    assert {card['advice'] for card in cards(*rows, known=False)} == {''}
    assert {card['advice'] for card in cards(*rows, level=STALE)} == {''}
    assert {card['advice'] for card in cards(*rows)} == {'do'}
    assert {card['advice'] for card in cards(*rows, angle=(0.5, 0.5, -0.5, 0.5))} == {STAND_CLEAR}


def test_a_card_is_as_old_as_its_cause() -> None:
    """The age is since the first of its alerts was raised."""
    rows = (row('TIP_OVER', 'right', start=NOW - 10**9), row('TIP_AHEAD', 'right', start=NOW))
    assert cards(*rows, level=OK)[0]['age_s'] == 1.0
