"""How the IMU is mounted: found by the frame of its messages, declared unknown, or moving."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.streams import (
    MS,
    T0,
    Carry,
    Imu,
    Joints,
    Message,
    S,
    give,
    live,
    recorded,
    run_of,
    settings,
    split,
)
from scipy.spatial.transform import Rotation

from ugv_acceptance.evaluation.alerts.messages import describe
from ugv_acceptance.evaluation.alerts.state_machine import STALE, Alert
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.settings import Delays, ImuInput, Settings
from ugv_acceptance.model.robot import Joint, Link, Matrix, Vector

AUTO = ImuInput(placed='auto')
PLACE: Vector = (0.05, -0.1, 0.3)
SIDEWAYS = Rotation.from_euler('xyz', [90.0, 0.0, 30.0], degrees=True)
LEANING = Rotation.from_euler('xyz', [8.0, -5.0, 20.0], degrees=True)


def rows(rotation: Rotation) -> Matrix:
    """Return a rotation as the model's matrix."""
    a, b, c = rotation.as_matrix().tolist()
    return tuple(a), tuple(b), tuple(c)


def with_imu(told: Settings, carrier: str = 'base', turn: Rotation = SIDEWAYS) -> Settings:
    """Return settings of the small robot with a link imu_link on another link."""
    joint = Joint('imu_joint', 'fixed', carrier, 'imu_link', PLACE, rows(turn))
    robot = told.robot
    links, joints = (*robot.links, Link('imu_link')), (*robot.joints, joint)
    return replace(told, robot=replace(robot, links=links, joints=joints))


def measured(base: Rotation, sensor: Rotation, frame: str = 'imu_link') -> Imu:
    """Return what an IMU with axes `sensor` (in the base's) measures on a base at rest."""
    world = base * sensor
    force = world.inv().apply([0.0, 0.0, 9.81])
    return Imu(0, tuple(world.as_quat()), acceleration=tuple(force), frame=frame)


def down(base: Rotation) -> Any:
    """Return gravity in the base's axes."""
    return base.inv().apply([0.0, 0.0, -9.81])


def gravities(told: Settings, messages: list[Message]) -> tuple[list[Any], list[Alert]]:
    """Return gravity at each message with margins, None without, live; and the IMU's alerts.

    The recording must give the same.
    """
    end = messages[-1].time + 100 * MS
    seen, alerts = live(told, messages, end, [T0 + k * 100 * MS for k in range(1, 60)])
    parts, evaluator = recorded(told, split(messages, [17, 40, 41]), end)
    mine, others = (
        [a for a in log if a.rule.code.startswith('IMU_') or a.rule.subject == 'imu']
        for log in (alerts, evaluator.watch.log)
    )
    assert sorted((a.rule.code, a.start, a.end or 0, a.detail) for a in mine) == sorted(
        (a.rule.code, a.start, a.end or 0, a.detail) for a in others
    )
    found = np.concatenate([part.gravity for part in parts])
    known = np.concatenate([part.known for part in parts])
    for (_, margins), row, there in zip(seen, found, known, strict=True):
        assert there == (margins is not None)
        if margins is not None:
            np.testing.assert_allclose(margins.gravity, row, rtol=1e-12, atol=1e-12)
    return [None if margins is None else margins.gravity for _, margins in seen], mine


def codes(alerts: list[Alert]) -> set[str]:
    """Return the codes of alerts."""
    return {alert.rule.code for alert in alerts}


@pytest.mark.parametrize('frame', ['imu_link', '/imu_link', 'r1/imu_link'])
def test_the_urdf_tells_how_the_frame_of_the_messages_is_mounted(frame: str) -> None:
    """The margins are those of a configuration with the same numbers, to the last digit."""
    run = run_of(1.0, imu=measured(LEANING, SIDEWAYS, frame))
    given = with_imu(settings(ImuInput(mounting=rows(SIDEWAYS), position=PLACE)))
    found = [live(told, run, T0 + S)[0] for told in (with_imu(settings(AUTO)), given)]
    margins = [[m and (m.gravity, m.torque, m.stability) for _, m in one] for one in found]
    assert margins[0] == margins[1]
    assert sum(m is not None for m in margins[0]) > 100


