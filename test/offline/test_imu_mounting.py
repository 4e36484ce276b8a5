"""Recordings whose IMU is placed by the URDF, by /tf_static, by a moving link, or by nobody."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from framed_robot import GROUND, robot_files
from scipy.spatial.transform import Rotation

import ugv_acceptance as ugv
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.transforms import TYPE, transforms_cdr
from ugv_acceptance.bag.writer import BagWriter, Qos

S, MS = 1_000_000_000, 1_000_000
T0 = 1_700_000_000 * S
# How the URDF mounts imu_link on base_link and hand_imu on arm_link.
IMU = Rotation.from_euler('xyz', [1.5708, 0.0, 0.5])
HAND = Rotation.from_euler('xyz', [0.0, 1.5708, 0.0])
LEANING = Rotation.from_euler('xyz', [6.0, -4.0, 30.0], degrees=True)
ARM = 0.3


def recorded(
    folder: Path,
    frame: str,
    sensor: Rotation,
    transforms: Sequence[tuple[str, str, Sequence[float], Sequence[float]]] = (),
    base: Rotation = LEANING,
) -> Path:
    """Write five seconds of the robot at rest, its IMU with these axes in the base's."""
    random = np.random.default_rng(4)
    world = base * sensor
    force = world.inv().apply([0.0, 0.0, 9.81])
    with BagWriter(folder) as bag:
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        if transforms:
            bag.add_topic('/tf_static', TYPE, Qos(durability='transient_local'))
            bag.write('/tf_static', T0 + S, transforms_cdr(transforms))
        for k in range(500):
            now = T0 + k * 10 * MS
            if k % 2:
                bag.write('/joint_states', now, joint_state_cdr(now, '', ['arm_joint'], [ARM]))
            felt = force + random.normal(0.0, 0.02, 3)
            spin = random.normal(0.0, 0.002, 3)
            bag.write('/imu/data', now, imu_cdr(now, frame, world.as_quat(), spin, felt))
    return folder


def judged(path: Path, config: Path, repository: Path) -> dict[str, Any]:
    """Return the result of evaluating a recording, which the schema allows."""
    result: dict[str, Any] = json.loads(ugv.evaluate(path, config=config).to_json())
    schema = json.loads((repository / 'schema' / 'result.schema.json').read_text('utf-8'))
    jsonschema.validate(result, schema)
    return result


def test_the_result_says_which_mounting_was_in_force(tmp_path: Path, repository: Path) -> None:
    """That of the URDF's chain, by the frame of the messages."""
    found = judged(recorded(tmp_path / 'run', 'imu_link', IMU), robot_files(tmp_path), repository)
    told = found['imu_mounting']
    assert (told['source'], told['frame'], told['link']) == ('urdf', 'imu_link', 'base_link')
    assert told['steps'] == ['imu_link', 'base_link']
    assert told['position_m'] == [0.19, 0.05, 0.149]
    assert told['rpy_deg'] == pytest.approx(np.degrees([1.5708, 0.0, 0.5]))
    assert found['verdict'] == 'PASS'


def test_static_transforms_are_used_whenever_they_were_recorded(
    tmp_path: Path, repository: Path
) -> None:
    """They hold for the whole recording: all of it is evaluated."""
    transforms = [('plate', 'xsens', (0.0, 0.0, 0.05), (0.0, 0.0, 0.0, 1.0)),
                  ('r1/base_link', 'plate', (0.1, 0.0, 0.0), IMU.as_quat().tolist())]  # fmt: skip
    run = recorded(tmp_path / 'run', '/xsens', IMU, transforms)
    found = judged(run, robot_files(tmp_path), repository)
    assert found['imu_mounting']['source'] == 'tf_static'
    assert found['imu_mounting']['steps'] == ['xsens', 'plate', 'base_link']
    assert found['verdict'] == 'PASS'
    assert found['coverage']['fraction'] > 0.98


@pytest.mark.parametrize(
    ('imu', 'frame', 'words'),
    [
        ('{mounting: auto}', 'xsens', "its frame 'xsens' is no link of the URDF"),
        ('{mounting: auto}', '', 'its messages name no frame'),
        ('{mounting: unknown}', 'imu_link', 'imu.mounting: unknown'),
    ],
)
def test_without_a_known_mounting_nothing_passes(
    tmp_path: Path, repository: Path, imu: str, frame: str, words: str
) -> None:
    """The verdict is INCONCLUSIVE, says why, and no margin is given."""
    run = recorded(tmp_path / 'run', frame, IMU)
    found = judged(run, robot_files(tmp_path, imu=imu), repository)
    assert found['verdict'] == 'INCONCLUSIVE'
    assert any(words in reason for reason in found['reasons'])
    assert words in found['imu_mounting']['why']
    assert found['coverage']['fraction'] == 0.0
    assert any('tilt' in one['what'] for one in found['not_checked'])


