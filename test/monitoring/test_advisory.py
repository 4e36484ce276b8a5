"""The verdict's advice and hints beside the alerts, and the operator's commands."""

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance import AcceptanceError, BadSample
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR
from ugv_acceptance.evaluation.alerts.alarms import Change, State
from ugv_acceptance.evaluation.alerts.messages import ALERTS, suspect_of
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Alert
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.monitoring.diagnostics import alert_status, verdict_of
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.nodes.monitor.operator_commands import DOINGS, operate, operation_from

PACKBOT = load().settings
FOLDED = (0.0, 2.0, -2.5, 2.0)
STRETCHED = (0.0, 0.0, 0.0, 2.0)
# 3.6 degrees past its tipping point.
NEARER = (0.0, 0.3, 0.2, 2.0)
DOWN = (0.0, 0.0, -9.81)


def session_with(settings: Settings = PACKBOT) -> Session:
    """Return a session that writes nothing down."""
    return Session(settings, lambda _stamp, _margins: None, lambda: None, lambda _text: None)


def give(
    session: Session, q: tuple[float, ...], pitch: float = 0.0, effort: Any = (0.0,) * 4
) -> None:
    """Give a session both inputs of a robot at rest that faces downhill by `pitch` (rad)."""
    now, names = session.clock.now(), PACKBOT.robot.joint_names
    force = (-9.81 * math.sin(pitch), 0.0, 9.81 * math.cos(pitch))
    turn = (0.0, math.sin(pitch / 2), 0.0, math.cos(pitch / 2))
    session.take_joint_state(joint_state_cdr(now, '', names, q, (0.0,) * 4, effort))
    session.take_imu(imu_cdr(now, 'imu_link', turn, (0.0, 0.0, 0.0), force))


def wait_until(condition: Any, meanwhile: Any) -> None:
    """Give messages until it is so."""
    end = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < end
        meanwhile()
        time.sleep(0.01)


def raised(session: Session, code: str, subject: str = '', level: int = 0) -> list[Alert]:
    """Return the alerts of a code that are active: on a busy machine an input may be late too."""
    rules = [(a, a.rule) for a in session.active if a.rule.code == code]
    return [a for a, rule in rules if rule.subject.startswith(subject) and rule.level >= level]


def test_advice_comes_without_holding_up_a_message() -> None:
    """First the general advice, then the computed one, which a thread has worked out."""
    session = session_with()
    wait_until(lambda: raised(session, 'TIP_OVER'), lambda: give(session, STRETCHED))
    session.alarm_tracker.take()
    assert 'raise the elbow' not in verdict_of(session).message
    wait_until(session.advisory.arrived, lambda: give(session, STRETCHED))
    wait_until(
        lambda: 'raise the elbow by' in verdict_of(session).message,
        lambda: give(session, STRETCHED),
    )
    verdict = verdict_of(session)
    assert verdict.values['do'] == verdict.values['advice_1']
    assert verdict.values['class'] in {'physical / effector', 'human / interaction'}


def test_after_a_fall_the_verdict_and_every_alert_say_to_stand_clear() -> None:
    """No motion of the arm and no load to set down, though both were advised before the fall."""
    session = session_with()
    wait_until(lambda: raised(session, 'TIP_OVER'), lambda: give(session, STRETCHED))
    verdict_of(session)
    wait_until(session.advisory.arrived, lambda: give(session, STRETCHED))
    wait_until(
        lambda: verdict_of(session).values.get('do') == STAND_CLEAR,
        lambda: give(session, STRETCHED, 1.2),
    )
    give(session, STRETCHED, 1.2)
    verdict, statuses = verdict_of(session), session.alarm_tracker.take()
    said = [value for key, value in verdict.values.items() if key.startswith('advice_')]
    assert (said, f'; {STAND_CLEAR}' in verdict.message) == ([STAND_CLEAR], True)
    assert len(statuses) > 1
    assert {alert_status(c, session).values['do'] for c in statuses} == {STAND_CLEAR}
    wait_until(
        lambda: verdict_of(session).values.get('do', '') != STAND_CLEAR,
        lambda: give(session, STRETCHED),
    )


def test_the_verdict_tells_the_margin_of_now() -> None:
    """A robot that was worse a moment ago is told the same as one that was not."""
    said = []
    for before in ((), (STRETCHED,)):
        session = session_with()
        for q in (*before, NEARER):
            # An input that is late for a moment is said first.
            wait_until(lambda q=q: _tells(session, q), lambda q=q: give(session, q))  # noqa: B023
        said.append(verdict_of(session).message.split(' (and ')[0])
    assert said[0] == said[1]
    assert raised(session, 'TIP_OVER', level=ERROR)[0].peak > math.radians(9.0)


