"""Recordings that look unchanged are not read again; whatever changed in any way is."""

import json
import os
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import pytest
from campaign.fleet import brief, campaign, write_run
from campaign.s3_server import Bucket, asked, s3_server

from ugv_acceptance.campaign.carry_out import Effort, Place, carry_out
from ugv_acceptance.campaign.hash_memory import NAME, read_memory
from ugv_acceptance.campaign.marks import RECENT_NS, listed_mark, local_mark
from ugv_acceptance.campaign.run_table import Row
from ugv_acceptance.campaign.sources import Source, find_sources
from ugv_acceptance.config.criteria import load_criteria

LATER = 10_000_000_000


def judged(place: Path | str, out: Path, *, rehash: bool = False) -> tuple[list[Row], Effort]:
    """Judge what a folder or URL holds, with the hashes remembered in `out`."""
    return carry_out(find_sources([str(place)]), brief(), Place(out, 1), rehash=rehash)


def old(*files: Path) -> None:
    """Wait until the last change of files is so old that their marks count."""
    changed = max(max(file.stat().st_mtime_ns, file.stat().st_ctime_ns) for file in files)
    while time.time_ns() < changed + RECENT_NS + 1:
        time.sleep(0.05)


def next_tick(folder: Path) -> None:
    """Wait until the clock of the file system went on."""
    first, other = folder / 'first', folder / 'other'
    first.write_text('')
    other.write_text('')
    while other.stat().st_ctime_ns == first.stat().st_ctime_ns:
        other.write_text('')


