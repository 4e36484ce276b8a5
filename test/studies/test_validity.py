"""Equations (9) and (10): Table 2, the critical value, and the speed it allows."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import tracked
from scipy import stats

from ugv_acceptance.model.statics import inverse_dynamics, static_torque
from ugv_acceptance.studies.offsets import matches, offset_family, table_2, table_error
from ugv_acceptance.studies.planar import PlanarArm, paper_arm, planar_dynamics, planar_torque
from ugv_acceptance.studies.validity import (
    critical_value,
    mean_square,
    paper_sweep,
    speed_error,
    speed_limit,
)

THETA1 = math.pi / 6.0


def by_the_book(offset1: float, offset2: float, speed_deg_s: float) -> np.ndarray:
    """Return MS of both joints as the paper says it, sample by sample."""
    q = paper_sweep(THETA1)
    rate = (0.0, math.radians(speed_deg_s))
    truth = planar_dynamics(PlanarArm(offset1=offset1, offset2=offset2), q, rate, (0.0, 0.0))
    model = planar_torque(PlanarArm(), q[:, 0], q[:, 1])
    return np.array([mean_square(t - m) for t, m in zip(truth, model, strict=True)])


def test_all_sixteen_cells_of_table_2() -> None:
    """With the centres of gravity of the page every cell rounds to the printed digit."""
    assert matches(table_2()).sum() == 16


def test_f_is_the_ratio_of_mean_squares() -> None:
    """F in closed form is the quotient of two sums over 201 samples."""
    book = by_the_book(0.04, -0.01, 108.0) / by_the_book(0.04, -0.01, 1.0)
    ours = table_error(0.04, -0.01).f_value(math.radians(108.0))
    assert ours == pytest.approx(book, rel=1e-9)


def test_every_member_of_the_family_gives_table_2() -> None:
    """Both bands of offsets give 16 of 16, along their whole length."""
    found = offset_family(np.arange(-10.0, 10.0, 0.1) / 1e3)
    assert found.offset2[0] * 1e3 == pytest.approx(-3.3)
    assert found.offset2[-1] * 1e3 == pytest.approx(-1.3)
    for offset2, *ends in zip(found.offset2, found.positive, found.negative, strict=True):
        assert all(matches(table_2(float(end.mean()), float(offset2))).all() for end in ends)


def test_just_outside_the_family_a_cell_differs() -> None:
    """The bands' ends are their ends: 0.01 mm further out at least one cell rounds otherwise."""
    found = offset_family(np.array([-0.00228]))
    (low, high) = sorted(found.positive[0])
    assert matches(table_2(low + 1e-6, -0.00228)).all()
    assert not matches(table_2(low - 1e-5, -0.00228)).all()
    assert not matches(table_2(high + 1e-5, -0.00228)).all()


def test_a_heavy_second_link_has_no_family() -> None:
    """With too heavy a second link, no offset of the first link gives Table 2."""
    arm = PlanarArm(0.23, 0.32, 13.6, 13.1, 6.2)
    found = offset_family(np.array([-0.1, 0.0]), arm)
    assert (found.offset2.shape, found.positive.shape, found.negative.shape) == (
        (0,),
        (0, 2),
        (0, 2),
    )


def test_without_offsets_f_grows_as_the_fourth_power_of_speed() -> None:
    """The mid-link model has no error at rest: F at 180 deg/s is 180^4."""
    assert table_2(0.0, 0.0)[-1, 0] == pytest.approx(180.0**4)


def test_the_critical_value_is_scipy_s() -> None:
    """F(0.05; 200, 200) is 1.2626, not the paper's 1.227."""
    assert critical_value() == pytest.approx(stats.f.ppf(0.95, 200, 200), rel=1e-12)
    assert critical_value() == pytest.approx(1.2626, abs=5e-5)


@given(critical=st.floats(1.01, 200.0))
def test_the_speed_is_a_root_of_f(critical: float) -> None:
    """At the acceptable speed F is the critical value; joint 2 accepts any speed."""
    error = table_error(0.04728, -0.00228)
    first, second = error.speed_at(critical)
    assert error.f_value(first)[0] == pytest.approx(critical)
    assert second == math.inf


def test_a_constant_rate_adds_its_square_times_a_function_of_posture() -> None:
    """Any tree: torque at rate v less static torque is v^2 times that at rate 1."""
    robot, rng = tracked(), np.random.default_rng(0)
    q = rng.uniform(-3.0, 3.0, (30, 4))
    rate, still = np.array([0.0, 0.0, 1.0, 0.0]), np.zeros(4)
    down = (1.0, 2.0, -9.0)
    at_rest = static_torque(robot, q, down)
    one, three = (inverse_dynamics(robot, q, v * rate, still, down) - at_rest for v in (1.0, 3.0))
    assert np.allclose(three, 9.0 * one, atol=1e-9)


def test_at_the_limit_the_worst_joint_has_the_critical_f() -> None:
    """Counted sample by sample: (reference^2 + MS of the motion) / reference^2 is critical."""
    robot, rng = tracked(), np.random.default_rng(1)
    q, still = rng.uniform(-3.0, 3.0, (201, 4)), np.zeros(4)
    limits = speed_limit(robot, q, reference=0.7)
    for joint in range(3):
        rate = np.zeros(4)
        rate[joint] = limits[joint]
        more = inverse_dynamics(robot, q, rate, still, (0, 0, 0))
        assert 1.0 + mean_square(more).max() / 0.49 == pytest.approx(critical_value())


def test_no_offset_is_needed_for_a_speed_limit() -> None:
    """The paper's arm and sweep, static error 1 N m: the elbow may move at 35.9 deg/s."""
    limits = speed_limit(paper_arm(), paper_sweep(THETA1), reference=1.0)
    assert math.degrees(limits[1]) == pytest.approx(35.88, abs=0.01)


def test_a_heavier_static_error_allows_more_speed() -> None:
    """The limit grows as the square root of the reference error."""
    one, four = (speed_limit(paper_arm(), paper_sweep(0.4), reference=r)[1] for r in (1.0, 4.0))
    assert four == pytest.approx(2.0 * one)


def test_an_error_of_both_models_is_taken_at_rest_too() -> None:
    """speed_error's part at rest is the difference of the two static models."""
    q = paper_sweep(0.5)
    error = speed_error(paper_arm(0.03, 0.01), q, 1, static=paper_arm())
    down = (0.0, 0.0, -9.81)
    rest = static_torque(paper_arm(0.03, 0.01), q, down) - static_torque(paper_arm(), q, down)
    assert error.rest == pytest.approx(mean_square(rest))
