"""Margins kept by less than their uncertainty, and what leads the verdict when sensors differ."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from nodes.live_case import FOLDED, NAMES, imu

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import choose_topics, open_bag
from ugv_acceptance.config import load
from ugv_acceptance.config.uncertain import sources_from
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Alert
from ugv_acceptance.evaluation.criteria.uncertainty import Source, combined, effects_of
from ugv_acceptance.evaluation.margin_words import excess_words, tipping_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.monitoring.background import AtOnce
from ugv_acceptance.monitoring.diagnostics import verdict_of
from ugv_acceptance.monitoring.session import Session

CONFIG = load()
SETTINGS, SOURCES = CONFIG.settings, sources_from(CONFIG)
S, MS = 1_000_000_000, 1_000_000


@dataclass(slots=True)
class Robot:
    """A PackBot that sends 50 messages a second to a session, whose time this sets."""

    sources: tuple[Source, ...] = SOURCES
    settings: Settings = SETTINGS
    at: int = 1000 * S
    session: Session = field(init=False)

    def __post_init__(self) -> None:
        self.session = Session(
            self.settings, lambda *_: None, lambda: None, lambda _: None, clock=self,
            sources=self.sources, pool=AtOnce(),
        )  # fmt: skip

    def now(self) -> int:
        """Return the time (ns)."""
        return self.at

    def stand(self, seconds: float, q: tuple[float, ...], roll: float = 0.0) -> None:
        """Send messages of a robot at rest in a posture."""
        for k in range(round(seconds * 50)):
            self.at += 20 * MS
            self.session.take_joint_state(joint_state_cdr(self.at, '', NAMES, q))
            self.session.take_imu(imu(roll, self.at))
            if k % 2:
                self.session.tick()

    def alerts(self, code: str = 'MARGIN_UNCERTAIN') -> list[Alert]:
        """Return the alerts of a code that were raised so far."""
        return [a for a in self.session.evaluator.watch.log if a.rule.code == code]


def left_and_bound(robot: Robot, side: str) -> tuple[float, float]:
    """Return the tilt left above its limit to a side, and its bound (rad), computed anew."""
    margins = robot.session.evaluator.margins
    assert margins is not None
    payload, k = robot.session.evaluator.payload, SIDES.index(side)
    effects = effects_of(robot.settings, robot.sources, margins.q, margins.gravity, payload)
    left = float(margins.stability.angle[k]) - robot.settings.limits.tip_error
    return left, float(combined(effects.angle, 'rss')[k])


def in_doubt() -> tuple[float, ...]:
    """Return a posture whose tilt left to the front is half as much as it is known."""
    robot = Robot()
    for shoulder in np.arange(1.5, 0.0, -0.02).tolist():
        robot.stand(0.1, (0.0, shoulder, 0.0, 2.0))
        left, bound = left_and_bound(robot, 'front')
        if left < 0.5 * bound:
            return (0.0, shoulder, 0.0, 2.0)
    raise AssertionError


def test_a_margin_kept_by_less_than_its_uncertainty_is_a_caution() -> None:
    """The alert says which margin, how much is left and how well it is known; it is a CAUTION."""
    robot = Robot()
    robot.stand(3.0, FOLDED)
    assert robot.alerts() == []
    robot.stand(3.0, in_doubt())
    (alert,) = [a for a in robot.alerts() if a.rule.subject == 'front']
    left, bound = left_and_bound(robot, 'front')
    sentence = robot.session.faults.sentence(alert, SETTINGS)
    assert alert.rule.level == WARN
    assert f'+/- {excess_words(bound)}' in sentence
    assert tipping_words('front', left + math.radians(5.0)) in sentence


def test_it_ends_when_the_margin_is_large_again() -> None:
    """Back in a safe posture the alert is over within five seconds."""
    robot = Robot()
    robot.stand(3.0, in_doubt())
    robot.stand(5.0, FOLDED)
    assert robot.alerts()
    assert all(a.end is not None for a in robot.alerts())


def test_the_torque_of_a_joint_has_a_bound_too() -> None:
    """A joint within its limit by less than its +/- is told in its own unit."""
    limit = 50.5
    robot = Robot()
    robot.stand(0.1, (0.0, 0.3, -0.3, 2.0))
    margins = robot.session.evaluator.margins
    assert margins is not None
    need = abs(margins.torque[1])
    torque = (math.inf, need + 0.5, limit, math.inf)
    close = replace(SETTINGS, limits=replace(SETTINGS.limits, torque=torque))
    robot = Robot(settings=close)
    robot.stand(3.0, (0.0, 0.3, -0.3, 2.0))
    (alert,) = [a for a in robot.alerts() if a.rule.subject == 'shoulder_joint']
    assert 'shoulder_joint has 0.5 N m left' in robot.session.faults.sentence(alert, close)


def test_a_margin_that_is_used_up_is_not_only_uncertain() -> None:
    """Past the limit there is nothing to doubt: TIP_OVER says it, and this alert does not."""
    robot = Robot()
    robot.stand(3.0, (0.0, 0.0, 0.0, 2.0))
    assert robot.alerts('TIP_OVER')
    assert 'front' not in {a.rule.subject for a in robot.alerts()}


def test_without_stated_uncertainty_nothing_is_in_doubt() -> None:
    """A configuration without `uncertainty` bounds no margin, so none is told."""
    robot = Robot(sources=())
    robot.stand(3.0, in_doubt())
    assert robot.alerts() == []


def test_a_margin_at_its_bound_raises_one_alert_and_no_storm() -> None:
    """A posture that swings about the border for a minute gives one alert, not one a swing."""
    inside = in_doubt()
    robot = Robot()
    shoulder = next(s for s in np.arange(inside[1], 1.5, 0.005).tolist() if at_border(robot, s))
    for k in range(60):
        robot.stand(1.0, (0.0, shoulder + (0.01 if k % 2 else -0.01), 0.0, 2.0))
    assert len([a for a in robot.alerts() if a.rule.subject == 'front']) == 1


def at_border(robot: Robot, shoulder: float) -> bool:
    """Return whether the front's margin is no more than its bound with the shoulder here."""
    robot.stand(0.1, (0.0, shoulder, 0.0, 2.0))
    left, bound = left_and_bound(robot, 'front')
    return left >= bound