@pytest.fixture(scope='module')
def old_runs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Folders of two recordings of a standing robot, old enough to be remembered: one a test."""
    place = tmp_path_factory.mktemp('old')
    for hour, name in enumerate('ab'):
        write_run(place / '0' / name, hour)
    for k in range(1, 40):
        shutil.copytree(place / '0', place / str(k))
    old(*(file for file in place.rglob('*') if file.is_file()))
    return iter(sorted(place.iterdir()))


@pytest.fixture
def runs(old_runs: Iterator[Path]) -> Path:
    """A folder of two old recordings that a test may change."""
    return next(old_runs)


def overwritten(file: Path) -> None:
    """Write into a file."""
    with file.open('r+b') as stream:
        stream.write(b'B')


def replaced(file: Path) -> None:
    """Put another file in its place."""
    other = file.with_name('other')
    other.write_bytes(b'B' + file.read_bytes()[1:])
    other.replace(file)


def longer(file: Path) -> None:
    """Write behind its end."""
    with file.open('ab') as stream:
        stream.write(b'B')


@pytest.mark.parametrize('change', [overwritten, replaced, longer])
def test_a_changed_file_has_another_mark_whatever_its_time_says(
    change: Callable[[Path], None], tmp_path: Path
) -> None:
    """Written over, replaced or longer, with its old time of modification set again."""
    file = tmp_path / 'run.mcap'
    file.write_bytes(b'A' * 100)
    before, times = local_mark(str(file), time.time_ns() + LATER), file.stat()
    next_tick(tmp_path)
    change(file)
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert file.stat().st_mtime_ns == times.st_mtime_ns
    after = local_mark(str(file), time.time_ns() + LATER)
    assert before
    assert after
    assert before != after


def test_a_touched_file_has_another_mark(tmp_path: Path) -> None:
    """Another time of modification is a change, even with the same bytes."""
    file = tmp_path / 'run.mcap'
    file.write_bytes(b'A')
    before = local_mark(str(file), time.time_ns() + LATER)
    os.utime(file, ns=(1, 1))
    assert local_mark(str(file), time.time_ns() + LATER) != before


def test_a_file_just_changed_has_no_mark(tmp_path: Path) -> None:
    """A second change within a step of the clock leaves no trace; an old date hides nothing."""
    file = tmp_path / 'run.mcap'
    file.write_bytes(b'A')
    os.utime(file, ns=(1, 1))
    changed = file.stat().st_ctime_ns
    assert local_mark(str(file), changed) == ''
    assert local_mark(str(file), changed + RECENT_NS - 1) == ''
    assert local_mark(str(file), changed + RECENT_NS)
    os.utime(file, ns=(changed + LATER, changed + LATER))  # by a clock that is ahead
    assert local_mark(str(file), changed + RECENT_NS + LATER // 2) == ''


def test_what_is_no_file_has_no_mark_and_nobody_waits_for_it(tmp_path: Path) -> None:
    """A pipe into which nobody writes, and a name without a file."""
    os.mkfifo(tmp_path / 'pipe.mcap')
    local_mark(str(tmp_path / 'pipe.mcap'), time.time_ns())
    assert local_mark(str(tmp_path / 'nothing.mcap'), time.time_ns()) == ''


WRITTEN = datetime(2026, 1, 2, tzinfo=timezone.utc)
S3 = {'size': 7, 'LastModified': WRITTEN, 'ETag': '"a"'}
SFTP = {'size': 7, 'mtime': WRITTEN}
FILE = {'size': 7, 'mtime': 1.5, 'created': 2.5, 'ino': 9}


@pytest.mark.parametrize(
    ('listed', 'change'),
    [
        (S3, {'ETag': '"b"'}),
        (S3, {'size': 8}),
        (S3, {'LastModified': datetime(2026, 1, 3, tzinfo=timezone.utc)}),
        (SFTP, {'size': 8}),
        (SFTP, {'mtime': datetime(2026, 1, 2, 0, 0, 1, tzinfo=timezone.utc)}),
        (FILE, {'mtime': 1.6}),
        (FILE, {'created': 2.6}),
        (FILE, {'ino': 8}),
    ],
)
def test_every_thing_that_a_store_lists_counts(
    listed: dict[str, Any], change: dict[str, Any]
) -> None:
    """Of the same size and time but another ETag it is another object, and so on."""
    mark = listed_mark(listed, time.time_ns())
    assert mark
    assert listed_mark({**listed, **change}, time.time_ns()) not in {'', mark}


def test_a_store_that_tells_too_little_gives_no_mark() -> None:
    """Without a size or a time nothing is known; nor of an object that was just written."""
    now = time.time_ns()
    for missing in ('size', 'LastModified'):
        assert listed_mark({k: v for k, v in S3.items() if k != missing}, now) == ''
    assert listed_mark({**S3, 'size': None}, now) == ''
    assert listed_mark({**S3, 'LastModified': ''}, now) == ''
    assert listed_mark(S3, round(WRITTEN.timestamp() * 1e9) + RECENT_NS - 1) == ''


def test_a_store_may_list_an_object_otherwise_than_it_tells_of_it_alone() -> None:
    """Some stores list milliseconds and bare tags, of one object whole seconds and quoted tags."""
    moment = datetime(2026, 1, 2, 0, 0, 0, 432000, tzinfo=timezone.utc)
    fine = {**S3, 'LastModified': moment, 'ETag': 'a'}
    assert listed_mark(fine, time.time_ns()) == listed_mark(S3, time.time_ns())


def test_unchanged_runs_are_not_read_again(runs: Path, tmp_path: Path) -> None:
    """The second time every run comes from memory, and says the same."""
    out = tmp_path / 'out'
    first, effort = judged(runs, out)
    assert (effort.judged, effort.unchanged) == (2, 0)
    again, effort = judged(runs, out)
    assert (effort.judged, effort.unchanged, effort.odd) == (0, 2, '')
    assert effort.since.startswith(str(datetime.now(timezone.utc).year))
    assert again == first


def test_rehash_reads_every_run(runs: Path, tmp_path: Path) -> None:
    """With `rehash` nothing is taken from memory, and nothing judged twice."""
    judged(runs, tmp_path / 'out')
    _, effort = judged(runs, tmp_path / 'out', rehash=True)
    assert (effort.judged, effort.unchanged) == (0, 0)


def test_a_changed_run_is_read_again(runs: Path, tmp_path: Path) -> None:
    """Another recording of the same name and time of modification: only it is judged."""
    out = tmp_path / 'out'
    (a, b), _ = judged(runs, out)
    write_run(tmp_path / 'tips', 0, tilt_deg=60.0)
    (new,), (file,) = (tmp_path / 'tips').glob('*.mcap'), (runs / 'a').glob('*.mcap')
    times = file.stat()
    file.write_bytes(new.read_bytes())
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
    changed, effort = judged(runs, out)
    assert (effort.judged, effort.unchanged) == (1, 1)
    assert [row.verdict for row in changed] == ['FAIL', 'PASS']
    assert (a.verdict, changed[1]) == ('PASS', b)


def test_a_run_with_a_file_more_is_read_again(runs: Path, tmp_path: Path) -> None:
    """A part that came later changes its recording, even where the other parts are as they were."""
    out = tmp_path / 'out'
    judged(runs, out)
    shutil.copy(next((runs / 'b').glob('*.mcap')), runs / 'a' / 'a_1.mcap')
    _, effort = judged(runs, out)
    assert effort.unchanged == 1


def test_a_run_just_written_is_read_until_its_date_is_past(runs: Path, tmp_path: Path) -> None:
    """A date too near to trust is not remembered, however often the campaign is resumed."""
    file = next((runs / 'a').glob('*.mcap'))
    soon = time.time_ns() + 1000 * LATER
    os.utime(file, ns=(soon, soon))
    for unchanged in (0, 1, 1):
        assert judged(runs, tmp_path / 'out')[1].unchanged == unchanged


def test_a_run_that_changed_while_it_was_read_is_not_remembered(runs: Path, tmp_path: Path) -> None:
    """The mark of what was listed does not go with the hash of what was read later."""
    found = find_sources([str(runs)])
    with next((runs / 'a').glob('*.mcap')).open('ab') as file:
        file.write(b'more')
    carry_out(found, brief(), Place(tmp_path / 'out', 1))
    assert set(read_memory(tmp_path / 'out').runs) == {str(runs / 'b')}


def test_a_file_that_nobody_looked_at_is_not_trusted(runs: Path, tmp_path: Path) -> None:
    """metadata.yaml may name a file that was not looked at: then nothing is remembered."""
    file = next((runs / 'a').glob('*.mcap'))
    shutil.copy(file, runs / 'a' / 'a_1.mcap')
    hidden = file.rename(runs / 'a' / 'hidden.dat')
    metadata = runs / 'a' / 'metadata.yaml'
    metadata.write_text(metadata.read_text().replace(file.name, hidden.name))
    old(*(runs / 'a').iterdir())
    (source, _), out = find_sources([str(runs)]), tmp_path / 'out'
    assert source.marked
    assert hidden.name not in ' '.join(source.files)
    for _ in range(2):
        assert judged(runs / 'a', out)[1].unchanged == 0


def test_other_criteria_judge_anew(runs: Path, tmp_path: Path) -> None:
    """A remembered hash is no result: what was judged by other criteria is judged."""
    judged(runs, tmp_path / 'out')
    criteria = tmp_path / 'site.yaml'
    criteria.write_text(
        'version: 1\nname: site\ncriteria:\n  tilt:\n    value: tip_angle\n    above_deg: 5\n'
    )
    terms = replace(brief(), criteria=load_criteria(criteria, brief().config.settings))
    _, effort = carry_out(find_sources([str(runs)]), terms, Place(tmp_path / 'out', 1))
    assert (effort.judged, effort.unchanged) == (2, 0)


def test_a_spoilt_result_is_no_unchanged_run(runs: Path, tmp_path: Path) -> None:
    """A recording whose stored result is damaged is read and judged, and not counted otherwise."""
    rows, _ = judged(runs, tmp_path / 'out')
    (tmp_path / 'out' / str(rows[0].result)).write_text('{')
    again, effort = judged(runs, tmp_path / 'out')
    assert effort.unchanged == 1
    assert again == rows


def test_damaged_lines_of_the_memory_are_ignored_and_said(runs: Path, tmp_path: Path) -> None:
    """A line that is cut off, no JSON, or not as we write it counts for nothing; others stay."""
    out = tmp_path / 'out'
    judged(runs, out)
    memory = out / NAME
    first, a, b = memory.read_text().splitlines()
    told = json.loads(a)
    wrong = ['{', '3', '[' * 100_000, a[:-9], a.replace(told['sha256'], 'abc'), '\ufffd\x00']
    wrong += [json.dumps({**told, field: 3}) for field in ('run', 'files', 'hashed', 'sha256')]
    wrong += [json.dumps({**told, 'files': {'x': 3}}), json.dumps({**told, 'hashed': 'once'})]
    for line in wrong:
        memory.write_text(f'{first}\n{line}\n{b}\n')
        _, effort = judged(runs, out)
        assert (effort.unchanged, effort.odd) == (
            1,
            f'{memory}: damaged lines: 1; those runs are read again',
        )
        assert judged(runs, out)[1].unchanged == 2


def test_a_memory_that_was_cut_off_is_mended(runs: Path, tmp_path: Path) -> None:
    """Wherever a write was cut off, what is whole counts, and what is added later is read."""
    out = tmp_path / 'out'
    judged(runs, out)
    whole = (out / NAME).read_bytes()
    header = whole.index(b'\n')
    for end in (0, 5, header, header + 1, header + 9, len(whole) - 1):
        (out / NAME).write_bytes(whole[:end])
        judged(runs, out)
        _, effort = judged(runs, out)
        assert (effort.unchanged, effort.odd) == (2, '')


def test_a_file_of_somebody_else_is_neither_used_nor_touched(runs: Path, tmp_path: Path) -> None:
    """A file of that name that this program did not write stays; every recording is read."""
    out = tmp_path / 'out'
    judged(runs, out)
    for content in (b'mine\n', b'{"version": 7}\n', b'\xff\xfe\n'):
        (out / NAME).write_bytes(content)
        _, effort = judged(runs, out)
        assert effort.unchanged == 0
        assert effort.odd.startswith(f'{out / NAME}: expected remembered hashes, got ')
        assert (out / NAME).read_bytes() == content


def test_lines_that_a_later_one_replaced_do_not_stay(runs: Path, tmp_path: Path) -> None:
    """The memory does not grow with every time that a campaign is resumed."""
    for _ in range(4):
        judged(runs, tmp_path / 'out', rehash=True)
    judged(runs, tmp_path / 'out')
    assert (tmp_path / 'out' / NAME).read_text().count('\n') == 3


def test_the_command_says_what_it_did_not_read(runs: Path, tmp_path: Path) -> None:
    """It says how many runs were taken as unchanged; with --rehash it reads all; same bytes."""
    out = tmp_path / 'out'
    campaign(out, runs, '--workers', '1')
    statement = (out / 'campaign.json').read_bytes()
    code, text = campaign(out, runs, '--workers', '1')
    words = ' '.join(text.split())
    assert code == 0
    assert '0 of 2 newly judged' in words
    assert '2 of 2 not read again: size, time and inode or ETag of their files are' in words
    assert (out / 'campaign.json').read_bytes() == statement
    code, text = campaign(out, runs, '--workers', '1', '--rehash')
    assert code == 0
    assert 'not read again' not in text
    assert (out / 'campaign.json').read_bytes() == statement


def test_a_folder_with_only_results_and_memory_is_a_campaign_s(runs: Path, tmp_path: Path) -> None:
    """A campaign that was stopped before its statement goes on in its folder."""
    judged(runs, tmp_path / 'out')
    assert {p.name for p in (tmp_path / 'out').iterdir()} == {'runs', NAME}
    code, text = campaign(tmp_path / 'out', runs, '--workers', '1')
    assert code == 0, text


@pytest.fixture(scope='module')
def bucket() -> Iterator[Bucket]:
    """A bucket on an S3 server."""
    with s3_server() as found:
        yield found


def test_unchanged_objects_are_only_listed(bucket: Bucket, runs: Path, tmp_path: Path) -> None:
    """Resumed, a campaign on S3 fetches no object and asks for none by itself."""
    url = bucket.put(runs, 'listed')
    first, _ = judged(url, tmp_path / 'out')
    with asked() as requests:
        again, effort = judged(url, tmp_path / 'out')
    assert (effort.judged, effort.unchanged) == (0, 2)
    assert again == first
    assert requests
    assert not [path for _, path in requests if '.mcap' in path or '.yaml' in path]


def test_a_listing_takes_a_request_a_thousand_objects(bucket: Bucket) -> None:
    """Three pages for 2,001 objects and a few requests about the folder itself."""
    for k in range(2001):
        bucket.write(f'many/run_{k}.x/a.mcap', b'x')
    with asked() as requests:
        found = find_sources([f'{bucket.url}/many'])
    assert len(found) == 2001
    assert all(source.marked for source in found)
    pages = [path for method, path in requests if method == 'GET' and 'list-type=2' in path]
    assert 3 <= len(pages) <= 4
    assert len(requests) <= 6


def test_an_object_with_another_etag_is_judged_anew(
    bucket: Bucket, runs: Path, tmp_path: Path
) -> None:
    """Replaced by one of the same size and time of modification."""
    url, out = bucket.put(runs, 'replaced'), tmp_path / 'out'
    rows, _ = judged(url, out)
    file = next((runs / 'a').glob('*.mcap'))
    name = f'replaced/a/{file.name}'
    moment = bucket.held.get_object('acceptance', name).last_modified
    content = bytearray(file.read_bytes())
    content[-1] ^= 1  # the magic at its end
    bucket.write(name, bytes(content))
    bucket.held.get_object('acceptance', name).last_modified = moment
    changed, effort = judged(url, out)
    assert (effort.judged, effort.unchanged) == (1, 1)
    assert [row.sha256 for row in changed] != [row.sha256 for row in rows]


def test_an_object_just_written_is_fetched_again(
    bucket: Bucket, runs: Path, tmp_path: Path
) -> None:
    """As dated by a server whose clock is ahead: it is fetched each time, others are not."""
    url = bucket.put(runs, 'recent')
    bucket.date(f'recent/a/{next((runs / "a").glob("*.mcap")).name}', -3600.0)
    for unchanged in (0, 1, 1):
        assert judged(url, tmp_path / 'out')[1].unchanged == unchanged


def test_an_object_that_was_replaced_before_it_was_fetched_is_not_remembered(
    bucket: Bucket, runs: Path, tmp_path: Path
) -> None:
    """Else the version that was listed, once restored, would keep the verdict of another."""
    url = bucket.put(runs, 'fetched')
    found = find_sources([url])
    file = next((runs / 'b').glob('*.mcap'))
    bucket.write(f'fetched/b/{file.name}', file.read_bytes() + b'more')
    carry_out(found, brief(), Place(tmp_path / 'out', 1))
    assert set(read_memory(tmp_path / 'out').runs) == {f'{url}/a'}


def test_a_source_that_nobody_looked_at_is_not_remembered(runs: Path, tmp_path: Path) -> None:
    """Sources that a caller made by hand have no marks."""
    (source, _) = find_sources([str(runs)])
    by_hand = Source(source.name, source.files)
    carry_out([by_hand], brief(), Place(tmp_path, 1))
    assert not (tmp_path / NAME).exists()
