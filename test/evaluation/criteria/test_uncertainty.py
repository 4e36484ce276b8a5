"""Bounds of margins: against a robot built anew, against closed forms, against random robots."""

import math
from dataclasses import replace

import hypothesis
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import tracked

from ugv_acceptance.evaluation.criteria.uncertainty import Source, combined, effects_of
from ugv_acceptance.evaluation.settings import ImuInput, JointInput, Limits, Settings
from ugv_acceptance.model.robot import Joint, Link, Payload, Robot, Vector
from ugv_acceptance.model.stability import margins

ROBOT = tracked()
PAYLOAD = Payload(2.0, (0.05, 0.0, 0.0))
SETTINGS = Settings(
    ROBOT, (JointInput('x'),) * 4, ImuInput(), Limits((math.inf, 50.0, 50.0, math.inf))
)
POSTURES = [(0.3, 0.5, -0.4, 2.0), (1.5, 1.0, -1.5, -0.35), (-2.0, 0.2, 0.3, 3.0)]
GRAVITY = (0.5, -1.2, -9.7)
Gravity = tuple[float, float, float]

SOURCES = [
    Source('base mass', 'base_link', 'mass', 0.5),
    Source('base cog x', 'base_link', 'cog', 0.01, 0),
    Source('base cog z', 'base_link', 'cog', 0.01, 2),
    Source('link mass', 'link1', 'mass', 0.1),
    Source('link cog', 'link2', 'cog', 0.02, 0),
    Source('flipper mass', 'flippers', 'mass', 0.3),
    Source('turret place', 'turret', 'place', 0.02, 0),
    Source('flipper place', 'flippers', 'place', 0.01, 0),
    Source('elbow offset', 'elbow', 'offset', 0.02),
    Source('payload mass', 'payload', 'mass', 0.1),
    Source('payload cog', 'payload', 'cog', 0.03, 2),
    Source('contacts x', 'contacts', 'place', 0.005, 0),
    Source('contacts y', 'contacts', 'place', 0.005, 1),
    Source('roll', 'imu', 'roll', 0.01),
    Source('pitch', 'imu', 'pitch', 0.01),
]
each_source = pytest.mark.parametrize('source', SOURCES, ids=lambda s: s.name)
each_posture = pytest.mark.parametrize('q', POSTURES, ids=str)


def moved(v: Vector, axis: int, by: float) -> Vector:
    """Return a vector with one coordinate moved."""
    parts = list(v)
    parts[axis] += by
    return (parts[0], parts[1], parts[2])


def other_link(link: Link, source: Source, by: float) -> Link:
    """Return the link as the source moves it."""
    if link.name != source.subject:
        return link
    if source.what == 'mass':
        return replace(link, mass=link.mass + by)
    return replace(link, cog=moved(link.cog, source.axis, by))


def other_joint(joint: Joint, source: Source, by: float) -> Joint:
    """Return the joint as the source moves it."""
    if joint.name != source.subject:
        return joint
    return replace(joint, xyz=moved(joint.xyz, source.axis, by))


