"""A TFMessage is read and written as rosbags does it, an implementation that is not ours."""

import math
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from ugv_acceptance import BadSample
from ugv_acceptance.bag.transforms import TYPE, transforms_cdr, transforms_of

ROWS = (
    ('base_link', 'imu_link', (0.19, -0.5, 0.149), (0.0, math.sin(0.4), 0.0, math.cos(0.4))),
    ('r1/base', '/x', (1.0, 2.0, 3.0), (0.5, -0.5, 0.5, 0.5)),
)
STORE = get_typestore(Stores.ROS2_JAZZY)


def message() -> Any:
    """Return ROWS as rosbags' message object."""
    types = STORE.types
    header, time = types['std_msgs/msg/Header'], types['builtin_interfaces/msg/Time']
    stamped, vector = (
        types['geometry_msgs/msg/TransformStamped'],
        types['geometry_msgs/msg/Vector3'],
    )
    transform, turn = types['geometry_msgs/msg/Transform'], types['geometry_msgs/msg/Quaternion']
    return types[TYPE](
        transforms=[
            stamped(header(time(0, 0), parent), child, transform(vector(*xyz), turn(*q)))
            for parent, child, xyz, q in ROWS
        ]
    )


def written() -> bytes:
    """Return ROWS as rosbags writes them."""
    return bytes(STORE.serialize_cdr(message(), TYPE))


def test_frames_places_and_rotations_are_read() -> None:
    """From CDR of either byte order: names, origin and the rotation's matrix."""
    for data in (written(), bytes(STORE.serialize_cdr(message(), TYPE, little_endian=False))):
        for found, (parent, child, xyz, q) in zip(transforms_of(data), ROWS, strict=True):
            assert (found.parent, found.child, found.xyz) == (parent, child, xyz)
            np.testing.assert_allclose(
                found.rotation, Rotation.from_quat(q).as_matrix(), atol=1e-15
            )


def test_ros_1_is_read_too() -> None:
    """Its headers have a sequence number each, and nothing is aligned."""
    data = bytes(STORE.cdr_to_ros1(written(), TYPE))
    assert transforms_of(data, 'ros1') == transforms_of(written())


def test_what_is_written_is_what_rosbags_writes() -> None:
    """Byte for byte."""
    assert transforms_cdr(ROWS) == written()


@pytest.mark.parametrize('cut', [3, 7, 20, 60, 150])
def test_a_message_that_is_cut_off_is_refused(cut: int) -> None:
    """With a sentence, not with another exception."""
    with pytest.raises(BadSample):
        transforms_of(written()[:cut])


@pytest.mark.parametrize(
    'quaternion', [(0.0,) * 4, (1.0, 1.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0)]
)
def test_a_quaternion_that_is_no_rotation_is_refused(quaternion: tuple[float, ...]) -> None:
    """It would turn the robot's attitude into anything."""
    with pytest.raises(BadSample, match='unit quaternion'):
        transforms_of(transforms_cdr([('a', 'b', (0.0, 0.0, 0.0), quaternion)]))


def test_a_count_that_does_not_fit_is_refused() -> None:
    """Without reading on for ever."""
    with pytest.raises(BadSample, match='do not fit'):
        transforms_of(b'\x00\x01\x00\x00\xff\xff\xff\x7f' + bytes(100))
