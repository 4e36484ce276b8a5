"""Every verb for robots that are no PackBot: it works, or says in one line why not."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from cli.here import ugv
from foreign_files import arm_alone, mobile_arm, rover, walker

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.config import Config, load
from ugv_acceptance.report.format import short_name

LONG = 'a_name_as_long_as_any_that_a_generator_of_descriptions_writes__'
START = 1_748_854_800_000_000_000


def recorded(config: Config, folder: Path) -> Path:
    """Record a robot standing still with its joints at rest for two seconds."""
    robot = config.settings.robot
    rest = [max(min(0.0, robot.joint(n).upper), robot.joint(n).lower) for n in robot.joint_names]
    rng = np.random.default_rng(1)
    with BagWriter(folder) as bag:
        for topic in config.topics.used.values():
            bag.add_topic(f'/{topic.name}', topic.type)
        for k in range(100):
            at = START + k * 20_000_000
            if config.topics.joint_states.used:
                bag.write('/joint_states', at, joint_state_cdr(at, '', robot.joint_names, rest))
            if config.topics.imu.used:
                force = np.array((0.0, 0.0, 9.81)) + rng.normal(0.0, 0.01, 3)
                rate = rng.normal(0.0, 0.001, 3)
                bag.write('/imu/data', at, imu_cdr(at, 'imu', (0, 0, 0, 1), rate, force))
    return folder


def told(done: 'subprocess.CompletedProcess[str]') -> str:
    """Return the one line of a verb that says why not."""
    assert done.returncode == 2, done.stdout + done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    return lines[0].removeprefix('ugv-acceptance: ')


def test_a_map_takes_the_arms_own_joints(tmp_path: Path) -> None:
    """Without --x and --y it is over the two joints that lift, each over its own range."""
    config = mobile_arm(tmp_path)
    out = tmp_path / 'map.npz'
    for kind in ('torque', 'rollover', 'payload', 'drag'):
        words = ('--steps', '21', '--out', out, '--overwrite')
        done = ugv('map', kind, '--config', config, *words)
        assert done.returncode == 0, done.stderr
    with np.load(out) as arrays:
        assert arrays['names'].tolist() == ['big_lift', 'mid_lift']
        assert arrays['x'][[0, -1]] == pytest.approx([-2.9, 0.3])
        assert arrays['y'][[0, -1]] == pytest.approx([-2.2, 2.2])


def test_a_range_below_zero_is_mapped_over_what_it_has(tmp_path: Path) -> None:
    """The axis is the joint's range, and a joint that is not on an axis stands within its own."""
    config, out = arm_alone(tmp_path), tmp_path / 'map.npz'
    done = ugv('map', 'torque', '--config', config, '--steps', '21', '--out', out)
    assert done.returncode == 0, done.stderr
    with np.load(out) as arrays:
        assert arrays['y'][[0, -1]] == pytest.approx([-2.6, -0.2])
    words = ('--x', 'base.yaw', '--y', 'big_lift', '--steps', '21', '--out', out, '--overwrite')
    done = ugv('map', 'torque', '--config', config, *words)
    assert 'mid_lift -80°' in done.stdout


def test_speed_and_risk_are_in_the_units_of_the_joints(tmp_path: Path) -> None:
    """Each measured joint has a line; risk draws them by their own names."""
    config = mobile_arm(tmp_path)
    done = ugv('speed', '--config', config, '--json')
    assert list(json.loads(done.stdout)['speed_deg_s']) == [
        'base.yaw', 'big_lift', 'mid_lift', 'roll_a', 'nod', 'roll_b'
    ]  # fmt: skip
    done = ugv('risk', '--config', config, '--samples', '2000')
    assert done.returncode == 0, done.stderr
    assert 'big_lift.position' in done.stdout


def test_a_rover_has_all_verbs_but_those_of_the_arm(tmp_path: Path) -> None:
    """Speed and map say that it has no joints; risk says that it judges no torque."""
    config = rover(tmp_path)
    assert 'speed: expected measured joints, rover has none' in told(ugv('speed', '-c', config))
    assert 'rover has none' in told(ugv('map', 'rollover', '-c', config))
    done = ugv('risk', '-c', config, '--samples', '2000')
    assert 'saturation   not judged: no joint has a torque limit' in done.stdout
    assert ugv('plan', '-c', config).returncode == 0
    assert ugv('model', '-c', config).returncode == 0


