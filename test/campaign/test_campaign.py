"""Campaigns on real recordings: what is counted, what is resumed, what comes out."""

import json
import re
import tempfile
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from campaign.fleet import brief, campaign, exit_at_b, said, write_run

from ugv_acceptance import AcceptanceError
from ugv_acceptance.campaign.batches import batches
from ugv_acceptance.campaign.carry_out import Place, carry_out
from ugv_acceptance.campaign.groups import comparison
from ugv_acceptance.campaign.pool import in_processes, judge_all
from ugv_acceptance.campaign.sources import Source, find_sources, sorted_out
from ugv_acceptance.campaign.work import judge_source


@pytest.fixture(scope='module')
def single(fleet: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a campaign on the fleet with one worker."""
    out = tmp_path_factory.mktemp('single')
    code, text = campaign(out, fleet, '--workers', '1', '--require-mtbf', '96')
    assert code == 1, text
    return out


def test_every_run_is_counted_once(single: Path) -> None:
    """Inconclusive and unreadable runs are counted; a copy is named, not counted again."""
    runs = said(single)['runs']
    assert runs == {
        'total': 5,
        'PASS': 2,
        'FAIL': 1,
        'INCONCLUSIVE': 1,
        'DOUBTFUL': 0,
        'BROKEN': 1,
        'NOT_JUDGED': 0,
        'copies': 1,
    }


def test_what_is_unclear_is_no_success(single: Path) -> None:
    """INCONCLUSIVE and BROKEN runs do not count as passed: two of five runs did."""
    success = said(single)['success']
    assert (success['passed'], success['runs']) == (2, 5)
    assert success['if_unclear_had_passed']['value'] == pytest.approx(0.8)


def test_hours_are_those_that_could_be_judged(single: Path) -> None:
    """Only the time with known margins counts as operated, not the silent half of a run."""
    hours = said(single)['hours']
    assert hours['recorded'] * 3600 == pytest.approx(4 * 3.98, abs=0.01)
    assert hours['judged'] * 3600 == pytest.approx(3 * 3.98 + 2.08, abs=0.05)


def test_failures_are_sorted_by_the_taxonomy(single: Path) -> None:
    """A fall points to interaction, a silent input to communications."""
    failures = said(single)['failures']
    assert failures['class'] == {'human / interaction': 1, 'physical / communications': 1}
    assert failures['impact'] == {'terminal': 2}


def test_two_workers_give_the_same_bytes(fleet: Path, single: Path, tmp_path: Path) -> None:
    """Number of workers and order of inputs leave no trace in campaign.json."""
    places = sorted(fleet.iterdir(), reverse=True)
    campaign(tmp_path, *places, '--workers', '2', '--require-mtbf', '96')
    assert (tmp_path / 'campaign.json').read_bytes() == (single / 'campaign.json').read_bytes()


def test_a_resumed_campaign_computes_nothing_again(fleet: Path, single: Path) -> None:
    """What was judged with the same hashes is taken from the folder, and says the same."""
    before = (single / 'campaign.json').read_bytes()
    _, text = campaign(single, fleet, '--workers', '1', '--require-mtbf', '96')
    assert '0 of 6 newly judged' in text
    assert (single / 'campaign.json').read_bytes() == before


def test_another_bag_or_criteria_is_computed(fleet: Path, tmp_path: Path) -> None:
    """A resumed campaign judges only new runs; under new criteria it judges all again."""
    sources = find_sources([str(fleet / 'good_a')])
    write_run(tmp_path / 'new', 5)
    out = Place(tmp_path / 'out', 1)
    assert carry_out(sources, brief(), out)[1].judged == 1
    both = [*sources, *find_sources([str(tmp_path / 'new')])]
    assert carry_out(both, brief(), out)[1].judged == 1
    criteria = tmp_path / 'criteria.yaml'
    code, text = campaign(tmp_path / 'out', fleet / 'good_a', '--criteria', written(criteria))
    assert '1 of 1 newly judged' in text
    assert code == 0


def written(path: Path) -> Path:
    """Write criteria that a standing robot meets."""
    path.write_text(
        'version: 1\nname: site\ncriteria:\n  tilt:\n    value: tip_angle\n    above_deg: 5\n'
    )
    return path


def test_a_spoilt_result_is_computed_again(fleet: Path, tmp_path: Path) -> None:
    """A stored result that is damaged is computed again."""
    sources, place = find_sources([str(fleet / 'good_a')]), Place(tmp_path, 1)
    rows, _ = carry_out(sources, brief(), place)
    fields = '"verdict": 1, "coverage": [], "start_ns": null, "alerts"'
    for spoilt in ('{', '3', '[' * 100_000, f'{{{fields}: 3}}', f'{{{fields}: [{{}}]}}'):
        (tmp_path / str(rows[0].result)).write_text(spoilt)
        assert carry_out(sources, brief(), place)[0] == rows


def test_no_room_for_a_copy_breaks_no_run(fleet: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a recording cannot be fetched for want of a place, its run is not judged, with why."""
    pytest.importorskip('fsspec', reason='extra cluster is not installed')
    (source,) = find_sources([f'file://{fleet}/good_a'])
    monkeypatch.setattr(tempfile, 'tempdir', str(fleet / 'gone'))
    done = judge_source(source, brief())
    assert 'No such file or directory' in done.lost
    assert not done.error


def test_a_place_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    """A campaign's folder that cannot be made is an error before any run is judged."""
    (tmp_path / 'file').write_text('')
    with pytest.raises(AcceptanceError, match='file: '):
        carry_out([], brief(), Place(tmp_path / 'file', 1))


def test_groups_that_cannot_be_compared_are_refused(fleet: Path, tmp_path: Path) -> None:
    """--compare is refused, with the reason, if a group is empty or both share a run."""
    sources = find_sources([str(fleet / 'good_a'), str(fleet / 'tips')])
    rows, _ = carry_out(sources, brief(), Place(tmp_path, 1))
    wrong = {
        'expected two groups, got 1': [('a', '*')],
        'expected runs with judged time, got 0 runs': [('a', '*/good_*'), ('b', '*/nothing')],
        'expected each run in one group': [('a', '*/good_*'), ('b', '*')],
    }
    for text, groups in wrong.items():
        with pytest.raises(AcceptanceError, match=text):
            comparison(rows, [], groups, 0.8)


def test_a_worker_that_dies_takes_one_run_down() -> None:
    """The run that killed its process is not judged, and not broken; all others are done."""
    sources = [Source(name, (name,)) for name in 'abcdef']
    done = {d.source.name: d for d in in_processes(exit_at_b, sources, 2)}
    assert sorted(done) == list('abcdef')
    assert [name for name, d in done.items() if d.lost] == ['b']
    assert not any(d.error for d in done.values())


def test_a_dask_cluster_gives_the_same(fleet: Path, tmp_path: Path, single: Path) -> None:
    """Workers of dask.distributed on loopback judge as processes here do."""
    distributed = pytest.importorskip('distributed', reason='extra cluster is not installed')
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host='127.0.0.1', dashboard_address=':0'
    ) as cluster:
        options = ('--scheduler', cluster.scheduler_address, '--require-mtbf', '96')
        code, text = campaign(tmp_path, fleet, *options)
    assert code == 1, text
    assert (tmp_path / 'campaign.json').read_bytes() == (single / 'campaign.json').read_bytes()


