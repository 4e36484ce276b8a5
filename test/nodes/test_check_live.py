"""`ugv-acceptance check --live`, in processes of its own: the running monitor's answer.

One monitor serves the whole module; its driver sends a robot at rest all the time.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from cli.here import ugv
from diagnostic_msgs.msg import DiagnosticStatus
from nodes.live_case import NAMES, Live, session_of
from nodes.test_motion_desk import SPACE, Site, begun, motion
from rclpy.node import Node
from trajectory_msgs.msg import JointTrajectory

from ugv_acceptance.nodes.check_client import DEPTH, CheckClient, LiveAnswer, name_of
from ugv_acceptance.nodes.monitor.publishers import key_values

# With it the monitor and its driver keep apart from those of other tests.
# `check` as it is, but for the seconds in which it expects a monitor.
CODE = (
    'import ugv_acceptance.cli.check_live as live; live.WITHIN = {within}; '
    'from ugv_acceptance.cli import main; main()'
)
Ask = Callable[..., tuple[int, str, str]]


def file_of(message: JointTrajectory, folder: Path) -> Path:
    """Write a motion as YAML."""
    points = [
        {
            'positions': list(point.positions),
            'time_from_start': {
                'sec': point.time_from_start.sec,
                'nanosec': point.time_from_start.nanosec,
            },
        }
        for point in message.points
    ]
    path = folder / 'reach.yaml'
    text = json.dumps({'joint_names': list(message.joint_names), 'points': points})
    path.write_text(text, encoding='utf-8')  # JSON is YAML
    return path


def started(path: Path, *words: str, space: str, within: float) -> 'subprocess.Popen[str]':
    """Start `check --live` in a namespace."""
    env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    code, named = CODE.format(within=within), ('--ros-args', '-r', f'__ns:={space}')
    command = [sys.executable, '-c', code, 'check', str(path), '--live', *words, *named]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, env=env, stdout=pipe, stderr=pipe, text=True)


@pytest.fixture(scope='module')
def site() -> Iterator[Site]:
    """Return a monitor that was told load and ground, and its robot at rest."""
    with begun() as made:
        made.tell('payload', mass_kg='1')
        made.tell('ground', kind='flat')
        made.permitted(motion(0.05, 0.0))
        yield made


@pytest.fixture
def ask(site: Site, tmp_path: Path) -> Ask:
    """Return what runs `check --live` on a motion: exit code, output, errors."""

    def asked(message: JointTrajectory, *words: str) -> tuple[int, str, str]:
        path = file_of(message, tmp_path)
        process = started(path, *words, space=SPACE, within=30.0)
        site.until(lambda: process.poll() is not None)
        out, errors = process.communicate()
        return process.returncode, out, errors

    return asked


def test_the_exit_code_is_the_monitors_answer(site: Site, ask: Ask) -> None:
    """0 permitted, with what it rests on and until when; 1 refused, with the reason."""
    site.permitted(motion(0.05, 0.0))  # at rest for long enough
    code, out, errors = ask(motion(0.1, 0.0))
    text = ' '.join(out.split())
    assert (code, errors) == (0, '')
    assert 'PERMITTED' in text
    assert '(told by operator); ground flat' in text, text
    assert 'it has to begin within' in text
    code, out, errors = ask(motion(-0.4, -0.8, -1.2), '--json')
    found = json.loads(out)
    assert (code, errors, found['result']) == (1, '', 'refused')
    assert 'on the way to point' in found['message']


def test_where_the_monitor_does_not_know_it_is_no_permission(site: Site, ask: Ask) -> None:
    """Exit code 3, with the reason: here it is not active."""
    monitor: Any = site.monitor
    monitor.trigger_deactivate()
    code, out, _ = ask(motion(0.1, 0.0))
    monitor.trigger_activate()
    site.until(lambda: session_of(site.monitor).evaluator.margins is not None)
    assert code == 3
    assert 'NOT KNOWN' in out
    assert 'the monitor is not active' in ' '.join(out.split())


def mute(live: Live) -> Node:
    """Return a node that hears questions on the monitor's topic, and never answers."""
    node: Node = live.add(rclpy.create_node('mute', namespace='/mute'))
    node.create_subscription(JointTrajectory, 'acceptance_monitor/check', lambda _: None, DEPTH)
    node.create_publisher(DiagnosticStatus, 'acceptance_monitor/check_result', DEPTH)
    return node


@pytest.mark.parametrize(
    ('space', 'said'),
    [
        ('/nowhere', 'no monitor hears on /nowhere/acceptance_monitor/check'),
        ('/mute', 'nobody answered on /mute/acceptance_monitor/check in 3 s'),
    ],
)
def test_where_nobody_answers_nothing_is_known(
    live: Live, tmp_path: Path, space: str, said: str
) -> None:
    """Exit code 3; it says where a monitor was expected."""
    mute(live)
    process = started(file_of(motion(0.1, 0.0), tmp_path), space=space, within=3.0)
    live.until(lambda: process.poll() is not None)
    out, _ = process.communicate()
    assert process.returncode == 3
    assert 'NOT KNOWN' in out
    assert said in ' '.join(out.split())


@pytest.mark.parametrize(
    'words',
    [
        ('--live', '--payload', '2kg'),
        ('--live', '--at', '1cm,0,0'),
        ('--live', '--tilt', 'roll=1deg'),
        ('--live', '--posture', 'STOW'),
        ('--live', '--ground', 'flat'),
        ('--live', '--config', 'packbot'),
        ('--ros-args', '-r', '__ns:=/a'),
    ],
)
def test_what_the_monitor_knows_better_is_refused(tmp_path: Path, words: tuple[str, ...]) -> None:
    """Exit code 2 and one line that names the option; nobody is asked."""
    done = ugv('check', file_of(motion(0.1, 0.0), tmp_path), *words)
    named = next(word for word in words[::-1] if word.startswith('--'))
    assert (done.returncode, done.stdout) == (2, '')
    assert named in done.stderr
    assert '--live' in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_only_an_answer_about_this_very_motion_is_taken(live: Live) -> None:
    """Neither what is said of another, nor that a permission of before is taken back."""
    monitor = live.add(rclpy.create_node('monitor', namespace='/answers'))
    heard: list[JointTrajectory] = []
    at = 'acceptance_monitor/check'
    monitor.create_subscription(JointTrajectory, at, heard.append, DEPTH)
    out = monitor.create_publisher(DiagnosticStatus, f'{at}_result', DEPTH)
    client = CheckClient(live.add(rclpy.create_node('asking', namespace='/answers')))
    live.until(lambda: client.heard and out.get_subscription_count())
    mine, other = motion(0.1, 0.0), motion(0.2, 0.0)
    client.ask(mine)
    live.until(lambda: heard)
    assert name_of(heard[0]) == name_of(mine) != name_of(other)

    def say(about: str, result: str) -> None:
        values = key_values({'trajectory_sha256': about, 'result': result})
        out.publish(DiagnosticStatus(message=f'{result} now', values=values))

    def answers() -> list[LiveAnswer]:
        return [a for a in client.answers if a.result != 'not_known']

    for result in ('permitted', 'refused'):
        say(name_of(other), result)
        say('', result)
    for result in ('withdrawn', 'expired', 'nonsense', ''):
        say(name_of(mine), result)
    say(name_of(mine), 'refused')
    live.until(answers)
    assert [(a.result, a.text) for a in client.answers] == [('refused', 'refused now')]
    assert tuple(heard[0].joint_names) == NAMES
