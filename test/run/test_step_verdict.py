"""The verdict on a step from its alerts, and the folder that holds a run."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.plan.derive import Wanted, derive
from ugv_acceptance.plan.plan import Ground, Step, plan_text, read_plan
from ugv_acceptance.run.catalogue import case_of
from ugv_acceptance.run.folder import open_folder
from ugv_acceptance.run.record import record
from ugv_acceptance.run.report import cells, coverage_of
from ugv_acceptance.run.step_verdict import Done, decide, judge_step, seen_in, whole

CONFIG = load()
PLAN = derive(CONFIG, Wanted(short=True))
WINDOW = (0.0, 5.0, 8.0)
DONE = Done(0, 5, 8)


def step(must: tuple[str, ...] = (), must_not: tuple[str, ...] = ('ERROR', 'STALE')) -> Step:
    """Return a step that expects these alerts."""
    return Step.model_validate(
        {'id': 'a', 'group': 'g', 'title': 't', 'purpose': 'p', 'posture_deg': {},
         'alerts': {'must': must, 'must_not': must_not}}
    )  # fmt: skip


def alert(text: str, start: float, end: float | None) -> dict[str, Any]:
    """Return an alert of a result."""
    level, code, subject = text.split()
    return {'level': level, 'code': code, 'subject': subject, 'start_s': start, 'end_s': end,
            'message': 'm'}  # fmt: skip


ERROR = 'ERROR TIP_OVER left'


@pytest.mark.parametrize(
    ('asked', 'alerts', 'expected'),
    [
        (step(), [], 'PASS'),
        (step(), [alert(ERROR, 6.0, None)], 'FAIL'),
        (step(), [alert(ERROR, 1.0, 4.9)], 'PASS'),
        (step(), [alert(ERROR, 1.0, 5.1)], 'FAIL'),
        (step(), [alert('WARN TIP_OVER left', 6.0, None)], 'PASS'),
        (step(), [alert('STALE INPUT_STALE imu', 6.0, 6.5)], 'INCONCLUSIVE'),
        (step((ERROR,), ()), [], 'FAIL'),
        (step((ERROR,), ()), [alert(ERROR, 1.0, 2.0)], 'PASS'),
        (step((ERROR,), ()), [alert('ERROR TIP_OVER right', 1.0, 2.0)], 'FAIL'),
        (step(('ERROR TIP_OVER',), ()), [alert(ERROR, 8.5, None)], 'FAIL'),
    ],
)
def test_a_step_passes_if_its_alerts_are_those_it_expects(
    asked: Step, alerts: list[dict[str, Any]], expected: str
) -> None:
    """What must be raised was, from the motion on; what must not was not active in the hold."""
    assert decide(asked, alerts, WINDOW, DONE, 1.0)[0] == expected


@pytest.mark.parametrize(
    ('done', 'share', 'expected'),
    [
        (Done(0, 5, 8, stopped='ERROR TIP_OVER left'), 1.0, 'FAIL'),
        (Done(0, 5, 8, fault='the monitor has said nothing'), 1.0, 'INCONCLUSIVE'),
        (Done(0, 5, 8, wrong='the posture was not reached'), 1.0, 'FAIL'),
        (DONE, 0.9, 'INCONCLUSIVE'),
        (Done(0, 5, 8, wrong='the posture was not held'), 0.9, 'FAIL'),
    ],
)
def test_what_was_stopped_or_not_seen_never_passes(done: Done, share: float, expected: str) -> None:
    """A step whose motion was frozen fails; one with missing data is INCONCLUSIVE."""
    assert decide(step(), [], WINDOW, done, share)[0] == expected


@pytest.mark.parametrize(
    ('alerts', 'share', 'expected'),
    [
        ([], 1.0, 'FAIL'),
        ([], 0.9, 'INCONCLUSIVE'),
        ([alert('STALE INPUT_STALE imu', 6.0, 6.5)], 1.0, 'INCONCLUSIVE'),
        ([alert(ERROR, 6.0, None)], 0.9, 'FAIL'),
    ],
)
def test_an_alert_that_does_not_come_while_data_are_missing_shows_nothing(
    alerts: list[dict[str, Any]], share: float, expected: str
) -> None:
    """It may have been due then; what was active all the same still fails."""
    asked = step(('WARN TIP_OVER left',))
    assert decide(asked, alerts, WINDOW, DONE, share)[0] == expected


def test_a_run_is_as_good_as_its_worst_step() -> None:
    """A run's verdict is that of its worst step; a skipped step makes it INCONCLUSIVE."""
    passed, failed, skipped = ({'verdict': v} for v in ('PASS', 'FAIL', 'SKIPPED'))
    assert whole([passed, passed]) == 'PASS'
    assert whole([passed, skipped]) == 'INCONCLUSIVE'
    assert whole([passed, skipped, failed]) == 'FAIL'


