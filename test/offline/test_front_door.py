"""The Python front door: what `import ugv_acceptance` offers, and that commands say the same."""

import csv
import doctest
import json
import math
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pyarrow as pa
import pytest
from offline.typed_use import both
from typer.testing import CliRunner

import ugv_acceptance as ugv
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.writer import BagWriter, Qos

RUNS = {'packbot_pass': 'PASS', 'packbot_fail': 'FAIL', 'packbot_gap': 'INCONCLUSIVE'}
WITH_EXAMPLES = ('bag.recording', 'config.loading', 'offline.evaluate', 'monitoring.live_evaluator')
S = 1_000_000_000


@pytest.fixture(scope='module')
def found(repository: Path) -> dict[str, ugv.Evaluation]:
    """Return the evaluations of the recordings that ship, by name."""
    return {name: ugv.evaluate(repository / 'bags' / name) for name in RUNS}


each_run = pytest.mark.parametrize('name', RUNS)


@each_run
def test_a_recording_is_judged_by_its_path(found: dict[str, ugv.Evaluation], name: str) -> None:
    """`evaluate` takes a path and gives verdict, reasons and criteria."""
    result = found[name]
    assert result.verdict == RUNS[name]
    assert result.reasons
    assert result.verdict in {c.verdict for c in result.criteria} | {'PASS'}


@each_run
def test_its_json_has_the_published_layout(
    found: dict[str, ugv.Evaluation], repository: Path, name: str
) -> None:
    """What `to_json` returns validates against schema/result.schema.json."""
    schema = json.loads((repository / 'schema' / 'result.schema.json').read_text('utf-8'))
    jsonschema.Draft202012Validator(schema).validate(json.loads(found[name].to_json()))


@each_run
def test_it_is_the_result_of_the_command(
    found: dict[str, ugv.Evaluation], repository: Path, tmp_path: Path, name: str
) -> None:
    """`ugv-acceptance evaluate --json` writes what `to_json` returns, to the letter."""
    out = tmp_path / 'r.json'
    command = [sys.executable, '-c', 'from ugv_acceptance.cli import main; main()']
    done = subprocess.run(
        [*command, 'evaluate', repository / 'bags' / name, '--json', out],
        capture_output=True,
        check=False,
    )
    assert done.returncode == {'PASS': 0, 'FAIL': 1, 'INCONCLUSIVE': 3}[RUNS[name]]
    assert out.read_text('utf-8') == found[name].to_json()


def test_margins_are_columns_of_one_length(found: dict[str, ugv.Evaluation]) -> None:
    """Every column has a row a message; unknown rows are NaN and no other is."""
    result = found['packbot_gap']
    margins, messages = result.margins, result.to_dict()['bag']
    assert isinstance(messages, dict)
    counts = messages['messages']
    n, joints = len(margins), len(margins.joints)
    assert n == counts['/joint_states'] + counts['/imu/data']
    assert margins.tip_angle.shape == (n, len(margins.sides))
    assert margins.static_torque.shape == margins.torque_margin.shape == (n, joints)
    assert (np.isnan(margins.static_torque).all(axis=1) == ~margins.known).all()
    assert 0 < margins.known.sum() < n


def test_the_least_margin_of_the_columns_is_that_of_the_result(
    found: dict[str, ugv.Evaluation],
) -> None:
    """Summary and columns tell of the same worst moment."""
    result = found['packbot_fail']
    told: Any = result.to_dict()['stability']
    margins = result.margins
    least = np.unravel_index(np.nanargmin(margins.tip_angle), margins.tip_angle.shape)
    assert told['edge'] == margins.sides[least[1]]
    assert told['time_of_min_s'] == margins.time_s[least[0]]
    assert told['min_angle_deg'] == float(np.degrees(margins.tip_angle[least]))


