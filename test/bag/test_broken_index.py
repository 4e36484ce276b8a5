"""Summaries, chunks and message indexes that are wrong: every message is found all the same."""

import os
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bag.bag_cases import IMU, Message, expected, rows, run, write_mcap
from bag.recordings import BOTH, SHAPES, chunk_starts, damaged, read
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.summary import Summary
from mcap.writer import CompressionType

from ugv_acceptance.bag.chunks import indexed, walk
from ugv_acceptance.bag.mcap_index import MAGIC
from ugv_acceptance.bag.raw import messages as raw_messages
from ugv_acceptance.bag.reader import open_bag

WRITTEN: list[Message] = run(60)
GARBLED = b'\x03' + struct.pack('<Q', 3) + b'\xff\xff\xff'


def with_summary(
    path: Path, edit: Callable[[Summary], object], extra: bytes = b'', start: int | None = None
) -> Path:
    """The file with its summary edited, `extra` bytes behind it; `start`: what the footer says."""
    with path.open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    edit(summary)
    held: list[records.McapRecord] = [*summary.schemas.values(), *summary.channels.values()]
    held += summary.chunk_indexes
    held += [summary.statistics] if summary.statistics else []
    builder = RecordBuilder()
    for record in held:
        record.write(builder)
    data = path.read_bytes()
    at = struct.unpack_from('<Q', data, len(data) - len(MAGIC) - 20)[0]
    footer = b'\x02' + struct.pack('<QQQI', 20, at if start is None else start, 0, 0) + MAGIC
    body = bytes(builder.end())  # type: ignore[no-untyped-call]
    path.write_bytes(data[:at] + body + extra + footer)
    return path


def counts(summary: Summary) -> records.Statistics:
    """The statistics of a summary, which has some."""
    assert summary.statistics is not None
    return summary.statistics


def drop_a_chunk(summary: Summary) -> None:
    """Lose the entry of a chunk."""
    summary.chunk_indexes.pop()


def same_chunk_twice(summary: Summary) -> None:
    """Two entries for one place."""
    one, other, *_ = summary.chunk_indexes
    other.chunk_start_offset = one.chunk_start_offset


def longer_chunk(summary: Summary) -> None:
    """A length that the chunk does not have."""
    summary.chunk_indexes[-1].chunk_length -= 1


WRONG: dict[str, tuple[Callable[[Summary], object], str]] = {
    'a chunk too few': (drop_a_chunk, 'its summary lists'),
    'a chunk twice': (same_chunk_twice, 'inside another or outside the file'),
    'a length': (longer_chunk, 'the index says'),
    'no chunks': (lambda s: s.chunk_indexes.clear(), ''),
    'counts not by channel': (lambda s: counts(s).channel_message_counts.clear(), ''),
    'no channels': (lambda s: s.channels.clear(), ''),
    'no schemas': (lambda s: s.schemas.clear(), ''),
}


@pytest.mark.parametrize('name', WRONG)
def test_a_wrong_summary_is_found_out(tmp_path: Path, name: str) -> None:
    """A summary that contradicts the file is a finding, and the file is scanned instead."""
    edit, finding = WRONG[name]
    bag, batches, _ = read(with_summary(write_mcap(tmp_path / 'run.mcap', WRITTEN), edit))
    assert rows(batches) == expected(WRITTEN)
    assert [finding in text for text in bag.findings] == ([True] if finding else [])


def test_numbers_of_the_statistics_are_compared(tmp_path: Path) -> None:
    """A total that is not the sum of the channels is a finding; the messages are all read."""
    path = write_mcap(tmp_path / 'run.mcap', WRITTEN)
    with_summary(path, lambda s: setattr(counts(s), 'message_count', 7))
    bag, batches, _ = read(path)
    assert rows(batches) == expected(WRITTEN)
    assert bag.findings == ('run.mcap: statistics: 7 messages in all, 120 in its channels',)


@pytest.mark.parametrize('kind', [3, 4])
def test_a_garbled_definition_spoils_no_other(tmp_path: Path, kind: int) -> None:
    """A schema or channel that cannot be parsed is a finding beside all the messages."""
    garbled = bytes([kind]) + GARBLED[1:]
    path = with_summary(write_mcap(tmp_path / 'run.mcap', WRITTEN), lambda _: None, garbled)
    bag, batches, _ = read(path)
    assert rows(batches) == expected(WRITTEN)
    assert ['damaged record' in text for text in bag.findings] == [True]


