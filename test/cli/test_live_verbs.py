"""The verbs that run nodes, each in a process of its own, on the domain of this test process."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from nodes.live_case import joints

from ugv_acceptance.bag.writer import BagWriter, Qos

CODE = 'from ugv_acceptance.cli import main; main()'


def start(*words: str) -> 'subprocess.Popen[str]':
    """Start a verb."""
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    return subprocess.Popen(
        [sys.executable, '-c', CODE, *words],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_the_demo_shows_live_alerts_and_the_verdict(repository: Path) -> None:
    """The run that ships fails: alerts come live and from the recording, and all worked: 0."""
    process = start('demo', '--rate', '3', '--bag', str(repository / 'bags' / 'packbot_fail'))
    text, errors = process.communicate(timeout=120)
    assert process.returncode == 0, text + errors
    assert re.search(r'DANGER\s+raised: .* (to|past) tipping: ', text)
    assert 'FAIL is the right verdict' in text


def test_the_demo_played_fast_warns_neither_of_stamps_nor_of_the_load(repository: Path) -> None:
    """What is shown is about the robot, at any rate: stamps and load are as they should be."""
    bag = str(repository / 'bags' / 'packbot_pass')
    process = start('demo', '--no-console', '--rate', '1.5', '--bag', bag)
    text, errors = process.communicate(timeout=120)
    assert process.returncode == 0, text + errors
    assert 'all margins kept' in text.partition('2. The same run')[0]
    assert 'raised: header stamps' not in text
    assert 'suggest a payload' not in text


def test_the_monitor_prints_lines_and_ends_when_asked() -> None:
    """Without a terminal it prints lines; SIGINT ends it with exit code 0."""
    process = start('monitor', '--every', '1', '--ros-args', '-r', '__ns:=/alone')
    assert process.stdout
    first = process.stdout.readline()
    assert 'NO DATA' in first
    end = time.monotonic() + 60
    while 'no message from' not in process.stdout.readline():
        assert time.monotonic() < end
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 0
    assert 'Traceback' not in errors


@pytest.mark.parametrize(
    ('words', 'reason'),
    [
        (('monitor', '--config', '/nowhere.yaml'), '/nowhere.yaml'),
        (('monitor', '--cnofig', 'x'), '--cnofig'),
        (('replay', '/nowhere'), '/nowhere'),
        (('replay', '/nowhere', '--rate', '0'), 'rate'),
        (('doctor', '--config', '/nowhere.yaml'), '/nowhere.yaml'),
        (('demo', '--bag', '/nowhere'), '/nowhere'),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(words: tuple[str, ...], reason: str) -> None:
    """A file that is not there or an option that does not exist: what it was, and 2."""
    process = start(*words)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 2
    assert reason in errors
    assert 'Traceback' not in errors


def test_replay_says_how_much_it_played(tmp_path: Path) -> None:
    """It publishes all and says so, also what it cannot play."""
    with BagWriter(tmp_path / 'run') as writer:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState', Qos())
        for k in range(20):
            writer.write('/joint_states', k * 10_000_000, joints(stamp=k))
    process = start('replay', str(tmp_path / 'run'), '--restamp', '--rate', '10')
    text, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    assert '20 messages of 1 topics published' in text
