"""The word `~/ok` on a clock set by hand: when it is false, and how soon after good data end."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import pytest
from nodes.live_case import FOLDED, NAMES

from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts.messages import ALERTS, LIVE
from ugv_acceptance.evaluation.alerts.state_machine import OK, STALE, WARN
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.monitoring.diagnostics import verdict_of
from ugv_acceptance.monitoring.ok_word import ADVISING, SETTLED, Delay, OkWord
from ugv_acceptance.monitoring.receipt_clock import StampShift
from ugv_acceptance.monitoring.session import Session

SETTINGS = load().settings
MS, S = 1_000_000, 1_000_000_000
STRETCHED = (0.0, 0.3, 0.2, 2.0)
# A lean (rad) that is a CAUTION, and one that is DANGER, of a folded arm.
LEAN, FALL = 0.62, 0.75


def imu(when: int, roll: float = 0.0, force: float = 9.81) -> bytes:
    """Return an Imu message of a robot at rest that leans to its right."""
    orientation = (math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2))
    felt = (0.0, force * math.sin(roll), force * math.cos(roll))
    return imu_cdr(when, 'imu_link', orientation, (0.0, 0.0, 0.0), felt)


@dataclass
class Robot:
    """A PackBot that sends each input every 10 ms; the word is looked at as often.

    `good` is when the newest good messages came (ns), `true` when the word was true last.
    """

    settings: Settings = SETTINGS
    simulated: bool = False
    at: int = 1000 * S
    good: int = 0
    true: int = 0
    why: str = ''
    session: Session = field(init=False)
    word: OkWord = field(init=False)

    def __post_init__(self) -> None:
        self.session = Session(
            self.settings, lambda *_: None, self._changed, lambda _: None, clock=self,
            stamps=StampShift(self.simulated),
        )  # fmt: skip
        self.word = OkWord(self.session)

    def now(self) -> int:
        """Return the time (ns)."""
        return self.at

    def _changed(self) -> None:
        self.session.alarm_tracker.take()

    def run(self, seconds: float, send: Callable[[int], None]) -> 'Robot':
        """Let time pass, with `send(stamp)` and a look each 10 ms."""
        for _ in range(round(seconds * 100)):
            self.at += 10 * MS
            send(self.at)
            self.session.tick()
            self.why = self.word.why_not()
            if not self.why:
                self.true = self.at
        return self

    def stand(self, seconds: float, q: tuple[float, ...] = FOLDED, roll: float = 0.0) -> 'Robot':
        """Stand at rest in a posture."""

        def send(stamp: int) -> None:
            self.good = stamp
            self.joints(stamp, q)
            self.session.take_imu(imu(stamp, roll))

        return self.run(seconds, send)

    def joints(self, stamp: int, q: tuple[float, ...] = FOLDED) -> None:
        """Send a joint state."""
        self.session.take_joint_state(joint_state_cdr(stamp, '', NAMES, q))

    @property
    def level(self) -> int:
        """The level of the verdict."""
        return verdict_of(self.session).level


def ready() -> Robot:
    """Return a robot of which the word is true."""
    robot = Robot().stand(SETTLED + 0.5)
    assert robot.why == ''
    return robot


def test_it_is_true_of_a_robot_that_stands_well_but_not_at_once() -> None:
    """From one second of known margins on: what is due to be told by then has been."""
    robot = Robot().stand(SETTLED - 0.05)
    assert (robot.level, robot.true) == (OK, 0)
    assert 'margins known for' in robot.why
    assert robot.stand(0.2).why == ''


def test_it_is_true_under_a_caution_about_a_small_margin() -> None:
    """A lean that is CAUTION leaves all known: program and person may go on with care."""
    robot = Robot().stand(3.0, roll=LEAN)
    assert {a.rule.code for a in robot.session.active} == {'TIP_OVER'}
    assert (robot.level, robot.why) == (WARN, '')


def test_it_is_false_in_danger_and_until_that_was_reset() -> None:
    """A tip-over that is over stays false: acknowledged is not enough, a reset is."""
    robot = ready().stand(2.0, roll=FALL)
    assert robot.why == 'DANGER TIP_OVER right'
    over = robot.stand(8.0)
    assert (over.level, over.why) == (WARN, 'TIP_OVER right: over, not acknowledged')
    alarms = robot.session.alarm_tracker.alarms
    alarms.acknowledge(robot.at, 'Ada')
    assert robot.stand(0.1).why == 'TIP_OVER right: over, latched until reset'
    alarms.reset(robot.at, 'Ada')
    assert robot.stand(0.1).why == ''


def test_it_is_false_before_the_delay_of_an_alert_is_over() -> None:
    """A limit of DANGER that is passed now, by a load or a fall, is false from that message on."""
    assert ready().stand(0.02, roll=FALL).why == 'a limit of DANGER is passed'
    settings = replace(SETTINGS, robot=replace(SETTINGS.robot, contacts=WIDE))
    robot = Robot(settings).stand(SETTLED + 0.5)
    assert robot.why == ''
    load = inertia_cdr(robot.at, 'gripper_link', 30.0, (0.0, 0.0, 0.0))
    robot.session.take_payload(load)
    assert robot.stand(0.02).why == 'a limit of DANGER is passed'
    assert verdict_of(robot.session).message.startswith('a limit of DANGER is passed: ')


def test_an_overload_that_is_over_must_be_acknowledged() -> None:
    """A torque beyond its limit is false until somebody has seen it."""
    settings = replace(SETTINGS, robot=replace(SETTINGS.robot, contacts=WIDE))
    robot = Robot(settings).stand(2.0, STRETCHED)
    assert robot.why.startswith('DANGER TORQUE_LIMIT shoulder_joint')
    robot.stand(4.0)
    assert 'not acknowledged' in robot.why
    robot.session.alarm_tracker.alarms.acknowledge(robot.at, 'Ada')
    assert robot.stand(0.1).why == ''


WIDE = tuple(
    replace(contact, position=(4.0 * contact.position[0], contact.position[1], 0.0))
    for contact in SETTINGS.robot.contacts
    if contact.link == 'base_link'
)


def nothing(_: int) -> None:
    """Send nothing."""


# How good data end: what is sent from then on, of a robot that stood well.
Ending = Callable[[Robot], Callable[[int], None]]


def only_joints(robot: Robot) -> Callable[[int], None]:
    """Only joint states go on."""
    return robot.joints


def only_imu(robot: Robot) -> Callable[[int], None]:
    """Only the IMU goes on."""
    return lambda stamp: robot.session.take_imu(imu(stamp))


def joints_repeated(robot: Robot) -> Callable[[int], None]:
    """The joints' driver repeats its last message, the IMU goes on."""
    last = robot.at

    def send(stamp: int) -> None:
        robot.joints(last)
        robot.session.take_imu(imu(stamp))

    return send


