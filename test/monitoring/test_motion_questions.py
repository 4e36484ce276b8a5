"""May the arm move so, now? What a session answers, and what ends a permission."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import hypothesis
import pytest
from bag.trajectories import encoded, trajectory
from hypothesis import given
from hypothesis import strategies as st
from nodes.live_case import FOLDED, NAMES, joints

from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr
from ugv_acceptance.bag.trajectory import MOST_POINTS, NS, trajectory_from
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.alerts.messages import LIVE
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, OK, STALE, WARN
from ugv_acceptance.evaluation.ground import Ground
from ugv_acceptance.evaluation.inputs.timeouts import STARTUP
from ugv_acceptance.evaluation.settings import LEVEL, PAYLOAD_LINK, Settings, Untold
from ugv_acceptance.monitoring.diagnostics import Status
from ugv_acceptance.monitoring.motion_answers import VALID_NS
from ugv_acceptance.monitoring.motion_questions import (
    DISPLACED,
    LATE,
    LONGEST,
    MotionQuestions,
    Question,
)
from ugv_acceptance.monitoring.motion_situation import HARMLESS, dangers, missing
from ugv_acceptance.monitoring.session import Session

FLAT = replace(load().settings, ground=Ground('flat'))
START = 1_700_000_000 * NS
STEP = NS // 25
SHOULDER = NAMES.index('shoulder_joint')
FAR = (0.0, 0.1, 0.0, 2.0)


@dataclass
class Watch:
    """A clock that shows what it is set to (ns)."""

    at: int = START

    def now(self) -> int:
        """Return that."""
        return self.at


def still(roll: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return orientation and specific force of a robot at rest that leans by `roll` (rad)."""
    force = (0.0, 9.81 * math.sin(roll), 9.81 * math.cos(roll))
    return (math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2)), force


@dataclass
class Robot:
    """A session that hears a robot of which somebody may ask; `load_by` told its payload."""

    settings: Settings = FLAT
    load_by: str = 'operator'
    clock: Watch = field(default_factory=Watch)
    problems: list[str] = field(default_factory=list)
    pose: tuple[float, ...] = FOLDED
    roll: float = 0.01  # an orientation that is told

    def __post_init__(self) -> None:
        self.session: Session | None = self.begun()
        self.questions = MotionQuestions(
            lambda: self.session, lambda: self.load_by, self.problems.append
        )

    def begun(self) -> Session:
        """Return a new session."""
        return Session(
            self.settings, lambda _s, _m: None, lambda: None, self.problems.append, self.clock
        )

    def live(
        self,
        seconds: float = 0.8,
        *,
        spin: Sequence[float] = (0.0, 0.0, 0.0),
        push: float = 0.0,
        roll_rate: float = 0.0,
        rate: float = 0.0,
    ) -> 'Robot':
        """Let time pass: messages of both inputs 25 times a second."""
        for _ in range(round(seconds * NS / STEP)):
            self.clock.at += STEP
            self.roll += roll_rate * STEP / NS
            self.pose = tuple(
                q + rate * STEP / NS * (j == SHOULDER) for j, q in enumerate(self.pose)
            )
            if self.session is None:
                continue
            turn, (x, y, z) = still(self.roll)
            self.session.take_joint_state(joints(self.pose, stamp=self.clock.at))
            felt = imu_cdr(self.clock.at, 'imu_link', turn, spin, (x + push, y, z))
            self.session.take_imu(felt)
            self.session.tick()
        return self

    def look(self) -> list[Status]:
        """Return what there is to say once everything asked is computed."""
        said, end = [], time.monotonic() + 60.0
        while True:
            said += self.questions.look(self.clock.at)
            if not self.questions.computing:
                return said
            assert time.monotonic() < end
            time.sleep(0.001)

    def ask(self, data: bytes) -> Status:
        """Ask, and return the answer."""
        said = self.questions.ask(Question(data, self.clock.at, self.clock.at))
        (answer,) = (said + self.look())[-1:]
        return answer

    def result(self, data: bytes) -> object:
        """Ask, and return the result."""
        return self.ask(data).values['result']


def motion(*ways: float, names: Sequence[str] = NAMES, stamp: int = 0, first: float = 0.5) -> bytes:
    """Return a motion of the shoulder, by `ways` (rad) from where it stands, half a second each."""
    rows = [
        [q + way * (name == 'shoulder_joint') for name, q in zip(NAMES, FOLDED, strict=True)]
        for way in ways
    ]
    times = [first + 0.5 * k for k in range(len(ways))]
    return encoded(trajectory(rows, names=names, times=times, stamp=stamp))


