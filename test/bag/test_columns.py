"""Whole chunks to columns: regular or not, the same numbers in the same order as one by one."""

import struct
from typing import Any

import numpy as np
import zstandard
from bag.bag_cases import cdr, imus, joint_state, joint_states, numbers, rows
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance import BadSample
from ugv_acceptance.bag import cdr as kinds
from ugv_acceptance.bag.columns import ColumnDecoder, Decoded, batch
from ugv_acceptance.bag.gather import LEAD, SLACK, Bytes, Offsets

CHANNEL = 3


def chunk(messages: list[bytes], channel: int = CHANNEL) -> tuple[Bytes, int, Offsets]:
    """Message records one behind the other, each logged at its place in the list."""
    out, offsets = bytearray(LEAD), []
    for place, data in enumerate(messages):
        offsets.append(len(out) - LEAD)
        out += struct.pack('<BQHIQQ', 5, 22 + len(data), channel, place, place, place) + data
    size = len(out) - LEAD
    return np.frombuffer(bytes(out) + bytes(SLACK), np.uint8), size, np.array(offsets, np.int64)


def decoded_rows(decoded: Decoded) -> list[Any]:
    """The numbers of what was decoded, by log time."""
    return rows([batch(decoded.columns)])


@given(st.lists(joint_states(), min_size=1, max_size=4), st.lists(st.integers(0, 3), max_size=40))
def test_mixed_joint_states_equal_rosbags(pool: list[Any], picks: list[int]) -> None:
    """Messages of several layouts, mixed, give what rosbags gives, in the same order."""
    messages = [pool[i % len(pool)] for i in picks]
    decoder = ColumnDecoder(kinds.JOINT_STATE, CHANNEL)
    wanted = [(i, numbers(message)) for i, message in enumerate(messages)]
    for _ in range(2):  # the second time all layouts are known
        found = decoder.records(*chunk([cdr(message) for message in messages]))
        assert decoded_rows(found) == wanted
        assert (found.count, found.malformed, found.broken) == (len(messages), 0, 0)


@given(st.lists(st.tuples(imus(), st.booleans()), min_size=1, max_size=12))
def test_imus_of_either_byte_order_equal_rosbags(messages: list[tuple[Any, bool]]) -> None:
    """IMU messages of both byte orders and any frames give what rosbags gives."""
    found = ColumnDecoder(kinds.IMU, CHANNEL).records(
        *chunk([cdr(message, little=little) for message, little in messages])
    )
    assert decoded_rows(found) == [(i, numbers(m)) for i, (m, _) in enumerate(messages)]


@given(
    st.lists(st.integers(0, 5), min_size=1, max_size=30),
    st.integers(0, 10**4),
    st.integers(0, 255),
)
def test_columns_equal_one_by_one_whatever_is_damaged(
    picks: list[int], place: int, value: int
) -> None:
    """With a byte changed anywhere, columns and `one` agree on every number and every refusal."""
    pool = [
        joint_state((i, 0), 'f' * (i % 2), ('a', 'b' * i), ((i, 2), (), (i, 4))) for i in range(6)
    ]
    messages = [bytearray(cdr(pool[i])) for i in picks]
    victim = messages[place % len(messages)]
    victim[place % len(victim)] = value
    one = kinds.joint_state_decoder()
    wanted, refused = [], 0
    for i, data in enumerate(messages):
        try:
            s = one.one(bytes(data))
        except BadSample:
            refused += 1
            continue
        arrays = (np.array(a).tobytes() for a in (s.position, s.velocity, s.effort))
        wanted.append((i, (s.stamp, s.names, *arrays)))
    decoder = ColumnDecoder(kinds.JOINT_STATE, CHANNEL)
    decoder.records(*chunk([cdr(message) for message in pool]))
    found = decoder.records(*chunk([bytes(m) for m in messages]))
    assert decoded_rows(found) == wanted
    assert found.malformed == refused


def test_same_names_are_one_group() -> None:
    """Messages that differ in what columns do not hold (the frame) share columns, in file order."""
    messages = [cdr(joint_state((i, 0), 'frame' * (i % 3))) for i in range(9)]
    found = ColumnDecoder(kinds.JOINT_STATE, CHANNEL).records(*chunk(messages))
    assert [c.log_time.tolist() for c in found.columns] == [list(range(9))]


def test_a_name_never_repeated_is_still_right() -> None:
    """More layouts than are tried a chunk fall back to one by one and lose nothing."""
    messages = [joint_state(names=(f'joint{i}', 'x')) for i in range(40)]
    found = ColumnDecoder(kinds.JOINT_STATE, CHANNEL).records(*chunk([cdr(m) for m in messages]))
    assert decoded_rows(found) == [(i, numbers(m)) for i, m in enumerate(messages)]


def test_dirty_padding_stays_regular() -> None:
    """Padding with other content is the same layout, so no message needs the slow way."""
    clean = cdr(joint_state(names=('ab', 'c'), frame_id='f'))
    dirty = bytearray(clean)
    dirty[18:20] = b'\xfe\xff'
    decoder = ColumnDecoder(kinds.JOINT_STATE, CHANNEL)
    found = decoder.records(*chunk([clean, bytes(dirty)] * 5))
    assert len(decoder._plans) == 1
    assert found.count == 10


def test_message_compression_is_undone() -> None:
    """Messages that rosbag2 compressed one by one are unpacked."""
    data = cdr(joint_state())
    packed = zstandard.ZstdCompressor().compress(data)
    found = ColumnDecoder(kinds.JOINT_STATE, CHANNEL).records(*chunk([packed, data]))
    assert (found.count, found.malformed) == (2, 0)


def test_broken_message_compression_is_malformed() -> None:
    """A compressed message that cannot be unpacked is counted, with the reason."""
    packed = zstandard.ZstdCompressor().compress(cdr(joint_state()))[:-3]
    found = ColumnDecoder(kinds.JOINT_STATE, CHANNEL).records(*chunk([packed]))
    assert (found.count, found.malformed) == (0, 1)
    assert 'zstd' in found.reason


def test_entries_of_another_channel_are_broken() -> None:
    """Index entries that point to messages of another channel, or nowhere, give no message."""
    buffer, size, offsets = chunk([cdr(joint_state())] * 3, channel=9)
    found = ColumnDecoder(kinds.JOINT_STATE, CHANNEL).records(buffer, size, offsets)
    assert (found.count, found.broken) == (0, 3)


@given(st.lists(st.integers(0, 2**40), max_size=20, unique=True))
def test_any_offsets_are_harmless(places: list[int]) -> None:
    """Offsets that point anywhere never raise and never invent a message."""
    messages = [cdr(joint_state((i, 0))) for i in range(5)]
    buffer, size, true = chunk(messages)
    decoder = ColumnDecoder(kinds.JOINT_STATE, CHANNEL)
    decoder.records(buffer, size, true)
    offsets = np.unique(np.concatenate((np.array(places, np.int64) % (2 * size), true[1:3])))
    found = decoder.records(buffer, size, offsets)
    assert found.count + found.broken + found.malformed == len(offsets)
    assert found.count == len(set(offsets.tolist()) & set(true.tolist()))
