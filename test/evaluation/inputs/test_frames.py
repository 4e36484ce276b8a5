"""Where a frame is on the robot: by its links, by transforms, by both; and names of frames."""

import numpy as np
import pytest
from robots import tracked
from scipy.spatial.transform import Rotation

from ugv_acceptance.evaluation.inputs.frames import (
    Place,
    Transform,
    link_of,
    place_of,
    without_prefix,
)
from ugv_acceptance.model.robot import Matrix
from ugv_acceptance.type_aliases import Floats

ROBOT = tracked()


def turn(*degrees: float) -> Matrix:
    """Return a rotation by roll, pitch and yaw (deg)."""
    a, b, c = Rotation.from_euler('xyz', degrees, degrees=True).as_matrix().tolist()
    return tuple(a), tuple(b), tuple(c)


def matrix(place: Place | Transform | None) -> Floats:
    """Return a place or a transform as a matrix of 4 x 4."""
    assert place is not None
    at = np.eye(4)
    xyz, rotation = (place.xyz, place.rotation) if isinstance(place, Place) else place[2:]
    at[:3, 3], at[:3, :3] = xyz, rotation
    return at


PLATE: Transform = ('base_link', 'plate', (0.1, 0.2, 0.3), turn(10.0, 20.0, 30.0))
IMU: Transform = ('plate', 'imu', (-0.1, 0.0, 0.05), turn(-90.0, 5.0, 170.0))


@pytest.mark.parametrize('name', ['link1', '/link1', 'r1/link1', '/fleet/r1/link1'])
def test_a_slash_and_namespaces_before_a_link_are_understood(name: str) -> None:
    """As TF and drivers write them."""
    assert link_of(ROBOT, name) == 'link1'


@pytest.mark.parametrize('name', ['', '/', 'link', 'xlink1', 'link1/imu', 'r1_link1'])
def test_what_is_not_the_name_of_a_link_is_none(name: str) -> None:
    """Neither a part of a name, nor a sensor on a link whose place nobody tells."""
    assert link_of(ROBOT, name) is None


def test_a_prefix_without_a_slash_is_taken_off() -> None:
    """As robot_state_publisher puts it before every frame."""
    assert without_prefix('r1_link1', 'r1_') == 'link1'
    assert without_prefix('/r1/link1', 'r1/') == 'link1'
    assert without_prefix('link1', 'r1_') == 'link1'


def test_transforms_lead_to_the_robot_step_by_step() -> None:
    """In whatever order they were told."""
    for told in ([PLATE, IMU], [IMU, PLATE]):
        found = place_of(ROBOT, '/imu', told)
        assert found is not None
        assert (found.link, found.steps) == ('base_link', ('imu', 'plate', 'base_link'))
        np.testing.assert_allclose(matrix(found), matrix(PLATE) @ matrix(IMU), atol=1e-15)


def test_a_frame_on_a_moving_link_stays_in_the_axes_of_that_link() -> None:
    """Joints move it: only they tell where it is."""
    found = place_of(ROBOT, 'imu', [('link1', 'imu', *IMU[2:])])
    assert found is not None
    assert found.link == 'link1'
    np.testing.assert_allclose(matrix(found), matrix(IMU), atol=1e-15)


def test_transforms_may_lead_to_a_frame_above_the_root_of_the_robot() -> None:
    """Such as base_footprint, which some drivers tell and the URDF does not have."""
    told = [('base_footprint', 'base_link', *PLATE[2:]), ('base_footprint', 'imu', *IMU[2:])]
    found = place_of(ROBOT, 'imu', told)
    assert found is not None
    assert found.link == 'base_link'
    np.testing.assert_allclose(
        matrix(found), np.linalg.inv(matrix(PLATE)) @ matrix(IMU), atol=1e-15
    )


@pytest.mark.parametrize(
    'told',
    [
        (),
        (('elsewhere', 'imu', *IMU[2:]),),
        (('b', 'imu', *IMU[2:]), ('imu', 'b', *IMU[2:])),
        (('imu', 'imu', *IMU[2:]),),
    ],
)
def test_a_frame_that_leads_nowhere_or_in_a_circle_has_no_place(
    told: tuple[Transform, ...],
) -> None:
    """Then nobody knows where it is; no number stands in for it."""
    assert place_of(ROBOT, 'imu', told) is None
