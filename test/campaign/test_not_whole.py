"""A resumed campaign sees that a recording is not whole, although its files are as they were."""

import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
import yaml
from campaign.fleet import brief, write_run
from campaign.test_unchanged import judged, old

from ugv_acceptance.bag.metadata import NAME as METADATA
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.campaign.carry_out import Place, carry_out
from ugv_acceptance.campaign.hash_memory import read_memory
from ugv_acceptance.campaign.sources import find_sources, is_unchanged


def sqlite_run(folder: Path) -> Path:
    """Write a standing run as an SQLite file without metadata.yaml."""
    source = open_bag(write_run(folder / 'mcap', 0))
    topics = sorted(source.topics)
    file = folder / 'runs' / 'run.db3'
    file.parent.mkdir()
    with closing(sqlite3.connect(file)) as db:
        db.executescript(
            'CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,'
            ' serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);'
            'CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,'
            ' timestamp INTEGER NOT NULL, data BLOB NOT NULL);'
            'CREATE INDEX timestamp_idx ON messages (timestamp ASC);'
        )
        for number, name in enumerate(topics, 1):
            kind = source.topics[name].type
            db.execute('INSERT INTO topics VALUES (?, ?, ?, "cdr", "")', (number, name, kind))
        for one in messages(source, topics):
            row = (topics.index(one.topic) + 1, one.log_time, one.data)
            db.execute('INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)', row)
        db.commit()
    return file


# How the two files begin that a killed recorder may leave beside an SQLite file.
LEFT = {'-wal': b'\x37\x7f\x06\x82', '-journal': b'\xd9\xd5\x05\xf9'}


@pytest.mark.parametrize('end', LEFT)
@pytest.mark.parametrize('place', ['{}', 'file://{}', 'file://{}/run.db3'])
def test_what_came_later_beside_a_file_is_seen(end: str, place: str, tmp_path: Path) -> None:
    """The end of a recording in a -wal or -journal: the file is read again, and does not pass."""
    if place != '{}':
        pytest.importorskip('fsspec', reason='extra cluster is not installed')
    file, out = sqlite_run(tmp_path), tmp_path / 'out'
    where = place.format(file.parent)
    old(file)
    (whole,), _ = judged(where, out)
    assert whole.verdict == 'PASS'
    left = file.with_name(file.name + end)
    left.write_bytes(LEFT[end] + bytes(600))
    old(left)
    for _ in range(2):
        (row,), effort = judged(where, out)
        assert row.verdict == 'INCONCLUSIVE'
        assert left.name in ' '.join(row.reasons)
    assert effort.unchanged == 1
    left.unlink()
    assert judged(where, out)[0] == [whole]


def test_what_comes_while_a_run_is_read_is_not_remembered(tmp_path: Path) -> None:
    """The mark of the file alone does not go with a result that may rest on more."""
    file, out = sqlite_run(tmp_path), tmp_path / 'out'
    old(file)
    found = find_sources([str(file.parent)])
    assert is_unchanged(found[0])
    file.with_name('run.db3-wal').write_bytes(LEFT['-wal'] + bytes(600))
    assert not is_unchanged(found[0])
    carry_out(found, brief(), Place(out, 1))
    assert not read_memory(out).runs


def test_a_copy_that_lacks_its_end_is_no_copy(tmp_path: Path) -> None:
    """Of two equal files one has a -wal beside it: both runs stand in the table."""
    file = sqlite_run(tmp_path)
    shutil.copy(file, file.with_name('other.db3'))
    file.with_name('run.db3-wal').write_bytes(LEFT['-wal'] + bytes(600))
    rows, _ = judged(file.parent, tmp_path / 'out')
    assert [row.verdict for row in rows] == ['PASS', 'INCONCLUSIVE']


def test_what_metadata_counts_later_is_seen(tmp_path: Path) -> None:
    """The same file of which metadata.yaml then counts more messages: one result is not both's."""
    run, out = write_run(tmp_path / 'run', 0), tmp_path / 'out'
    (whole,), _ = judged(run, out)
    assert whole.verdict == 'PASS'
    path = run / METADATA
    told = yaml.safe_load(path.read_text())
    for topic in told['rosbag2_bagfile_information']['topics_with_message_count']:
        topic['message_count'] += 500
    path.write_text(yaml.safe_dump(told))
    (row,), _ = judged(run, out)
    assert row.verdict == 'INCONCLUSIVE'


@pytest.mark.parametrize('place', ['{}', 'file://{}'])
def test_the_only_part_that_is_left_does_not_pass(place: str, tmp_path: Path) -> None:
    """A folder run with run_2.mcap alone, without metadata.yaml: the parts before are missing."""
    if place != '{}':
        pytest.importorskip('fsspec', reason='extra cluster is not installed')
    run = write_run(tmp_path / 'run', 0)
    (run / METADATA).unlink()
    file = next(run.glob('*.mcap'))
    file.rename(run / 'run_2.mcap')
    (row,), _ = judged(place.format(tmp_path), tmp_path.parent / f'{tmp_path.name}_out')
    assert row.verdict == 'INCONCLUSIVE'
    assert 'run_0, run_1 are missing' in ' '.join(row.reasons)
    os.rename(run / 'run_2.mcap', run / 'run_0.mcap')  # noqa: PTH104
    (row,), _ = judged(place.format(tmp_path), tmp_path.parent / f'{tmp_path.name}_out')
    assert row.verdict == 'PASS'