def test_no_scheduler_is_said() -> None:
    """An address where no scheduler listens is an error of one line."""
    pytest.importorskip('distributed', reason='extra cluster is not installed')
    with pytest.raises(AcceptanceError, match='expected a dask scheduler'):
        list(judge_all([], brief(), 1, 'tcp://127.0.0.1:1'))


def schema_of(repository: Path) -> Any:
    """Return the validator of campaign.json."""
    schema = json.loads((repository / 'schema' / 'campaign.schema.json').read_text('utf-8'))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_a_statement_follows_its_schema(
    fleet: Path, single: Path, repository: Path, tmp_path: Path
) -> None:
    """With a requirement, and with a comparison; what is missing or unknown there is refused."""
    validator = schema_of(repository)
    campaign(tmp_path, fleet, '--compare', 'good=*/good_*', '--compare', 'other=*/tips')
    for folder in (single, tmp_path):
        validator.validate(said(folder))
    found = said(single)
    for spoilt in ({**found, 'surprise': 1}, {k: v for k, v in found.items() if k != 'hours'}):
        assert not validator.is_valid(spoilt)


def test_short_runs_go_in_batches_that_all_workers_share(tmp_path: Path) -> None:
    """Every run once, at most 16 of them or 4 MB together, an eighth of a worker's share."""
    small, large = tmp_path / 'small.mcap', tmp_path / 'large.mcap'
    small.write_bytes(b'x')
    large.write_bytes(bytes(5 << 20))
    sources = [Source(f'{k:04d}', (str(large if k % 50 == 7 else small),)) for k in range(1000)]
    sources += [Source('url', ('s3://bucket/run',), remote=True)]
    found = list(batches(sources, 2))
    assert [source for batch in found for source in batch] == sources
    assert max(len(batch) for batch in found) == 16
    assert all(batch[-1].name[2:] in {'07', '57'} for batch in found[:-1] if len(batch) < 16)
    assert [len(batch) for batch in batches(sources[:40], 2)] == [2] * 20