def test_a_prefix_before_every_frame_is_understood() -> None:
    """One without a slash must be configured."""
    run = run_of(1.0, imu=measured(LEANING, SIDEWAYS, 'r1_imu_link'))
    told = replace(with_imu(settings(AUTO)), frame_prefix='r1_')
    np.testing.assert_allclose(gravities(told, run)[0][-1], down(LEANING), atol=1e-9)


def test_another_robots_imu_is_not_taken_for_ours() -> None:
    """Where the prefix of our frames is known, another namespace is another robot."""
    told = replace(with_imu(settings(AUTO)), frame_prefix='r1/')
    for frame, ours in (('r1/imu_link', True), ('/r1/imu_link', True), ('r2/imu_link', False)):
        found, _ = gravities(told, run_of(0.5, imu=measured(LEANING, SIDEWAYS, frame)))
        assert (found[-1] is not None) == ours


def test_a_payload_in_a_frame_with_the_prefix_is_carried() -> None:
    """Live and recorded alike."""
    told = replace(settings(), frame_prefix='r1_')
    run: list[Message] = [Carry(T0, 3.0, frame='r1_hand'), *run_of(0.5)]
    evaluator = LiveEvaluator(told)
    evaluator.start(T0)
    for message in run:
        give(evaluator, message)
    assert evaluator.load_known
    assert evaluator.payload.mass == 3.0
    _, other = recorded(told, [run], T0 + S)
    assert other.first_payload is not None
    assert not [a for a in other.watch.log if a.rule.code == 'PAYLOAD_INVALID']


def test_static_transforms_tell_it_where_the_urdf_does_not() -> None:
    """They are joined to the URDF's links."""
    transforms = (('base', 'imu_link', PLACE, rows(SIDEWAYS)),)
    told = settings(replace(AUTO, transforms=transforms))
    found, alerts = gravities(told, run_of(3.0, imu=measured(LEANING, SIDEWAYS)))
    np.testing.assert_allclose(found[-1], down(LEANING), atol=1e-9)
    assert not alerts


def test_without_a_known_frame_no_margin_is_known() -> None:
    """After 2 s in which transforms could have come a sentence says why; the level is NO DATA."""
    told = settings(AUTO)
    found, alerts = gravities(told, run_of(4.0, imu=measured(LEANING, SIDEWAYS, 'elsewhere')))
    assert set(found) == {None}
    assert [(a.rule.code, a.rule.level, a.start) for a in alerts] == [
        ('IMU_MOUNTING_UNKNOWN', STALE, T0 + MS + 2 * S)
    ]
    assert describe(alerts[0], told) == (
        'how imu is mounted is not known, so neither is the tilt: its frame '
        "'elsewhere' is no link of the URDF, and /tf_static does not lead from it to base"
    )


def test_messages_without_a_frame_are_not_believed_until_one_names_it() -> None:
    """Then the mounting is known from that message on."""
    run = run_of(4.0, imu=measured(LEANING, SIDEWAYS))
    half = T0 + 3 * S
    messages = [replace(m, frame='') if isinstance(m, Imu) and m.time < half else m for m in run]
    found, alerts = gravities(with_imu(settings(AUTO)), messages)
    first = next(k for k, m in enumerate(messages) if isinstance(m, Imu) and m.time >= half)
    assert set(found[:first]) == {None}
    assert None not in found[first:]
    assert codes(alerts) == {'IMU_MOUNTING_UNKNOWN'}
    assert 'frame_id is empty' in alerts[0].detail


def test_the_first_frame_decides_and_another_one_is_a_fault() -> None:
    """A driver that changes its frame may have changed its axes: no margin from then on."""
    half = T0 + 2 * S
    told = settings(replace(AUTO, transforms=(('base', 'other', PLACE, rows(SIDEWAYS)),)))
    messages = [
        replace(m, frame='other') if isinstance(m, Imu) and m.time >= half else m
        for m in run_of(3.0, imu=measured(LEANING, SIDEWAYS))
    ]
    found, alerts = gravities(with_imu(told), messages)
    first = next(k for k, m in enumerate(messages) if isinstance(m, Imu) and m.time >= half)
    assert None not in found[10:first]
    assert set(found[first:]) == {None}
    assert 'IMU_FRAME' in codes(alerts)


def test_a_mounting_declared_unknown_gives_no_margin() -> None:
    """Whatever frame the messages name."""
    told = with_imu(settings(ImuInput(placed='unknown')))
    found, alerts = gravities(told, run_of(4.0, imu=measured(LEANING, SIDEWAYS)))
    assert set(found) == {None}
    assert codes(alerts) == {'IMU_MOUNTING_UNKNOWN'}
    assert 'imu.mounting: unknown' in alerts[0].detail


