"""A monitor whose configuration calls values `unknown`: no OK, and DANGER is told all the same."""

from dataclasses import replace

import pytest
from monitoring.test_certainty import SETTINGS, Robot
from nodes.live_case import FOLDED

from ugv_acceptance.console.frame import frame_of
from ugv_acceptance.console.snapshot import Snapshot
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.monitoring.diagnostics import margin_statuses, verdict_of
from ugv_acceptance.monitoring.drawing import figure_of

STRETCHED = (0.0, 0.0, 0.0, 2.0)
NO_FEET = replace(SETTINGS, robot=replace(SETTINGS.robot, contacts=()), unknown=('contacts',))
CASES = {
    'contacts': NO_FEET,
    'payload.link': replace(SETTINGS, unknown=('payload.link',)),
    'joints.turret_joint.limit': replace(SETTINGS, unknown=('joints.turret_joint.limit',)),
}


def at_rest(settings: Settings, q: tuple[float, ...] = FOLDED) -> Robot:
    """Return a PackBot with these settings that has stood for two seconds."""
    robot = Robot((), settings)
    robot.stand(2.0, q)
    return robot


@pytest.mark.parametrize('key', list(CASES))
def test_no_verdict_is_ok_while_something_is_unknown(key: str) -> None:
    """Where the same robot would be OK the level is NO DATA, and the sentence names the key."""
    assert verdict_of(at_rest(SETTINGS).session).level == OK
    session = at_rest(CASES[key]).session
    assert (session.level, verdict_of(session).level) == (STALE, STALE)
    assert f'the configuration does not know {key}' in verdict_of(session).message


def test_unknown_contacts_leave_tip_over_without_an_alert_and_never_ok() -> None:
    """No support polygon is no fall: the status of tip-over says why there is no margin."""
    session = at_rest(NO_FEET, STRETCHED).session
    codes = {alert.rule.code for alert in session.evaluator.watch.log}
    assert not codes & {'NO_SUPPORT', 'TIP_OVER'}
    tip = [s for s in margin_statuses(session.evaluator, []) if s.name == 'Tip-over']
    assert [(s.level, 'contacts: unknown' in s.message) for s in tip] == [(STALE, True)]


def test_danger_is_told_beside_unknown_values() -> None:
    """A joint beyond its limit is DANGER, not NO DATA, though nobody knows the contact points."""
    verdict = verdict_of(at_rest(NO_FEET, STRETCHED).session)
    assert verdict.level == ERROR
    assert 'shoulder_joint' in verdict.message


@pytest.mark.parametrize('key', list(CASES))
def test_the_console_says_what_is_unknown(key: str) -> None:
    """A frame of such a robot is NO DATA, says what to enter, and shows what is known."""
    settings = CASES[key]
    margins = at_rest(settings).session.evaluator.margins
    assert margins is not None
    seen = Snapshot(
        1, OK, q=margins.q, torque=margins.torque, gravity=margins.gravity, known=True,
        angle=tuple(float(angle) for angle in margins.stability.angle),
        state=int(margins.stability.state),
    )  # fmt: skip
    frame = frame_of(seen, settings, figure_of(settings.robot))
    assert frame['level'] == 'STALE'
    headline = frame['headline']
    assert key in headline['cause']
    assert headline['action'] == 'COMPLETE THE CONFIGURATION'
    assert 'shoulder ' in headline['notes'][0] or 'elbow ' in headline['notes'][0]
    assert all(row['words'] != '-' for row in frame['torque'])
