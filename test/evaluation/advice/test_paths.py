"""Paths that an operator could follow: where they lead, their time, and what they must not do."""

import math
from dataclasses import replace

import numpy as np
import pytest
from evaluation.streams import settings
from robots import DOWN, tracked

from ugv_acceptance.evaluation.advice.paths import joint_paths, joint_speed, turn_paths
from ugv_acceptance.evaluation.settings import ImuInput, JointInput, Limits, Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import centre_of_gravity

TOLD = settings()
STILL = np.array((0.0, 0.0))
NO_TORQUE = np.zeros(2)
TRACKED = tracked()
WIDE = Settings(
    TRACKED,
    tuple(JointInput(name) for name in TRACKED.joint_names),
    ImuInput(),
    Limits((math.inf,) * 4),
)


def test_a_joint_moves_at_nine_tenths_of_its_least_speed() -> None:
    """The lift's model holds to 0.6 rad/s; the slide's URDF says 1 m/s; an unknown one 0.3."""
    assert joint_speed(TOLD, 0) == pytest.approx(0.54)
    assert joint_speed(TOLD, 1) == pytest.approx(0.9)
    assert joint_speed(replace(TOLD, limits=Limits((45.0, 30.0))), 0) == pytest.approx(1.8)
    assert joint_speed(WIDE, 0) == 0.3


def test_a_path_goes_as_far_as_four_seconds_or_the_joint_allow() -> None:
    """The lift at 0.54 rad/s, to its ends at 1.6 and -1.5; the slide to 0.4 and -0.2 m."""
    paths = joint_paths(TOLD, STILL, np.array(DOWN), NO_TORQUE)
    ends = {(p.subject, p.amount[-1] > 0.0): float(p.amount[-1]) for p in paths}
    assert ends == pytest.approx({
        ('lift', True): 1.6, ('lift', False): -1.5, ('slide', True): 0.4, ('slide', False): -0.2,
    })  # fmt: skip
    slow = replace(TOLD, limits=Limits((45.0, 30.0), speed=(0.1, math.inf)))
    lift = joint_paths(slow, STILL, np.array(DOWN), NO_TORQUE)[:2]
    assert [p.amount[-1] for p in lift] == pytest.approx([0.36, -0.36])


def test_a_path_is_sixteen_even_steps_from_now() -> None:
    """Only its joint moves, gravity stays, and the time is that of its speed."""
    for path in joint_paths(TOLD, np.array((0.2, 0.1)), np.array(DOWN), NO_TORQUE):
        j = TOLD.robot.joint_names.index(path.subject)
        assert len(path.amount) == 16
        assert path.amount == pytest.approx(path.amount[-1] * np.arange(1, 17) / 16)
        assert path.q[:, j] == pytest.approx((0.2, 0.1)[j] + path.amount)
        assert (path.q[:, 1 - j] == (0.2, 0.1)[1 - j]).all()
        assert path.seconds == pytest.approx(np.abs(path.amount) / joint_speed(TOLD, j))
        assert (path.gravity == DOWN).all()


@pytest.mark.parametrize(('at', 'ways'), [(1.6, [-1.0]), (-1.5, [1.0]), (1.7, [-1.0])])
def test_a_joint_at_its_end_moves_only_back(at: float, ways: list[float]) -> None:
    """No path leaves a joint's range, and no path stands still."""
    paths = joint_paths(TOLD, np.array((at, 0.0)), np.array(DOWN), NO_TORQUE)
    assert [np.sign(p.amount[-1]) for p in paths if p.subject == 'lift'] == ways


@pytest.mark.parametrize(
    ('torque', 'ways'), [(44.9, [1, -1]), (45.0, [-1]), (-45.0, [1]), (60.0, [-1])]
)
def test_a_motor_at_its_limit_only_lets_down(torque: float, ways: list[int]) -> None:
    """From 45 N m on, the lift moves only the way its load pulls."""
    paths = joint_paths(TOLD, STILL, np.array(DOWN), np.array((torque, 0.0)))
    assert [np.sign(p.amount[-1]) for p in paths if p.subject == 'lift'] == ways