def test_a_table_has_the_columns_of_the_csv(
    found: dict[str, ugv.Evaluation], repository: Path, tmp_path: Path
) -> None:
    """Arrow's and pandas' tables hold what --csv writes, under the same names."""
    import typer  # noqa: PLC0415 - the same

    from ugv_acceptance.cli import evaluate  # noqa: PLC0415 - the verb

    command = typer.Typer()
    command.command()(evaluate.evaluate)
    out = tmp_path / 'm.csv'
    arguments = [str(repository / 'bags' / 'packbot_fail'), '--csv', str(out)]
    CliRunner().invoke(command, arguments)
    with out.open(encoding='utf-8') as file:
        rows = list(csv.DictReader(file))
    table = found['packbot_fail'].table('arrow')
    assert isinstance(table, pa.Table)
    assert table.num_rows == len(rows)
    assert set(rows[0]) <= set(table.column_names)
    for name in rows[0]:
        written = [row[name] for row in rows[:: max(1, len(rows) // 50)]]
        held = table[name].to_pylist()[:: max(1, len(rows) // 50)]
        if name == 'state':
            assert written == held
        else:
            numbers = [float(text) if text else None for text in written]
            finite = [x if x is not None and math.isfinite(x) else None for x in held]
            assert numbers == pytest.approx(finite, abs=1e-9)


def test_a_library_that_is_not_there_is_named(
    found: dict[str, ugv.Evaluation], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without PyArrow and pandas, `table` says in one line what to install."""
    monkeypatch.setitem(sys.modules, 'pyarrow', None)
    monkeypatch.setitem(sys.modules, 'pandas', None)
    with pytest.raises(ugv.AcceptanceError, match='pip install'):
        found['packbot_pass'].table()


def test_a_declared_payload_counts_where_no_message_says_otherwise() -> None:
    """A payload given to `evaluate` is in force until a message declares another."""
    config = ugv.load_config('packbot')
    light = ugv.LiveEvaluator(config)
    heavy = ugv.LiveEvaluator(config)
    torque = []
    for live, mass in ((light, 0.0), (heavy, 4.0)):
        live.payload(mass, time_ns=S)
        live.joint_state(live.joint_names, [0.0] * len(live.joint_names), time_ns=S)
        margins = live.imu((0.0, 0.0, 9.81), time_ns=S)
        assert margins is not None
        torque.append(abs(margins.static_torque['shoulder_joint']))
    assert torque[1] - torque[0] > 4.0 * 9.81 * 0.5


def test_a_payload_that_is_no_mass_is_refused(repository: Path) -> None:
    """A payload below zero is an error that says what was expected."""
    with pytest.raises(ugv.BadConfig, match='payload: expected kg from 0 on'):
        ugv.evaluate(repository / 'bags' / 'packbot_pass', payload=-1.0)


def test_samples_come_in_the_order_of_the_log(repository: Path) -> None:
    """Iterating a recording gives every message of its inputs once, in order."""
    recording = ugv.open_recording(repository / 'bags' / 'packbot_gap')
    samples = list(recording)
    times = [sample.time_ns for sample in samples]
    assert times == sorted(times)
    assert len(samples) == sum(topic.count for topic in recording.topics.values())


def test_a_robot_fed_from_python_raises_the_alerts_of_the_recording(
    found: dict[str, ugv.Evaluation], repository: Path
) -> None:
    """Messages taken one by one give the alerts that the evaluation of the recording gives."""
    live = ugv.LiveEvaluator('packbot')
    for sample in ugv.open_recording(repository / 'bags' / 'packbot_fail'):
        live.take(sample)
    told = [(a.code, a.subject, a.level, round(a.start_s, 6)) for a in live.alerts]
    expected = found['packbot_fail'].alerts
    assert sorted(told) == sorted(
        (a.code, a.subject, a.level, round(a.start_s, 6)) for a in expected
    )


def test_topics_that_a_user_names_are_those_judged(repository: Path, tmp_path: Path) -> None:
    """The names given to `open_recording` go before those of the configuration."""
    source = ugv.open_recording(repository / 'bags' / 'packbot_pass')
    kinds = {name: source.topics[name].type for name in source.topics}
    with BagWriter(tmp_path / 'two') as writer:
        for name, kind in kinds.items():
            writer.add_topic(name, kind, Qos())
        writer.add_topic('/other/imu', kinds['/imu/data'], Qos())
        for logged in messages(source.bag, kinds):
            writer.write(logged.topic, logged.log_time, logged.data)
            if logged.topic == '/imu/data':
                writer.write('/other/imu', logged.log_time, logged.data)
    names = ('joint_states', 'other/imu', 'payload')
    named = ugv.evaluate(ugv.open_recording(tmp_path / 'two', names=names))
    assert named.judgement.topics.imu == '/other/imu'
    assert ugv.evaluate(tmp_path / 'two').judgement.topics.imu == '/imu/data'


def test_silence_takes_the_margins_away() -> None:
    """Margins are None once an input has been silent too long, and the level is STALE."""
    live = ugv.LiveEvaluator('packbot')
    live.joint_state(live.joint_names, [0.0] * len(live.joint_names), time_ns=S)
    assert live.imu((0.0, 0.0, 9.81), time_ns=S) is not None
    live.tick(3 * S)
    assert live.margins is None
    assert live.level == 'STALE'


def test_numbers_that_do_not_fit_are_refused() -> None:
    """A message whose lengths disagree is a BadSample, and nothing of it is taken."""
    live = ugv.LiveEvaluator('packbot')
    with pytest.raises(ugv.BadSample, match='position: expected 2 numbers, got 1'):
        live.joint_state(('a', 'b'), (1.0,))
    with pytest.raises(ugv.BadSample, match='expected 3 numbers, got 2'):
        live.imu((0.0, 9.81))


@pytest.mark.parametrize('module', WITH_EXAMPLES)
def test_the_examples_of_the_docstrings_are_true(
    module: str, repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every example in a docstring of the front door prints what it says."""
    monkeypatch.chdir(repository)
    failed, tried = doctest.testmod(import_module(f'ugv_acceptance.{module}'))
    assert tried > 0
    assert failed == 0


@pytest.mark.parametrize('name', ['judge_a_recording', 'watch_a_robot'])
def test_the_example_scripts_run(repository: Path, name: str) -> None:
    """The scripts in docs/examples find the tip-over of the run that fails."""
    script = repository / 'docs' / 'examples' / f'{name}.py'
    done = subprocess.run(
        [sys.executable, script], cwd=repository, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert re.search('(to|past) tipping: RIGHT', done.stdout)


def test_the_page_for_python_is_true(
    repository: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every block of code in docs/python.md runs, and the first prints what the page says."""
    monkeypatch.chdir(repository)
    text = (repository / 'docs' / 'python.md').read_text('utf-8')
    fences = re.findall(r'^```(\w*)\n(.*?)^```$', text, re.DOTALL | re.MULTILINE)
    blocks = [content for kind, content in fences if kind == 'python']
    shown = [content for kind, content in fences if not kind]
    assert len(blocks) > 3
    names: dict[str, object] = {}
    for k, block in enumerate(blocks):
        exec(compile(block, f'<docs/python.md, block {k + 1}>', 'exec'), names)  # noqa: S102 - ours
        if k == 0:
            assert capsys.readouterr().out == shown[0]


def test_every_part_of_it_can_be_used(repository: Path) -> None:
    """A user's file that uses all of the front door, which mypy finds free of Any, also runs."""
    told, margins = both(str(repository / 'bags' / 'packbot_pass'))
    assert 'PASS' in told
    assert {'front', 'left', 'rear', 'right', 'shoulder_joint'} <= set(margins)


def test_the_import_is_cheap() -> None:
    """`import ugv_acceptance` loads neither NumPy nor anything else that is heavy."""
    code = (
        'import sys; before = set(sys.modules); import ugv_acceptance; '
        'print(sorted(name.split(".")[0] for name in set(sys.modules) - before))'
    )
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert 'numpy' not in done.stdout
    assert 'pydantic' not in done.stdout


def test_every_public_name_is_there() -> None:
    """Every name in `__all__` can be imported and is listed by `dir`."""
    assert all(getattr(ugv, name) is not None for name in ugv.__all__)
    assert set(ugv.__all__) <= set(dir(ugv))


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    """A wrong name fails as that of any module does."""
    with pytest.raises(AttributeError, match='no attribute'):
        ugv.judge_everything  # noqa: B018 - asking is the test
