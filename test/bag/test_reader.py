"""Recordings of every shape: what was written is what is read, in order, and nothing is hidden."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from bag.bag_cases import (
    IMU,
    JOINT_STATE,
    Message,
    cdr,
    expected,
    joint_state,
    rows,
    run,
    write_mcap,
)
from bag.recordings import BOTH, SHAPES, read
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ugv_acceptance.bag.reader import Topics, choose_topics, open_bag


@pytest.mark.parametrize('shape', SHAPES)
@pytest.mark.parametrize('workers', [1, 2])
def test_every_shape_of_mcap(tmp_path: Path, shape: str, workers: int) -> None:
    """However the file is built, the messages are those that rosbags decodes, in order."""
    messages = run(60)
    path = write_mcap(tmp_path / 'run.mcap', messages, **SHAPES[shape])
    bag = open_bag(path)
    reading = bag.batches(choose_topics(bag), workers=workers)
    assert rows(reading) == expected(messages)
    assert reading.facts.counts == {'/joint_states': 60, '/imu/data': 60}
    assert bag.findings == reading.facts.findings == ()
    assert reading.facts.complete


def test_facts_of_a_bag(tmp_path: Path) -> None:
    """Span, counts, types and hash are those of the file."""
    path = write_mcap(tmp_path / 'run.mcap', run(50))
    bag = open_bag(path)
    assert (bag.start_ns, bag.end_ns) == (10**9, 10**9 + 49 * 10**7 + 10**6)
    assert bag.duration_s == pytest.approx(0.491)
    assert {n: (t.type, t.count) for n, t in bag.topics.items()} == {
        '/joint_states': (JOINT_STATE, 50),
        '/imu/data': (IMU, 50),
    }
    assert bag.sha256() == hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize('protected', ['all', 'none'])
def test_protected_says_whether_chunks_carry_checksums(tmp_path: Path, protected: str) -> None:
    """Chunks with checksums are protected, those without are not."""
    path = write_mcap(tmp_path / 'run.mcap', run(30), enable_crcs=protected == 'all')
    assert open_bag(path).protected == protected


def test_parts_are_one_recording(tmp_path: Path) -> None:
    """Several files, given in any order, are read in log time order; some without checksums."""
    messages = run(90)
    first = write_mcap(tmp_path / 'a.mcap', messages[:70])
    second = write_mcap(tmp_path / 'b.mcap', messages[70:], enable_crcs=False)
    bag, batches, _ = read([second, first])
    assert rows(batches) == expected(messages)
    assert bag.protected == 'part'
    digests = [hashlib.sha256(p.read_bytes()).digest() for p in (second, first)]
    assert bag.sha256() == hashlib.sha256(b''.join(digests)).hexdigest()


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    max_examples=30,
)
@given(order=st.permutations(range(40)), chunk=st.sampled_from([1, 1000, 5000, 10**6]))
def test_batches_follow_each_other(tmp_path: Path, order: list[int], chunk: int) -> None:
    """However log times jump in the file, no batch begins before the one before it ends."""
    messages: list[Message] = [
        ('/joint_states', JOINT_STATE, 10**6 * i, cdr(joint_state((i, 0)))) for i in order
    ]
    path = write_mcap(tmp_path / 'run.mcap', messages, chunk_size=chunk)
    bag = open_bag(path)
    reading = bag.batches(Topics('/joint_states', None, None))
    last = -1
    seen: list[int] = []
    for batch in reading:
        times = np.concatenate([c.log_time for c in batch.joints])
        assert times.min() >= last
        last = int(times.max())
        seen += times.tolist()
    assert sorted(seen) == sorted(m[2] for m in messages)
    assert reading.facts.late == 0


def test_closing_early_ends_the_threads(tmp_path: Path) -> None:
    """A reader that stops half way can give back its threads and files."""
    reading = open_bag(write_mcap(tmp_path / 'run.mcap', run(400))).batches(BOTH, workers=2)
    next(reading)
    reading.close()
    assert list(reading) == []
    assert not reading.facts.complete