def imu_repeated(robot: Robot) -> Callable[[int], None]:
    """The IMU's driver repeats its last message, joint states go on."""
    last = robot.at

    def send(stamp: int) -> None:
        robot.joints(stamp)
        robot.session.take_imu(imu(last))

    return send


def both_repeated(robot: Robot) -> Callable[[int], None]:
    """Both are repeated."""
    last = robot.at

    def send(_: int) -> None:
        robot.joints(last)
        robot.session.take_imu(imu(last))

    return send


def stuck_stamps(robot: Robot) -> Callable[[int], None]:
    """Values go on under a stamp that stands still: nobody knows of when they are."""
    last = robot.at

    def send(stamp: int) -> None:
        robot.joints(last, (0.0, 2.0 + 1e-4 * math.sin(stamp / S), -2.5, 2.0))
        robot.session.take_imu(imu(last, 1e-4 * math.sin(stamp / S)))

    return send


def joints_nan(robot: Robot) -> Callable[[int], None]:
    """One joint's position is NaN."""

    def send(stamp: int) -> None:
        robot.joints(stamp, (0.0, math.nan, -2.5, 2.0))
        robot.session.take_imu(imu(stamp))

    return send


def imu_nan(robot: Robot) -> Callable[[int], None]:
    """The IMU sends NaN."""

    def send(stamp: int) -> None:
        robot.joints(stamp)
        robot.session.take_imu(imu(stamp, math.nan))

    return send


def one_joint_gone(robot: Robot) -> Callable[[int], None]:
    """A joint is no longer in the messages."""

    def send(stamp: int) -> None:
        robot.session.take_joint_state(joint_state_cdr(stamp, '', NAMES[:3], FOLDED[:3]))
        robot.session.take_imu(imu(stamp))

    return send


def late(robot: Robot) -> Callable[[int], None]:
    """Messages come as often as before, but 0.3 s later: a queue has filled before the monitor."""

    def send(stamp: int) -> None:
        robot.joints(stamp - 300 * MS)
        robot.session.take_imu(imu(stamp - 300 * MS))

    return send


def malformed(robot: Robot) -> Callable[[int], None]:
    """Messages cannot be decoded."""

    def send(_: int) -> None:
        robot.session.take_joint_state(b'\x00\x01\x00\x00')
        robot.session.take_imu(b'')

    return send


ENDINGS: dict[str, Ending] = {
    'both silent': lambda _: nothing,
    **{
        of.__name__: of
        for of in (
            only_joints,
            only_imu,
            joints_repeated,
            imu_repeated,
            both_repeated,
            stuck_stamps,
            joints_nan,
            imu_nan,
            one_joint_gone,
            late,
            malformed,
        )
    },
}