def test_a_run_that_passes_is_never_in_doubt(repository: Path) -> None:
    """The recording that passes, played live, raises no alert at all."""
    robot = Robot()
    bag = open_bag(repository / 'bags' / 'packbot_pass')
    topics = choose_topics(bag, *CONFIG.topics.names)
    take = {
        topics.joint_states: robot.session.take_joint_state,
        topics.imu: robot.session.take_imu,
        topics.payload: robot.session.take_payload,
    }
    due = bag.start_ns
    for message in messages(bag, [name for name in take if name]):
        while due < message.log_time:
            robot.at = due
            robot.session.tick()
            due += 50 * MS
        robot.at = message.log_time
        take[message.topic](message.data)
    assert robot.alerts() == []


def test_what_contradicts_the_imu_leads_the_verdict() -> None:
    """While the IMU contradicts itself, the verdict says so before the tip-over drawn from it."""
    robot = Robot()
    robot.stand(2.0, FOLDED)
    for _ in range(150):  # the orientation turns over, the acceleration stays level
        robot.at += 20 * MS
        robot.session.take_joint_state(joint_state_cdr(robot.at, '', NAMES, FOLDED))
        lying = (math.sin(0.6), 0.0, 0.0, math.cos(0.6))
        force, still = (0.0, 0.0, 9.81), (0.0, 0.0, 0.0)
        robot.session.take_imu(imu_cdr(robot.at, 'imu_link', lying, still, force))
        robot.session.tick()
        codes = {a.rule.code for a in robot.session.active if a.rule.level == ERROR}
        if {'IMU_INCONSISTENT', 'TIP_OVER'} <= codes:
            break
    else:
        pytest.fail('expected both alerts at once')
    assert 'disagree' in verdict_of(robot.session).message.partition(';')[0]
    assert verdict_of(robot.session).values['code'] == 'IMU_INCONSISTENT'