def test_the_worst_value_comes_with_its_own_time() -> None:
    """In the verdict and in the alert list: when it was worst, which was before it got better."""
    session = session_with()
    for q in (STRETCHED, NEARER):
        wait_until(lambda q=q: _tells(session, q), lambda q=q: give(session, q))
    verdict = verdict_of(session)
    alert = raised(session, 'TIP_OVER', level=ERROR)[0]
    change = Change(session.clock.now(), alert, 'raised', State.ACTIVE_UNACKNOWLEDGED)
    told = alert_status(change, session).values
    margins = session.evaluator.margins
    assert margins is not None
    assert alert.worst_at is not None
    assert alert.worst_at < margins.time
    assert told['worst_ns'] == alert.worst_at
    if verdict.values['code'] == 'TIP_OVER':
        assert verdict.values['peak'] == alert.peak


def _tells(session: Session, q: tuple[float, ...]) -> bool:
    margins = session.evaluator.margins
    there = margins is not None and margins.q == q
    return there and 'past tipping: FRONT; DANGER' in verdict_of(session).message


# Postures that load shoulder and elbow differently.
LOADED = ((0.0, 0.0, 0.3, 2.0), (0.0, 0.6, 1.5, 2.0), (0.0, 1.0, -1.2, 2.0))


def rest(session: Session, q: tuple[float, ...], carried: float, scale: float = 1.0) -> None:
    """Let a robot rest for three looks with a load (kg) and an effort that is `scale` x torque."""
    effort = scale * static_torque(PACKBOT.robot, q, DOWN, Payload(carried))
    for _ in range(3):
        wait_until(
            lambda: session.evaluator.margins, lambda: give(session, q, 0.0, effort.tolist())
        )
        give(session, q, 0.0, effort.tolist())
        session.feel()


def test_a_robot_that_slides_before_it_tips_is_told() -> None:
    """With a friction of 0.3 the tracks slide at 16.7 degrees: 1.7 are left on a slope of 15."""
    limits = replace(PACKBOT.limits, friction=0.3)
    session = session_with(replace(PACKBOT, limits=limits))
    slope = math.radians(15.0)
    wait_until(lambda: session.evaluator.margins, lambda: give(session, FOLDED, slope))
    verdict = verdict_of(session)
    assert verdict.values['slide_left_deg'] == pytest.approx(1.7, abs=0.01)
    wait_until(lambda: raised(session, 'SLIDE'), lambda: give(session, FOLDED, slope))
    assert [a.rule.subject for a in raised(session, 'SLIDE')] == ['robot']
    assert not raised(session, 'TIP_OVER')
    said = verdict_of(session).message
    assert 'the tracks will slide before the robot tips: 1.6 deg of slope left' in said
    assert 'drive straight up or down the slope to where it is less steep' in said


def test_a_robot_that_tips_before_it_slides_is_not_told_of_sliding() -> None:
    """With a friction of 0.8 a stretched arm with its load tips first."""
    limits = replace(PACKBOT.limits, friction=0.8)
    session = session_with(replace(PACKBOT, limits=limits))
    wait_until(
        lambda: raised(session, 'TIP_OVER'),
        lambda: give(session, STRETCHED, math.radians(30.0)),
    )
    assert not raised(session, 'SLIDE')


def test_a_load_that_the_motors_feel_is_offered() -> None:
    """Efforts of 6 kg where 4 are declared: told after three looks at rest."""
    session = session_with()
    for q in LOADED:
        rest(session, q, carried=6.0)
    wait_until(lambda: session.advisory.estimate, session.feel)
    session.feel()
    alert = next(a for a in session.active if a.rule.code == 'PAYLOAD_DIFFERS')
    assert alert.peak == pytest.approx(2.0, abs=0.01)
    words = session.faults.sentence(alert, session.settings)
    assert words == 'measured efforts suggest a payload of 6.0 kg, but 4.0 kg is declared'
    assert 'declare the payload' in session.advisory.do(alert)
    assert verdict_of(session).values['payload_estimate_kg'] == pytest.approx(6.0, abs=0.01)


def test_a_load_that_is_felt_is_not_forgotten_in_motion_but_once_it_is_declared() -> None:
    """An undeclared payload stays an alert in motion, until efforts agree with the declared one."""
    session, q = session_with(), LOADED[-1]
    for posture in LOADED:
        rest(session, posture, carried=6.0)
    wait_until(lambda: session.advisory.estimate, session.feel)
    effort = static_torque(PACKBOT.robot, q, DOWN, Payload(6.0)).tolist()
    moving = joint_state_cdr(
        time.time_ns(), '', PACKBOT.robot.joint_names, q, (0.0, 0.3, 0.0, 0.0), effort
    )
    session.take_joint_state(moving)
    session.feel()
    assert session.advisory.estimate is not None
    session.evaluator.payload = Payload(6.0)

    def goes_on() -> None:
        give(session, q, 0.0, effort)
        session.feel()

    wait_until(lambda: session.advisory.estimate is None, goes_on)


