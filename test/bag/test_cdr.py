"""Single messages: the same numbers as rosbags, and BadSample of anything that is no message."""

import struct
from contextlib import suppress
from typing import Any

import pytest
from bag.bag_cases import (
    IMU,
    STORE,
    bits,
    cdr,
    imu,
    imus,
    inertia,
    inertias,
    joint_state,
    joint_states,
    numbers,
)
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance import BadSample
from ugv_acceptance.bag import cdr as ours
from ugv_acceptance.bag.cdr import Decoder, imu_decoder, joint_state_decoder, payload_decoder
from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr

DECODERS = [joint_state_decoder, imu_decoder, payload_decoder]


def said(sample: Any) -> tuple[Any, ...]:
    """A sample as `numbers` gives a message of rosbags."""
    if isinstance(sample, ours.JointStateSample):
        arrays = (sample.position, sample.velocity, sample.effort)
        return (sample.stamp, sample.names, *(bits(a) for a in arrays))
    if isinstance(sample, ours.PayloadSample):
        return (sample.stamp, sample.frame_id, bits([sample.mass, *sample.com]))
    vectors = (*sample.orientation, *sample.angular_velocity, *sample.linear_acceleration)
    first = (
        sample.orientation_covariance_0,
        sample.angular_velocity_covariance_0,
        sample.linear_acceleration_covariance_0,
    )
    return (sample.stamp, sample.frame_id, bits(vectors), bits(first))


@given(st.lists(st.tuples(joint_states(), st.booleans()), min_size=1, max_size=4))
def test_joint_states_equal_rosbags(messages: list[tuple[Any, bool]]) -> None:
    """Any joint states, of either byte order, give what rosbags gives, also when met again."""
    decoder = joint_state_decoder()
    for message, little in messages * 2:
        assert said(decoder.one(cdr(message, little=little))) == numbers(message)


@given(st.lists(st.tuples(imus(), st.booleans()), min_size=1, max_size=3))
def test_imus_equal_rosbags(messages: list[tuple[Any, bool]]) -> None:
    """Any IMU messages, of either byte order, give what rosbags gives."""
    decoder = imu_decoder()
    for message, little in messages * 2:
        assert said(decoder.one(cdr(message, little=little))) == numbers(message)


@given(inertias(), st.booleans())
def test_payloads_equal_rosbags(message: Any, little: bool) -> None:  # noqa: FBT001
    """Any payload message, of either byte order, gives what rosbags gives."""
    assert said(payload_decoder().one(cdr(message, little=little))) == numbers(message)


@given(joint_states())
def test_ros1_packing_equals_rosbags(message: Any) -> None:
    """ROS 1's packing of a joint state gives the same numbers (its stamps are not negative)."""
    message.header.stamp.sec &= 0x7FFFFFFF
    packed = STORE.cdr_to_ros1(cdr(message), 'sensor_msgs/msg/JointState')
    assert said(Decoder(ours.JOINT_STATE, 'ros1').one(bytes(packed))) == numbers(message)


@pytest.mark.parametrize('make', DECODERS)
@given(data=st.binary(max_size=200), little=st.booleans())
def test_no_bytes_but_badsample(make: Any, data: bytes, little: bool) -> None:  # noqa: FBT001
    """Bytes that are no message raise BadSample and nothing else."""
    for tried in (data, b'\x00' + bytes([little]) + b'\x00\x00' + data):
        with suppress(BadSample):
            assert make().one(tried).frame_id is not None


@given(st.integers(0, 400), st.integers(0, 255), st.integers(0, 420))
def test_damage_is_badsample_or_a_sample(place: int, value: int, size: int) -> None:
    """A message with a byte changed or its end cut off never raises anything but BadSample."""
    whole = bytearray(cdr(joint_state(names=('arm', 'hand'), arrays=((1, 2), (3, 4), (5, 6)))))
    whole[place % len(whole)] = value
    decoder = joint_state_decoder()
    decoder.one(cdr(joint_state()))
    try:
        sample = decoder.one(bytes(whole[:size]))
    except BadSample:
        return
    assert {len(sample.position), len(sample.velocity)} <= {0, len(sample.names)}


def test_names_of_messages_alike_are_one_object() -> None:
    """A caller may compare names with `is`, also across frames and empty arrays."""
    decoder = joint_state_decoder()
    first = decoder.one(cdr(joint_state(frame_id='x')))
    second = decoder.one(cdr(joint_state(frame_id='longer', arrays=((), (), ()))))
    assert first.names is second.names


def test_padding_of_any_content_is_ignored() -> None:
    """Bytes between fields may hold anything, as writers that reuse buffers leave them."""
    clean = cdr(joint_state(names=('ab', 'c'), frame_id='f'))
    dirty = bytearray(clean)
    dirty[2:4] = b'\xab\xcd'  # encapsulation options
    dirty[18:20] = b'\xfe\xff'  # behind the frame's text
    decoder = joint_state_decoder()
    decoder.one(clean)
    assert decoder.one(bytes(dirty)) == decoder.one(clean)
    assert len(decoder._known[len(clean)]) == 1