LITTLE = motion(0.1, 0.0)


@pytest.fixture
def robot() -> Robot:
    """Return a robot that has been at rest for a while."""
    return Robot().live()


def test_a_small_motion_is_permitted_with_all_that_it_rests_on(robot: Robot) -> None:
    """Load, attitude, ground, limits, posture, how long it holds, least margins and where."""
    robot.roll = 0.1
    said = robot.live(1.2).ask(LITTLE)
    values = said.values
    assert (said.level, values['result']) == (OK, 'permitted')
    assert said.message.startswith('permitted: at least ')
    assert values['trajectory_sha256'] == trajectory_from(LITTLE).sha256
    assert (values['payload_kg'], values['payload_by']) == (4.0, 'operator')
    assert (values['payload_cog_m'], values['ground']) == ('0,0,0', 'flat')
    assert (values['roll_deg'], values['pitch_deg']) == pytest.approx((math.degrees(0.1), 0.0))
    assert values['limits_hash'] == robot.begun().limits_hash
    assert values['valid_until_ns'] == robot.clock.at + VALID_NS
    assert 'shoulder_joint=2.0000' in str(values['posture'])
    assert {'tilt_left_deg', 'tilt_side', 'tilt_time_s', 'tilt_point'} <= set(values)
    assert {'torque_share', 'torque_joint', 'torque_time_s', 'torque_point'} <= set(values)


def test_a_motion_past_a_limit_is_refused_with_the_place(robot: Robot) -> None:
    """The reason says which margin, when, and on the way to which point."""
    said = robot.ask(motion(-0.4, -0.8, -1.2, -1.6, -2.0))
    assert (said.level, said.values['result']) == (ERROR, 'refused')
    assert 'on the way to point' in said.message
    assert said.values['valid_until_ns'] == 0


def test_an_answer_is_none_of_another_trajectory(robot: Robot) -> None:
    """It carries the name of the one that was asked, and its stamp."""
    now = robot.clock.at
    said = robot.ask(motion(0.1, 0.0, stamp=now + NS))
    assert said.values['stamp_ns'] == now + NS
    assert said.values['trajectory_sha256'] == trajectory_from(LITTLE).sha256
    other = robot.ask(motion(0.05))
    assert other.values['trajectory_sha256'] != said.values['trajectory_sha256']


def inactive(robot: Robot) -> None:
    """Deactivate the monitor."""
    robot.session = None


def new(robot: Robot) -> None:
    """Begin a new evaluation."""
    robot.session = robot.begun()


def silent(robot: Robot) -> None:
    """Let the inputs be silent."""
    robot.clock.at += NS
    assert robot.session is not None
    robot.session.tick()


def nan(robot: Robot) -> None:
    """Let a joint be not a number."""
    robot.pose = (math.nan, *FOLDED[1:])
    robot.live(0.1)


def tell_load(robot: Robot, mass: float, frame: str = 'gripper_link') -> None:
    """Tell a load."""
    assert robot.session is not None
    robot.session.take_payload(inertia_cdr(robot.clock.at, frame, mass, (0.0, 0.0, 0.0)))
    robot.live(0.1)


def settings_of(**changes: Any) -> Callable[[Robot], None]:
    """Return what makes the monitor judge by other settings from now on."""

    def do(robot: Robot) -> None:
        assert robot.session is not None
        robot.session.adopt(replace(robot.session.settings, **changes))
        robot.live(0.1)

    return do


def untold_load(robot: Robot) -> None:
    """Let nobody have told the load."""
    robot.load_by = ''


def arm_on_ground(robot: Robot) -> None:
    """Put the arm on the ground."""
    robot.pose = (0.0, -0.4, 0.0, 2.0)
    robot.live(1.0)


MISSING = {
    'inactive': (inactive, 'the monitor is not active'),
    'new': (new, 'the monitor shows NO DATA: waiting for joint_states and imu'),
    'silent': (silent, 'the monitor shows NO DATA: no message from'),
    'nan': (nan, 'the monitor shows NO DATA'),
    'bad load': (
        lambda r: tell_load(r, 1.0, 'elsewhere'),
        'the monitor shows NO DATA: the declared payload cannot be used',
    ),
    'untold load': (untold_load, 'nobody told the payload'),
    'untold ground': (settings_of(ground=Ground()), 'nobody told the ground'),
    'stairs at first': (settings_of(ground=Ground('stairs')), 'is not known yet'),
    'hand': (settings_of(hand_may_touch=((0.0, math.inf),)), 'the arm may touch the ground'),
    'unknown': (settings_of(unknown=(PAYLOAD_LINK,)), 'does not know payload.link'),
    'turned': (lambda r: r.live(0.3, roll_rate=0.2), 'its attitude changed'),
    'turning': (lambda r: r.live(0.3, spin=(0.0, 0.0, 0.5)), 'the robot turns'),
    'driven': (lambda r: r.live(0.3, push=1.0), 'the robot is driven or pushed'),
    'moving': (lambda r: r.live(0.3, rate=0.2), 'shoulder_joint moves'),
}


