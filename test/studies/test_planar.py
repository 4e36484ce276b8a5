"""The paper's two-link arm in closed form: equations (1)-(8), Table 1, and its dynamics."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ugv_acceptance.model.statics import inverse_dynamics, static_torque
from ugv_acceptance.studies.planar import (
    PAPER,
    PlanarArm,
    arm_robot,
    paper_arm,
    planar_dynamics,
    planar_torque,
    safe_theta2,
    worst_theta2,
)

DOWN = (0.0, 0.0, -9.81)
TURN = 2.0 * math.pi
angles = st.floats(0.0, math.pi)
limits = st.floats(5.0, 120.0)
arms = st.builds(
    PlanarArm,
    *(st.floats(0.2, 1.0) for _ in range(5)),
    offset1=st.floats(-0.1, 0.1),
    offset2=st.floats(-0.1, 0.1),
)


def test_torques_of_the_stretched_arm() -> None:
    """By hand: 2.5 g 0.275 + 6.5 g 0.55 = 41.815 and 2.5 g 0.32 + 4 g 0.64 = 32.962 N m."""
    tau1, tau2 = planar_torque(PAPER, 0.0, 0.0)
    assert float(tau2) == pytest.approx(9.81 * 3.36)
    assert float(tau1) == pytest.approx(9.81 * (0.6875 + 3.575 + 3.36))


@given(arm=arms, q=st.tuples(*[st.floats(-7.0, 7.0)] * 2))
def test_the_arm_as_a_robot_has_the_same_torques(arm: PlanarArm, q: tuple[float, float]) -> None:
    """The general tree gives equations (1) and (2) to 1e-12."""
    ours = static_torque(arm_robot(arm), q, DOWN)
    assert np.allclose(ours, np.stack(planar_torque(arm, *q)), rtol=0, atol=1e-12)


@given(arm=arms, seed=st.integers(0, 10_000))
def test_the_recursion_gives_the_two_link_dynamics(arm: PlanarArm, seed: int) -> None:
    """Inverse dynamics of the tree are the textbook closed form of two links."""
    q, qd, qdd = np.random.default_rng(seed).uniform(-3.0, 3.0, (3, 8, 2))
    ours = inverse_dynamics(arm_robot(arm), q, qd, qdd, DOWN)
    assert np.allclose(
        ours, np.stack(planar_dynamics(arm, q, qd, qdd), axis=-1), rtol=0, atol=1e-11
    )


def test_offsets_move_the_centres_of_gravity_outwards() -> None:
    """An offset of link 1 by d adds m1 g d cos(theta1) to joint 1 and nothing to joint 2."""
    more = static_torque(paper_arm(0.04), (0.3, 0.5), DOWN) - static_torque(
        paper_arm(), (0.3, 0.5), DOWN
    )
    assert more == pytest.approx([2.5 * 9.81 * 0.04 * math.cos(0.3), 0.0], abs=1e-12)


@pytest.mark.parametrize(
    ('theta1', 'theta2'),
    [
        (0, (0, 2)),
        (1 / 6, (11 / 6,)),
        (1 / 3, (5 / 3,)),
        (1 / 2, (1 / 2, 3 / 2)),
        (2 / 3, (1 / 3,)),
        (5 / 6, (1 / 6,)),
        (1, (0, 2)),
    ],
)
def test_table_1(theta1: float, theta2: tuple[float, ...]) -> None:
    """Every row of Table 1, in units of pi, with both roots where there are two."""
    assert worst_theta2(math.pi * theta1) == pytest.approx([math.pi * x for x in theta2])


@given(theta1=angles)
def test_no_theta2_loads_joint_1_more_than_the_worst(theta1: float) -> None:
    """|tau_1| at a worst-case angle is at least that of a fine sweep."""
    sweep = np.abs(planar_torque(PAPER, theta1, np.linspace(0.0, TURN, 721))[0]).max()
    worst = [abs(float(planar_torque(PAPER, theta1, t)[0])) for t in worst_theta2(theta1)]
    assert max(worst) >= sweep - 1e-9
    assert min(worst) == pytest.approx(max(worst))


@example(theta1=3.1415926535897927, limit1=5.0, limit2=5.0, two_sided=False)
@given(theta1=angles, limit1=limits, limit2=limits, two_sided=st.booleans())
def test_the_safe_range_is_where_no_limit_is_passed(
    theta1: float, limit1: float, limit2: float, *, two_sided: bool
) -> None:
    """Inside the intervals both torques keep their limits, outside one does not."""
    found = safe_theta2(PAPER, theta1, limit1, limit2, two_sided=two_sided)
    theta2 = np.linspace(0.0, TURN, 1441)
    inside = np.zeros(theta2.shape, dtype=np.bool_)
    for start, end in found:
        inside |= (theta2 >= start) & (theta2 <= end)
    torques = planar_torque(PAPER, theta1, theta2)
    over = [
        (np.abs(tau) if two_sided else tau) - limit
        for tau, limit in zip(torques, (limit1, limit2), strict=True)
    ]
    slack = np.max(over, axis=0)
    clear = np.abs(slack) > 1e-9
    assert ((slack <= 0.0) == inside)[clear].all()


def test_the_paper_s_reading_misses_negative_saturation() -> None:
    """At theta1 = 150 deg and 30 N m joint 1 is at -69 N m in postures the paper calls safe."""
    theta1 = math.radians(150.0)
    both = safe_theta2(PAPER, theta1, 30.0, 30.0)
    one = safe_theta2(PAPER, theta1, 30.0, 30.0, two_sided=False)
    worst = worst_theta2(theta1)[0]
    assert any(start <= worst <= end for start, end in one)
    assert not any(start <= worst <= end for start, end in both)