def test_parts_of_a_split_bag_are_one_run() -> None:
    """Files that differ only in their number go together, in the order of the numbers."""
    files = ['d/a_10.mcap', 'd/a_9.mcap', 'd/b.mcap', 'd/notes.txt', 'r/metadata.yaml', 'r/x.db3']
    found = {s.name: s.files for s in sorted_out(files)}
    assert found == {
        'd/a_9.mcap': ('d/a_9.mcap', 'd/a_10.mcap'),
        'd/b.mcap': ('d/b.mcap',),
        'r': ('r/x.db3', 'r/metadata.yaml'),
    }


@pytest.mark.parametrize(
    ('place', 'text'), [('nowhere', 'found nothing'), ('nope://x/y', 'that fsspec knows')]
)
def test_a_place_without_runs_is_one_line(place: str, text: str, tmp_path: Path) -> None:
    """A folder or URL without recordings ends with code 2 and what was expected."""
    code, printed = campaign(tmp_path, place)
    assert (code, printed.count('\n')) == (2, 1)
    assert text in printed


def test_groups_are_compared(fleet: Path, tmp_path: Path) -> None:
    """Two groups are compared side by side, with p-value and power."""
    _, text = campaign(tmp_path, fleet, '--compare', 'good=*/good_*', '--compare', 'other=*/tips')
    words = ' '.join(text.split())
    assert re.search(r'other over good 0 \(0 to [0-9.e+]+\): no difference shown at 80%', words)
    assert '0 of 1 passed, and 2 of 2 passed: no difference shown at 80%' in words
    assert 'MTBF of other over that of good: 0.00' in (tmp_path / 'campaign.html').read_text()
    found = said(tmp_path)['comparison']
    assert [group['failures'] for group in found['groups']] == [0, 1]
    assert 0.0 < found['mtbf']['p'] <= 1.0
    assert 0.0 <= found['mtbf']['power'] <= 1.0


def test_a_requirement_within_reach_passes(fleet: Path, tmp_path: Path) -> None:
    """Two good runs of 4 s demonstrate 0.001 h at 80 %: the exit code is 0."""
    options = ('--require-mtbf', '0.001', '--workers', '1')
    code, text = campaign(tmp_path, fleet / 'good_a', fleet / 'good_b', *options)
    assert code == 0, text
    assert 'judged of 7.96 s recorded' in text  # 0.002 h is no number anybody reads
    assert said(tmp_path)['requirement']['still_to_run_h'] == 0.0


def test_hostile_names_are_escaped(tmp_path: Path) -> None:
    """A folder named like a script stays text on the page."""
    write_run(tmp_path / 'fleet' / '<script>alert(1)<', 0)
    campaign(tmp_path / 'out', tmp_path / 'fleet', '--workers', '1')
    page = (tmp_path / 'out' / 'campaign.html').read_text()
    assert '&lt;script&gt;alert(1)' in page
    assert '<script' not in page


def test_the_page_stands_alone_and_shows_the_trend(single: Path) -> None:
    """One file, no address, a picture, and a closing sentence about the criterion."""
    page = (single / 'campaign.html').read_text()
    assert '<svg' in page
    assert 'src="http' not in page
    assert 'href="http' not in page
    assert 'did not meet this criterion: MTBF of 96 h at 80%' in page