@pytest.mark.parametrize('attitude', ['auto', 'accelerometer'])
def test_a_mounting_that_gravity_denies_is_not_believed(attitude: str) -> None:
    """As on the public Husky, whose URDF and recording differ: named, and no margin after 2 s."""
    urdf = Rotation.from_euler('xyz', [180.0, -90.0, 0.0], degrees=True)
    true = Rotation.from_euler('xyz', [90.0, 0.0, 0.0], degrees=True)
    told = with_imu(settings(replace(AUTO, attitude=attitude)), turn=urdf)
    run = run_of(4.0, imu=measured(Rotation.identity(), true))
    random = np.random.default_rng(1)
    messages = [
        replace(m, acceleration=tuple(m.acceleration + random.normal(0.0, 0.05, 3)))
        if isinstance(m, Imu) else m
        for m in run
    ]  # fmt: skip
    found, alerts = gravities(told, messages)
    assert set(found[-200:]) == {None}
    wrong = next(a for a in alerts if a.rule.code == 'IMU_MOUNTING')
    assert describe(wrong, told) == (
        'from the first message on imu leans by over 45 deg, so it seems mounted otherwise '
        'than configured: its y axis points up: imu.mounting_rpy_deg: [90, 0, 0]: '
        'imu.mounting: auto took it from the URDF (imu_link - base)'
    )


def on_the_arm(q: float, base: Rotation, frame: str = 'imu_link') -> Imu:
    """Return what an IMU on the arm measures at a position of the lift (rad, as in the URDF)."""
    return measured(base, Rotation.from_rotvec([0.0, -q, 0.0]) * SIDEWAYS, frame)


@pytest.mark.parametrize('how', ['auto', 'link', 'tf_static'])
@pytest.mark.parametrize('attitude', ['orientation', 'accelerometer'])
def test_on_an_arm_the_attitude_of_the_base_follows_from_the_joints(
    how: str, attitude: str
) -> None:
    """While the arm moves the base's gravity stays; whoever told on which link the IMU is."""
    delays = Delays(tip_on=0.02, off=0.1)
    if how == 'auto':
        told = with_imu(settings(ImuInput(placed='auto', attitude=attitude), delays), 'arm')
    elif how == 'link':
        imu = ImuInput(link='arm', mounting=rows(SIDEWAYS), position=PLACE, attitude=attitude)
        told = settings(imu, delays)
    else:
        transforms = (('arm', 'imu_link', PLACE, rows(SIDEWAYS)),)
        told = settings(ImuInput(placed='auto', transforms=transforms, attitude=attitude), delays)
    messages: list[Message] = []
    for k in range(400):
        now, q = T0 + 10 * k * MS, 0.4 + 0.4 * math.sin(k / 80.0)
        rate = 0.4 * math.cos(k / 80.0) / 0.8
        messages.append(Joints(now, position=(0.1 - q, 0.0), velocity=(-rate, 0.0)))
        turn = Rotation.from_rotvec([0.0, -q, 0.0]) * SIDEWAYS
        felt = on_the_arm(q, LEANING)
        omega = turn.inv().apply([0.0, -rate, 0.0])
        messages.append(replace(felt, time=now + MS, omega=tuple(omega)))
    found, alerts = gravities(told, messages)
    known = [row for row in found if row is not None]
    assert len(known) > 790
    np.testing.assert_allclose(known, np.tile(down(LEANING), (len(known), 1)), atol=1e-9)
    assert not [a for a in alerts if a.rule.code.startswith('IMU_')]


@pytest.mark.parametrize('velocities', [True, False])
def test_old_joint_states_of_a_fast_arm_tell_no_attitude(
    velocities: bool,  # noqa: FBT001 - a case
) -> None:
    """What the arm may have turned since would be a wrong tilt; nor is the IMU blamed for it."""
    messages: list[Message] = []
    for k in range(800):
        now, phase = T0 + 10 * k * MS, k / 60.0
        q, rate = 0.6 * math.sin(phase), math.cos(phase)
        if k % 10 == 0:
            given = (-rate, 0.0) if velocities else ()
            messages.append(Joints(now, position=(0.1 - q, 0.0), velocity=given))
        turn = Rotation.from_rotvec([0.0, -q, 0.0]) * SIDEWAYS
        omega = tuple(turn.inv().apply([0.0, -rate, 0.0]))
        messages.append(replace(on_the_arm(q, LEANING), time=now + MS, omega=omega))
    found, alerts = gravities(with_imu(settings(AUTO), 'arm'), messages)
    known = np.array([row for row in found if row is not None])
    assert 0.3 < len(known) / len(found) < 0.9
    cosine = known @ down(LEANING) / 9.81**2
    assert np.degrees(np.arccos(np.minimum(cosine, 1.0))).max() < 5.0
    assert not alerts


