"""TAB: the values of options, asked for as bash and zsh ask for them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from cli.here import ugv

from ugv_acceptance.cli import completion
from ugv_acceptance.evaluation.alerts.messages import ALERTS
from ugv_acceptance.evaluation.ground import KINDS
from ugv_acceptance.run.catalogue import names
from ugv_acceptance.simulation.faults import KINDS as FAULTS
from ugv_acceptance.studies.orientations import ORIENTATIONS

REPOSITORY = Path(__file__).parents[2]
SHIPPED = sorted(path.stem for path in (REPOSITORY / 'msg_configs').glob('*.yaml'))
SCRIPT = Path(sys.executable).with_name('ugv-acceptance')
PLAN = REPOSITORY / 'bags' / 'packbot_short_plan.yaml'


def bash(typed: str, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return what bash is answered at the end of what was typed."""
    words = f'ugv-acceptance {typed}'
    monkeypatch.setenv('_UGV_ACCEPTANCE_COMPLETE', 'complete_bash')
    monkeypatch.setenv('COMP_WORDS', words)
    monkeypatch.setenv('COMP_CWORD', str(len(words.split(' ')) - 1))
    return ugv().stdout.split()


@pytest.mark.parametrize(
    ('typed', 'offered'),
    [
        ('evaluate run --config ', SHIPPED),
        ('model -c packbot_', ['packbot_eod']),
        ('verify r.json --config ab', ['abitobot']),
        ('evaluate run --ground ', ['flat', 'uneven', 'stairs']),
        ('check reach.yaml --ground u', ['uneven']),
        ('check reach.yaml --config packbot_eod --posture ST', ['STOW', 'STAIRS']),
        ('map ', ['torque', 'rollover', 'payload', 'drag']),
        ('map drag --orientation nose-down', ['nose-down', 'nose-down-right', 'nose-down-left']),
        ('map --y elbow', ['elbow_joint']),
        ('simulate over', ['overreach']),
        ('simulate gentle --fault dead', ['dead', 'dead-encoder']),
        ('init my.urdf --tilt ', ['real', 'not-real']),
        ('model --config packbot_eod --posture ST', ['STOW', 'STAIRS']),
        (f'run {PLAN} --only ro', ['rollover']),
        ('evaluate run --json ', []),
        ('ev', ['evaluate']),
    ],
)
def test_bash_is_offered_the_values(
    typed: str, offered: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that begin as what was typed; nothing leaves the word to the shell, for files."""
    monkeypatch.chdir(tmp_path)
    assert bash(typed, monkeypatch) == offered


def test_a_configuration_of_this_folder_is_offered_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside those that ship; a hidden file is not."""
    monkeypatch.chdir(tmp_path)
    for name in ('mine.yaml', '.hidden.yaml'):
        Path(name).touch()
    assert bash('model --config ', monkeypatch) == [*SHIPPED, 'mine.yaml']


@pytest.mark.parametrize('verb', ['info', 'doctor'])
def test_recordings_are_offered(verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """rosbag2 folders, files of recordings, and with a slash the folders on the way to others."""
    monkeypatch.chdir(tmp_path)
    for name in ('run1/metadata.yaml', 'runs/day/run2.mcap', 'run.mcap', 'run.yaml', '.run.mcap'):
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).touch()
    assert bash(f'{verb} ru', monkeypatch) == ['run.mcap', 'run1', 'runs/']
    assert bash(f'{verb} runs/d', monkeypatch) == ['runs/day/']
    assert bash(f'{verb} runs/day/', monkeypatch) == ['runs/day/run2.mcap']
    assert bash(f'{verb} nowhere/', monkeypatch) == []


@pytest.mark.skipif(not SCRIPT.exists(), reason='by colcon the script is elsewhere: the first test')
def test_the_installed_script_answers_zsh(tmp_path: Path) -> None:
    """By the variables that its completion script sets."""
    asked = {'_UGV_ACCEPTANCE_COMPLETE': 'complete_zsh', '_TYPER_COMPLETE_ARGS': 'ugv-acceptance '
             'model --config packbot'}  # fmt: skip
    known = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    done = subprocess.run(
        [SCRIPT], cwd=tmp_path, env={**known, **asked}, capture_output=True, text=True, check=False
    )
    assert done.stderr == ''
    assert '"packbot"' in done.stdout
    assert '"packbot_eod"' in done.stdout


def test_the_words_offered_are_those_of_the_tables() -> None:
    """They stand apart from them, so that a TAB imports neither NumPy nor MuJoCo."""
    assert set(completion.GROUNDS) == set(KINDS)
    assert tuple(ORIENTATIONS) == completion.ORIENTATIONS
    assert tuple(FAULTS) == completion.FAULTS
    assert tuple(names()) == completion.SCENARIOS
    assert completion.codes_like('TIP_O') == [code for code in ALERTS if code.startswith('TIP_O')]


def test_a_tab_imports_nothing_heavy() -> None:
    """A list of words is there at once: no NumPy, no MuJoCo, no ROS."""
    code = (
        'import sys\nfrom ugv_acceptance.cli import main\ntry: main()\nfinally: print(*sys.modules)'
    )
    asked = {'_UGV_ACCEPTANCE_COMPLETE': 'complete_bash', 'COMP_CWORD': '3',
             'COMP_WORDS': 'ugv-acceptance map --orientation l'}  # fmt: skip
    known = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    done = subprocess.run(
        [sys.executable, '-c', code], env={**known, **asked}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    offered, *others = done.stdout.split()
    assert offered == 'level', done.stderr
    assert not {'numpy', 'mujoco', 'rclpy'} & set(others)


def test_a_start_reads_no_configuration() -> None:
    """Every start and every TAB pays for what the verbs import: half a second with pydantic."""
    code = (
        'import sys\nfrom ugv_acceptance.cli import main\n'
        'sys.argv = ["ugv-acceptance", "--version"]\ntry: main()\nfinally: print(*sys.modules)'
    )
    known = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    done = subprocess.run(
        [sys.executable, '-c', code], env=known, capture_output=True, text=True, check=False
    )
    assert 'ugv_acceptance.cli' in done.stdout.split(), done.stderr
    assert not {'pydantic', 'rclpy', 'textual'} & set(done.stdout.split())