@pytest.mark.parametrize('scale', [0.0, math.nan, 1.0 / 12.0, 12.0])
def test_efforts_that_are_no_torque_weigh_nothing(scale: float) -> None:
    """Efforts that are zero, missing or of another unit suggest no payload and no sign."""
    session = session_with()
    for q in LOADED:
        rest(session, q, carried=6.0, scale=scale)
    wait_until(lambda: session.advisory.efforts, session.feel)
    for _ in range(3):
        session.feel()
    assert session.advisory.estimate is None
    assert not raised(session, 'PAYLOAD_DIFFERS')
    assert not raised(session, 'EFFORT_SIGN')


def test_efforts_of_the_other_sign_are_named() -> None:
    """EFFORT_SIGN names each loaded joint whose effort is against its load."""
    session = session_with()
    for q in LOADED:
        rest(session, q, carried=4.0, scale=-1.0)
    wait_until(lambda: raised(session, 'EFFORT_SIGN'), session.feel)
    named = {alert.rule.subject for alert in raised(session, 'EFFORT_SIGN')}
    assert {'shoulder_joint', 'elbow_joint'} <= named
    assert session.advisory.estimate is None


def test_a_tilt_that_grows_fast_is_urgent() -> None:
    """Tipping within two seconds is said at once, and with its time."""
    session, begin = session_with(), time.monotonic()

    def lean() -> None:
        give(session, FOLDED, 0.3 * (time.monotonic() - begin))

    wait_until(lambda: session.advisory.urgent(session.clock.now()), lean)
    verdict = verdict_of(session)
    assert verdict.values['tip_of'] == 'front'
    assert 'tips FRONT in' in verdict.message


def message(name: str, /, **values: str) -> DiagnosticStatus:
    """Return an operator's message."""
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticStatus(name=name, hardware_id='Ada', message='seen', values=pairs)


def test_the_operators_page_has_every_code_with_its_class(repository: Path) -> None:
    """One row a code: meaning, what to do, and where to look first."""
    page = (repository / 'docs' / 'operator.md').read_text(encoding='utf-8')
    rows = [line.strip('| ').split(' | ') for line in page.splitlines() if line.count('|') == 5]
    written = {row[0]: row[3] for row in rows if row[0].isupper()}
    assert written == {code: suspect_of(code) for code in ALERTS}


texts = st.text(st.characters(exclude_categories=['Cs'], exclude_characters='\0'), max_size=12)


keys = texts | st.sampled_from(['seconds', 'code', 'subject', 'level'])


@given(
    texts | st.sampled_from(DOINGS),
    st.dictionaries(keys, texts | st.sampled_from(['WARN', 'ERROR', '60'])),
)
def test_whatever_an_operator_sends_is_done_or_refused_in_one_line(
    name: str, values: dict[str, str]
) -> None:
    """No message ends the node: it is an operation, or an error of one line that says why."""
    error = None
    try:
        operate(session_with(), message(name, **values))
    except AcceptanceError as refused:
        error = refused
    assert error is None or len(str(error).splitlines()) == 1


@pytest.mark.parametrize(
    ('sent', 'said'),
    [
        (message('explode'), 'name: expected one of acknowledge'),
        (message('shelve', code='CLOCK', level='BAD'), 'level: expected one of OK'),
        (message('shelve', seconds='soon'), 'seconds: expected a number'),
        (message('shelve', seconds='nan'), 'seconds: expected a number'),
    ],
)
def test_what_is_wrong_with_an_operation_is_said(sent: DiagnosticStatus, said: str) -> None:
    """A wrong operator command is refused with field, what was expected and what came."""
    with pytest.raises(BadSample, match=said):
        operation_from(sent)


def test_one_alarm_can_be_acknowledged_by_its_code() -> None:
    """One alarm can be acknowledged by its code; the others stay as they are."""
    session = session_with()
    wait_until(
        lambda: raised(session, 'TIP_OVER', 'front', ERROR) and len(session.active) > 3,
        lambda: give(session, STRETCHED),
    )
    session.alarm_tracker.take()
    asked = message('acknowledge', code='TIP_OVER', subject='front', level='ERROR')
    (change,) = operate(session, asked)
    assert (change.who, change.note) == ('Ada', 'seen')
    states = [alarm.state for alarm in session.alarm_tracker.alarms.table.values()]
    assert states.count(State.ACTIVE_ACKNOWLEDGED) == 1
