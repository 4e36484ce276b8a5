"""`ugv-acceptance run --sim` as people start it: a simulated robot, a monitor, real DDS."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
import rclpy
from nodes.live_case import Live
from trajectory_msgs.msg import JointTrajectory

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.cli import run_session as running_plan
from ugv_acceptance.config import load
from ugv_acceptance.nodes.runner_world import Guard
from ugv_acceptance.plan.plan import Plan, plan_text
from ugv_acceptance.run.actuation import OPERATOR, ROBOT
from ugv_acceptance.run.step_verdict import seen_in

HOME = {'turret_joint': 0, 'shoulder_joint': 95, 'elbow_joint': 140, 'flipper_joint': 180}
# A start on a busy machine, and a step.
LONG = 240.0


def step(name: str, **change: Any) -> dict[str, Any]:
    """Return a step near home that expects nothing."""
    return {
        'id': name, 'group': 'g', 'title': name, 'purpose': 'p', 'hold_s': 0.5,
        'speed_degps': 35.0, 'posture_deg': {**HOME, 'shoulder_joint': 105},
        'alerts': {'must_not': ['ERROR']}, **change,
    }  # fmt: skip


# Falls over sideways: the arm out, 2 kg, on a slope of 25 degrees.
TIP = step(
    'tips', where='simulation', action='tip', payload_kg=2.0, speed_degps=57.0,
    ground={'orientation': 'left', 'tilt_deg': 25.0},
    posture_deg={**HOME, 'turret_joint': 90, 'shoulder_joint': 40, 'elbow_joint': -85},
    alerts={'must': ['ERROR TIP_OVER left'], 'must_not': []},
)  # fmt: skip


def plan_file(folder: Path, *steps: dict[str, Any]) -> Path:
    """Write a plan and return its path."""
    plan = Plan.model_validate(
        {'plan': 'tiny', 'robot': 'packbot', 'config_sha256': load().sha256, 'home_deg': HOME,
         'steps': steps}
    )  # fmt: skip
    (folder / 'plan.yaml').write_text(plan_text(plan), 'utf-8')
    return folder / 'plan.yaml'


@contextmanager
def running(plan: Path | None, out: Path, *more: str) -> Iterator['subprocess.Popen[str]']:
    """Run the verb in a process of its own, in a session that is ended at the end."""
    named = [str(plan)] if plan else []
    env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    code = 'from ugv_acceptance.cli import main; main()'
    process = subprocess.Popen(
        [sys.executable, '-c', code, 'run', *named, '--sim', '--out', str(out), *more],
        env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True,
    )  # fmt: skip
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()


def finished(process: 'subprocess.Popen[str]') -> tuple[int, str]:
    """Return exit code and output."""
    text, _ = process.communicate(timeout=LONG)
    return process.returncode, text


def children(process: 'subprocess.Popen[str]') -> dict[str, int]:
    """Return the pids of the robot and the monitor by name."""
    listed = Path(f'/proc/{process.pid}/task/{process.pid}/children').read_text().split()
    lines = {int(p): Path(f'/proc/{p}/cmdline').read_bytes().split(b'\0') for p in listed}
    return {line[3].decode(): pid for pid, line in lines.items() if len(line) > 3}


def until(condition: Callable[[], Any]) -> Any:
    """Wait until something comes true and return it."""
    end = time.monotonic() + LONG
    while not (found := condition()):
        assert time.monotonic() < end, 'expected this to come true, it did not'
        time.sleep(0.05)
    return found


def recording(out: Path, name: str, at_least: int) -> Path | None:
    """Return a step's file once it holds this many bytes."""
    path = out / 'steps' / name / f'{name}_0.mcap'
    return path if path.is_file() and path.stat().st_size >= at_least else None


def positions(folder: Path) -> list[float]:
    """Return the shoulder's positions (rad) in a recording, as far as it goes."""
    config = load()
    _, q, _, _ = seen_in(folder, config).joined()
    return [float(x) for x in q[:, config.settings.robot.joint_names.index('shoulder_joint')]]


def moved(path: Path | None) -> bool:
    """Return whether a recording shows that the shoulder has left home."""
    return path is not None and min(positions(path)) < math.radians(HOME['shoulder_joint'] - 3)


def gone(pid: int) -> bool:
    """Return whether a process has ended."""
    path = Path(f'/proc/{pid}/stat')
    return not path.exists() or path.read_text().rsplit(')', 1)[1].split()[0] == 'Z'


