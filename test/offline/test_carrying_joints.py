"""Recordings of robots that stand on their joints: overloaded legs do not pass, standing does."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from offline.joint_runs import EPOCH, FOLDED, Run, judged

import ugv_acceptance as ugv
from bench.bench_reactions import LEGGED, ROBOTS, yaml_of
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.carrying import reactions_at

NS = 1_000_000_000
START = 1_748_854_800 * NS
SECONDS = 6.0

LEGGED_ROBOTS = pytest.mark.skipif(
    not ROBOTS.is_dir(), reason='needs ../shared/robots: robots of others, no part of this project'
)


def standing(folder: Path, name: str, load: str = '') -> ugv.Evaluation:
    """Judge a recording of a legged robot that stands still on level ground."""
    config, legged = folder / 'robot.yaml', LEGGED[name]
    config.write_text(yaml_of(legged, extra=load), encoding='utf-8')
    names, position = tuple(legged.stand), list(legged.stand.values())
    with BagWriter(folder / 'run') as bag:
        sensor = Qos(reliability='best_effort')
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState', sensor)
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu', sensor)
        for k in range(int(SECONDS * 50)):
            at, wave = START + k * NS // 50, 1e-3 * float(np.sin(0.1 * k))
            bag.write('/joint_states', at, joint_state_cdr(at, '', names, position, (), ()))
            force = (wave, -wave, 9.81 + wave)
            turned = (0.5 * wave, 0.0, 0.0, 1.0)
            bag.write('/imu/data', at, imu_cdr(at, 'imu', turned, (wave, 0.0, 0.0), force))
    return ugv.evaluate(folder / 'run', config=config)


@LEGGED_ROBOTS
def test_a_standing_robot_passes_and_says_what_cannot_be_excluded(
    tmp_path: Path, repository: Path
) -> None:
    """ANYmal's knees hold 27 N m of 80 evenly spread; what else balances is told, and no FAIL."""
    found = standing(tmp_path, 'anymal_c')
    assert found.verdict == 'PASS', found.result['reasons']
    knee = found.result['carrying']['LF_KFE']
    assert abs(knee['hanging']) < 1.0
    assert abs(knee['even']) == pytest.approx(27.0, abs=2.0)
    assert knee['most'] - knee['least'] > 40.0
    schema = json.loads((repository / 'schema' / 'result.schema.json').read_text('utf-8'))
    described = schema['$defs']['result']['properties']['carrying']
    jsonschema.Draft202012Validator(described).validate(found.result['carrying'])
    unchecked = {one['what']: one['why'] for one in found.result['not_checked']}
    assert 'cannot be excluded' in unchecked['how the contact points share the weight']
    assert 'LF_KFE' in unchecked['friction on the ground']


@LEGGED_ROBOTS
def test_an_overloaded_leg_does_not_pass(tmp_path: Path) -> None:
    """Go2 with 110 kg on its back: each calf holds more than its 45 N m, hanging only 0.2."""
    found = standing(tmp_path, 'go2', 'payload: {link: base, mass_kg: 110, known: true}\n')
    assert found.verdict == 'FAIL'
    calf = found.result['carrying']['RL_calf_joint']
    assert (abs(calf['hanging']) < 1.0, abs(calf['even']) > 45.43) == (True, True)
    assert any(
        'calf_joint 1' in reason and 'it needs' in reason for reason in found.result['reasons']
    )
    raised = {(alert.code, alert.subject, alert.level) for alert in found.alerts}
    assert ('TORQUE_LIMIT', 'RL_calf_joint', 'ERROR') in raised


@LEGGED_ROBOTS
def test_the_same_load_is_carried_where_the_limits_allow_it(tmp_path: Path) -> None:
    """Go2 with 20 kg passes: the reaction alone is no reason to fail."""
    found = standing(tmp_path, 'go2', 'payload: {link: base, mass_kg: 20, known: true}\n')
    assert found.verdict == 'PASS', found.result['reasons']


def on_flippers(measured: float | None) -> Run:
    """Return a PackBot that rests on its flippers in six postures, 0.1 rad/s in between.

    `measured` is the share of the ground's reaction that the flippers' effort shows: the rest is
    what friction between flippers and tracks holds. None: no efforts are told.
    """
    flipper = np.radians((-25.0, -32.0, -40.0, -48.0, -55.0, -62.0))
    shoulder = (1.1, 0.9, 0.7, 0.9, 0.7, 0.9)
    knots = np.arange(12) * 2.0
    seconds = np.arange(0.0, 23.0, 0.02)
    time = EPOCH + (seconds * NS).astype(np.int64)
    position = np.tile(FOLDED, (len(time), 1))
    position[:, 3] = np.interp(seconds, knots, np.repeat(flipper, 2))
    position[:, 1] = np.interp(seconds, knots, np.repeat(shoulder, 2))
    effort, settings = np.zeros_like(position), load('packbot').settings
    for k, q in enumerate(position.tolist()):
        found = reactions_at(settings, q, (0.0, 0.0, -9.81), settings.robot.payload)
        effort[k] = found.even
        effort[k, 3] = found.hanging[3] + (measured or 0.0) * (found.even[3] - found.hanging[3])
    told = None if measured is None else effort
    return Run(time, time, position, np.gradient(position, 0.02, axis=0), told, seconds=23.0)


def with_flipper_limit(folder: Path, limit: float) -> Path:
    """Write PackBot's configuration with a limit (N m) of the flippers."""
    shipped = load('packbot')
    before, after = shipped.path.read_text(encoding='utf-8').split('  flipper_joint:')
    text = f'{before}  flipper_joint:{after.replace("limit_nm: null", f"limit_nm: {limit}", 1)}'
    path = folder / 'robot.yaml'
    path.write_text(text.replace('../urdf/packbot.urdf', str(shipped.urdf_path)), encoding='utf-8')
    return path


@pytest.mark.parametrize(
    ('measured', 'verdict', 'reason'),
    [
        (None, 'FAIL', 'flipper_joint 103 % of its limit'),
        (0.93, 'PASS', 'all margins kept'),
        (0.99, 'FAIL', 'the measured torque of flipper_joint is 20.9 N m'),
    ],
)
def test_a_measured_torque_judges_a_joint_that_carries(
    tmp_path: Path, measured: float | None, verdict: str, reason: str
) -> None:
    """Flippers that need 21.1 N m of 20.5 fail, unless their efforts are torques and stay below."""
    run, config = on_flippers(measured), with_flipper_limit(tmp_path, 20.5)
    found = judged(tmp_path, run, config=config)
    assert found.verdict == verdict, found.result['reasons']
    assert found.result['carrying']['flipper_joint']['by_effort'] == (measured is not None)
    assert any(line.startswith(reason) or reason in line for line in found.result['reasons'])