def test_a_mounting_that_gravity_denies_is_told_and_not_believed(
    tmp_path: Path, repository: Path
) -> None:
    """The URDF says one thing, the messages another: whose word it was stands in the reason."""
    run = recorded(tmp_path / 'run', 'imu_link', Rotation.from_euler('xyz', [0.0, -1.5708, 0.0]))
    found = judged(run, robot_files(tmp_path), repository)
    assert found['verdict'] == 'INCONCLUSIVE'
    text = ' '.join(found['reasons'])
    assert 'imu.mounting_rpy_deg: [0, -90, 0]' in text
    assert 'imu.mounting: auto took it from the URDF (imu_link - base_link)' in text


def test_an_imu_on_the_arm_is_judged_with_a_word(tmp_path: Path, repository: Path) -> None:
    """The base's tilt follows from the joint; that it is as old as that stands in NOT CHECKED."""
    sensor = Rotation.from_rotvec([0.0, -ARM, 0.0]) * HAND
    run = recorded(tmp_path / 'run', 'hand_imu', sensor)
    found = judged(run, robot_files(tmp_path), repository)
    assert found['imu_mounting']['moved_by'] == ['arm_joint']
    assert found['imu_mounting']['link'] == 'hand_imu'
    assert any('while arm_joint moves' in one['what'] for one in found['not_checked'])
    still = judged(recorded(tmp_path / 'base', 'imu_link', IMU), robot_files(tmp_path), repository)
    least = [result['stability']['min_angle_deg'] for result in (found, still)]
    assert least[0] == pytest.approx(least[1], abs=0.1)


@pytest.mark.parametrize('root', sorted(set(GROUND) - {'base_link'}))
@pytest.mark.parametrize('frame', ['imu_link', 'hand_imu'])
def test_margins_do_not_depend_on_the_root_link(tmp_path: Path, root: str, frame: str) -> None:
    """base_footprint, or a world in which base_link is shifted: the same torques and angles."""
    sensor = IMU if frame == 'imu_link' else Rotation.from_rotvec([0.0, -ARM, 0.0]) * HAND
    run = recorded(tmp_path / 'run', frame, sensor)
    found = [
        ugv.evaluate(run, config=robot_files(tmp_path, one)).margins for one in ('base_link', root)
    ]
    known = found[0].known
    assert known.sum() > 700
    np.testing.assert_array_equal(found[1].known, known)
    for name in ('tip_angle', 'static_torque', 'torque_margin'):
        ours, others = (getattr(margins, name)[known] for margins in found)
        np.testing.assert_allclose(others, ours, rtol=1e-9, atol=1e-9)


def test_the_husky_of_a_real_recording_is_not_believed_by_its_urdf(
    tmp_path: Path, shared_bags: Path
) -> None:
    """Its URDF turns the IMU's link by 180, -90, 0 deg; in the recording its y axis points up."""
    bag = shared_bags / 'robot_localization' / 'robot_localization_test1.bag'
    urdf = shared_bags.parent / 'robots' / 'husky' / 'husky.urdf'
    wheels = [f'{a}_{b}_wheel' for a in ('front', 'rear') for b in ('left', 'right')]
    feet = ''.join(
        f'  {name}: {{link: base_link, position_m: [{x}, {y}, -0.13228]}}\n'
        for name, x, y in zip(
            wheels, (0.256, 0.256, -0.256, -0.256), (0.285, -0.285) * 2, strict=True
        )
    )
    config = tmp_path / 'husky.yaml'
    config.write_text(
        f'robot: {{name: husky}}\nurdf: {urdf}\ntopics: {{joint_states: null}}\n'
        f'held: {{{", ".join(f"{name}: 0" for name in wheels)}}}\nimu: {{mounting: auto}}\n'
        f'contacts:\n{feet}ground: {{height_m: -0.13228, kind: flat}}\n',
        'utf-8',
    )
    result = ugv.evaluate(bag, config=config).to_dict()
    told: Any = result['imu_mounting']
    assert told['source'] == 'urdf'
    assert result['verdict'] == 'INCONCLUSIVE'
    codes = {alert['code'] for alert in result['alerts']}  # type: ignore[attr-defined]
    assert 'IMU_MOUNTING' in codes
    assert 'imu.mounting_rpy_deg: [90, 0, 0]' in str(result['alerts'])
    assert not math.isnan(told['rpy_deg'][0])