@pytest.mark.skipif(not Path('/proc/self').exists(), reason='reads processes from /proc')
def test_a_plan_is_run_judged_and_filed(tmp_path: Path) -> None:
    """A safe posture and an alarm that is expected: both pass, each with its recording."""
    plan, out = plan_file(tmp_path, step('safe'), TIP), tmp_path / 'out'
    with running(plan, out) as process:
        code, text = finished(process)
    result = json.loads((out / 'result.json').read_text())
    assert (code, result['verdict']) == (0, 'PASS'), text
    peaks = [a['peak'] for a in result['steps'][1]['alerts'] if a['code'] == 'TIP_OVER']
    assert min(peaks) < math.degrees(load().settings.limits.tip_error)
    assert (out / 'report.txt').is_file()
    for name in ('safe', 'tips'):
        assert open_bag(out / 'steps' / name).topics['/imu/data'].count > 100


@pytest.mark.skipif(not Path('/proc/self').exists(), reason='reads processes from /proc')
def test_an_alert_that_is_not_expected_freezes_the_robot(tmp_path: Path) -> None:
    """The same tip-over in a step that does not expect it: stopped, and the run fails."""
    unexpected = {**TIP, 'alerts': {'must_not': ['ERROR TIP_OVER']}}
    plan, out = plan_file(tmp_path, unexpected), tmp_path / 'out'
    with running(plan, out) as process:
        code, text = finished(process)
    result = json.loads((out / 'result.json').read_text())
    assert code == 1, text
    assert 'STOP' in text
    assert result['steps'][0]['reasons'][0].startswith('stopped: DANGER TIP_OVER left')


@pytest.mark.skipif(not Path('/proc/self').exists(), reason='reads processes from /proc')
def test_the_run_stops_when_the_monitor_dies(tmp_path: Path) -> None:
    """A monitor that dies freezes a moving arm, and no step passes without one."""
    far = {**HOME, 'shoulder_joint': 35}
    plan, out = (
        plan_file(tmp_path, step('long', posture_deg=far, speed_degps=2.0)),
        tmp_path / 'out',
    )
    with running(plan, out) as process:
        until(lambda: moved(recording(out, 'long', 60_000)))
        os.kill(children(process)['monitor.node'], signal.SIGKILL)
        code, text = finished(process)
    assert code == 3, text
    assert 'the monitor has published nothing' in text
    assert json.loads((out / 'result.json').read_text())['verdict'] == 'INCONCLUSIVE'
    shoulder = positions(out / 'steps' / 'long')
    last = shoulder[-50:]
    assert max(last) - min(last) < math.radians(1.0)
    assert last[-1] > math.radians(HOME['shoulder_joint'] - 40)


@pytest.mark.skipif(not Path('/proc/self').exists(), reason='reads processes from /proc')
def test_a_killed_run_loses_nothing_and_is_continued(tmp_path: Path) -> None:
    """Kill -9 in step two: its recording is readable, the nodes end, --resume goes on."""
    plan = plan_file(tmp_path, step('one'), step('two', hold_s=4.0))
    out = tmp_path / 'out'
    with running(plan, out) as process:
        path = until(lambda: recording(out, 'two', 60_000))
        others = children(process)
        process.kill()
        process.wait()
    until(lambda: all(map(gone, others.values())))
    assert open_bag(path).topics['/imu/data'].count > 50
    first = (out / 'steps' / 'one.json').read_text()
    with running(plan, out, '--resume') as process:
        code, text = finished(process)
    assert code == 0, text
    assert '1 of 2 steps are done already' in text
    assert (out / 'steps' / 'one.json').read_text() == first
    assert open_bag(out / 'steps' / 'two.interrupted-1').topics['/imu/data'].count > 50


@pytest.mark.parametrize('mode', [ROBOT, OPERATOR])
def test_a_run_does_not_begin_before_the_arm_controller_listens(live: Live, mode: str) -> None:
    """A first trajectory that nobody takes is lost: the arm stays, and a step would fail."""
    guard = live.add(Guard(load(), lambda _: None, mode=mode))
    _, driver = live.running()
    arm = '/arm_controller/joint_trajectory'
    wanted = '' if mode == OPERATOR else f'a listener on {arm}'
    live.until(lambda: guard.missing() == wanted, driver.send)
    controller = live.add(rclpy.create_node('controller'))
    controller.create_subscription(JointTrajectory, arm, lambda _: None, 10)
    live.until(lambda: not guard.missing(), driver.send)


def test_two_runs_never_share_a_ros_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    """While one holds its domain, every other asker gets another, and the last gets none."""
    for name in ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE'):
        monkeypatch.setenv(name, os.environ.get(name, ''))
    # Domains nobody else asks for; their ports are beyond those that Linux lends to any program.
    monkeypatch.setattr(running_plan, 'DOMAINS', range(216, 219))
    with ExitStack() as held:
        found = []
        for _ in range(3):
            held.enter_context(running_plan.own_domain())
            found.append(os.environ['ROS_DOMAIN_ID'])
        assert sorted(found) == ['216', '217', '218']
        with pytest.raises(AcceptanceError, match='all are taken'):
            held.enter_context(running_plan.own_domain())