@pytest.mark.parametrize(
    ('extra', 'finding'),
    [
        (b'\x08' + GARBLED[1:], 'chunk index: damaged record'),
        (b'\x0b' + GARBLED[1:], 'statistics: damaged record'),
        (b'\x0c' + struct.pack('<Q', 1 << 40), 'its summary is truncated'),
    ],
)
def test_a_garbled_summary_is_scanned(tmp_path: Path, extra: bytes, finding: str) -> None:
    """A summary that cannot be parsed makes nothing lost, and the finding says why."""
    path = with_summary(write_mcap(tmp_path / 'run.mcap', WRITTEN), lambda _: None, extra)
    bag, batches, _ = read(path)
    assert rows(batches) == expected(WRITTEN)
    assert [f'scanned from its start because {finding}' in text for text in bag.findings] == [True]


@pytest.mark.parametrize('start', [3, 1 << 50])
def test_a_footer_that_points_nowhere(tmp_path: Path, start: int) -> None:
    """A summary said to lie before or behind the file is not looked for."""
    path = write_mcap(tmp_path / 'run.mcap', WRITTEN)
    bag, batches, _ = read(with_summary(path, lambda _: None, start=start))
    assert rows(batches) == expected(WRITTEN)
    assert f'its footer points to byte {start} of' in bag.findings[0]


def test_message_indexes_elsewhere_are_not_used(tmp_path: Path) -> None:
    """Message indexes said to lie outside their place: the chunk is walked, nothing is lost."""
    path = write_mcap(tmp_path / 'run.mcap', WRITTEN)
    with_summary(path, lambda s: s.chunk_indexes[0].message_index_offsets.update({1: 8}))
    bag, batches, facts = read(path)
    assert rows(batches) == expected(WRITTEN)
    assert (bag.findings, facts.findings) == ((), ())


def test_a_message_index_of_another_channel_is_not_believed(tmp_path: Path) -> None:
    """A message index that names another channel is found out and the records are walked."""
    path = write_mcap(tmp_path / 'run.mcap', WRITTEN, chunk_size=1 << 20)
    data = path.read_bytes()
    index = chunk_starts(data)[0]
    index += 9 + struct.unpack_from('<Q', data, index + 1)[0]
    damaged(path, index + 9, b'\x63')
    _, batches, facts = read(path)
    assert rows(batches) == expected(WRITTEN)
    assert any('message index are wrong' in text for text in facts.findings)


@pytest.mark.parametrize('edit', ['left out', 'of each other'])
def test_serialised_messages_do_not_hang_on_a_message_index(tmp_path: Path, edit: str) -> None:
    """Where an index leaves a message out, or has one of another channel, each is found once."""
    path = write_mcap(tmp_path / 'run.mcap', WRITTEN)
    # The second chunk, for the first has definitions as well.
    data, at, entries = path.read_bytes(), chunk_starts(path.read_bytes())[1], list[int]()
    for _ in range(3):  # the chunk, and the indexes of two channels
        if data[at] == 7:
            entries.append(at + 15)
        at += 9 + struct.unpack_from('<Q', data, at + 1)[0]
    one, other = entries
    if edit == 'left out':
        damaged(path, one + 24, data[one + 8 : one + 16])
    else:
        damaged(path, one + 24, data[other + 24 : other + 32])
        damaged(path, other + 24, data[one + 24 : one + 32])
    bag = open_bag(path)
    found = [(m.topic, m.log_time, m.data) for m in raw_messages(bag, bag.topics)]
    assert sorted(found) == sorted((topic, time, data) for topic, _, time, data in WRITTEN)


@pytest.mark.parametrize(
    ('shape', 'finding'),
    [
        ('zstd', 'bytes unpacked, got'),
        ('lz4', 'bytes unpacked, got'),
        ('uncompressed', 'bytes of records, got'),
        ('no message indexes', 'bytes unpacked, got'),
    ],
)
def test_a_chunk_of_another_size_than_it_says(tmp_path: Path, shape: str, finding: str) -> None:
    """A chunk of another size than it states is left out with a finding; the others are read."""
    path = write_mcap(tmp_path / 'run.mcap', WRITTEN, **SHAPES[shape])
    start = chunk_starts(path.read_bytes())[1]
    size = struct.unpack_from('<Q', path.read_bytes(), start + 25)[0]
    damaged(path, start + 25, struct.pack('<Q', size + 1))
    bag, batches, facts = read(path)
    found = rows(batches)
    assert 0 < len(found) < len(WRITTEN)
    assert finding in facts.findings[0]
    raw = list(raw_messages(bag, bag.topics))
    assert [message.log_time for message in raw] == sorted(time for time, _ in found)


def test_a_scan_leaves_out_what_it_cannot_unpack(tmp_path: Path) -> None:
    """Without an index, a chunk that is broken or claims too much loses itself alone."""
    path = write_mcap(tmp_path / 'run.mcap', WRITTEN, **SHAPES['no chunk indexes'])
    starts = chunk_starts(path.read_bytes())
    damaged(path, starts[0] + 33, b'\x01\x02\x03\x04')  # its checksum
    damaged(path, starts[1] + 25, struct.pack('<Q', 1 << 40))
    bag, batches, _ = read(path)
    found = rows(batches)
    assert 0 < len(found) < len(WRITTEN)
    assert set(found) < set(expected(WRITTEN))
    assert bag.findings[0].startswith(f'run.mcap: chunk at byte {starts[0]} not used: its checksum')
    assert bag.findings[1].startswith(f'run.mcap: chunk at byte {starts[1]} not read: it claims')