@pytest.mark.parametrize('state', sorted(MISSING))
def test_nothing_is_permitted_where_something_is_missing(robot: Robot, state: str) -> None:
    """The answer is that it is not known, and what is missing; it names the trajectory."""
    assert robot.result(LITTLE) == 'permitted'
    bring, reason = MISSING[state]
    bring(robot)
    said = robot.ask(LITTLE)
    assert (said.level, said.values['result']) == (STALE, 'not_known')
    assert reason in str(said.values['reasons'])
    assert said.values['trajectory_sha256'] == trajectory_from(LITTLE).sha256
    assert said.values['valid_until_ns'] == 0


def test_a_robot_that_just_came_to_rest_is_not_known_to_rest() -> None:
    """It must have been seen at rest for half a second."""
    robot = Robot().live(0.2)
    assert 'whether the robot stands still' in robot.ask(LITTLE).message
    assert robot.live(1.0).result(LITTLE) == 'permitted'


@pytest.mark.parametrize('steps', [1, 2])
def test_the_newest_message_tells_that_the_robot_begins_to_move(robot: Robot, steps: int) -> None:
    """What is looked at is 50 ms apart, and the message after it."""
    assert robot.live(steps * STEP / NS).result(LITTLE) == 'permitted'
    robot.roll += 0.02
    robot.live(STEP / NS)
    said = robot.ask(motion(0.2, 0.0))
    assert said.values['result'] == 'not_known'
    assert 'attitude changed' in said.message


def test_a_base_that_was_declared_level_has_no_attitude() -> None:
    """Without an IMU nobody knows how the robot leans: nothing is permitted."""
    level = replace(FLAT, imu=replace(FLAT.imu, attitude=LEVEL))
    said = Robot(level).live().ask(LITTLE)
    assert said.values['result'] == 'not_known'
    assert 'tip-over is not judged' in said.message


@pytest.mark.parametrize('harmless', [True, False])
def test_a_joint_that_no_message_tells_does_not_begin_to_move(*, harmless: bool) -> None:
    """Held, it is told beside a permission if it is harmless; else nothing is known."""
    untold = (Untold(0.0, harmless), None, None, None)
    robot = Robot(replace(FLAT, untold=untold))

    def live(seconds: float) -> None:
        for _ in range(round(seconds * NS / STEP)):
            robot.clock.at += STEP
            assert robot.session is not None
            told = trajectory_state(robot.clock.at)
            robot.session.take_joint_state(told)
            turn, force = still(0.0)
            robot.session.take_imu(imu_cdr(robot.clock.at, 'imu_link', turn, (0.0,) * 3, force))
            robot.session.tick()

    live(STARTUP / NS + 2.0)
    others = encoded(trajectory([FOLDED[1:]], names=NAMES[1:], times=[1.0], stamp=0))
    said = robot.ask(others)
    assert said.values['result'] == ('permitted' if harmless else 'not_known')
    assert not harmless or 'never told, taken as held' in str(said.values['cautions'])
    assert robot.result(LITTLE) == 'not_known'


def trajectory_state(stamp: int) -> bytes:
    """Return a JointState without the turret."""
    return joint_state_cdr(stamp, '', NAMES[1:], FOLDED[1:])


@pytest.mark.parametrize('code', sorted(LIVE))
def test_beside_a_fault_that_only_a_live_node_sees_nothing_is_permitted(
    robot: Robot, code: str
) -> None:
    """Another publisher, a load that differs, lost trust in a number: all but what is harmless."""
    assert robot.session is not None
    robot.session.faults.set(robot.clock.at, code, 'payload', 1.0, 'as it happens')
    expected = {'permitted'} if code in HARMLESS else {'refused', 'not_known'}
    assert robot.result(LITTLE) in expected