@pytest.mark.parametrize('extra', [1, 2, 3])
def test_message_padded_to_a_multiple_of_four(extra: int) -> None:
    """Up to three bytes behind the message are padding."""
    data = cdr(imu())
    assert imu_decoder().one(data + bytes(extra)) == imu_decoder().one(data)


def test_longer_than_its_type_is_another_type() -> None:
    """Four bytes too many are not padding: the message is of another type."""
    with pytest.raises(BadSample, match='end at byte'):
        imu_decoder().one(cdr(imu()) + bytes(4))


def test_error_says_which_field() -> None:
    """The sentence names the field in which the message breaks."""
    with pytest.raises(BadSample, match=r'name\[1\]'):
        joint_state_decoder().one(cdr(joint_state(names=('arm', 'hand')))[:38])


def test_array_of_another_length_than_names() -> None:
    """Three positions for two names are malformed, not cut to fit."""
    message = joint_state(names=('a', 'b'), arrays=((1, 2, 3), (), ()))
    with pytest.raises(BadSample, match='position: expected 2 values'):
        joint_state_decoder().one(cdr(message))


def test_positions_without_names() -> None:
    """A driver that leaves the names out is told that they are empty."""
    message = joint_state(names=(), arrays=((1, 2), (), ()))
    with pytest.raises(BadSample, match='the names are empty, but there are 2 positions'):
        joint_state_decoder().one(cdr(message))


@pytest.mark.parametrize('effort', [(), (5.0,), (5.0, 6.0), (5.0, 6.0, 7.0)])
@pytest.mark.parametrize('velocity', [(), (3.0,), (3.0, 4.0), (3.0, 4.0, 5.0)])
def test_rates_and_efforts_that_are_not_one_a_name_count_as_not_given(
    velocity: tuple[float, ...], effort: tuple[float, ...]
) -> None:
    """The positions are whole and stay; the two ways of decoding agree."""
    data = cdr(joint_state(names=('a', 'b'), arrays=((1.0, 2.0), velocity, effort)))
    sample = joint_state_decoder().one(data)
    assert sample.position == (1.0, 2.0)
    assert sample.velocity == (velocity if len(velocity) == 2 else ())
    assert sample.effort == (effort if len(effort) == 2 else ())


def test_huge_counts_do_not_allocate() -> None:
    """A message that claims four thousand million names is refused at once."""
    data = bytearray(cdr(joint_state(names=('a',), arrays=((1,), (), ()))))
    struct.pack_into('<I', data, 20, 0xFFFFFFFF)
    with pytest.raises(BadSample, match='name'):
        joint_state_decoder().one(bytes(data))


def test_texts_that_never_repeat_do_not_fill_memory() -> None:
    """A publisher with a new frame in every message does not make the decoder grow for ever."""
    decoder = imu_decoder()
    for i in range(2000):
        decoder.one(cdr(imu(frame_id=f'frame{i}')))
    assert sum(len(known) for known in decoder._known.values()) <= 256


@given(joint_states())
def test_joint_state_encoding_equals_rosbags(message: Any) -> None:
    """Our serialisation of a joint state is rosbags' byte for byte."""
    stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec % 10**9
    message.header.stamp.nanosec %= 10**9
    arrays = [a.tolist() for a in (message.position, message.velocity, message.effort)]
    ours_ = joint_state_cdr(stamp, message.header.frame_id, message.name, *arrays)
    assert ours_ == cdr(message)


@given(st.lists(st.floats(allow_nan=False), min_size=37, max_size=37), st.text('ab/', max_size=5))
def test_imu_encoding_equals_rosbags(v: list[float], frame_id: str) -> None:
    """Our serialisation of an IMU message is rosbags' byte for byte."""
    covariances = (v[4:13], v[16:25], v[28:37])
    data = imu_cdr(10**9 + 2, frame_id, v[0:4], v[13:16], v[25:28], covariances)
    assert data == cdr(imu((1, 2), frame_id, v))


def test_payload_encoding_equals_rosbags() -> None:
    """Our serialisation of a payload is rosbags' byte for byte."""
    assert inertia_cdr(10**9 + 2, 'grip', 0.0, [1, 2, 3], [4, 5, 6, 7, 8, 9]) == cdr(inertia())


def test_wrong_number_of_values_is_refused() -> None:
    """A quaternion of three values is refused, not sent."""
    with pytest.raises(ValueError, match='expected 4 values, got 3'):
        imu_cdr(0, '', [0, 0, 1], [0, 0, 0], [0, 0, 0])


def test_kinds_name_their_types() -> None:
    """The IMU kind's type is the name that bags use."""
    assert ours.IMU.type == IMU