def truth(source: Source, by: float, q: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return torques and tip angles of a robot that really is as the source moves it."""
    robot, payload, gravity, posture = ROBOT, PAYLOAD, np.array(GRAVITY), np.array(q)
    if source.subject == 'contacts':
        contacts = [replace(c, position=moved(c.position, source.axis, by)) for c in robot.contacts]
        robot = replace(robot, contacts=tuple(contacts))
    elif source.subject == 'payload':
        if source.what == 'mass':
            payload = replace(payload, mass=payload.mass + by)
        else:
            payload = replace(payload, cog=moved(payload.cog, source.axis, by))
    elif source.subject == 'imu':
        axis = {'roll': 0, 'pitch': 1}[source.what]
        a, b = [(1, 2), (2, 0)][axis]
        gravity[[a, b]] = (
            math.cos(by) * gravity[a] - math.sin(by) * gravity[b],
            math.sin(by) * gravity[a] + math.cos(by) * gravity[b],
        )
    elif source.what == 'offset':
        posture[robot.joint_names.index(source.subject)] += by
    elif source.what == 'place':
        robot = replace(robot, joints=tuple(other_joint(j, source, by) for j in robot.joints))
    else:
        robot = replace(robot, links=tuple(other_link(x, source, by) for x in robot.links))
    found = margins(robot, posture, gravity, payload)
    return found.torque, found.angle


@each_source
@each_posture
def test_an_effect_is_that_of_a_robot_built_anew(source: Source, q: tuple[float, ...]) -> None:
    """Half the difference of two robots, one with each end of the number, compiled for it."""
    effects = effects_of(SETTINGS, [source], q, GRAVITY, PAYLOAD)
    (high, high_angle), (low, low_angle) = (truth(source, s * source.value, q) for s in (1, -1))
    np.testing.assert_allclose(effects.torque[0], (high - low) / 2.0, rtol=1e-9, atol=1e-9)
    expected = (high_angle - low_angle) / 2.0
    finite = np.isfinite(high_angle)
    np.testing.assert_allclose(effects.angle[0][finite], expected[finite], rtol=1e-9, atol=1e-9)


def test_a_heavier_payload_loads_the_shoulder_by_its_lever() -> None:
    """Level and stretched out: 0.1 kg at 0.55 + 0.64 + 0.05 m are 1.216 N m."""
    source = Source('', 'payload', 'mass', 0.1)
    effects = effects_of(SETTINGS, [source], (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, -9.81), PAYLOAD)
    assert effects.torque[0][1] == pytest.approx(0.1 * 9.81 * 1.24, rel=1e-12)


def test_an_imu_that_is_off_takes_its_angle_from_the_tilt_left() -> None:
    """Rolled by 0.01 rad, a level robot has that much less to one side and more to the other."""
    source = Source('', 'imu', 'roll', 0.01)
    effects = effects_of(SETTINGS, [source], (0.0, 2.0, -2.0, 3.0), (0.0, 0.0, -9.81), PAYLOAD)
    left, right = effects.angle[0][1], effects.angle[0][3]
    assert abs(left) == pytest.approx(0.01, rel=1e-9)
    assert left == pytest.approx(-right, rel=1e-9)


def test_the_root_sum_of_squares_is_the_spread_of_random_robots() -> None:
    """Of 300 robots with numbers off by a normal deviate the torques spread by the bound."""
    rng = np.random.default_rng(4)
    q = POSTURES[0]
    some = [s for s in SOURCES if s.what in ('mass', 'offset') or s.subject == 'payload'][:6]
    bound = combined(effects_of(SETTINGS, some, q, GRAVITY, PAYLOAD).torque, 'rss')
    base = margins(ROBOT, np.array(q), np.array(GRAVITY), PAYLOAD).torque
    draws = rng.standard_normal((300, len(some)))
    # One number at a time: the model is so nearly linear that their effects add up.
    spread = np.zeros((300, 4))
    for k, source in enumerate(some):
        torque, _ = truth(source, source.value, q)
        spread += draws[:, k : k + 1] * (torque - base)
    np.testing.assert_allclose(spread.std(axis=0)[1:3], bound[1:3], rtol=0.15)


# The square of less than 1e-150 has lost digits.
@given(
    st.lists(st.floats(-5, 5).filter(lambda x: x == 0.0 or abs(x) > 1e-150), min_size=1, max_size=8)
)
@hypothesis.settings(max_examples=50)
def test_the_worst_case_is_never_below_the_root_sum_of_squares(effects: list[float]) -> None:
    """Both are the effect itself where there is one."""
    column = np.array(effects)[:, None]
    rss, worst = combined(column, 'rss')[0], combined(column, 'worst_case')[0]
    assert rss <= worst * (1 + 1e-12)
    if len(effects) == 1:
        assert rss == pytest.approx(abs(effects[0]))


def test_a_limit_is_uncertain_without_any_torque() -> None:
    """An uncertainty of +/- 2 N m of a limit moves the limit and nothing else."""
    source = Source('shoulder.limit_nm', 'shoulder', 'limit', 2.0)
    effects = effects_of(SETTINGS, [source], POSTURES[0], GRAVITY, PAYLOAD)
    assert effects.limit.tolist() == [[0.0, 2.0, 0.0, 0.0]]
    assert not effects.torque.any()


def test_without_a_polygon_torques_still_have_bounds() -> None:
    """A robot in the air tips nowhere: angles are unknown."""
    robot: Robot = replace(ROBOT, contacts=ROBOT.contacts[:2])
    told = replace(SETTINGS, robot=robot)
    effects = effects_of(told, [SOURCES[3]], POSTURES[0], GRAVITY, PAYLOAD)
    assert np.isnan(effects.angle).all()
    assert effects.torque[0][1] != 0.0


@each_posture
@each_source
def test_a_joints_offset_moves_its_own_position_and_nothing_else_does(
    source: Source, q: tuple[float, ...]
) -> None:
    """A joint's offset error moves its own position by that offset, in every posture."""
    expected = [source.value if source.subject == name else 0.0 for name in ROBOT.joint_names]
    if source.what != 'offset':
        expected = [0.0] * len(q)
    found = effects_of(SETTINGS, [source], q, GRAVITY, PAYLOAD).position
    assert found[0] == pytest.approx(expected)


@each_posture
@each_source
def test_an_imu_that_is_off_tilts_and_nothing_else_does(
    source: Source, q: tuple[float, ...]
) -> None:
    """An IMU's angle error moves the tilt by that angle, in every posture."""
    expected = source.value if source.subject == 'imu' else 0.0
    assert effects_of(SETTINGS, [source], q, GRAVITY, PAYLOAD).tilt[0] == expected


def test_the_height_of_each_contact_counts_alone() -> None:
    """A millimetre on one of four tracks' ends rocks the robot, whichever way: 10 rad a radius.

    In the stowed posture, flippers high: of the four ends each takes as much, squares add up.
    """
    source = Source('contacts.z_m', 'contacts', 'place', 0.001, 2)
    level = (0.0, 0.0, -9.81)
    found = effects_of(SETTINGS, [source], (0.0, 2.6, -2.6, 0.5), level, PAYLOAD).angle[0]
    one = 0.0
    for sign in (1.0, -1.0):
        first = replace(
            ROBOT.contacts[0], position=moved(ROBOT.contacts[0].position, 2, sign * 0.001)
        )
        robot = replace(ROBOT, contacts=(first, *ROBOT.contacts[1:]))
        angles = [margins(r, (0.0, 2.6, -2.6, 0.5), level, PAYLOAD).angle for r in (ROBOT, robot)]
        one = max(one, float(angles[0].min() - angles[1].min()))
    assert one > 0.01
    assert float(found.min()) == pytest.approx(2.0 * one, rel=0.1)