def test_beside_any_alert_of_robot_or_input_nothing_is_permitted(robot: Robot) -> None:
    """But those of margins that the motion itself is held against, below DANGER."""
    session = robot.session
    assert session is not None
    assert not [*missing(session, 'operator'), *dangers(session)]
    for signal in session.evaluator.watch.signals:
        rule = signal.rule
        signal.judge_by(replace(rule, on_delay=0, off_delay=0))
        signal.set(robot.clock.at, max(rule.on, -1e3) + 1.0)
        found = [*missing(session, 'operator'), *dangers(session)]
        harmless = rule.code in HARMLESS and rule.level == WARN
        assert bool(found) is not harmless, rule
        signal.clear(robot.clock.at)


def test_a_danger_now_refuses_whatever_is_asked(robot: Robot) -> None:
    """Also a motion that would be good: the monitor's advice says what leads out of it."""
    robot.roll = 1.0
    said = robot.live().ask(encoded(trajectory([FOLDED], names=NAMES, times=[1.0], stamp=0)))
    assert (said.level, said.values['result']) == (ERROR, 'refused')
    assert said.message.startswith('refused: the monitor shows DANGER: ')


def test_relaxed_limits_are_said(robot: Robot) -> None:
    """A permission under limits that are wider than permitted is a CAUTION that says so."""
    limits = replace(FLAT.limits, tip_error=math.radians(-20.0))
    settings_of(limits=limits, unsafe='on a rope')(robot)
    said = robot.live().ask(LITTLE)
    assert (said.level, said.values['result']) == (WARN, 'permitted')
    assert 'on a rope' in said.message + str(said.values['limits_relaxed'])


def test_on_stairs_the_tilt_is_taken_cautiously(robot: Robot) -> None:
    """As soon as the trend is known, the least tilt is that of shortened tracks, and said so."""
    settings_of(ground=Ground('stairs'))(robot)
    said = robot.live().ask(LITTLE)
    assert said.values['result'] == 'not_known'
    assert 'taken cautiously on stairs ground: 3.5 deg to tipping' in said.message
    tell_load(robot, 0.5)
    said = robot.live().ask(LITTLE)
    assert said.values['result'] == 'permitted'
    assert float(str(said.values['cautious_left_deg'])) < float(str(said.values['tilt_left_deg']))
    assert 'taken cautiously' in said.message


UNUSABLE = {
    'another joint': (motion(0.1, names=('a', 'b', 'c', 'd')), 'not_known'),
    'not a number': (motion(math.nan), 'not_known'),
    'backwards': (
        encoded(trajectory([FOLDED, FOLDED], names=NAMES, times=[2.0, 1.0], stamp=0)),
        'not_known',
    ),
    'a jump at the start': (motion(0.3, 0.4, first=0.0), 'refused'),
    'to and fro': (motion(*[1e3, 0.0] * 100), 'not_known'),
    'empty': (encoded(trajectory([], names=NAMES, stamp=0)), 'refused'),
    'too many points': (
        encoded(trajectory([FOLDED] * (MOST_POINTS + 1), names=NAMES, stamp=0)),
        'refused',
    ),
    'too many bytes': (bytes(LONGEST + 1), 'refused'),
    'no bytes': (b'', 'refused'),
    'no message': (b'\x00\x01\x00\x00' + b'\xff' * 40, 'refused'),
}


@pytest.mark.parametrize('which', sorted(UNUSABLE))
def test_what_is_no_motion_from_here_is_not_permitted(robot: Robot, which: str) -> None:
    """Neither of what is malformed nor of what the robot cannot do from where it stands."""
    data, result = UNUSABLE[which]
    said = robot.ask(data)
    assert said.values['result'] == result
    assert len(said.message) < 400
    assert not robot.problems
    assert robot.result(LITTLE) == 'permitted'


@hypothesis.settings(max_examples=40)
@given(st.integers(0, 350), st.binary(max_size=12), st.integers(0, 350))
def test_no_bytes_are_permitted_or_end_it(at: int, noise: bytes, length: int) -> None:
    """Any message that is cut or overwritten is answered, and the next question as well."""
    robot = ROBOT
    for data in (LITTLE[:length], LITTLE[:at] + noise + LITTLE[at + len(noise) :], noise):
        said = robot.ask(data)
        assert said.values['result'] in {'permitted', 'refused', 'not_known'}
    assert not robot.problems


ROBOT = Robot().live()


@pytest.mark.parametrize(
    ('ahead', 'result'),
    [
        (-LATE - 1, 'not_known'),
        (-LATE, 'permitted'),
        (VALID_NS, 'permitted'),
        (VALID_NS + 1, 'not_known'),
        (3600 * NS, 'not_known'),
    ],
)
def test_a_motion_begins_while_the_answer_holds(robot: Robot, ahead: int, result: str) -> None:
    """By its header stamp: not in the past, nor when nobody knows yet how the robot stands."""
    assert robot.result(motion(0.1, 0.0, stamp=robot.clock.at + ahead)) == result


