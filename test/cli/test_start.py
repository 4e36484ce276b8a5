"""What a command loads before it works: nothing that it does not need."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ugv_acceptance.cli import VERBS

# Of what takes long to load, by how few commands need it.
NUMBERS = {'numpy'}
CONFIGURATION = {'defusedxml', 'pydantic', 'yaml'}
RECORDINGS = {'lz4', 'mcap', 'zstandard', 'ugv_acceptance.bag'}
RARE = {
    *('asyncio', 'collada', 'distributed', 'foxglove', 'fsspec', 'jinja2', 'junitparser'),
    *('matplotlib', 'mujoco', 'multiprocessing', 'pyarrow', 'rclpy', 'rosbags', 'scipy'),
    *('starlette', 'textual', 'trimesh', 'uvicorn', 'xacro', 'ugv_acceptance.nodes'),
}
NO_NUMBERS = RARE | RECORDINGS | CONFIGURATION | NUMBERS

# Command -> what it must not load.
COMMANDS = {
    '--version': NO_NUMBERS | {'rich'},
    '--help': NO_NUMBERS,
    'evaluate --help': NO_NUMBERS - {'pydantic'},
    'tell ground nonsense': NO_NUMBERS - {'pydantic'},
    'model': RARE | RECORDINGS,
    'check test/cli/little_motion.yaml': RARE | RECORDINGS,
    'info bags/packbot_pass': RARE,
    'doctor bags/packbot_pass': RARE,
    'evaluate bags/packbot_pass': RARE,
    'verify {result}': RARE,
    # The console is a page of its own: with asyncio.
    'watch bags/packbot_pass': RARE - {'asyncio'},
}
# A shell's question at TAB, after these words -> what must not be loaded for an answer.
QUESTIONS = {'ev': NO_NUMBERS - {'pydantic'}, 'evaluate --': NO_NUMBERS - {'pydantic'}}

MAIN = """
import sys
from ugv_acceptance.cli import main
try:
    main()
finally:
    print('LOADED', *sys.modules)
"""
COLLECTED = """
import atexit, gc
atexit.register(lambda: print('FROZEN', gc.get_freeze_count() > 1000))
from ugv_acceptance.cli import main
before = sum(stage['collections'] for stage in gc.get_stats())
try:
    main()
finally:
    print('COLLECTED', sum(stage['collections'] for stage in gc.get_stats()) - before)
"""


def loaded(words: str, repository: Path, **environment: str) -> set[str]:
    """Return the modules that are loaded when a command is done."""
    done = subprocess.run(
        [sys.executable, '-c', MAIN, *words.split()],
        capture_output=True,
        text=True,
        check=False,
        cwd=repository,
        env={**os.environ, **environment},
    )
    assert 'LOADED' in done.stdout, done.stderr
    assert 'Traceback' not in done.stderr, done.stderr
    return set(done.stdout.rpartition('LOADED')[2].split())


@pytest.fixture(scope='module')
def result(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the result of a recording that ships."""
    path = tmp_path_factory.mktemp('start') / 'result.json'
    words = ['evaluate', str(repository / 'bags' / 'packbot_pass'), '--json', str(path)]
    command = [sys.executable, '-c', 'from ugv_acceptance.cli import main; main()', *words]
    subprocess.run(command, check=True, capture_output=True, cwd=repository)
    return path


@pytest.mark.parametrize('words', COMMANDS)
def test_a_command_loads_only_what_it_needs(words: str, repository: Path, result: Path) -> None:
    """No numbers for help, no recordings for a posture, no SciPy or ROS for a verdict."""
    found = loaded(words.format(result=result), repository)
    assert 'ugv_acceptance.cli' in found
    assert sorted(found & COMMANDS[words]) == []


@pytest.mark.parametrize('words', QUESTIONS)
def test_a_shell_is_answered_without_anything_heavy(words: str, repository: Path) -> None:
    """At every TAB the program starts anew: it reads no configuration to complete a name."""
    asked = {
        '_UGV_ACCEPTANCE_COMPLETE': 'complete_bash',
        'COMP_WORDS': f'ugv-acceptance {words}',
        'COMP_CWORD': str(len(words.split())),
    }
    assert sorted(loaded('', repository, **asked) & QUESTIONS[words]) == []


def test_all_verbs_are_known_without_numpy() -> None:
    """The module of a verb says how it is used; what does its work is loaded when it runs."""
    code = f"""
import importlib, sys
for verb in {VERBS}:
    importlib.import_module(f'ugv_acceptance.cli.{{verb}}')
    if heavy := sorted(set(sys.modules) & {NO_NUMBERS}):
        sys.exit(f'{{verb}} brings {{heavy}}')
"""
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, '')


def test_a_campaign_without_groups_needs_no_statistics() -> None:
    """A campaign that compares nothing, such as one that is resumed, starts without scipy.stats."""
    code = 'import sys, ugv_acceptance.campaign.statement; print("scipy.stats" in sys.modules)'
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ['False']


def test_the_simulator_is_loaded_without_a_process_of_its_own() -> None:
    """A window library would start one to ask for its version; ended just then, it complains."""
    code = """
import sys
begun = []
sys.addaudithook(lambda event, told: begun.append(told) if event == 'subprocess.Popen' else None)
import ugv_acceptance.simulation.engine
print('mujoco' in sys.modules, begun)
"""
    known = {name: value for name, value in os.environ.items() if name != 'MUJOCO_GL'}
    done = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True, check=True, env=known
    )
    assert done.stdout == 'True []\n'


def test_the_garbage_collector_does_not_look_through_a_start(repository: Path) -> None:
    """All that a start makes stays: the collector looks seldom, and not at the end."""
    done = subprocess.run(
        [sys.executable, '-c', COLLECTED, 'evaluate', 'bags/packbot_pass'],
        capture_output=True,
        text=True,
        check=True,
        cwd=repository,
    )
    words = done.stdout.split()
    assert int(words[words.index('COLLECTED') + 1]) < 10
    assert words[-2:] == ['FROZEN', 'True']
