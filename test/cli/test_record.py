"""`record` as it is typed: amounts, and what is refused before anything is begun."""

from pathlib import Path

import pytest
from cli.test_outputs import process

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.amounts import bytes_of, seconds_of, size_or_time, size_words, time_words


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        (['--split', '5 apples'], '--split: expected a size such as'),
        (['--leave', '10min'], '--leave: expected a size'),
        (['--duration', '-3s'], '--duration: expected a time'),
        (['--keep', '0'], '--keep: expected at least 1'),
        (['--keep', '3', '--out', 'x'], '--keep: expected without --out'),
        (['-c', '/nowhere.yaml'], '/nowhere.yaml'),
        (['--out', '/proc/nowhere'], '/proc/nowhere: cannot be written'),
        (['--out', 'used'], '--out used: expected a new or empty folder'),
    ],
)
def test_bad_input_is_one_line_and_makes_no_folder(
    tmp_path: Path, words: list[str], told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says what was expected, what came, where."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'used').mkdir()
    (tmp_path / 'used' / 'mine.mcap').write_bytes(b'mine')
    done = process('record', *words)  # of its own: some of them come as far as ROS
    assert done.returncode == 2
    assert told in done.stderr
    assert done.stderr.count('\n') == 1
    assert [path.name for path in tmp_path.iterdir()] == ['used']
    assert (tmp_path / 'used' / 'mine.mcap').read_bytes() == b'mine'


def test_amounts_are_read_with_their_units() -> None:
    """Sizes by thousands or by 1024, times in seconds, minutes, hours; nothing without a unit."""
    assert bytes_of('1GB', '--leave') == 10**9
    assert bytes_of('1.5 GiB', '--leave') == 3 << 29
    assert (seconds_of('90s', '--duration'), seconds_of('2 h', '--duration')) == (90.0, 7200.0)
    assert size_or_time('10min', '--split') == (None, 600.0)
    assert size_or_time('500mb', '--split') == (500_000_000, None)
    for text in ('', '5', '0GB', 'GB', '1e999GB', '-1GB', 'nan GB'):
        with pytest.raises(BadConfig):
            bytes_of(text, '--leave')


def test_amounts_are_told_as_people_read_them() -> None:
    """With the unit that fits."""
    assert [size_words(n) for n in (900, 1.5e6, 2.34e9)] == ['1 kB', '1.5 MB', '2.3 GB']
    told = [time_words(s) for s in (45, 600, 9_000, 1e6)]
    assert told == ['45 s', '10 min', '2.5 h', '12 days']