def test_a_recording_is_judged_in_its_window(tmp_path: Path) -> None:
    """A run on level ground at rest passes, with its margins and full coverage of the hold."""
    record(CONFIG, case_of('gentle', CONFIG.settings.robot, 1, 3.0), 1, tmp_path / 'run')
    start = int(seen_in(tmp_path / 'run', CONFIG).joined()[0][0])
    done = Done(start, start + 1_000_000_000, start + 2_500_000_000)
    result = judge_step(step(), tmp_path / 'run', CONFIG, done)
    assert result['verdict'] == 'PASS'
    assert result['covered'] > 0.99
    assert 30.0 < result['measured']['tilt_left_deg'] < 70.0


def test_coverage_counts_the_cells_that_were_visited(tmp_path: Path) -> None:
    """A robot that stands still visits one cell, well inside both limits."""
    record(CONFIG, case_of('gentle', CONFIG.settings.robot, 1, 1.0), 1, tmp_path / 'run')
    found = coverage_of(CONFIG, [seen_in(tmp_path / 'run', CONFIG)])
    assert found['cells_visited'] <= 2  # noise may cross the line between two
    for name in ('shoulder_joint', 'elbow_joint'):
        assert found['torque_limit'][name]['outside'] is None
        assert found['torque_limit'][name]['inside'] > 0.3
    assert all(found['tip_limit_deg'][side]['inside'] > 20.0 for side in SIDES)


def test_cells_do_not_see_whole_turns() -> None:
    """A posture and the same posture a turn further are one cell; unknown positions are none."""
    q = np.radians([[12.0, -170.0], [372.0, 190.0], [np.nan, 0.0]])
    assert len(cells(q)) == 1


def opened(path: Path, plan_file: Path, *, resume: bool = False, mode: str = 'sim') -> Any:
    """Open a run's folder."""
    plan_file.write_text(plan_text(PLAN), 'utf-8')
    return open_folder(path, PLAN, plan_file, mode, CONFIG, resume=resume)


def test_a_run_killed_while_it_made_its_folder_is_begun_anew(tmp_path: Path) -> None:
    """Without run.json nothing was begun: neither refused nor taken for a run."""
    out = tmp_path / 'out'
    (out / 'steps').mkdir(parents=True)
    (out / 'plan.yaml').write_text('half of a pl')
    opened(out, tmp_path / 'plan.yaml', resume=True)
    assert read_plan(out / 'plan.yaml') == PLAN
    with pytest.raises(BadConfig, match='use --resume to continue'):
        opened(out, tmp_path / 'plan.yaml')


def test_the_journal_tells_what_began_and_what_came_of_it(tmp_path: Path) -> None:
    """A line an event, in order, each a whole JSON object with its time."""
    folder = opened(tmp_path / 'out', tmp_path / 'plan.yaml')
    folder.note('attempt', step='one', number=1)
    lines = [json.loads(x) for x in (folder.path / 'journal.jsonl').read_text().splitlines()]
    assert [line['event'] for line in lines] == ['begun', 'attempt']
    assert lines[0]['plan_sha256'] == PLAN.sha256
    assert lines[0]['time'] <= lines[1]['time']


def test_a_run_is_continued_only_when_asked(tmp_path: Path) -> None:
    """A folder with a run in it is never written over."""
    opened(tmp_path / 'out', tmp_path / 'plan.yaml')
    with pytest.raises(BadConfig, match='use --resume to continue'):
        opened(tmp_path / 'out', tmp_path / 'plan.yaml')
    opened(tmp_path / 'out', tmp_path / 'plan.yaml', resume=True)


