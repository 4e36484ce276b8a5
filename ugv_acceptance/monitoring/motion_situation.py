"""What an answer about a planned motion rests on: whether it is known, and still holds.

An answer is good for the robot as it was seen when it was asked: at rest, in one posture, with one
load, on one ground, under one set of limits. A `Situation` keeps that; whatever of it is missing
is named, and so is whatever has changed since.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ugv_acceptance.evaluation.alerts.level_words import level_words
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, STALE
from ugv_acceptance.evaluation.criteria.not_judged import unknown_words
from ugv_acceptance.evaluation.inputs.timeouts import FOREVER
from ugv_acceptance.evaluation.margin_words import excess_words
from ugv_acceptance.evaluation.planned_motion import Conditions
from ugv_acceptance.evaluation.planned_motion.asked import NEAR, NEAR_SLIDE
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.attitude import angle_between
from ugv_acceptance.model.robot import Payload, Vector
from ugv_acceptance.monitoring.diagnostics import verdict_of
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.monitoring.trends import LEAST

# Alerts below DANGER beside which a motion may be judged: it is held against the same limits, or
# they do not touch what is known now. With any other alert nothing is promised.
HARMLESS = frozenset({'TIP_OVER', 'TORQUE_LIMIT', 'LIMITS_RELAXED', 'MESSAGES_LOST'})
# How far gravity (rad) may be from where it was; joints: as far as a motion may begin beside them.
TURNED = math.radians(1.0)
# Length (ns) of the time that a robot must be seen at rest.
AT_REST = 500_000_000
INACTIVE = 'the monitor is not active'


@dataclass(frozen=True, slots=True)
class Situation:
    """What an answer rests on, as it was seen at `time` (ns, of the session's clock).

    `q` (j,) rad or m, `gravity` m/s2 in `base_link`; `load_by` says who told the payload, `level`
    is the monitor's. `held` are joints that no message tells, taken as held.
    """

    session: Session
    time: int
    settings: Settings
    limits_hash: str
    payload: Payload
    load_by: str
    gravity: Vector
    q: tuple[float, ...]
    level: int
    held: frozenset[str]

    def conditions(self, moved: tuple[str, ...]) -> Conditions:
        """Return the conditions for a motion of the joints that messages call `moved`.

        The position of a joint that is to move must have been told.
        """
        joints = zip(self.settings.robot.joint_names, self.settings.joints, self.q, strict=True)
        posture = tuple(
            math.nan if name in self.held and joint.topic_name in moved else q
            for name, joint, q in joints
        )
        return Conditions(self.gravity, self.payload, self.settings.ground.kind, posture)


def situation_of(session: Session, load_by: str) -> Situation:
    """Return the situation now; only where `missing` finds nothing."""
    evaluator, settings = session.evaluator, session.settings
    margins, joints = evaluator.margins, evaluator.joints
    if margins is None:
        raise ValueError('expected margins: ask `missing` first')
    names = zip(settings.robot.joint_names, joints.seen, strict=True)
    return Situation(
        session,
        session.clock.now(),
        settings,
        session.limits_hash,
        evaluator.payload,
        load_by,
        margins.gravity,
        margins.q,
        session.level,
        frozenset(name for name, seen in names if seen == FOREVER),
    )


def missing(session: Session | None, load_by: str) -> Iterator[str]:
    """Yield in sentences what would have to be known before a motion can be judged.

    `load_by` says who told the payload; '' if nobody did.
    """
    if session is None:
        yield INACTIVE
        return
    evaluator, settings = session.evaluator, session.settings
    if settings.unknown:
        yield unknown_words(settings)
    if not settings.judges_tilt:
        yield 'tip-over is not judged: the attitude or the contact points are not known'
    if evaluator.margins is None or session.level == STALE:
        yield f'the monitor shows {level_words(STALE)}: {verdict_of(session).message}'
        return
    if evaluator.joints.doubted:
        yield 'a joint that no message tells is taken as held, and it may matter'
    yield from _untold(settings, load_by)
    for alert in session.active:
        if alert.rule.level < ERROR and alert.rule.code not in HARMLESS:
            words = session.faults.sentence(alert, settings)
            yield f'{alert.rule.code} {alert.rule.subject} is active: {words}'
    yield from unrest(session)


def _untold(settings: Settings, load_by: str) -> Iterator[str]:
    """Yield what only a person can tell, and has not."""
    if not load_by and settings.robot.payload_link is not None:
        yield 'nobody told the payload: ugv-acceptance tell payload 0kg, or what it carries'
    if settings.ground.kind is None:
        yield 'nobody told the ground: ugv-acceptance tell ground flat, uneven or stairs'
    if settings.hand_may_touch:
        yield 'the arm may touch the ground (hand_may_touch), so no torque is known'


def dangers(session: Session | None) -> Iterator[str]:
    """Yield in sentences why nothing may move now: what the monitor shows as DANGER.

    Nothing where it shows NO DATA: `missing` says that.
    """
    if session is None or session.level == STALE:
        return
    for alert in session.active:
        if alert.rule.level == ERROR:
            words = session.faults.sentence(alert, session.settings)
            yield f'the monitor shows {level_words(ERROR)}: {words}'


def unrest(session: Session) -> Iterator[str]:
    """Yield in sentences why the robot is not seen to be at rest, by its IMU and its joints."""
    now, names = session.clock.now(), session.settings.robot.joint_names
    recent = session.trends.recent(now)
    if len(recent) < LEAST or recent[-1].time - recent[0].time < AT_REST:
        yield 'it is not known yet whether the robot stands still: ask again in a second'
        return
    # They are 50 ms apart: what came since tells first that it begins to move.
    newest = session.evaluator.margins or recent[-1]
    recent = [*recent, newest]
    turned = max(float(angle_between(m.gravity, newest.gravity)) for m in recent)
    if turned > TURNED:
        yield f'the robot moves: its attitude changed by {excess_words(turned)} in a second'
    felt, imu = session.evaluator.chassis.filter, session.settings.imu
    if felt.running and math.hypot(*felt.state[9:12]) > imu.rest_rate:
        yield 'the robot turns, by its gyro'
    if felt.running and math.hypot(*felt.state[3:6]) > imu.rest_acceleration:
        yield 'the robot is driven or pushed, by its accelerometer'
    rows = zip(names, _near(session.settings), *(m.q for m in recent), strict=True)
    for name, near, *told in rows:
        if max(told) - min(told) > near:
            yield f'{name} moves'


def change(situation: Situation, session: Session | None, load_by: str) -> tuple[str, str]:
    """Return what no longer is as an answer says, in a word and in a sentence; '' if nothing.

    The word is one of monitor, payload, ground, attitude, posture, limits, verdict.
    """
    then = situation
    if session is None:
        return 'monitor', INACTIVE
    if session is not then.session:
        return 'monitor', 'the monitor began a new evaluation'
    evaluator = session.evaluator
    changed: tuple[tuple[str, Callable[[], bool], str], ...] = (
        (
            'payload',
            lambda: evaluator.payload != then.payload or not evaluator.load_known,
            'another payload was told',
        ),
        ('ground', lambda: session.settings.ground != then.settings.ground, 'another ground'),
        ('limits', lambda: _other_limits(session, then), 'limits or settings were changed'),
        ('attitude', lambda: _turned(session, then), 'the robot leans otherwise than then'),
        ('posture', lambda: _moved(session, then), 'the joints stand otherwise than then'),
        ('verdict', lambda: session.level > then.level, _worse(session)),
    )
    for word, is_so, sentence in changed:
        if is_so():
            return word, sentence
    found = next(iter([*dangers(session), *missing(session, load_by)]), '')
    return ('verdict', found) if found else ('', '')


def _other_limits(session: Session, then: Situation) -> bool:
    if session.settings is then.settings:
        return False
    now, before = session.settings, then.settings
    return session.limits_hash != then.limits_hash or (
        now.limits,
        now.imu,
        now.hand_may_touch,
        now.unsafe,
    ) != (before.limits, before.imu, before.hand_may_touch, before.unsafe)


def _turned(session: Session, then: Situation) -> bool:
    margins = session.evaluator.margins
    return margins is not None and float(angle_between(margins.gravity, then.gravity)) > TURNED


def _moved(session: Session, then: Situation) -> bool:
    margins = session.evaluator.margins
    if margins is None:
        return False
    rows = zip(margins.q, then.q, _near(session.settings), strict=True)
    return any(abs(q - before) > near for q, before, near in rows)


def _near(settings: Settings) -> list[float]:
    """Return how far each joint may be from where it was and still stand there: its noise."""
    robot = settings.robot
    slides = (robot.joint(name).slides for name in robot.joint_names)
    return [NEAR_SLIDE if along else NEAR for along in slides]


def _worse(session: Session) -> str:
    return f'the monitor shows {level_words(session.level)} now'
