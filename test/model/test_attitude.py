"""Up, roll, pitch and the moved accelerometer against scipy's rotations and against derivatives."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ugv_acceptance.model.attitude import (
    NORM_SLACK,
    angle_between,
    is_rotation,
    moved_specific_force,
    roll_pitch,
    up_from_acceleration,
    up_from_orientation,
)
from ugv_acceptance.model.robot import IDENTITY, Matrix
from ugv_acceptance.type_aliases import Floats

component = st.floats(-1.0, 1.0)
quaternions = st.tuples(component, component, component, component)
vectors = st.tuples(component, component, component)
angle = st.floats(-1.5, 1.5)


def as_matrix(rotation: Rotation) -> Matrix:
    """Return a rotation as nested tuples."""
    a, b, c = (tuple(row) for row in rotation.as_matrix().tolist())
    return (a, b, c)


MOUNTING = Rotation.from_euler('xyz', [0.4, -1.1, 2.5])


@given(quaternions)
def test_up_is_the_world_s_vertical_in_base_axes(q: tuple[float, float, float, float]) -> None:
    """Of any quaternion, not only of unit length, with the sensor mounted askew."""
    assume(math.hypot(*q) > 1e-3)
    up = up_from_orientation(*q, as_matrix(MOUNTING))
    expected = MOUNTING.apply(Rotation.from_quat(q).inv().apply([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(up, expected, atol=1e-12)


@given(quaternions)
def test_an_accelerometer_at_rest_shows_the_same_up(
    q: tuple[float, float, float, float],
) -> None:
    """Its specific force is g upwards."""
    assume(math.hypot(*q) > 1e-3)
    x, y, z = Rotation.from_quat(q).inv().apply([0.0, 0.0, 9.81]).tolist()
    mounting = as_matrix(MOUNTING)
    by_force = up_from_acceleration(x, y, z, mounting)
    np.testing.assert_allclose(by_force, up_from_orientation(*q, mounting), atol=1e-12)


def test_arrays_give_what_their_samples_give() -> None:
    """Functions of arrays give the same values as for each sample alone."""
    rng = np.random.default_rng(0)
    q, mounting = rng.normal(size=(4, 50)), as_matrix(MOUNTING)
    a, b, c, d = q
    up = np.array(up_from_orientation(a, b, c, d, mounting))
    leaning = np.array(up_from_acceleration(a, b, c, mounting))
    for k in range(50):
        x, y, z, w = q[:, k].tolist()
        np.testing.assert_allclose(up[:, k], up_from_orientation(x, y, z, w, mounting))
        np.testing.assert_allclose(leaning[:, k], up_from_acceleration(x, y, z, mounting))


@pytest.mark.parametrize('bad', [(0.0,) * 4, (math.nan, 0.0, 0.0, 1.0), (math.inf, 0.0, 0.0, 1.0)])
def test_an_orientation_that_says_nothing_gives_nan(
    bad: tuple[float, float, float, float],
) -> None:
    """A quaternion of zeros, NaN or infinity gives NaN, without exception or warning."""
    one = up_from_orientation(*bad, IDENTITY)
    x, y, z, w = (np.array([x]) for x in bad)
    many = up_from_orientation(x, y, z, w, IDENTITY)
    assert np.isnan(one).any()
    assert np.isnan(many).any()
    assert not is_rotation(*bad)


def test_free_fall_shows_no_up() -> None:
    """An accelerometer that measures nothing does not say where up is."""
    assert np.isnan(up_from_acceleration(0.0, 0.0, 0.0, IDENTITY)).all()


@pytest.mark.parametrize('norm', [0.991, 1.0, 1.009])
def test_a_norm_near_1_is_a_rotation(norm: float) -> None:
    """A quaternion whose norm is within 1 % of 1 counts as a rotation."""
    assert is_rotation(0.6 * norm, 0.0, 0.8 * norm, 0.0) is True


@pytest.mark.parametrize('norm', [0.0, 0.5, 0.989, 1.011, 2.0])
def test_another_norm_is_none(norm: float) -> None:
    """A quaternion of any other norm, such as zeros or degrees, is refused; arrays give a mask."""
    assert is_rotation(0.6 * norm, 0.0, 0.8 * norm, 0.0) is False
    assert not is_rotation(*np.array([[0.6], [0.0], [0.8], [0.0]]) * norm).any()


@pytest.mark.parametrize('norm', [1.0 - NORM_SLACK, 1.0 + NORM_SLACK])
def test_the_limit_of_the_norm_is_a_rotation_still(norm: float) -> None:
    """A quaternion's norm may be exactly 1 % off, and no more."""
    assert is_rotation(norm, 0.0, 0.0, 0.0) is True
    further = norm + math.copysign(1e-12, norm - 1.0)
    assert is_rotation(further, 0.0, 0.0, 0.0) is False


@given(angle, angle, st.floats(-3.0, 3.0))
def test_roll_and_pitch_are_those_of_the_orientation(roll: float, pitch: float, yaw: float) -> None:
    """Whatever the heading; positive pitch is nose down, positive roll is right side down."""
    x, y, z, w = Rotation.from_euler('xyz', [roll, pitch, yaw]).as_quat().tolist()
    found = roll_pitch(up_from_orientation(x, y, z, w, IDENTITY))
    np.testing.assert_allclose(found, (roll, pitch), atol=1e-9)


@given(vectors, st.floats(0.0, math.pi))
def test_the_angle_between_vectors(axis: tuple[float, float, float], turn: float) -> None:
    """A vector turned by an angle about one at right angles is that angle away, however small."""
    assume(math.hypot(*axis) > 1e-2)
    start = np.cross(axis, [0.3, -0.5, 0.8])
    assume(float(np.linalg.norm(start)) > 1e-3)
    end = Rotation.from_rotvec(turn * np.asarray(axis) / math.hypot(*axis)).apply(start)
    assert angle_between(start.tolist(), end.tolist()) == pytest.approx(turn, abs=1e-14, rel=1e-12)


def test_a_tiny_angle_is_not_lost() -> None:
    """A tiny angle between vectors is kept, for which the arc cosine would give 0."""
    assert angle_between((1.0, 0.0, 0.0), (1.0, 1e-12, 0.0)) == pytest.approx(1e-12, rel=1e-9)


def test_the_moved_specific_force_is_that_of_the_moved_point() -> None:
    """Second derivatives of a point on a turning, accelerating body, by finite differences."""
    omega, alpha = np.array([0.7, -0.3, 1.1]), np.array([0.5, 2.0, -1.0])
    arm, down = np.array([0.2, -0.1, 0.3]), np.array([0.0, 0.0, -9.81])
    start = np.array([1.0, 2.0, 0.5])  # of the sensor, relative to a point that does not move

    def place(point: Floats, t: float) -> Floats:
        # To third order in t, which is all a second derivative at t = 0 sees.
        turned: Floats = point + np.cross(t * omega + 0.5 * t * t * alpha, point)
        turned += 0.5 * t * t * np.cross(omega, np.cross(omega, point))
        return turned

    def force(point: Floats) -> Floats:
        h = 1e-3
        second: Floats = (place(point, h) - 2.0 * point + place(point, -h)) / h**2
        felt: Floats = second - down
        return felt

    moved = moved_specific_force(
        force(start).tolist(), omega.tolist(), alpha.tolist(), arm.tolist()
    )
    np.testing.assert_allclose(moved, force(start + arm), atol=1e-7)
