"""SQLite recordings whose recorder was killed: what it left beside the file is told."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from bag.bag_cases import run
from bag.recordings import write_other

from ugv_acceptance import BadBag
from ugv_acceptance.bag.reader import open_bag


def killed(folder: Path, mode: str, *, begun: bool = True) -> Path:
    """A recording as a killed recorder leaves it: its last 100 messages are not in the file.

    With `mode` WAL they are in run.db3-wal, all of the recording if nothing had `begun` to be
    moved; with DELETE the file is in the middle of being written, and run.db3-journal undoes that.
    """
    source, path = folder / 'whole.db3', folder / 'recorded.db3'
    write_other(source, run(200))
    if begun:
        shutil.copy(source, path)
        with closing(sqlite3.connect(path)) as db:
            db.execute('DELETE FROM messages WHERE id > 300')
            db.commit()
    with closing(sqlite3.connect(path)) as db, closing(sqlite3.connect(source)) as whole:
        db.execute(f'PRAGMA journal_mode={mode}')
        db.execute('PRAGMA cache_size=1')
        rows = whole.execute('SELECT * FROM messages WHERE id > 300').fetchall()
        if not begun:
            db.executescript('\n'.join(whole.iterdump()))
        else:
            db.executemany('INSERT INTO messages VALUES (?, ?, ?, ?)', rows)
        if mode == 'WAL':
            db.commit()
        for part in folder.glob('recorded.db3*'):
            shutil.copy(part, folder / part.name.replace('recorded', 'run'))
    (folder / 'run.db3-shm').unlink(missing_ok=True)
    return folder / 'run.db3'


@pytest.mark.parametrize(('mode', 'left'), [('WAL', 'run.db3-wal'), ('DELETE', 'run.db3-journal')])
def test_what_lies_beside_a_file_is_told(tmp_path: Path, mode: str, left: str) -> None:
    """Not read, it counts as damage of the recording, as a file that breaks off does."""
    bag = open_bag(killed(tmp_path, mode))
    assert (tmp_path / left).stat().st_size
    assert bag.salvaged is not None
    assert left in bag.salvaged


def test_what_lies_beside_a_file_explains_that_it_cannot_be_read(tmp_path: Path) -> None:
    """If nothing is in the file itself, the error says where it may be."""
    path = killed(tmp_path, 'WAL', begun=False)
    with pytest.raises(BadBag, match=r'run\.db3-wal'):
        open_bag(path)


@pytest.mark.parametrize('mode', ['WAL', 'DELETE'])
def test_what_is_told_to_do_brings_them_together(tmp_path: Path, mode: str) -> None:
    """After any reading by SQLite itself the recording is whole again, or what it was before."""
    path = killed(tmp_path, mode)
    said = open_bag(path).salvaged or ''
    query = said.partition('"')[2].partition('"')[0]
    with closing(sqlite3.connect(path)) as db:
        db.execute(query).fetchone()
    bag = open_bag(path)
    assert bag.salvaged is None
    assert sum(topic.count for topic in bag.topics.values()) == (400 if mode == 'WAL' else 300)


@pytest.mark.parametrize('content', [b'', bytes(600)])
def test_an_emptied_journal_says_nothing(tmp_path: Path, content: bytes) -> None:
    """A journal that SQLite emptied or zeroed, as it does with some settings, holds nothing."""
    write_other(tmp_path / 'run.db3', run(20))
    for end in ('journal', 'wal'):
        (tmp_path / f'run.db3-{end}').write_bytes(content)
    assert open_bag(tmp_path / 'run.db3').salvaged is None