def another_load(robot: Robot) -> None:
    """Declare another load."""
    assert robot.session is not None
    robot.session.take_payload(inertia_cdr(robot.clock.at, 'gripper_link', 1.0, (0.0, 0.0, 0.0)))


CHANGES: dict[str, Callable[[Robot], object]] = {
    'monitor': inactive,
    'verdict': silent,
    'payload': another_load,
    'ground': settings_of(ground=Ground('uneven')),
    'limits': settings_of(limits=replace(FLAT.limits, torque_warn=0.5)),
    'attitude': lambda r: setattr(r, 'roll', 0.03),
    'posture': lambda r: setattr(r, 'pose', (0.03, *FOLDED[1:])),
}


@pytest.mark.parametrize('cause', sorted(CHANGES))
def test_a_permission_is_withdrawn_when_what_it_rests_on_changes(robot: Robot, cause: str) -> None:
    """Once, for the same trajectory, in a word and in a sentence."""
    assert robot.result(LITTLE) == 'permitted'
    assert not robot.live(0.1).look()
    CHANGES[cause](robot)
    if cause != 'verdict':
        robot.live(0.1)
    (said,) = robot.look()
    assert (said.level, said.values['result'], said.values['cause']) == (STALE, 'withdrawn', cause)
    assert said.values['trajectory_sha256'] == trajectory_from(LITTLE).sha256
    assert not robot.live(3.0).look()


def test_a_permission_expires(robot: Robot) -> None:
    """After two seconds it is taken back, though nothing has changed; nothing is left to do."""
    assert robot.result(LITTLE) == 'permitted'
    robot.live(VALID_NS / NS - STEP / NS)
    assert not robot.look()
    (said,) = robot.live(STEP / NS).look()
    assert (said.level, said.values['result']) == (STALE, 'expired')
    assert not robot.questions.busy


def test_of_two_permissions_the_newer_stands(robot: Robot) -> None:
    """Both motions at once were never judged, so the first is withdrawn before the second."""
    assert robot.result(LITTLE) == 'permitted'
    other = motion(0.05)
    robot.questions.ask(Question(other, robot.clock.at, robot.clock.at))
    first, second = robot.look()
    assert (first.values['result'], first.values['cause']) == ('withdrawn', 'newer')
    assert first.values['trajectory_sha256'] == trajectory_from(LITTLE).sha256
    assert second.values['result'] == 'permitted'
    assert second.values['trajectory_sha256'] == trajectory_from(other).sha256


def test_what_changes_while_an_answer_is_computed_makes_it_not_known(robot: Robot) -> None:
    """The robot leans otherwise before the answer is out: it is none."""
    robot.questions.ask(Question(LITTLE, robot.clock.at, robot.clock.at))
    robot.roll = 0.05
    (said,) = robot.live(0.1).look()
    assert said.values['result'] == 'not_known'
    assert said.message.startswith('not known: while it was computed: ')


def test_of_a_flood_the_newest_is_answered_and_the_others_refused(robot: Robot) -> None:
    """One is computed, one waits; the displaced are refused by their stamps, and not too many."""
    stamps = [robot.clock.at + k for k in range(3 * DISPLACED)]
    said: list[Status] = []
    for stamp in stamps:
        data = motion(0.1, 0.0, stamp=stamp)
        said += robot.questions.ask(Question(data, robot.clock.at, robot.clock.at))
    assert [s.values['stamp_ns'] for s in said] == stamps[1 : DISPLACED + 1]
    assert all('too many questions' in s.message and s.level == ERROR for s in said)
    answered = robot.look()
    assert [s.values['stamp_ns'] for s in answered] == [stamps[0], stamps[-1]]
    assert {s.values['result'] for s in answered} == {'permitted'}
    counted = robot.questions
    assert (counted.asked, counted.displaced) == (len(stamps), len(stamps) - 2)


def test_a_fault_of_ours_permits_nothing(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is told as such in answer and log; the monitor's own margins stay."""

    def broken(*_: Any) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr('ugv_acceptance.monitoring.motion_questions.trajectory_of', broken)
    said = robot.ask(LITTLE)
    assert said.values['result'] == 'not_known'
    assert 'fault of the monitor' in said.message
    assert robot.problems
    assert robot.session is not None
    assert robot.session.evaluator.margins is not None