def test_a_joint_that_moves_contact_points_goes_in_fine_steps() -> None:
    """A flipper's tip counts only within the ground's tolerance: 0.01 rad a step."""
    paths = joint_paths(WIDE, np.zeros(4), np.array(DOWN), np.zeros(4))
    counts = {p.subject: len(p.amount) for p in paths}
    assert counts == {'turret': 16, 'shoulder': 16, 'elbow': 16, 'flippers': 120}


def test_an_arm_does_not_come_nearer_the_ground_than_six_centimetres() -> None:
    """The load, 1.1 m from the lift at 0.3 m, is at 0.3 + 1.1 sin q."""
    for path in joint_paths(TOLD, STILL, np.array(DOWN), NO_TORQUE):
        lowest = np.minimum(0.3, 0.3 + (1.1 + path.q[:, 1]) * np.sin(path.q[:, 0]))
        assert (path.forbidden == (lowest < 0.06 - 1e-6)).all()
        assert path.forbidden.any() == (path.subject == 'lift' and path.amount[-1] < 0.0)


def test_an_arm_that_lies_low_may_rise() -> None:
    """Below 6 cm above the ground only motions that lead lower are forbidden."""
    q = np.array((-math.asin(0.28 / 1.1), 0.0))  # the load at 2 cm
    up, down = joint_paths(TOLD, q, np.array(DOWN), NO_TORQUE)[:2]
    assert not up.forbidden.any()
    assert down.forbidden.all()
    retracted = joint_paths(TOLD, q, np.array(DOWN), NO_TORQUE)[3]
    assert retracted.subject == 'slide'
    assert not retracted.forbidden.any()


@pytest.mark.parametrize(('slope', 'count'), [(0.0499, 0), (0.0501, 2)])
def test_turning_is_for_slopes(slope: float, count: int) -> None:
    """Turning on the spot is tried only on slopes of at least 0.05 (the sine of the angle)."""
    angle = math.asin(slope)
    down = 9.81 * np.array((math.sin(angle), 0.0, -math.cos(angle)))
    assert len(list(turn_paths(TOLD.robot, STILL, down, Payload()))) == count


def test_a_turn_goes_half_around_either_way_in_steps_of_five_degrees() -> None:
    """Gravity keeps its size and turns against the robot; 0.4 rad/s."""
    down = np.array((1.5, 2.0, -9.0))
    left, right = turn_paths(TOLD.robot, STILL, down, Payload())
    for path, way in ((left, 1.0), (right, -1.0)):
        assert path.amount == pytest.approx(way * np.radians(np.arange(5.0, 181.0, 5.0)))
        assert path.seconds == pytest.approx(np.abs(path.amount) / 0.4)
        heading = np.arctan2(path.gravity[:, 1], path.gravity[:, 0])
        turned = np.angle(np.exp(1j * (math.atan2(2.0, 1.5) - heading - path.amount)))
        assert np.abs(turned).max() < 1e-9
        assert np.linalg.norm(path.gravity, axis=1) == pytest.approx(np.linalg.norm(down))
        assert (path.gravity[:, 2] == -9.0).all()
        assert (path.q == 0.0).all()
    assert left.gravity[17] == pytest.approx((2.0, -1.5, -9.0))  # a quarter turn to the left


@pytest.mark.parametrize(('across', 'slips'), [(5.9, False), (6.3, True)])
def test_a_robot_on_one_track_does_not_turn(across: float, slips: bool) -> None:  # noqa: FBT001
    """Turning needs a quarter of the weight on the lighter track; the bound is in closed form."""
    down = np.array((1.0, across, -9.0))
    cog = centre_of_gravity(TOLD.robot, STILL, Payload())
    y = cog[2] * across / 9.0  # tracks at +-0.3 m
    assert ((0.3 - abs(y)) / 0.6 < 0.25) == slips
    for path in turn_paths(TOLD.robot, STILL, down, Payload()):
        assert path.forbidden.all() == slips