# A simulation's clock runs at a speed of its own: there a late message cannot be told.
@pytest.mark.parametrize(
    ('how', 'clock'),
    [
        *((how, 'real') for how in ENDINGS),
        *((how, 'simulated') for how in ENDINGS if how != 'late'),
    ],
)
def test_it_is_false_when_data_are_older_than_the_stale_limit(how: str, clock: str) -> None:
    """However a driver fails: no true word later than that after the last good message, ever."""
    robot = Robot(simulated=clock == 'simulated').stand(SETTLED + 0.5)
    assert robot.why == ''
    limits = [timeout.limit for timeout in robot.session.evaluator.fresh]
    assert max(limits) <= 100 * MS
    robot.run(2.0, ENDINGS[how](robot))
    assert robot.why
    assert robot.true - robot.good <= max(limits)


@pytest.mark.parametrize('frozen', [0, 1])
def test_one_of_two_drivers_of_a_topic_that_repeats_itself_is_seen(frozen: int) -> None:
    """Joints told by two nodes: the stamps of the one that lives hide nothing of the other."""
    robot, parts = Robot(), ((0, 2), (2, 4))
    last = [0, 0]

    def send(stamp: int) -> None:
        for k, (a, b) in enumerate(parts):
            if k != frozen or stamp <= 1002 * S:
                last[k] = stamp
            message = joint_state_cdr(last[k], '', NAMES[a:b], FOLDED[a:b])
            robot.session.take_joint_state(message)
        robot.session.take_imu(imu(stamp))

    robot.run(2.0, send)
    assert robot.why == ''
    robot.run(2.0, send)
    assert robot.true <= 1002 * S + 100 * MS


@pytest.mark.parametrize('speed', [0.0, 0.2, 1.0, 3.0])
def test_joints_that_are_repeated_in_a_simulation_are_no_data(speed: float) -> None:
    """At whatever speed /clock runs, and where it stands: an old message is no new one."""
    robot = Robot(simulated=True)
    began = robot.at + 1990 * MS  # no whole second: such a stamp may stand still for longer
    last = 0

    def send(at: int) -> None:
        nonlocal last
        lives = at <= began
        clock = 50 * S + round((at - began) * (1.0 if lives else speed))
        last = clock if lives else last
        robot.session.stamps.follow(at, clock)
        robot.joints(last)
        robot.session.take_imu(imu(clock))

    robot.run(1.99, send)
    assert (robot.level, robot.why) == (OK, '')
    robot.run(1.0, send)
    assert robot.level == STALE
    assert {a.rule.code for a in robot.session.active} >= {'JOINTS_REPEATED'}
    assert robot.true <= began + 100 * MS


def test_a_driver_that_names_its_joints_otherwise_from_now_on_is_alive() -> None:
    """The last message of an old list of names is no message that is repeated."""
    robot = ready()

    def send(stamp: int) -> None:
        names, q = (*NAMES, 'lamp_joint'), (*FOLDED, 0.0)
        robot.session.take_joint_state(joint_state_cdr(stamp, '', names, q))
        robot.session.take_imu(imu(stamp))

    assert robot.run(3.0, send).why == ''


def test_after_a_gap_it_takes_a_second_again() -> None:
    """Data that come back are not believed at once."""
    robot = ready().run(1.0, nothing).stand(SETTLED - 0.05)
    assert robot.why
    assert robot.true < robot.at - 1.5 * S
    assert robot.stand(2.0).why == ''


def waits(robot: Robot) -> bool:
    """Return whether the trend is not known yet."""
    return robot.session.evaluator.waits_for_trend


@pytest.mark.parametrize('ground', ['uneven', 'stairs'])
def test_on_rough_ground_it_waits_for_the_trend(ground: str) -> None:
    """From the moment it is entered until it is known whether the robot begins to tip: false."""
    robot = ready()
    rough = replace(SETTINGS, ground=replace(SETTINGS.ground, kind=ground))
    robot.session.adopt(rough)
    assert waits(robot)
    assert robot.word.why_not() == 'whether the robot begins to tip is not known yet'
    since = robot.at
    while waits(robot):
        robot.stand(0.01)
        assert robot.true <= since or not waits(robot)
    assert robot.stand(0.1).why == ''


