"""A load that is told only later: before that it is unknown, and no verdict may rest on a guess."""

from pathlib import Path

import pytest

import ugv_acceptance as ugv
from ugv_acceptance.bag.encode import imu_cdr, inertia_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.offline.evaluation import Evaluation

MS = 1_000_000
START = 1_750_000_000_000_000_000
NAMES = ['turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint']
# The arm stretched forward and level: the shoulder needs 31.4 N m without and 54.8 N m with 2 kg.
STRETCHED = (0.0, 0.0, 0.0, 0.0)
COVARIANCES = ((1e-4, *(0.0,) * 8),) * 3


def write(folder: Path, told: float, mass: float, seconds: float = 6.0) -> Path:
    """Record a PackBot with its arm stretched; at `told` (s) a payload of `mass` (kg) is told."""
    with BagWriter(folder) as bag:
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        bag.add_topic('/payload', 'geometry_msgs/msg/InertiaStamped')
        for k in range(int(seconds * 100)):
            now = START + k * 10 * MS
            level = ((0.0, 0.0, 0.7071068, 0.7071068), (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))
            bag.write('/imu/data', now, imu_cdr(now, 'imu_link', *level, COVARIANCES))
            if k % 2 == 0:
                body = joint_state_cdr(now, '', NAMES, STRETCHED, [0.0] * 4, [])
                bag.write('/joint_states', now + MS, body)
            if k == int(told * 100):
                load = inertia_cdr(now, 'gripper_link', mass, (0.0, 0.0, 0.0))
                bag.write('/payload', now + 2 * MS, load)
    return folder


def judged(
    folder: Path, config: Path, told: float, mass: float, payload: float | None = None
) -> Evaluation:
    """Return the evaluation of such a run."""
    return ugv.evaluate(write(folder, told, mass), config=config, payload=payload)


@pytest.fixture
def heavy(repository: Path, tmp_path: Path) -> Path:
    """PackBot with 4 kg in its configuration: stretched it needs 74.8 of 50 N m."""
    return _config(repository, tmp_path, 4.0)


def _config(repository: Path, folder: Path, mass: float) -> Path:
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    lines = [
        f'  mass_kg: {mass}' if line.startswith('  mass_kg:') else line
        for line in text.splitlines()
    ]
    assert any(line == f'  mass_kg: {mass}' for line in lines)
    path = folder / f'packbot_{mass:g}.yaml'
    path.write_text('\n'.join(lines).replace('../urdf', str(repository / 'urdf')), encoding='utf-8')
    return path


def test_a_load_told_late_is_judged_with_both_values(heavy: Path, tmp_path: Path) -> None:
    """The configuration's 4 kg would fail, the 0.5 kg told after 3 s pass: nobody knows."""
    found = judged(tmp_path / 'run', heavy, 3.0, 0.5)
    assert found.verdict == 'INCONCLUSIVE'
    assert found.reasons[0].startswith(
        'the load was told only after 3.00 s: with 4 kg until then (the configuration) FAIL, '
        'with 0.5 kg (told first) PASS'
    )


def test_the_beginning_before_the_first_message_is_not_judged(heavy: Path, tmp_path: Path) -> None:
    """Twenty milliseconds of the configuration's load are no failure."""
    found = judged(tmp_path / 'run', heavy, 0.02, 0.5)
    assert found.verdict == 'PASS', found.reasons
    assert found.coverage > 0.99


def test_two_loads_with_one_verdict_need_no_choice(heavy: Path, tmp_path: Path) -> None:
    """Both too much: a failure, whichever was carried."""
    assert judged(tmp_path / 'run', heavy, 3.0, 4.5).verdict == 'FAIL'


def test_a_load_given_to_the_evaluation_is_known(heavy: Path, tmp_path: Path) -> None:
    """Who says what was carried at first has decided it."""
    found = judged(tmp_path / 'run', heavy, 3.0, 0.5, payload=0.0)
    assert found.verdict == 'PASS', found.reasons