def test_an_arm_that_lies_low_may_move_along_the_ground() -> None:
    """At 3 cm a level slide comes no lower; the lift may go up, not down."""
    robot = TOLD.robot
    joints = (replace(robot.joints[0], xyz=(0.1, 0.0, 0.03)), *robot.joints[1:])
    low = replace(TOLD, robot=replace(robot, joints=joints))
    paths = joint_paths(low, STILL, np.array(DOWN), NO_TORQUE)
    forbidden = {(p.subject, p.amount[-1] > 0.0): p.forbidden.tolist() for p in paths}
    assert forbidden == {
        ('lift', True): [False] * 16, ('lift', False): [True] * 16,
        ('slide', True): [False] * 16, ('slide', False): [False] * 16,
    }  # fmt: skip


def test_the_last_joint_of_an_arm_without_a_load_counts() -> None:
    """Where nothing is carried, the slide's joint, 1 m from the lift, is the lowest."""
    bare = replace(TOLD, robot=replace(TOLD.robot, payload_link=None))
    _, down, *_ = joint_paths(bare, STILL, np.array(DOWN), NO_TORQUE)
    lowest = 0.3 + np.sin(down.q[:, 0])
    assert (down.forbidden == (lowest < 0.06 - 1e-6)).all()
    assert 0 < down.forbidden.sum() < 16


def test_a_joint_that_cannot_move_has_no_path() -> None:
    """A joint without a range to move in has no path, nor has a robot of such joints."""
    fixed = tuple(replace(j, lower=0.0, upper=0.0) for j in TOLD.robot.joints)
    still = replace(TOLD, robot=replace(TOLD.robot, joints=fixed))
    assert joint_paths(still, STILL, np.array(DOWN), NO_TORQUE) == []


def test_a_turn_that_would_slip_anywhere_is_forbidden_there() -> None:
    """A robot that leans to the front slips while the slope is across: on both sides, not before.

    Closed form: gravity through the centre of gravity meets the ground beyond a quarter.
    """
    down = np.array((6.2, 0.0, -9.0))
    cog = centre_of_gravity(TOLD.robot, STILL, Payload())
    for path in turn_paths(TOLD.robot, STILL, down, Payload()):
        y = cog[2] * path.gravity[:, 1] / 9.0
        x = cog[0] + cog[2] * path.gravity[:, 0] / 9.0
        stands = np.abs(x) < 0.4
        slips = (0.3 - np.abs(y)) / 0.6 < 0.25
        assert (path.forbidden == (slips | ~stands)).all()
        assert slips.any()
        assert not slips.all()


def test_a_joint_that_never_moves_lets_nothing_else_come_as_low() -> None:
    """The lift at 3 cm is part of the body: what it carries keeps its 6 cm all the same."""
    robot = TOLD.robot
    joints = (replace(robot.joints[0], xyz=(0.1, 0.0, 0.03)), *robot.joints[1:])
    low = replace(TOLD, robot=replace(robot, joints=joints))
    _, down, *_ = joint_paths(low, np.array((0.5, 0.0)), np.array(DOWN), NO_TORQUE)
    assert (down.forbidden == (0.03 + np.sin(down.q[:, 0]) < 0.06 - 1e-6)).all()
    assert down.forbidden.any()


def test_a_robot_that_slips_where_it_stands_does_not_turn() -> None:
    """A robot that slips at its heading gets no turn, though a small one would be enough."""
    cog = centre_of_gravity(TOLD.robot, STILL, Payload())
    across = 0.15 * 9.0 / cog[2] + 0.02
    left, _ = turn_paths(TOLD.robot, STILL, np.array((1.0, across, -9.0)), Payload())
    assert left.gravity[0, 1] < across - 0.04
    assert left.forbidden.all()
