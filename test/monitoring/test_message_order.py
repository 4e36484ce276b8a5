"""The order of what is published: cause and what to do before rqt and terminals cut a message."""

from collections.abc import Iterator
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.config import Config, load
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR
from ugv_acceptance.evaluation.alerts.alarms import Change, State
from ugv_acceptance.evaluation.alerts.messages import ALERTS, LIVE, advice
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, STALE, WARN, Alert, Rule
from ugv_acceptance.monitoring.diagnostics import alert_status, diagnostics_of, verdict_of
from ugv_acceptance.monitoring.message_order import SHOWN, clauses_of, in_order
from ugv_acceptance.monitoring.status import Status
from ugv_acceptance.offline.replayed_session import ReplayedSession

ROBOTS = ('packbot', 'packbot_eod')
LONG = 'manipulator_left_shoulder_lift_joint'
# As long as names of nodes, files and values make it.
DETAIL = ', '.join(
    f'/robot_{k}/sensors/driver_of_the_left_arm says 0.1234 of 5.6789' for k in range(9)
)


@cache
def robot(name: str) -> Config:
    """Return the configuration of a robot that ships."""
    return load(name)


def alarmed(of: Config, rule: Rule, do: str) -> tuple[ReplayedSession, Alert]:
    """Return a session in which an alert with a long detail is active, and the alert."""
    alert = Alert(rule, 1, 0.2, detail=DETAIL)
    told = {(1, rule.code, rule.subject, rule.level): do}
    session = ReplayedSession(
        of.settings, lambda _s, _m: None, lambda: None, lambda _: None, told=told
    )
    if rule.code in LIVE:
        session.faults.set(1, rule.code, rule.subject, 3.0, DETAIL)
        alert = session.faults.active[0]
    else:
        session.evaluator.watch.log.append(alert)
    session.alarm_tracker.take()
    return session, alert


def published(session: ReplayedSession, alert: Alert) -> Iterator[Status]:
    """Yield every status that says the alert: verdict, alerts, diagnostics."""
    verdict = verdict_of(session)
    yield verdict
    for how in ('raised', 'acknowledged', 'unshelved'):
        state = State.ACTIVE_ACKNOWLEDGED if how == 'acknowledged' else State.ACTIVE_UNACKNOWLEDGED
        yield alert_status(Change(1, alert, how, state), session)
    statuses = diagnostics_of(verdict, None, session, None)
    yield from (s for s in statuses if s.name in {'Monitor', f'Input {alert.rule.subject}'})


def told_in_time(message: str, do: str) -> bool:
    """Return whether at least the first clause of what to do is shown."""
    clause = clauses_of(do)[-1]
    return clause in message[:SHOWN]


@pytest.mark.parametrize('code', ALERTS)
def test_what_to_do_is_shown_before_a_message_is_cut(code: str) -> None:
    """Of every alert, level, robot and subject, with a long detail, by its first clause."""
    late = []
    for of in map(robot, ROBOTS):
        settings = of.settings
        subjects = ('joint_states', 'imu', 'payload', 'front', settings.robot.joint_names[0], LONG)
        for subject, level in zip(subjects, (WARN, ERROR, STALE) * 2, strict=True):
            rule = Rule(code, subject, LIVE.get(code, level), 0.1, 0.1, 0, 0)
            do = advice(code, settings.robot)
            session, alert = alarmed(of, rule, do)
            said = [status.message for status in published(session, alert)]
            late += [message for message in said if not told_in_time(message, do)]
    assert late == []


TEXTS = st.text(st.characters(codec='ascii', exclude_categories=['Cc']), max_size=400)
NAMES = st.from_regex(r'[a-z][a-z_]{0,45}', fullmatch=True)
DOES = st.one_of(
    st.sampled_from([text.to_do for text in ALERTS.values()] + [STAND_CLEAR]),
    NAMES.map(lambda name: f'lower the {name} by 10 deg: 3 deg further from tipping to the right'),
)


@given(TEXTS, DOES, st.sampled_from(['', ' (and 12 more)']), st.sampled_from(['', 'unshelved: ']))
def test_no_cause_is_so_long_that_it_hides_what_to_do(
    cause: str, do: str, more: str, before: str
) -> None:
    """Whatever the cause: the first clause of what to do is shown."""
    assert told_in_time(in_order(cause, do, 'the rest', before=before, more=more), do)


@given(TEXTS, DOES)
def test_nothing_is_lost_from_a_message(cause: str, do: str) -> None:
    """A cause that had to be cut stands in full at the end; all else is there too."""
    said = in_order(cause, do, 'the rest')
    assert (cause in said, do in said, 'the rest' in said) == (True, True, True)


def test_a_short_cause_is_not_cut() -> None:
    """What happened, how many more, what to do, what is left."""
    said = in_order(
        'no message from imu', 'check its driver', 'margins not known', more=' (and 2 more)'
    )
    assert said == 'no message from imu (and 2 more); check its driver; margins not known'


def test_what_is_over_tells_what_happened_alone() -> None:
    """Of an alert that was cleared nothing is to be done."""
    session, alert = alarmed(
        robot('packbot'), Rule('NO_SUPPORT', 'robot', ERROR, 0.1, 0.1, 0, 0), 'stop'
    )
    said = alert_status(Change(1, alert, 'cleared', State.NORMAL), session)
    assert said.message == f'cleared: {said.values["happened"]}'