def test_a_joint_that_is_not_known_makes_the_attitude_unknown() -> None:
    """And blames the joint, not the IMU."""
    told = with_imu(settings(AUTO), 'arm')
    run = run_of(3.0, joints=Joints(0, ('hand_slide',), (0.0,)), imu=on_the_arm(0.0, LEANING))
    found, alerts = gravities(told, run)
    assert set(found) == {None}
    assert not alerts


def test_a_joint_that_nobody_tells_is_held_where_the_configuration_says() -> None:
    """The IMU is then fixed to the base, turned by that position."""
    told = settings(AUTO)
    robot = replace(told.robot, joint_names=('slide',), held=(('lift', 0.5),))
    told = replace(
        with_imu(replace(told, robot=robot), 'arm'),
        joints=told.joints[1:], limits=replace(told.limits, torque=(30.0,), speed=()),
    )  # fmt: skip
    run = run_of(1.0, joints=Joints(0, ('hand_slide',), (0.0,)), imu=on_the_arm(0.5, LEANING))
    found, _ = gravities(told, run)
    np.testing.assert_allclose(found[-1], down(LEANING), atol=1e-9)
    mount = LiveEvaluator(told).mount
    mount.hear(0, 'imu_link')
    assert mount.found is not None
    assert mount.found.held == (('lift', 0.5),)


def test_a_frozen_imu_on_an_arm_is_found_though_the_arm_moves() -> None:
    """What it repeats must not seem to live by the noise of the joints."""
    random = np.random.default_rng(2)
    messages: list[Message] = []
    for k in range(400):
        now, q = T0 + 10 * k * MS, 0.3 + random.normal(0.0, 1e-4)
        messages.append(Joints(now, position=(0.1 - q, 0.0), velocity=(0.0, 0.0)))
        felt = on_the_arm(0.3, LEANING)
        if k < 200:
            noise = random.normal(0.0, 0.02, 3)
            felt = replace(felt, acceleration=tuple(np.add(felt.acceleration, noise)))
        messages.append(replace(felt, time=now + MS))
    found, alerts = gravities(with_imu(settings(AUTO), 'arm'), messages)
    assert 'IMU_FROZEN' in codes(alerts)
    assert found[-1] is None


def test_limits_can_change_while_the_mounting_stays() -> None:
    """What the messages told is not forgotten when a parameter is set."""
    told = with_imu(settings(AUTO))
    evaluator = LiveEvaluator(told)
    evaluator.start(T0)
    last: Margins | None = None
    for message in run_of(1.0, imu=measured(LEANING, SIDEWAYS)):
        last = give(evaluator, message)
        evaluator.adopt(replace(told, limits=replace(told.limits, tip_warn=0.3)))
    assert last is not None
    np.testing.assert_allclose(last.gravity, down(LEANING), atol=1e-9)


def test_transforms_that_come_late_settle_it_at_the_next_message() -> None:
    """As /tf_static does live, a second after the first messages."""
    told = settings(AUTO)
    evaluator = LiveEvaluator(told)
    evaluator.start(T0)
    for message in run_of(5.0, imu=measured(LEANING, SIDEWAYS)):
        if message.time >= T0 + 3 * S and evaluator.mount.seeks:
            assert codes(evaluator.watch.active) == {'IMU_MOUNTING_UNKNOWN'}
            transforms = (('base', 'imu_link', PLACE, rows(SIDEWAYS)),)
            evaluator.adopt(replace(told, imu=replace(told.imu, transforms=transforms)))
        last = give(evaluator, message)
        evaluator.tick(message.time)
    assert last is not None
    np.testing.assert_allclose(last.gravity, down(LEANING), atol=1e-9)
    assert not [a for a in evaluator.watch.active if a.rule.code == 'IMU_MOUNTING_UNKNOWN']