def test_a_scan_says_where_the_records_of_a_chunk_break(tmp_path: Path) -> None:
    """A scan keeps the messages before a break in a chunk, and tells where it is."""
    options = {**SHAPES['no chunk indexes'], 'compression': CompressionType.NONE}
    path = write_mcap(tmp_path / 'run.mcap', WRITTEN, enable_crcs=False, **options)
    start = chunk_starts(path.read_bytes())[1]
    damaged(path, path.read_bytes().index(b'\x05', start + 1500), bytes(9))
    bag, batches, _ = read(path)
    found = rows(batches)
    assert 0 < len(found) < len(WRITTEN)
    assert set(found) < set(expected(WRITTEN))
    assert f'chunk at byte {start}: damaged at byte' in bag.findings[0]


def test_a_scan_passes_a_record_that_is_too_big(tmp_path: Path) -> None:
    """A message above the limit is left out with its size; those behind it are read."""
    written = [*WRITTEN[:3], ('/big', IMU, WRITTEN[3][2], bytes(1_200_000)), *WRITTEN[3:]]
    path = write_mcap(tmp_path / 'run.mcap', written, use_chunking=False)
    bag, batches, _ = read(path, max_chunk_bytes=1 << 14)
    assert rows(batches) == expected(WRITTEN)
    assert 'record of 1200031 bytes at byte' in bag.findings[0]


def test_a_file_cut_off_while_it_is_read(tmp_path: Path) -> None:
    """A file truncated while it is read gives a finding for every chunk that is gone."""
    path = write_mcap(tmp_path / 'run.mcap', WRITTEN)
    bag = open_bag(path)
    os.truncate(path, chunk_starts(path.read_bytes())[1] + 50)
    reading = bag.batches(BOTH)
    found = rows(reading)
    assert 0 < len(found) < len(WRITTEN)
    assert 'bytes of the file, got 50' in reading.facts.findings[0]


def test_findings_are_not_without_end(tmp_path: Path) -> None:
    """Of very many findings the first are listed, with the number of the others."""
    path = write_mcap(tmp_path / 'run.mcap', run(150), chunk_size=1)
    data = bytearray(path.read_bytes())
    for start in chunk_starts(data):
        data[start + 33 : start + 37] = b'\x01\x02\x03\x04'  # its checksum
    path.write_bytes(data)
    _, batches, facts = read(path)
    assert rows(batches) == []
    # 300 chunks, and both topics of which the index counts more than was read.
    assert facts.findings[-1] == 'and 102 more findings of this kind'
    assert len(facts.findings) == 201


def test_a_walk_ends_at_a_message_without_a_head() -> None:
    """A message record too short for its own head is no message; nothing behind it is believed."""
    whole = b'\x05' + struct.pack('<Q', 22) + bytes(22)
    walked = walk(memoryview(whole + b'\x05' + struct.pack('<Q', 5) + bytes(5) + whole))
    assert (walked.stop, walked.whole) == (31, False)
    assert walked.messages[0].tolist() == [0]


def test_a_walk_passes_an_empty_record_at_the_end() -> None:
    """A record of a kind we do not know may be empty and last."""
    walked = walk(memoryview(b'\x80' + bytes(8)))
    assert (walked.stop, walked.whole) == (9, True)


def index_of(channel: int, offsets: list[int], size: int | None = None) -> bytes:
    """A MessageIndex record; `size`: what it says its entries take."""
    entries = b''.join(struct.pack('<QQ', 1, at) for at in offsets)
    said = len(entries) if size is None else size
    return b'\x07' + struct.pack('<QHI', 6 + max(said, 0), channel, said) + entries


@pytest.mark.parametrize(
    'data',
    [b'\x07', index_of(4, [1, 2]), index_of(3, [1], 15), b'\x08' + index_of(3, [1])[1:]],
)
def test_what_is_no_message_index(data: bytes) -> None:
    """A message index that is truncated, of another channel or kind, or misfit is not used."""
    assert indexed(data, 3) is None


def test_a_message_index_that_says_more_than_there_is() -> None:
    """A message index longer than its record gives no entries beyond it."""
    assert indexed(index_of(3, [1], 32), 3) is None


def test_entries_of_a_message_index_come_in_order() -> None:
    """Entries of a message index that are unsorted, repeated or negative are corrected."""
    found = indexed(index_of(3, [70, 8, 8, (1 << 64) - 1]), 3)
    assert found is not None
    assert np.array_equal(found, [8, 70])
