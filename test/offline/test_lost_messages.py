"""Messages that are counted somewhere but could not be read: nobody can say what they held."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from bag.bag_cases import write_mcap
from bag.recordings import chunk_starts

from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.recording import open_recording
from ugv_acceptance.offline.evaluate import evaluate

RUN = Path(__file__).parents[2] / 'bags' / 'packbot_pass'


@pytest.fixture(scope='module')
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the run that passes, in chunks of about a tenth of a second."""
    bag = open_bag(RUN)
    types = {name: topic.type for name, topic in bag.topics.items()}
    held = [(m.topic, types[m.topic], m.log_time, m.data) for m in messages(bag, types)]
    return write_mcap(tmp_path_factory.mktemp('small') / 'run.mcap', held, chunk_size=10_000)


def test_a_whole_recording_has_lost_nothing(small: Path) -> None:
    """What is counted is read: it passes."""
    assert evaluate(small).verdict == 'PASS'


@pytest.mark.parametrize('which', [[-1], [40], [10, 60, 110]])
def test_a_damaged_chunk_is_no_pass(small: Path, tmp_path: Path, which: Sequence[int]) -> None:
    """However short it is, and though the margins of all others were kept."""
    data = bytearray(small.read_bytes())
    starts = chunk_starts(data)
    for k in which:
        data[starts[k] + 200] ^= 0x55
    (tmp_path / 'run.mcap').write_bytes(data)
    found = evaluate(tmp_path / 'run.mcap')
    assert found.verdict == 'INCONCLUSIVE'
    assert any('messages are missing' in reason for reason in found.reasons)


def test_what_metadata_counts_is_missed_where_only_the_beginning_is_read(small: Path) -> None:
    """`info` reads no more of a long recording; what comes later is not called missing."""
    recording = open_recording(small)
    bag = recording.bag.beginning(recording.bag.start_ns + 5_000_000_000)
    for more in (0, 7):
        counts = {name: topic.count + more for name, topic in bag.topics.items()}
        found = evaluate(replace(recording, bag=replace(bag, promised=counts)))
        assert found.result['bag']['lost_messages'] == more * 3  # of each input
        assert (found.verdict == 'PASS') is (more == 0)
