"""A folder that is not one recording but holds several: nothing is taken for one run."""

from pathlib import Path

import pytest
from bag.bag_cases import run, write_mcap
from cli.here import ugv

from ugv_acceptance import BadBag
from ugv_acceptance.bag.metadata import numbered
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.cli.evaluate import recordings


def write_runs(folder: Path, *names: str) -> Path:
    """Write rosbag2 folders in a folder."""
    for name in names:
        with BagWriter(folder / name) as bag:
            bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
    return folder


def told(folder: Path) -> str:
    """Return what opening the folder says."""
    with pytest.raises(BadBag) as caught:
        open_bag(folder)
    return str(caught.value)


def test_a_folder_of_runs_names_them_and_what_judges_them(tmp_path: Path) -> None:
    """A folder of several recordings is refused with their names and the commands to use."""
    folder = write_runs(tmp_path / 'all runs', 'a', 'b', 'c', 'd', 'e')
    text = told(folder)
    assert text.startswith(f'{folder}: expected one recording, found 5 in it (a, b, c and 2 more)')
    assert f"`ugv-acceptance campaign '{folder}'` judges all of them" in text
    assert f"`ugv-acceptance evaluate '{folder}/a' '{folder}/b'` single ones" in text
    assert '\n' not in text


def test_files_of_two_runs_are_not_one(tmp_path: Path) -> None:
    """Without metadata.yaml only files that differ in their number alone are one recording."""
    for name in ('one.mcap', 'two.mcap'):
        write_mcap(tmp_path / name, run(20))
    assert 'found 2 in it (one.mcap, two.mcap)' in told(tmp_path)


def test_parts_without_metadata_are_one_recording(tmp_path: Path) -> None:
    """The parts of a split recording are read together as ever."""
    for name, count in (('run_0.mcap', 20), ('run_1.mcap', 30)):
        write_mcap(tmp_path / name, run(count))
    assert len(open_bag(tmp_path).paths) == 2


@pytest.mark.parametrize('number', ['²', '1²', '①', 'x', ''])
def test_what_is_no_decimal_number_makes_no_part(number: str, tmp_path: Path) -> None:
    """A name may hold any digit of any script: the file is a recording of its own."""
    names = ['run_0.mcap', f'run_{number}.mcap']
    assert sorted(numbered(names)) == [[name] for name in sorted(names)]
    paths = [tmp_path / name for name in names]
    for path in paths:
        path.touch()
    assert recordings(paths) == [[path] for path in paths]


def test_a_run_one_folder_further_down_is_named(tmp_path: Path) -> None:
    """A folder whose only recording is in a subfolder is refused with its name."""
    folder = write_runs(tmp_path / 'day', 'run')
    assert told(folder).endswith(f'found one below it: `ugv-acceptance evaluate {folder}/run`')


def test_a_folder_without_recordings_says_what_one_is(tmp_path: Path) -> None:
    """A folder without recordings is refused with the endings that were looked for."""
    (tmp_path / 'notes.txt').write_text('no bag')
    assert 'expected a rosbag2 folder, found no .mcap' in told(tmp_path)


@pytest.mark.parametrize('verb', [('evaluate',), ('watch',), ('map', 'torque', '--from-bag')])
def test_every_verb_says_so_in_one_line(
    verb: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every verb refuses a folder of several recordings with one line and exit code 2."""
    folder = write_runs(tmp_path / 'day', 'a', 'b')
    monkeypatch.chdir(tmp_path)
    done = ugv(*verb, folder)
    assert done.returncode == 2
    assert done.stderr.count('\n') == 1
    assert f'`ugv-acceptance campaign {folder}` judges all of them' in done.stderr
