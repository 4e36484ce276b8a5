"""Joints that carry the robot, beside MuJoCo at rest: the model holds what its motors hold."""

import pytest

from bench.bench_reactions import (
    ROBOTS,
    RUBBER,
    SLIPPERY,
    Case,
    compared,
    legged_robot,
    lifted,
    packbot,
    swayed,
)

LEGGED_ROBOTS = pytest.mark.skipif(
    not ROBOTS.is_dir(), reason='needs ../shared/robots: robots of others, no part of this project'
)


def test_flippers_that_lift_the_robot_hold_what_they_hold_in_mujoco() -> None:
    """PackBot on its flippers at -40 deg, 4 kg at full reach: 40 N m, of which 1 % may be off."""
    robot, q = packbot(4.0)
    (flipper,) = compared(Case('packbot', robot, q, SLIPPERY))[1]
    assert flipper.even == pytest.approx(flipper.truth, rel=0.01)
    assert abs(flipper.truth) > 35.0
    assert abs(flipper.hanging) < 1.0
    (braced,) = compared(Case('packbot', robot, q, RUBBER))[1]
    assert braced.inside


@LEGGED_ROBOTS
@pytest.mark.parametrize('name', ['go2', 'b1', 'anymal_c'])
def test_on_three_feet_all_joints_hold_what_they_hold_in_mujoco(name: str) -> None:
    """Without friction three feet settle all: every joint to 1 % of the largest."""
    robot, q = legged_robot(name)
    three, leaning = lifted(robot, q, 1)
    truth, rows = compared(Case(name, three, leaning, SLIPPERY))
    assert len(truth.points) == 3
    most = max(abs(row.truth) for row in rows)
    assert len(rows) == 9
    for row in rows:
        assert row.even == pytest.approx(row.truth, abs=0.01 * most), row.joint


@LEGGED_ROBOTS
@pytest.mark.parametrize('name', ['go2', 'anymal_c'])
def test_with_friction_mujoco_lies_in_the_interval_that_friction_widens(name: str) -> None:
    """On four feet that may brace each other, in the usual posture and a little off it."""
    robot, q = legged_robot(name)
    for at in (q, swayed(q, 0)):
        _, rows = compared(Case(name, robot, at, RUBBER))
        assert rows
        assert [row.joint for row in rows if not row.inside] == []
