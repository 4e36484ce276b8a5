"""A recording of many files: split as rosbag2 does, or recorded side by side."""

from collections.abc import Callable
from pathlib import Path

import pytest
from bag.bag_cases import JOINT_STATE, run, write_mcap
from bag.recordings import write_other
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.bag.annotated import write_annotated
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import Bag, choose_topics, open_bag

FILES = 24
Reading = Callable[[Bag, Path], list[int]]


def open_files() -> int:
    """How many files this process has open."""
    return len(list(Path('/proc/self/fd').iterdir()))


def columns(bag: Bag, _: Path) -> list[int]:
    """Files open after each batch of an evaluation's inputs."""
    return [open_files() for _ in bag.batches(choose_topics(bag))]


def single(bag: Bag, _: Path) -> list[int]:
    """Files open after each message."""
    return [open_files() for _ in messages(bag, bag.topics)]


def copied(bag: Bag, folder: Path) -> list[int]:
    """Files open after each part of an annotated copy."""
    found: list[int] = []
    write_annotated(folder / 'out.mcap', bag, {}, [], lambda _: found.append(open_files()))
    return found


@pytest.mark.parametrize('suffix', ['mcap', 'db3'])
@pytest.mark.parametrize('reading', [columns, single, copied])
def test_few_files_are_open_at_a_time(tmp_path: Path, reading: Reading, suffix: str) -> None:
    """However many files a recording was split into, few are open: a process may have 1024."""
    written, paths = run(10 * FILES), []
    for k in range(FILES):
        paths.append(tmp_path / f'run_{k}.{suffix}')
        part = written[20 * k : 20 * (k + 1)]
        (write_mcap if suffix == 'mcap' else write_other)(paths[-1], part)
    bag, before = open_bag(paths), open_files()
    found = reading(bag, tmp_path)
    assert len(found) >= FILES
    # The copy itself, a file, and the next one where both are compared.
    assert max(found) <= before + 3
    assert open_files() == before


@pytest.mark.parametrize('workers', [1, 2])
def test_a_reading_that_is_given_up_leaves_no_file_open(tmp_path: Path, workers: int) -> None:
    """Closed after its first batch, it has closed its files."""
    bag, before = open_bag(write_mcap(tmp_path / 'run.mcap', run(2000))), open_files()
    for _ in range(20):
        reading = bag.batches(choose_topics(bag), workers=workers)
        next(reading)
        reading.close()
        assert open_files() == before


parts = st.lists(st.lists(st.integers(0, 30), min_size=1, max_size=5), min_size=1, max_size=6)


@given(parts)
def test_files_side_by_side_give_their_messages_in_order(
    tmp_path_factory: pytest.TempPathFactory, made: list[list[int]]
) -> None:
    """In order of log time, each of them once."""
    folder, paths = tmp_path_factory.mktemp('parts'), []
    for k, times in enumerate(made):
        paths.append(folder / f'{k}.mcap')
        content = b'\0\1\0\0' + k.to_bytes(4, 'little')
        write_mcap(paths[-1], [('/a', JOINT_STATE, 1 + time, content) for time in sorted(times)])
    found = [(m.log_time, m.data[4]) for m in messages(open_bag(paths), ['/a'])]
    assert sorted(found) == sorted((1 + t, k) for k, times in enumerate(made) for t in times)
    assert [time for time, _ in found] == sorted(time for time, _ in found)