def test_a_run_of_another_mode_is_not_continued(tmp_path: Path) -> None:
    """Results of a robot and of a simulation never stand in one folder."""
    opened(tmp_path / 'out', tmp_path / 'plan.yaml')
    with pytest.raises(BadConfig, match='mode: expected robot, got sim'):
        opened(tmp_path / 'out', tmp_path / 'plan.yaml', resume=True, mode='robot')


@pytest.mark.parametrize('text', ['', '[]', '3', '{"plan": ', '[' * 100_000])
def test_a_run_whose_head_is_broken_is_not_continued(tmp_path: Path, text: str) -> None:
    """A run.json that is no run's is refused in one line that names it."""
    opened(tmp_path / 'out', tmp_path / 'plan.yaml')
    (tmp_path / 'out' / 'run.json').write_text(text)
    with pytest.raises(BadConfig, match=r'run\.json: expected the run to continue, got: '):
        opened(tmp_path / 'out', tmp_path / 'plan.yaml', resume=True)


def test_a_run_needs_a_place(tmp_path: Path) -> None:
    """A run's folder that cannot be made is an error that names it."""
    (tmp_path / 'file').write_text('')
    with pytest.raises(BadConfig, match='file/out: expected a folder to record into'):
        opened(tmp_path / 'file' / 'out', tmp_path / 'plan.yaml')


def test_what_an_interruption_left_is_kept(tmp_path: Path) -> None:
    """The recording of an unfinished step is moved aside, so that nothing recorded is lost."""
    folder = opened(tmp_path / 'out', tmp_path / 'plan.yaml')
    first = PLAN.steps[0]
    for number in (1, 2):
        place = folder.recording(first)
        place.mkdir()
        (place / 'data').write_text(str(number))
    aside = folder.path / 'steps' / f'{first.id}.interrupted-1' / 'data'
    assert aside.read_text() == '1'
    folder.recording(first, 'attempt')
    assert (folder.path / 'steps' / f'{first.id}.attempt-1' / 'data').read_text() == '2'


def test_the_result_names_the_plan_and_every_step(tmp_path: Path) -> None:
    """Steps that were not done are there as skipped, so the run is inconclusive."""
    folder = opened(tmp_path / 'out', tmp_path / 'plan.yaml')
    folder.finish_step(PLAN.steps[0], {'id': PLAN.steps[0].id, 'title': 't', 'verdict': 'PASS',
                                       'reasons': []})  # fmt: skip
    result = folder.finish(CONFIG, coverage_of(CONFIG, []))
    assert result['plan']['sha256'] == PLAN.sha256
    assert [s['id'] for s in result['steps']] == [s.id for s in PLAN.steps]
    assert result['verdict'] == 'INCONCLUSIVE'
    for name in ('report.txt', 'report.html'):
        text = (folder.path / name).read_text()
        assert PLAN.sha256 in text
        assert f'robot files sha256 {CONFIG.sha256}' in text
        assert 'robot serial number not entered\nugv_acceptance ' in text
    assert 'gripper empty: no limit is near, on level ground' in text


def on(**ground: str) -> Step:
    """Return a step on this ground that expects nothing."""
    return step(must_not=()).model_copy(update={'ground': Ground.model_validate(ground)})


@pytest.mark.parametrize(
    ('ground', 'expected', 'told'),
    [
        ({}, 'PASS', 'all alerts as expected'),
        ({'kind': 'flat'}, 'PASS', 'all alerts as expected'),
        ({'kind': 'stairs'}, 'INCONCLUSIVE', 'the ground was taken as stairs for 28.0 s'),
        ({'kind': 'uneven', 'accept': 'trend', 'reason': 'belayed'}, 'PASS', 'accepted (belayed)'),
    ],
)
def test_a_step_on_stairs_passes_by_an_accepted_rule_only(
    repository: Path, ground: dict[str, str], expected: str, told: str
) -> None:
    """Where its alerts are as expected, degrees that are an upper bound still show nothing."""
    bag = repository / 'bags' / 'packbot_pass'
    start = int(seen_in(bag, CONFIG).joined()[0][0])
    done = Done(start, start + 1_000_000_000, start + 20_000_000_000)
    result = judge_step(on(**ground), bag, CONFIG, done)
    assert result['verdict'] == expected
    assert told in result['reasons'][0]