LEVELLED = replace(SETTINGS, imu=replace(SETTINGS.imu, attitude='level'))
UNKNOWN: dict[str, tuple[Settings, str]] = {
    'no IMU': (LEVELLED, 'tip-over is not judged'),
    'unknown contacts': (replace(SETTINGS, unknown=('contacts',)), 'tip-over is not judged'),
    'unknown limit': (
        replace(SETTINGS, unknown=('joints.turret_joint.limit',)),
        'the configuration does not know joints.turret_joint.limit',
    ),
    'relaxed limit': (
        replace(SETTINGS, unsafe='bench', limits=replace(SETTINGS.limits, tip_error=-0.5)),
        'CAUTION LIMITS_RELAXED limits.tip_error_deg',
    ),
}


@pytest.mark.parametrize('case', list(UNKNOWN))
def test_it_is_never_true_of_what_the_configuration_leaves_open(case: str) -> None:
    """Where tip-over cannot be judged, a value is unknown or a limit is relaxed."""
    settings, why = UNKNOWN[case]
    robot = Robot(settings).stand(4.0)
    assert robot.true == 0
    assert why in robot.why


def test_a_payload_that_cannot_be_used_makes_it_false_until_a_good_one_comes() -> None:
    """The load is not known then."""
    robot = ready()
    robot.session.take_payload(inertia_cdr(robot.at, 'gripper_link', -1.0, (0.0, 0.0, 0.0)))
    robot.session.tick()
    assert robot.word.why_not()
    robot.session.take_payload(inertia_cdr(robot.at, 'gripper_link', 1.0, (0.0, 0.0, 0.0)))
    assert robot.stand(4.0).why == ''


def test_torques_that_are_not_judged_make_it_false() -> None:
    """While the hand may touch the ground and does, nobody knows the torques."""
    down = (0.0, math.radians(50.0), math.radians(-140.0), 2.0)
    light = replace(SETTINGS.robot, payload=replace(SETTINGS.robot.payload, mass=0.0))
    allowed = ((0.0, math.inf),)
    robot = Robot(replace(SETTINGS, robot=light, hand_may_touch=allowed)).stand(3.0, down)
    assert robot.session.evaluator.margins is not None
    assert (robot.true, robot.why) == (0, 'tip-over or a torque is not judged')


@pytest.mark.parametrize('off', [-1000 * S, -2 * S, 2 * S, 3600 * S])
def test_stamps_of_another_clock_make_it_false(off: int) -> None:
    """Over a second off nobody knows how old the data are."""
    robot = Robot()

    def send(stamp: int) -> None:
        robot.joints(stamp + off)
        robot.session.take_imu(imu(stamp + off))

    robot.run(3.0, send)
    assert (robot.true, robot.why) == (0, 'CAUTION CLOCK joint_states')


def test_clocks_that_differ_by_less_than_a_second_do_no_harm() -> None:
    """Only a message that comes later than others counts."""
    robot = Robot()

    def send(stamp: int) -> None:
        robot.joints(stamp - 400 * MS)
        robot.session.take_imu(imu(stamp - 400 * MS))

    assert robot.run(3.0, send).why == ''


def test_clocks_may_drift_apart() -> None:
    """A millisecond a second for an hour: the quickest message is that of the last minute."""
    delay = Delay()
    behind = [delay.behind(k * S // 10, k * S // 10_000) for k in range(36_000)]
    assert max(behind) <= 60 * MS
    assert delay.behind(3600 * S, 3600 * MS + 200 * MS) >= 200 * MS


def test_a_fault_of_ours_makes_it_false() -> None:
    """Margins are unknown after an exception, and it is an error until it is reset."""
    robot = ready()
    robot.session.fail('imu', ZeroDivisionError())
    assert robot.word.why_not() == 'margins not known'
    assert robot.stand(3.0).why == 'DANGER MONITOR_FAULT imu'


@pytest.mark.parametrize('code', sorted(LIVE))
def test_a_fault_that_only_a_live_node_sees_makes_it_false(code: str) -> None:
    """A second publisher, another robot, another payload ...; lost messages alone do not."""
    robot = ready()
    robot.session.faults.set(robot.at, code, 'imu', 1.0)
    assert bool(robot.word.why_not()) is (code != 'MESSAGES_LOST')


def test_every_caution_but_those_about_a_known_margin_makes_it_false() -> None:
    """Also one that is added to the rules later: who adds it has to say that all stays known."""
    robot, seen = ready(), set()
    for signal in robot.session.evaluator.watch.signals:
        if signal.rule.level != WARN:
            continue
        signal.judge_by(replace(signal.rule, on_delay=0, off_delay=0))
        signal.set(robot.at, 1.0)
        code = signal.rule.code
        assert bool(robot.word.why_not()) is (code not in ADVISING), code
        signal.clear(robot.at)
        assert robot.word.why_not() == ''
        seen.add(code)
    assert {'STATIC_MODEL', 'CLOCK', 'INPUT_SLOW', 'TIP_OVER', 'ENCODER_FROZEN'} <= seen
    assert set(ALERTS) >= ADVISING
