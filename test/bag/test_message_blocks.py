"""Serialised messages many at a time: nothing but what one message after another gives."""

import heapq
import io
from collections.abc import Iterator
from operator import itemgetter
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.bag.blocks import Block, Message, block_of, joined, merged
from ugv_acceptance.bag.encode import JointStateBytes
from ugv_acceptance.bag.mcap_writer import Compression, McapWriter

messages = st.tuples(
    st.integers(0, 12), st.integers(0, 3), st.integers(1, 3), st.binary(max_size=5)
)
streams = st.lists(st.lists(st.lists(messages, max_size=6), max_size=5), max_size=4)


@given(streams)
def test_streams_are_merged_as_their_messages_are(given_: list[list[list[Message]]]) -> None:
    """In the order of heapq.merge: by log time, an earlier stream first, a late message at once."""
    flat = [[message for part in stream for message in part] for stream in given_]
    wanted = list(heapq.merge(*flat, key=itemgetter(0)))
    blocks = merged([[block_of(part) for part in stream] for stream in given_])
    assert [message for block in blocks for message in block.messages()] == wanted


@given(st.lists(st.lists(messages, max_size=5), min_size=1, max_size=4), st.randoms())
def test_blocks_keep_their_messages(parts: list[list[Message]], random: Random) -> None:
    """Joined, put in another order, cut and packed, each message keeps its own content."""
    flat = [message for part in parts for message in part]
    order = list(range(len(flat)))
    random.shuffle(order)
    block = joined([block_of(part) for part in parts]).take(np.array(order, np.int64))
    wanted = [flat[k] for k in order]
    assert list(block.messages()) == list(block.packed().messages()) == wanted
    assert list(block.take(slice(1, 3)).packed().messages()) == wanted[1:3]


sizes = st.sampled_from([0, 1, 7, 40])
records = st.tuples(st.integers(0, 2**63 - 1), st.integers(0, 9), st.integers(1, 3), sizes)


@pytest.mark.parametrize('compression', ['zstd', ''])
@given(st.lists(st.lists(records, max_size=12), max_size=4), st.integers(1, 300))
def test_many_messages_are_written_as_one_after_another(
    compression: Compression, made: list[list[tuple[int, int, int, int]]], full: int
) -> None:
    """The same file, byte by byte: records, sequence numbers, ends of chunks, indexes, summary."""
    parts = [
        [
            (time, sent, channel, bytes([k]) * size)
            for k, (time, sent, channel, size) in enumerate(p)
        ]
        for p in made
    ]
    files = []
    for together in (True, False):
        file = io.BytesIO()
        writer = McapWriter(file, 'test', compression)
        for topic in 'abc':
            writer.channel(topic, 'a/msg/B', 'int32 x', {})
        for part in parts:
            if together:
                writer.messages(block_of(part), full)
                continue
            for log_time, published, channel, data in part:
                writer.message(channel, log_time, data, published)
                if writer.pending is not None and writer.pending[0] >= full:
                    writer.end_chunk()
        writer.finish()
        files.append(file.getvalue())
    assert files[0] == files[1]


@given(
    st.lists(
        st.tuples(st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1), st.floats(), st.floats()),
        max_size=20,
    )
)
def test_a_table_of_joint_states_has_the_bytes_of_each(
    rows: list[tuple[int, float, float]],
) -> None:
    """Stamp, positions and efforts of each row as in a message of its own."""
    template = JointStateBytes(('a', 'bc'), 'base')
    stamp = np.array([row[0] for row in rows], np.int64)
    position = np.array([(row[1], 0.5) for row in rows], np.float64).reshape(-1, 2)
    effort = np.array([(-0.0, row[2]) for row in rows], np.float64).reshape(-1, 2)
    table = template.table(stamp, position, effort)
    for k in range(len(rows)):
        one = template.fill(int(stamp[k]), position[k].tolist(), effort[k].tolist())
        assert table[k].tobytes() == one


def test_a_stream_is_not_read_on_before_it_is_needed() -> None:
    """What comes before all that is known of the others is given before they are read on."""
    read: list[int] = []

    def stream(number: int, parts: list[list[int]]) -> Iterator[Block]:
        for part in parts:
            read.append(number)
            yield block_of([(time, time, 1, b'') for time in part])

    found = merged([stream(0, [[1, 2], [3, 4], [90, 91]]), stream(1, [[2, 50], [60, 61]])])
    assert next(found).log_time.tolist() == [1]
    assert next(found).log_time.tolist() == [2, 2, 3]
    assert read == [0, 1, 0]
