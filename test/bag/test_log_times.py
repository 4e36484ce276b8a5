"""When messages were logged: rates, gaps and steps back, the same from an index and from a walk."""

from pathlib import Path

import numpy as np
import pytest
from bag.bag_cases import run, write_mcap
from bag.recordings import SHAPES, write_folder
from made.run import EPOCH, NS
from rosbags.rosbag2 import StoragePlugin

from ugv_acceptance.bag.log_times import LogTimes, log_times_of
from ugv_acceptance.bag.reader import choose_topics, open_bag


@pytest.mark.parametrize('shape', [*SHAPES, 'sqlite3'])
def test_every_form_of_a_file_tells_the_same_times(shape: str, tmp_path: Path) -> None:
    """With or without message indexes, chunks or a summary: count, first, last and longest gap."""
    written = run(50)
    if shape == 'sqlite3':
        path = write_folder(tmp_path / 'run', written, StoragePlugin.SQLITE3)
    else:
        path = write_mcap(tmp_path / 'run.mcap', written, **SHAPES[shape])
    found = log_times_of(open_bag(path))
    for topic in {topic for topic, _, _, _ in written}:
        times = np.array([time for name, _, time, _ in written if name == topic])
        of = found[topic]
        assert (of.count, of.first, of.last) == (len(times), times.min(), times.max())
        assert of.gap == np.diff(times).max()


def test_a_gap_across_two_parts_is_found_where_it_begins() -> None:
    """Times come chunk by chunk; the silence may lie between two of them."""
    found = LogTimes()
    found.take(np.arange(10) * NS // 100 + EPOCH)
    found.take(np.arange(10) * NS // 100 + EPOCH + 3 * NS)
    assert found.gap == 3 * NS - 9 * NS // 100
    assert found.gap_from == EPOCH + 9 * NS // 100
    assert found.rate == pytest.approx(100.0)


def test_a_clock_that_was_set_back_is_no_gap() -> None:
    """How far log times go back is told apart, and the first and last are those in time."""
    found = LogTimes()
    found.take(np.array([0, 1, 2, 3, 4]) * NS + EPOCH)
    found.take(np.array([2, 3]) * NS + EPOCH)
    assert (found.backwards, found.gap) == (2 * NS, NS)
    assert (found.first, found.last) == (EPOCH, EPOCH + 4 * NS)


def test_one_message_has_no_rate() -> None:
    """Nor a gap."""
    found = LogTimes()
    found.take(np.array([EPOCH]))
    assert found.rate is None
    assert found.gap == 0


@pytest.mark.parametrize('chunk', [1, 1 << 24])
def test_a_beginning_holds_all_messages_up_to_its_end(chunk: int, tmp_path: Path) -> None:
    """And none after it, though they may be in the same chunk; nothing is said to be lost."""
    written = run(50)
    bag = open_bag(write_mcap(tmp_path / 'run.mcap', written, chunk_size=chunk))
    until = sorted(time for _, _, time, _ in written)[40]
    topics = choose_topics(bag)
    reading = bag.beginning(until).batches(topics)
    batches = list(reading)
    got = [t for b in batches for c in b.joints for t in c.log_time.tolist()]
    got += [t for b in batches for c in b.imu for t in c.log_time.tolist()]
    inputs = {topics.joint_states, topics.imu}
    assert sorted(got) == sorted(t for name, _, t, _ in written if name in inputs and t <= until)
    assert reading.facts.findings == ()
    assert bag.beginning(until).sha256() == ''
