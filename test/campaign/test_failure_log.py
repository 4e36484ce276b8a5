"""The failure log a person writes: what it adds, what it corrects, and how it is refused."""

import json
from pathlib import Path

import pytest
from campaign.fleet import brief

from ugv_acceptance import BadConfig
from ugv_acceptance.campaign.carry_out import Place, all_failures, carry_out
from ugv_acceptance.campaign.failure_log import read_log
from ugv_acceptance.campaign.failures import Failure
from ugv_acceptance.campaign.run_table import Row
from ugv_acceptance.campaign.sources import find_sources
from ugv_acceptance.campaign.statement import Origin, Question, failure_times, statement
from ugv_acceptance.report.campaign import campaign_page, closing

LOG = """
failures:
  - run: tips
    alert: TIP_OVER
    class: design
    impact: terminal
    repairability: field-repairable
    repair_h: 0.5
    what: fell off the ramp
  - run: good_a
    at_s: 2.0
    class: power
    what: battery contact lost
    repair_h: 1.5
  - run: silent
    alert: INPUT_STALE
    chargeable: no
    repair_h: 0
"""
AS_CSV = """run,alert,class,impact,repairability,repair_h,what,at_s,chargeable
tips,TIP_OVER,design,terminal,field-repairable,0.5,fell off the ramp,,
good_a,,power,,,1.5,battery contact lost,2.0,
silent,INPUT_STALE,,,,0,,,no
"""


@pytest.fixture(scope='module')
def rows(fleet: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Row]:
    """The runs of the fleet, judged."""
    place = Place(tmp_path_factory.mktemp('out'), 1)
    return carry_out(find_sources([str(fleet)]), brief(), place)[0]


def written(folder: Path, text: str, name: str = 'log.yaml') -> Path:
    """Write a log."""
    path = folder / name
    path.write_text(text)
    return path


def failures(rows: list[Row], path: Path) -> list[Failure]:
    """Return the failures with those of a log."""
    return all_failures(rows, read_log(path))


def test_the_log_corrects_alerts_and_adds_failures(rows: list[Row], tmp_path: Path) -> None:
    """An entry with an alert replaces its suspicion; one without is a failure of its own."""
    found = failures(rows, written(tmp_path, LOG))
    told = {(f.origin, f.path, f.chargeable) for f in found}
    assert told == {
        ('alert and log', 'human / design', True),
        ('log', 'physical / power', True),
        ('alert and log', 'physical / communications', False),
    }


def test_csv_and_yaml_say_the_same(rows: list[Row], tmp_path: Path) -> None:
    """The same log in both forms gives the same failures."""
    one = failures(rows, written(tmp_path, LOG))
    assert failures(rows, written(tmp_path, AS_CSV, 'log.csv')) == one


def test_availability_needs_every_repair(rows: list[Row], tmp_path: Path) -> None:
    """Two repairs took 2 h; without the time of one nothing can be said of availability."""
    origin = Origin('packbot', '', 'limits', None)
    known = statement(rows, failures(rows, written(tmp_path, LOG)), Question(), origin)
    hours = known['hours']['judged']
    assert known['availability']['value'] == pytest.approx(hours / (hours + 2.0))
    without = statement(rows, all_failures(rows, []), Question(), origin)
    assert without['availability']['value'] is None
    assert without['availability']['repairs_unknown'] == 2


def test_failures_are_dated_by_the_time_judged_before(rows: list[Row], tmp_path: Path) -> None:
    """A failure 2 s into the first run and one in the second, in hours of the whole campaign."""
    times = failure_times(rows, failures(rows, written(tmp_path, LOG)))
    assert times[0] * 3600 == pytest.approx(2.0, abs=0.02)
    assert times[1] * 3600 == pytest.approx(3.98 + 1.7, abs=0.1)


def test_a_campaign_that_ends_by_failure_counts_hours_up_to_it(rows: list[Row]) -> None:
    """Failure-terminated: the time after the last failure does not count."""
    origin = Origin('packbot', '', 'limits', None)
    found = statement(rows, all_failures(rows, []), Question(failure_terminated=True), origin)
    last = found['trend']['failure_times_h'][-1]
    assert found['hours']['counted'] == last < found['hours']['judged']
    assert found['mtbf_h']['ended_by'] == 'failure'
    json.dumps(found, allow_nan=False)


def test_a_trend_is_drawn_as_its_power_law(rows: list[Row], tmp_path: Path) -> None:
    """From three failures on a slope is fitted, and the page draws and names it."""
    entries = ''.join(f'- {{run: good_a, what: stuck, at_s: {t}}}\n' for t in (0.5, 1.0, 2.0))
    found = failures(rows, written(tmp_path, entries))
    said = statement(rows, found, Question(), Origin('packbot', '', 'limits', None))
    law, page = said['trend']['power_law'], campaign_page(said)
    assert law['beta'] > 0.0
    assert f'power law, slope {law["beta"]:.2f}' in page
    assert closing(said) in page


@pytest.mark.parametrize(
    ('entry', 'text'),
    [
        ('{run: good_a, klass: power}', ':2: klass: expected one of run, '),
        ('{run: good_a, class: gremlins}', "class: expected one of effector, .*got 'gremlins'"),
        ('{run: good_a, repair_h: -1}', 'repair_h: expected a number of 0 or more, got -1'),
        ('{run: good_a, at_s: soon}', "at_s: expected a number of 0 or more, got 'soon'"),
        ('{what: no run}', 'run: expected the name of a run, got none'),
        (
            '{run: nowhere}',
            "run: expected one run of the campaign, got 'nowhere': no run name ends with it",
        ),
        ('{run: good_a, alert: TIP_OVER}', 'alert: expected a critical alert of this run'),
        ('just words', 'expected fields of a failure, got str'),
    ],
)
def test_a_wrong_entry_is_refused(entry: str, text: str, rows: list[Row], tmp_path: Path) -> None:
    """A wrong entry is refused with file, line, field, what was expected and what came."""
    path = written(tmp_path, f'\n- {entry}\n')
    with pytest.raises(BadConfig, match=text) as caught:
        failures(rows, path)
    assert f'{path}:2:' in str(caught.value)


@pytest.mark.parametrize(
    ('name', 'content', 'text'),
    [
        ('log.csv', b'run,what\ngood_a,fell,twice\n', ':2: expected as many fields as the head'),
        ('log.csv', b'run,what\n"' + b'x' * 200_000 + b'"\n', ':2: expected CSV, got: '),
        ('log.csv', b'run\n\xff\n', 'expected UTF-8 text'),
        ('log.yaml', b'run: good_a\n', ':1: expected a list of failures, got dict'),
        ('log.yaml', b' ' * 20_000_001, 'expected a failure log below 20 MB'),
        ('gone.yaml', None, 'expected a failure log, got: No such file or directory'),
    ],
)
def test_a_file_that_is_no_log_is_refused(
    name: str, content: bytes | None, text: str, tmp_path: Path
) -> None:
    """A file that is no failure log is refused with file, line and what was expected."""
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BadConfig, match=text) as caught:
        read_log(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize('text', ['', 'failures:\n'])
def test_a_log_without_an_entry_is_one(text: str, tmp_path: Path) -> None:
    """An empty failure log is valid."""
    assert read_log(written(tmp_path, text)) == []


def test_an_entry_may_name_a_copy(rows: list[Row], tmp_path: Path) -> None:
    """An entry about a copy counts for the recording that it copies."""
    found = failures(rows, written(tmp_path, '- {run: good_copy, class: sensor}'))
    assert [f.run.rpartition('/')[2] for f in found if f.origin == 'log'] == ['good_b']
