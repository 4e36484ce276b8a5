"""Recordings of robots that stand on their joints: overloaded legs do not pass, standing does."""

from pathlib import Path

import numpy as np
import pytest

import ugv_acceptance as ugv
from bench.bench_reactions import LEGGED, ROBOTS, yaml_of
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter, Qos

NS = 1_000_000_000
START = 1_748_854_800 * NS
SECONDS = 6.0

pytestmark = pytest.mark.skipif(
    not ROBOTS.is_dir(), reason='needs ../shared/robots: robots of others, no part of this project'
)


def standing(
    folder: Path, name: str, load: str = '', effort: dict[str, float] | None = None
) -> ugv.Evaluation:
    """Judge a recording of a legged robot that stands still on level ground."""
    config, legged = folder / 'robot.yaml', LEGGED[name]
    config.write_text(yaml_of(legged, extra=load), encoding='utf-8')
    names, position = tuple(legged.stand), list(legged.stand.values())
    told = [effort[joint] for joint in names] if effort else []
    with BagWriter(folder / 'run') as bag:
        sensor = Qos(reliability='best_effort')
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState', sensor)
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu', sensor)
        for k in range(int(SECONDS * 50)):
            at, wave = START + k * NS // 50, 1e-3 * float(np.sin(0.1 * k))
            bag.write('/joint_states', at, joint_state_cdr(at, '', names, position, (), told))
            force = (wave, -wave, 9.81 + wave)
            turned = (0.5 * wave, 0.0, 0.0, 1.0)
            bag.write('/imu/data', at, imu_cdr(at, 'imu', turned, (wave, 0.0, 0.0), force))
    return ugv.evaluate(folder / 'run', config=config)


def test_a_standing_robot_passes_and_says_what_cannot_be_excluded(tmp_path: Path) -> None:
    """ANYmal's knees hold 27 N m of 80 evenly spread; what else balances is told, and no FAIL."""
    found = standing(tmp_path, 'anymal_c')
    assert found.verdict == 'PASS', found.result['reasons']
    knee = found.result['carrying']['LF_KFE']
    assert abs(knee['hanging']) < 1.0
    assert abs(knee['even']) == pytest.approx(27.0, abs=2.0)
    assert knee['most'] - knee['least'] > 40.0
    unchecked = {one['what']: one['why'] for one in found.result['not_checked']}
    assert 'cannot be excluded' in unchecked['how the contact points share the weight']
    assert 'LF_KFE' in unchecked['friction on the ground']


def test_an_overloaded_leg_does_not_pass(tmp_path: Path) -> None:
    """Go2 with 110 kg on its back: each calf holds more than its 45 N m, hanging only 0.2."""
    found = standing(tmp_path, 'go2', 'payload: {link: base, mass_kg: 110, known: true}\n')
    assert found.verdict == 'FAIL'
    calf = found.result['carrying']['RL_calf_joint']
    assert (abs(calf['hanging']) < 1.0, abs(calf['even']) > 45.43) == (True, True)
    assert any('calf_joint needs' in reason for reason in found.result['reasons'])
    raised = {(alert.code, alert.subject, alert.level) for alert in found.alerts}
    assert ('TORQUE_LIMIT', 'RL_calf_joint', 'ERROR') in raised


def test_the_same_load_is_carried_where_the_limits_allow_it(tmp_path: Path) -> None:
    """Go2 with 20 kg passes: the reaction alone is no reason to fail."""
    found = standing(tmp_path, 'go2', 'payload: {link: base, mass_kg: 20, known: true}\n')
    assert found.verdict == 'PASS', found.result['reasons']
