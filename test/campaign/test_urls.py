"""Bags at URLs: a real S3 server on loopback, and fsspec's own protocols."""

import json
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from bag.test_sqlite_killed import killed
from campaign.fleet import brief, campaign, said
from campaign.s3_server import BUCKET, s3_server

from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.campaign.sources import Source, find_sources, local_paths
from ugv_acceptance.campaign.work import judge_source


@pytest.fixture(scope='module')
def s3(fleet: Path) -> Iterator[str]:
    """The URL of the fleet in a bucket of moto's S3 server."""
    with s3_server() as bucket:
        yield bucket.put(fleet, 'fleet')


def test_a_campaign_on_s3_is_that_of_the_folder(s3: str, fleet: Path, tmp_path: Path) -> None:
    """Fetched from S3, the runs have the same hashes and say the same; only names differ."""
    code, text = campaign(tmp_path / 's3', s3, '--workers', '2')
    assert code == 1, text
    campaign(tmp_path / 'here', fleet, '--workers', '1')
    there = (tmp_path / 's3' / 'campaign.json').read_text().replace(s3, str(fleet))
    here = said(tmp_path / 'here')
    assert json.loads(there)['runs'] == here['runs']
    verdicts = {(run['sha256'], run['verdict']) for run in here['each_run']}
    assert {(run['sha256'], run['verdict']) for run in json.loads(there)['each_run']} == verdicts
    assert json.loads(there)['mtbf_h'] == here['mtbf_h']


def test_nothing_of_a_fetched_copy_is_named(s3: str, tmp_path: Path) -> None:
    """The result of a run names its URL, not the temporary file it was fetched into."""
    campaign(tmp_path, f'{s3}/good_a', f'{s3}/nothing.mcap', '--workers', '1')
    (result,) = (tmp_path / 'runs').glob('*.json')
    assert json.loads(result.read_text())['bag']['path'][0].startswith(f'{s3}/good_a/')
    broken = next(run for run in said(tmp_path)['each_run'] if run['verdict'] == 'BROKEN')
    assert broken['reasons'][0].startswith(f'{s3}/nothing.mcap: expected MCAP')


def test_a_bucket_that_is_not_there_is_one_line(s3: str, tmp_path: Path) -> None:
    """A bucket that does not exist ends with code 2 and one line."""
    code, text = campaign(tmp_path, s3.replace(BUCKET, 'nobody'))
    assert (code, text.count('\n')) == (2, 1)


def test_an_object_that_is_gone_is_broken_a_server_that_is_gone_is_not(
    s3: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file missing after it was listed is the run's; a network that fails says nothing of it."""
    fsspec = pytest.importorskip('fsspec', reason='extra cluster is not installed')

    def listening_at(url: str) -> None:
        access = {'endpoint_url': url, 'key': 'nobody', 'secret': 'secret'}
        monkeypatch.setitem(fsspec.config.conf, 's3', access)

    listening_at(os.environ['FSSPEC_S3_ENDPOINT_URL'])
    (good,) = find_sources([f'{s3}/good_a'])
    gone = judge_source(Source(f'{s3}/gone.mcap', (f'{s3}/gone.mcap',), remote=True), brief())
    assert gone.error.startswith(f'{s3}/gone.mcap: cannot be read')
    assert not gone.lost
    with socket.socket() as nobody:  # a port that is taken, at which nobody listens
        nobody.bind(('127.0.0.1', 0))
        listening_at(f'http://127.0.0.1:{nobody.getsockname()[1]}')
        lost = judge_source(good, brief())
    assert lost.lost.startswith(f'{s3}/good_a/')
    assert 'cannot be fetched' in lost.lost
    assert not lost.error


def test_file_urls_are_read(fleet: Path, tmp_path: Path) -> None:
    """A file:// URL is fetched like any other."""
    pytest.importorskip('fsspec', reason='extra cluster is not installed')
    code, text = campaign(tmp_path, f'file://{fleet}/good_a', '--workers', '1')
    assert code == 0, text


def test_what_a_killed_recorder_left_is_fetched_too(tmp_path: Path) -> None:
    """A recording without its end is told as one, wherever it is kept."""
    pytest.importorskip('fsspec', reason='extra cluster is not installed')
    path = killed(tmp_path, 'WAL')
    (source,) = [s for s in find_sources([f'file://{tmp_path}']) if s.name.endswith(path.name)]
    with local_paths(source) as copies:
        bag = open_bag(copies)
        assert bag.salvaged is not None
        assert 'run.db3-wal' in bag.salvaged
