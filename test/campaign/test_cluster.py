"""Campaigns on real dask clusters whose workers or scheduler are killed in the middle."""

import json
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import jsonschema
import pytest
from campaign.fleet import brief, campaign, exit_at_b, said, write_run

from ugv_acceptance.campaign.carry_out import Place, all_failures, carry_out
from ugv_acceptance.campaign.cluster import on_cluster
from ugv_acceptance.campaign.failure_log import Entry
from ugv_acceptance.campaign.run_table import Row
from ugv_acceptance.campaign.sources import Source, find_sources
from ugv_acceptance.campaign.work import Done

pytest.importorskip('distributed', reason='extra cluster is not installed')

from campaign.dask_parts import Cluster

RUNS = 8


@pytest.fixture(scope='module')
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of eight good runs."""
    folder = tmp_path_factory.mktemp('runs')
    for k in range(RUNS):
        write_run(folder / f'run_{k:02d}', k)
    return folder


@pytest.fixture(scope='module')
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A cluster for all tests, which start what they need of it and kill what they like."""
    found = Cluster(tmp_path_factory.mktemp('elsewhere'))
    try:
        yield found
    finally:
        found.kill_workers()
        found.kill_scheduler()


def once(act: Callable[[], object]) -> Callable[[Done], None]:
    """Return a progress that acts when the first run is ready, in the middle of a campaign."""
    left = [act]

    def progress(_: Done) -> None:
        if left:
            left.pop()()

    return progress


def disturbed(
    runs: Path, out: Path, cluster: Cluster, act: Callable[[], object], wait_s: float = 60.0
) -> list[Row]:
    """Return the rows of a campaign on a cluster to which something is done in the middle."""
    place = Place(out, 1, cluster.address, wait_s)
    return carry_out(find_sources([str(runs)]), brief(), place, once(act))[0]


def counted(rows: list[Row]) -> Counter[str]:
    """Return how many runs have which verdict."""
    return Counter(row.verdict for row in rows)


def test_runs_of_killed_workers_are_judged_by_others(
    runs: Path, tmp_path: Path, cluster: Cluster
) -> None:
    """Both workers are killed and another one comes: every run is judged, none is broken."""

    def act() -> None:
        cluster.kill_workers()
        cluster.start(1)

    cluster.start(2)
    assert counted(disturbed(runs, tmp_path / 'out', cluster, act)) == {'PASS': RUNS}


def test_a_restarted_scheduler_costs_no_run(runs: Path, tmp_path: Path, cluster: Cluster) -> None:
    """A scheduler that is killed and started again at its address is connected to again."""

    def act() -> None:
        cluster.kill_scheduler()
        cluster.start(1)

    cluster.start(1)
    assert counted(disturbed(runs, tmp_path / 'out', cluster, act)) == {'PASS': RUNS}


@pytest.mark.parametrize(
    ('part', 'why'),
    [
        ('workers', 'the dask scheduler at {} had no workers for 1 s'),
        ('scheduler', 'no dask scheduler answered at {} for 1 s'),
    ],
)
def test_what_a_dead_cluster_leaves_is_judged_by_the_next_call(
    part: str, why: str, runs: Path, tmp_path: Path, cluster: Cluster
) -> None:
    """The rest is NOT_JUDGED with the reason; what was judged is kept, the next call adds to it."""
    cluster.start(1)
    kill = {'workers': cluster.kill_workers, 'scheduler': cluster.kill_scheduler}[part]
    found = counted(rows := disturbed(runs, tmp_path / 'out', cluster, kill, wait_s=1.0))
    assert set(found) == {'PASS', 'NOT_JUDGED'}
    reasons = {row.reasons for row in rows if row.verdict == 'NOT_JUDGED'}
    assert reasons == {(why.format(cluster.address),)}
    again, effort = carry_out(find_sources([str(runs)]), brief(), Place(tmp_path / 'out', 1))
    assert effort.judged == found['NOT_JUDGED']
    assert counted(again) == {'PASS': RUNS}


def test_no_statement_is_made_of_runs_that_were_not_judged(
    runs: Path, tmp_path: Path, cluster: Cluster, repository: Path
) -> None:
    """While a run is not judged the exit code is 3, and text, page and JSON claim no number."""
    cluster.kill_workers()
    cluster.start(0)
    options = ('--scheduler', cluster.address, '--cluster-wait', '0', '--require-mtbf', '0.0001')
    code, text = campaign(
        tmp_path / 'out', runs, *options, '--compare', 'a=*_0*', '--compare', 'b=*'
    )
    assert code == 3, text
    assert f'{RUNS} runs were not judged: no statement' in ' '.join(text.split())
    assert 'NOT_JUDGED' in text
    for word in ('MTBF', 'success', 'trend', 'requirement', 'BROKEN /'):
        assert word not in text
    page = (tmp_path / 'out' / 'campaign.html').read_text()
    assert f'{RUNS} runs were not judged: no statement' in page
    assert 'two-sided' not in page
    found = said(tmp_path / 'out')
    assert found['no_statement'] == f'{RUNS} runs were not judged: no statement'
    assert found['runs']['NOT_JUDGED'] == RUNS
    names = ('mtbf_h', 'success', 'availability', 'trend', 'endurance', 'requirement', 'comparison')
    assert [found[name] for name in names] == [None] * 7
    schema = json.loads((repository / 'schema' / 'campaign.schema.json').read_text('utf-8'))
    validator = jsonschema.Draft202012Validator(schema)
    validator.validate(found)
    assert not validator.is_valid({**found, 'no_statement': None})


def test_a_run_that_kills_its_workers_takes_no_other_with_it(cluster: Cluster) -> None:
    """A run that kills its workers is given up after a few, as not judged; all others are done."""
    cluster.start(3)
    sources = [Source(name, (name,)) for name in 'abcdefgh']
    done = {d.source.name: d for d in on_cluster(exit_at_b, sources, cluster.address, 1.0)}
    assert sorted(done) == list('abcdefgh')
    assert [name for name, d in done.items() if d.lost] == ['b']
    assert 'the process that judged it died' in done['b'].lost
    assert not any(d.error for d in done.values())


def test_a_worker_that_does_not_see_a_path_breaks_no_run(
    runs: Path, tmp_path: Path, cluster: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A recording that is here, and not there, is not judged; one that is nowhere is broken."""
    cluster.start(1)
    monkeypatch.chdir(runs)
    gone = Source('gone.mcap', ('gone.mcap',))
    place = Place(tmp_path / 'out', 1, cluster.address)
    rows, _ = carry_out([*find_sources(['run_00']), gone], brief(), place)
    assert {row.name: row.verdict for row in rows} == {
        'gone.mcap': 'BROKEN',
        'run_00': 'NOT_JUDGED',
    }
    assert 'cannot read this path' in rows[1].reasons[0]


def test_a_log_may_tell_of_an_alert_of_a_run_not_judged() -> None:
    """A log entry about an alert of a run not judged yet is kept for later, not refused."""
    row = Row('run', 'NOT_JUDGED', ('gone',))
    assert all_failures([row], [Entry('log:1', 'run', alert='TIP_OVER')]) == []
    assert len(all_failures([row], [Entry('log:1', 'run', what='wheel off')])) == 1
