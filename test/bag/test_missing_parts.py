"""Parts of a split recording that are missing: told by the names of the others, and no PASS."""

from pathlib import Path

import pytest
import yaml
from bag.bag_cases import run, write_mcap

from ugv_acceptance.bag.metadata import NAME as METADATA
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.writer import BagWriter


def parts(folder: Path, *names: str) -> Path:
    """A folder with files of so many messages each; the time of each begins anew."""
    folder.mkdir(exist_ok=True)
    for count, name in enumerate(names):
        write_mcap(folder / name, run(20 + count))
    return folder


@pytest.mark.parametrize(
    ('names', 'gone'),
    [
        (('run_1.mcap', 'run_2.mcap'), 'run_0 is missing'),
        (('run_0.mcap', 'run_2.mcap'), 'run_1 is missing'),
        (('run_0.mcap', 'run_9.mcap'), 'run_1, run_2, run_3 and 5 more are missing'),
        (('day_3.mcap', 'day_4.mcap'), 'day_0, day_1, day_2 are missing'),
        (('run_7.mcap',), 'run_0, run_1, run_2 and 4 more are missing'),
    ],
)
def test_a_part_that_is_missing_is_told(names: tuple[str, ...], gone: str, tmp_path: Path) -> None:
    """The first one, or one between others: the recording is not whole."""
    found = open_bag(parts(tmp_path / 'run', *names)).salvaged
    assert found is not None
    assert gone in found


@pytest.mark.parametrize(
    'names',
    [
        ('run_0.mcap',),
        ('run_0.mcap', 'run_1.mcap'),
        ('run_10.mcap', *(f'run_{k}.mcap' for k in range(10))),
        ('day_7.mcap',),
        ('run.mcap',),
        ('run_007.mcap',),
        ('run_03.mcap', 'run_05.mcap'),
        ('run_20261130.mcap', 'run_20261201.mcap'),
    ],
)
def test_what_may_be_all_is_not_missed(names: tuple[str, ...], tmp_path: Path) -> None:
    """A file by itself under another name than its folder's, other numbers than a recorder's."""
    assert open_bag(parts(tmp_path / 'run', *names)).salvaged is None


def test_one_file_that_is_named_may_be_a_part(tmp_path: Path) -> None:
    """Each part can be judged alone, and so can some from the first named on, if they are there."""
    folder = parts(tmp_path / 'run', 'run_0.mcap', 'run_1.mcap', 'run_2.mcap')
    given = [folder / 'run_1.mcap', folder / 'run_2.mcap']
    assert open_bag(given[1]).salvaged is None
    assert open_bag(given).salvaged is None
    (folder / 'run_0.mcap').unlink()
    assert 'run_0 is missing' in (open_bag(given).salvaged or '')
    assert open_bag(given[1:]).salvaged is None


def test_a_hole_between_named_files_is_told(tmp_path: Path) -> None:
    """Of files that are given as one recording, one between two others was left out."""
    folder = parts(tmp_path / 'run', 'run_0.mcap', 'run_1.mcap', 'run_2.mcap')
    bag = open_bag([folder / 'run_0.mcap', folder / 'run_2.mcap'])
    assert 'run_1 is missing' in (bag.salvaged or '')


def listed(folder: Path) -> Path:
    """A folder whose metadata.yaml lists one file more than there is."""
    with BagWriter(folder) as bag:
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        for number, (_, kind, time, data) in enumerate(run(60)):
            if kind == 'sensor_msgs/msg/Imu':
                bag.write('/imu/data', time + number, data)
    return folder


def change(folder: Path, **keys: object) -> Path:
    """Change keys of its metadata.yaml."""
    path = folder / METADATA
    told = yaml.safe_load(path.read_text())
    told['rosbag2_bagfile_information'].update(keys)
    path.write_text(yaml.safe_dump(told))
    return folder


def test_a_file_that_metadata_lists_and_that_is_gone_is_missing(tmp_path: Path) -> None:
    """Where it does not count the messages, nobody knows what was in it."""
    folder = listed(tmp_path / 'run')
    files = ['run_0.mcap', 'run_1.mcap']
    change(folder, relative_file_paths=files, topics_with_message_count=[])
    assert open_bag(folder).salvaged == "metadata.yaml: file 'run_1.mcap' is missing"


def test_a_file_in_which_no_message_was_is_not_missed(tmp_path: Path) -> None:
    """Where the others hold every message that it counts, the one that is gone is a finding."""
    folder = change(listed(tmp_path / 'run'), relative_file_paths=['run_0.mcap', 'run_1.mcap'])
    bag = open_bag(folder)
    assert bag.salvaged is None
    assert "metadata.yaml: file 'run_1.mcap' is missing" in bag.findings


def test_a_number_of_messages_alone_tells_that_some_are_missing(tmp_path: Path) -> None:
    """A metadata.yaml without topics says how many messages there were in all."""
    folder = change(listed(tmp_path / 'run'), message_count=9000, topics_with_message_count=[])
    assert 'metadata.yaml says 9000 messages, found 60' in (open_bag(folder).salvaged or '')


def test_parts_are_counted_where_metadata_cannot_be_read(tmp_path: Path) -> None:
    """A metadata.yaml that is broken lists nothing."""
    folder = parts(tmp_path / 'run', 'run_1.mcap', 'run_2.mcap')
    (folder / METADATA).write_text('rosbag2_bagfile_information: [')
    assert 'run_0 is missing' in (open_bag(folder).salvaged or '')
