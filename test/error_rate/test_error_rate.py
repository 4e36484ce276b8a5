"""The error rate in its short form, and that its measurement counts what it should."""

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from error_rate import measure
from error_rate.plan import GOOD, Plan
from made.judged import FAIL, INCONCLUSIVE, PASS
from made.run import messages_of
from made.subjects import PACKBOT, ROBOTS, ROOT, stand_in, subjects
from made.truth import torques
from robots import tracked

from ugv_acceptance.config import load
from ugv_acceptance.report.error_rate import FILE, error_rate_line

PLAN = Plan()


@pytest.mark.parametrize('name', list(PLAN.kinds))
def test_a_run_of_each_kind_is_judged_rightly(name: str, tmp_path: Path) -> None:
    """One run of each kind, drawn within its bounds, gets a verdict that is right of it."""
    numbers = range(2 * len(PLAN.kinds))
    number = next(n for n in numbers if PLAN.kind_of(n).name == name)
    line = measure.one(number, tmp_path)
    assert not line['wrong'], line


def test_a_number_always_gives_the_same_run(tmp_path: Path) -> None:
    """A run can be made again from its number alone, to the byte."""
    assert messages_of(PLAN.run(6, tmp_path).made.parts) == messages_of(
        PLAN.run(6, tmp_path).made.parts
    )


def test_half_of_the_runs_are_faulted_and_all_kinds_have_their_turn() -> None:
    """Numbers are dealt to faulted and good kinds in turn, so that every kind is tried alike."""
    kinds = [PLAN.kind_of(n) for n in range(4000)]
    assert sum(kind.half == GOOD for kind in kinds) == 2000
    counts = [sum(kind.name == name for kind in kinds) for name in PLAN.kinds]
    assert min(counts) > 50


@pytest.mark.parametrize(
    ('kind', 'verdict', 'fault'),
    [
        ('ordinary', PASS, ''),
        ('ordinary', INCONCLUSIVE, measure.NOT_PASSED),
        ('ordinary', FAIL, measure.WRONG_FAIL),
        ('both_silent', PASS, measure.WRONG_PASS),
        ('both_silent', INCONCLUSIVE, ''),
        ('both_silent', FAIL, measure.WRONG_FAIL),
        ('payload_first', PASS, ''),
        ('payload_first', FAIL, measure.WRONG_FAIL),
        ('falls', INCONCLUSIVE, measure.NOT_FAILED),
        ('falls', PASS, measure.WRONG_PASS),
    ],
)
def test_a_verdict_is_counted_as_what_it_is(kind: str, verdict: str, fault: str) -> None:
    """A PASS of a faulted run is a wrong PASS, a FAIL of what is well a wrong FAIL."""
    assert measure.wrong(PLAN.kinds[kind], verdict, pardoned=False) == fault


def test_a_pass_that_names_what_was_not_judged_is_pardoned() -> None:
    """Where nobody can know, a PASS beside the words that say so is right."""
    assert not measure.wrong(PLAN.kinds['limit_null'], PASS, pardoned=True)


def test_bounds_are_exact() -> None:
    """With no error in n runs the upper 95 % bound is the rate at which that has 5 % chance."""
    assert measure.upper(0, 2000) == pytest.approx(1.0 - 0.05 ** (1.0 / 2000.0))
    assert measure.upper(0, 1) == pytest.approx(0.95)
    assert measure.upper(3, 3) == 1.0


def test_a_measurement_goes_on_where_it_was(tmp_path: Path) -> None:
    """What is in the file is not judged again; a line that a kill cut short is."""
    file, done = tmp_path / 'results.jsonl', []
    measure.measure(file, [67], tmp_path, 1, lambda: done.append(1))
    text = file.read_text(encoding='utf-8')
    file.write_text(text + '{"number": 69, "ki', encoding='utf-8')
    lines = measure.measure(file, [67, 69], tmp_path, 1, lambda: done.append(1))
    assert len(done) == 2
    assert [line['number'] for line in lines] == [67, 69]
    assert [line['number'] for line in measure.lines_of(file)] == [67, 69]


def test_results_of_other_code_or_another_plan_are_not_mixed_in(tmp_path: Path) -> None:
    """A file whose first line has other hashes is refused."""
    file = tmp_path / 'results.jsonl'
    file.write_text(
        json.dumps(measure.head() | {'program_sha256': 'other'}) + '\n', encoding='utf-8'
    )
    with pytest.raises(measure.OtherResultsError, match=r'move it away'):
        measure.lines_of(file)


def test_the_table_stands_between_its_marks_in_the_documentation(tmp_path: Path) -> None:
    """What is published replaces what stood between the marks, and nothing else."""
    page = f'before {measure.MARK_BEGIN} old {measure.MARK_END} after'
    line = measure.one(67, tmp_path)
    once = measure.published(page, [line])
    assert once.startswith('before ')
    assert once.endswith(' after')
    assert line['kind'] in once
    assert ' old ' not in once
    assert measure.published(once, [line]) == once
    assert measure.MARK_END in (ROOT / 'docs' / 'error_rate.md').read_text(encoding='utf-8')


def test_the_robot_that_stands_in_for_those_of_others_is_itself(tmp_path: Path) -> None:
    """Written as a URDF and read again, the stand-in holds itself as before."""
    read = load(stand_in().config(tmp_path)).settings.robot
    q, up = np.array([[0.3, 0.8, -1.1, 2.0]]), np.array((0.0, 0.0, 1.0))
    assert torques(read, q, up) == pytest.approx(torques(tracked(), q, up))


def test_robots_of_others_take_part_where_they_are_here() -> None:
    """PackBot always takes part, and either the robots of ../shared or the stand-in."""
    assert PACKBOT in subjects()
    assert ('husky' in subjects()) is ROBOTS.is_dir()
    assert ('tracked' in subjects()) is not ROBOTS.is_dir()


def test_the_report_prints_the_rates_that_were_measured() -> None:
    """Every rate with its counts and bound; and says so where none was measured."""
    lines = [
        {'kind': kind.name, 'half': kind.half, 'wrong': '', 'verdict': 'PASS', 'number': k}
        for k, kind in enumerate(Plan().kinds.values())
    ]
    told = measure.published_rates(lines)
    assert told['kinds'] == len(lines)
    assert [x['wrong'] for x in told['rates']] == [0, 0, 0]
    n = told['rates'][0]['runs']
    assert told['rates'][0]['most'] == pytest.approx(1.0 - 0.05 ** (1.0 / n))
    line = error_rate_line()
    measured = (files('ugv_acceptance.report') / FILE).is_file()
    assert ('runs that must not pass' in line) == measured
    assert line.startswith('Error rate of verdicts')
