"""`ugv-acceptance run --operator`: a person at a terminal, here played by the test.

The robot is the simulator node, over real DDS; the person's hands are trajectories to its arm.
"""

import json
import math
import os
import pty
import re
import select
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import rclpy
from nodes.live_case import PATIENCE, Live, live_nodes
from nodes.test_run_verb import HOME, LONG, plan_file, step
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ugv_acceptance.nodes.subprocess_node import child

PROMPT = 'press Enter when it is done'


class Arm:
    """The person's hands: they move the simulated arm by its controller's topic."""

    def __init__(self, live: Live) -> None:
        node = live.add(rclpy.create_node('hands_of_the_operator'))
        self.live, self.at = live, dict[str, float]()
        self.topic = node.create_publisher(JointTrajectory, 'arm_controller/joint_trajectory', 10)
        node.create_subscription(JointState, 'joint_states', self._see, qos_profile_sensor_data)
        live.until(self.topic.get_subscription_count)

    def _see(self, message: JointState) -> None:
        self.at |= dict(zip(message.name, message.position, strict=True))

    def move(self, **degrees: float) -> None:
        """Bring joints to positions (deg) within a second; return once they are there."""
        message = JointTrajectory(joint_names=[f'{name}_joint' for name in degrees])
        positions = [math.radians(angle) for angle in degrees.values()]
        message.points = [JointTrajectoryPoint(positions=positions)]
        message.points[0].time_from_start.sec = 1
        self.topic.publish(message)
        goal = dict(zip(message.joint_names, positions, strict=True))
        near = math.radians(1.0)
        self.live.until(lambda: all(abs(self.at.get(n, 9.0) - p) < near for n, p in goal.items()))


class Terminal:
    """A pseudo-terminal with the verb behind it."""

    def __init__(self, plan: Path, out: Path) -> None:
        self.text = ''
        self._seen = 0
        self._mine, theirs = pty.openpty()
        code = 'from ugv_acceptance.cli import main; main()'
        env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
        self.process = subprocess.Popen(
            [sys.executable, '-c', code, 'run', str(plan), '--operator', '--out', str(out)],
            env={**env, 'TERM': 'dumb', 'COLUMNS': '400'},
            stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
        )  # fmt: skip
        os.close(theirs)

    def read(self) -> bool:
        """Take what was printed; False: the verb has closed its terminal."""
        if select.select([self._mine], [], [], 0.1)[0]:
            try:
                self.text += os.read(self._mine, 65536).decode()
            except OSError:
                return False
        return True

    def asked(self) -> str:
        """Return the next thing the person is asked for; empty: the verb has ended."""
        end = time.monotonic() + LONG
        while PROMPT not in self.text[self._seen :]:
            assert time.monotonic() < end, self.text
            if not self.read():
                return ''
        found, _, _ = self.text[self._seen :].partition(PROMPT)
        self._seen += len(found) + len(PROMPT)
        return found

    def answer(self, text: str = '') -> None:
        """Type a line."""
        os.write(self._mine, f'{text}\n'.encode())

    def close(self) -> None:
        """End the verb, if it has not ended."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self._mine)


@contextmanager
def operated(live: Live, tmp_path: Path, *steps: dict[str, Any]) -> Iterator[tuple[Terminal, Arm]]:
    """Start the robot and the verb for a plan of these steps."""
    home = ', '.join(str(math.radians(HOME[f'{n}_joint'])) for n in JOINTS)
    with child('packbot_simulator', ['--ros-args', '-p', f'home:=[{home}]']):
        arm = Arm(live)
        terminal = Terminal(plan_file(tmp_path, *steps), tmp_path / 'out')
        try:
            yield terminal, arm
        finally:
            terminal.close()


JOINTS = ('turret', 'shoulder', 'elbow', 'flipper')


def wanted(text: str) -> dict[str, float]:
    """Return the posture (deg) that a person is asked for."""
    return {name: float(a) for name, a in re.findall(r'(\w+)_joint (-?\d+) deg[, ]', text)}


def play(terminal: Terminal, arm: Arm, answer: Callable[[str], str]) -> list[str]:
    """Do whatever is asked for, and what `answer` says to it; return all that was asked."""
    asked = []
    while text := terminal.asked():
        asked.append(text)
        said = answer(text)
        if not said and 'bring the arm to' in text:
            arm.move(**wanted(text.rpartition('bring the arm to')[2]))
        terminal.answer(said.strip())
    terminal.process.wait(PATIENCE)
    return asked


def result_of(tmp_path: Path) -> dict[str, Any]:
    """Return the run's result."""
    found: dict[str, Any] = json.loads((tmp_path / 'out' / 'result.json').read_text())
    return found


@dataclass(frozen=True)
class Played:
    """What a person was asked in a run of two steps, what was shown, and what came of it."""

    asked: list[str]
    text: str
    code: int
    result: dict[str, Any]


@pytest.fixture(scope='module')
def played(tmp_path_factory: pytest.TempPathFactory) -> Played:
    """Return a run in which a person skips the first step and at first lies in the second."""
    folder = tmp_path_factory.mktemp('operator')
    lies = {'two: bring the arm to': ' ', 'one: bring the arm to': 's'}

    def answer(text: str) -> str:
        return next((lies.pop(key) for key in list(lies) if key in text), '')

    with (
        live_nodes() as live,
        operated(live, folder, step('one'), step('two')) as (terminal, arm),
    ):
        asked = play(terminal, arm, answer)
        code = terminal.process.wait()
    return Played(asked, terminal.text, code, result_of(folder))


def test_a_person_is_asked_for_everything(played: Played) -> None:
    """The operator is asked to set up, to stand the robot up, and for each posture."""
    assert 'stand the robot on its tracks' in played.asked[0]
    for name in ('one', 'two'):
        assert any(f'{name}: set up' in text for text in played.asked), played.text
        assert any(f'{name}: bring the arm to' in text for text in played.asked)


def test_joint_states_say_whether_it_was_done(played: Played) -> None:
    """Enter without moving the arm is not believed: what is off is told, and asked for again."""
    again = [text for text in played.asked if 'was not reached: shoulder_joint is ' in text]
    assert again, played.text
    assert re.search(r'shoulder_joint is (9\.\d|10\.\d) deg off', again[0])
    result = played.result['steps'][1]
    assert result['verdict'] == 'PASS', result
    assert result['covered'] > 0.9


def test_a_step_that_a_person_skips_is_inconclusive(played: Played) -> None:
    """The run goes on with the next step; what was not done never passes."""
    assert played.code == 3
    assert played.result['verdict'] == 'INCONCLUSIVE'
    first = played.result['steps'][0]
    assert first['verdict'] == 'INCONCLUSIVE'
    assert first['reasons'] == ['the operator did not do what was asked']
