"""The programs that `ros2 run` starts, as they begin: by the console scripts of setup.py."""

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from cli.test_termination import PATIENCE, environment

from ugv_acceptance.cli.node_programs import MODULES

SCRIPT = re.compile(r"'(\w+) = ([\w.]+):(\w+)'")
SCRIPTS = {
    name: (module, function)
    for name, module, function in SCRIPT.findall(
        (Path(__file__).parents[2] / 'setup.py').read_text(encoding='utf-8')
    )
}

# Stays at the import of ROS until a signal comes, as a slow computer does.
STAYS = """
import sys, time
class Slow:
    def find_spec(self, name, *_):
        if name == 'rclpy':
            print('importing', flush=True)
            time.sleep(1000)
sys.meta_path.insert(0, Slow())
from {module} import {function}
{function}()
"""


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize('name', sorted(SCRIPTS))
def test_a_node_that_still_starts_ends_without_a_traceback(
    name: str, number: signal.Signals
) -> None:
    """While it imports, Ctrl-C or SIGTERM ends it with 128 plus the signal, and not a word."""
    module, function = SCRIPTS[name]
    process = subprocess.Popen(
        [sys.executable, '-c', STAYS.format(module=module, function=function)],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == 'importing\n'
    process.send_signal(number)
    said = process.communicate(timeout=PATIENCE)[1]
    assert (process.returncode, said) == (128 + number, '')


def test_every_node_has_its_program() -> None:
    """Each console script of a node is in the table of programs, and the other way round."""
    assert set(SCRIPTS) == set(MODULES)