@pytest.mark.parametrize(
    'words', [('map', 'torque'), ('speed',), ('risk',), ('plan',), ('run', '--sim', '--fast')]
)
def test_legs_are_told_which_verbs_are_theirs(words: tuple[str, ...], tmp_path: Path) -> None:
    """One line, and the verbs that every robot has."""
    line = told(ugv(*words, '-c', walker(tmp_path)))
    assert f'{words[0].replace("run", "plan")}: walker stands on legs' in line
    assert 'model, evaluate, monitor and console are for every robot' in line


@pytest.mark.parametrize('words', [('risk',), ('plan',), ('run', '--sim', '--fast')])
def test_an_arm_alone_is_told_which_verbs_are_not_its_own(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    """A probability of tipping of 0 would be a lie: it stands on nothing."""
    assert 'arm_alone is an arm without contact points' in told(
        ugv(*words, '-c', arm_alone(tmp_path))
    )


def test_the_paper_is_about_its_own_robot(tmp_path: Path) -> None:
    """With another configuration it says so in one line, before anything is computed."""
    line = told(ugv('paper', '-c', mobile_arm(tmp_path), '--out', tmp_path / 'paper'))
    assert 'expected the configuration packbot, got mobile_arm' in line
    assert not (tmp_path / 'paper').exists()


@pytest.mark.parametrize('make', [rover, mobile_arm, arm_alone])
def test_a_recording_of_a_foreign_robot_is_judged_and_shown(make: object, tmp_path: Path) -> None:
    """Evaluate, its report, verify, and the console's words in a terminal."""
    assert callable(make)
    config = make(tmp_path)
    run = recorded(load(config), tmp_path / 'run')
    result, report = tmp_path / 'r.json', tmp_path / 'r.html'
    done = ugv('evaluate', run, '-c', config, '--json', result, '--report', report)
    assert done.returncode in (0, 1, 3), done.stderr
    assert 'packbot' not in report.read_text().lower()
    assert ugv('verify', result).returncode == 0
    assert ugv('watch', run, '-c', config).returncode == 0


@pytest.fixture(scope='module')
def long_names(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the configuration of a mobile arm with names of over sixty letters."""
    return mobile_arm(tmp_path_factory.mktemp('long'), prefix=LONG)


@pytest.mark.parametrize('verb', ['model', 'speed', 'risk --samples 2000', 'plan --short'])
def test_long_names_leave_tables_whole(verb: str, long_names: Path) -> None:
    """Names are folded, given their room, or shortened amid; no line is longer but for a name."""
    done = ugv(*verb.split(), '-c', long_names)
    assert done.returncode == 0, done.stderr
    if verb == 'risk --samples 2000':
        assert '~' in done.stdout or '…' in done.stdout
    assert [x for x in done.stdout.splitlines() if len(x) > 80 and len(x.split()) > 1] == []
    if verb == 'speed':
        rows = done.stdout.splitlines()[1:]
        assert len(rows) == 6
        wide = max(len(row.split()[0]) for row in rows)
        assert all(row[2 + wide] == ' ' for row in rows)


def test_long_names_leave_a_map_its_room(long_names: Path, tmp_path: Path) -> None:
    """Axes are labelled with the ends of the names, so that the map keeps its size."""
    name = f'{LONG}big_lift'
    assert len(short_name(name, 48)) == 48
    assert short_name(name, 48).endswith('big_lift')
    out = tmp_path / 'map.svg'
    done = ugv('map', 'rollover', '-c', long_names, '--steps', '21', '--out', out)
    assert done.returncode == 0, done.stderr


def test_the_short_plan_of_a_rover_runs_on_a_simulated_one(tmp_path: Path) -> None:
    """It drives, is tilted and judged by its IMU alone; no map of an arm is spoken of."""
    out = tmp_path / 'run'
    done = ugv('run', '--sim', '--fast', '-c', rover(tmp_path), '--out', out)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((out / 'result.json').read_text())
    assert [step['verdict'] for step in result['steps']] == ['PASS', 'PASS']
    text = (out / 'report.txt').read_text() + (out / 'report.html').read_text()
    assert 'failure map' not in text
    assert 'turret' not in text.lower()
