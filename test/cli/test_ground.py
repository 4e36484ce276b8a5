"""The kind of ground on the command line: what holds is said wherever margins are shown."""

import json
from pathlib import Path

import pytest
from jsonschema import validate

from ugv_acceptance import AcceptanceError, BadConfig
from ugv_acceptance.cli.evidence import Papers, evaluate_files
from ugv_acceptance.cli.ground_option import ground_from
from ugv_acceptance.cli.model_text import print_tables
from ugv_acceptance.cli.result_text import print_result
from ugv_acceptance.cli.robot_description import describe
from ugv_acceptance.cli.verify import again, compare, ground_of
from ugv_acceptance.config import Config, load
from ugv_acceptance.evaluation.ground import STAIRS, UNEVEN, Ground, GroundWindow
from ugv_acceptance.offline.annotation import Annotation
from ugv_acceptance.offline.evaluate import evaluate

ROOT = Path(__file__).parents[2]
BAG = ROOT / 'bags' / 'packbot_pass'


def robot(folder: Path, kind: str) -> Path:
    """Return a PackBot's file that enters this kind of ground."""
    text = (ROOT / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    path = folder / 'robot.yaml'
    text = text.replace('../urdf', str(ROOT / 'urdf')).replace(
        'ground:', f'ground:\n  kind: {kind}'
    )
    path.write_text(text, 'utf-8')
    return path


def test_the_option_reads_kinds_and_windows() -> None:
    """A bare kind holds all the time, one with times in them; times without a unit are in s."""
    assert ground_from([]) is None
    assert ground_from(['uneven']) == Ground(UNEVEN)
    windows = (GroundWindow(STAIRS, 12.0, 40.0), GroundWindow(UNEVEN, 0.5, 3.0))
    assert ground_from(['stairs=12s..40s', 'uneven=500ms..3']) == Ground(windows=windows)


@pytest.mark.parametrize(
    ('texts', 'told'),
    [
        (['rubble'], "--ground rubble: expected one of flat, uneven, stairs, got 'rubble'"),
        (['stairs=12s'], 'expected times such as stairs=12s..40s'),
        (['stairs=12s..4s'], 'expected a start from 0 on and an end after it'),
        (['stairs=-1..4'], 'expected a start from 0 on'),
        (['stairs=1m..4m'], 'expected a time'),
        (['=1..4'], 'expected one of flat, uneven, stairs'),
        (['flat', 'stairs'], 'expected one kind for all the time, got flat and stairs'),
    ],
)
def test_what_is_no_ground_is_refused(texts: list[str], told: str) -> None:
    """One line says what was expected and what came."""
    with pytest.raises(BadConfig) as raised:
        ground_from(texts)
    assert told in str(raised.value)


def test_result_text_json_report_and_verify_say_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The ground entered for a window stands in text, JSON and report; verify enters it again."""
    page = tmp_path / 'r.html'
    papers = Papers(report=page, ground=ground_from(['stairs=12s..20s']))
    found = evaluate_files([BAG], load(), papers)
    print_result(found.result, verbose=True)
    text = ' '.join(capsys.readouterr().out.split())
    line = 'ground, as entered: stairs from 12 to 20 s, else flat; where it is not flat, margins'
    assert line in text
    assert '<= 32.' in text
    result = json.loads(found.to_json())
    validate(result, json.loads((ROOT / 'schema' / 'result.schema.json').read_text('utf-8')))
    assert result['ground']['windows'] == [{'kind': 'stairs', 'start_s': 12.0, 'end_s': 20.0}]
    assert line.removeprefix('g') in page.read_text('utf-8')
    assert not compare(result, again(result, tmp_path, None, None, None, None))
    result['declared_ground']['windows'][0]['end_s'] = 25.0
    assert compare(result, again(result, tmp_path, None, None, None, None))


@pytest.mark.parametrize('said', [3, {'kind': 'rubble', 'windows': []}, {'kind': 'flat'}])
def test_verify_refuses_a_ground_that_is_none(said: object) -> None:
    """What stands in a result in place of a ground is one line, not a trace."""
    with pytest.raises(AcceptanceError, match='declared_ground: expected'):
        ground_of({'declared_ground': said})


def shown(config: Config, posture: str, capsys: pytest.CaptureFixture[str]) -> str:
    """Return what `model` prints of a robot in a posture."""
    print_tables(describe(config, posture))
    return ' '.join(capsys.readouterr().out.split())


def test_the_model_calls_the_tilt_an_upper_bound(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On flat ground nobody entered it says so; on stairs cautious margins stand beside."""
    posture = 'shoulder_joint=90deg,elbow_joint=-90deg,flipper_joint=180deg'
    assert 'Ground: flat (not entered) ' in shown(load(), posture, capsys)
    raised = shown(load(), 'flipper_joint=-40deg', capsys)
    assert 'the flippers carry the body: this holds on flat ground only' in raised
    stairs = load(robot(tmp_path, 'stairs'))
    text = shown(stairs, posture, capsys)
    assert 'Ground: stairs, so the tilt left is an upper bound; taken cautiously' in text
    assert '(upper bound)' in text
    assert '<= ' in text
    said = describe(stairs, posture)
    assert said['ground']['kind'] == 'stairs'
    assert said['ground']['cautious_deg']['front'] < said['sides']['front']['tilt_left_deg']


def test_an_annotated_recording_says_it_at_each_moment() -> None:
    """In the window the verdicts beside a recording call the tilt left an upper bound."""
    found = evaluate(BAG, ground=Ground(windows=(GroundWindow(STAIRS, 12.0, 20.0),)))
    start, seen = found.recording.start_ns, {}
    told = Annotation(found)
    topics = list(told.types)
    for block in told.said():
        for log_time, _, channel, data in block.messages():
            if topics[channel] == '/acceptance_monitor/verdict':
                seen[(log_time - start) / 1e9] = data
    flat = [data for at, data in seen.items() if not 11.9 < at < 20.1]
    stairs = [data for at, data in seen.items() if 12.6 < at < 20.0]
    assert stairs
    assert all(b'flat' in data and b'upper bound' not in data for data in flat)
    assert all(b'stairs' in data and b'upper bound' in data for data in stairs)
    assert not any(b'all margins kept' in data for data in stairs)
