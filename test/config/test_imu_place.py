"""Where a file says that the IMU is, and what it may not say; frames for viewers."""

from pathlib import Path

import numpy as np
import pytest
from framed_robot import robot_files

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config, load
from ugv_acceptance.evaluation.permitted_limits import limits_hash


def loaded(folder: Path, imu: str, more: str = '') -> Config:
    """Return the small robot with this section `imu`."""
    return load(robot_files(folder, imu=imu, more=more))


@pytest.mark.parametrize(
    ('imu', 'placed', 'link'),
    [
        ('{}', 'given', ''),
        ('{mounting: auto}', 'auto', ''),
        ('{mounting: unknown}', 'unknown', ''),
        ('{mounting: unknown, position_m: [0, 0, 0.1]}', 'unknown', ''),
        ('{link: hand_imu, mounting_rpy_deg: [0, 90, 0]}', 'given', 'hand_imu'),
    ],
)
def test_a_file_says_where_the_imu_is(tmp_path: Path, imu: str, placed: str, link: str) -> None:
    """By numbers, by a link, by its messages, or that nobody knows."""
    found = loaded(tmp_path, imu).settings.imu
    assert (found.placed, found.link) == (placed, link)


@pytest.mark.parametrize(
    ('imu', 'words'),
    [
        ('{mounting: auto, mounting_rpy_deg: [0, 0, 0]}', 'expected auto alone.* got mounting_rpy'),
        ('{mounting: unknown, mounting_rpy_deg: [0, 0, 9]}', 'expected unknown alone'),
        ('{mounting: auto, link: imu_link}', 'expected auto alone.* got link too'),
        ('{mounting: auto, position_m: [0, 0, 1]}', 'expected auto alone.* got position too'),
        ('{mounting: level}', "expected 'auto' or 'unknown'"),
        ('{link: imu_lnk}', 'no link "imu_lnk"; did you mean imu_link'),
    ],
)
def test_what_is_said_twice_or_of_no_link_is_refused(tmp_path: Path, imu: str, words: str) -> None:
    """With the place in the file: one of the two would silently not count."""
    with pytest.raises(BadConfig, match=f'framed.yaml:3: imu.*{words}'):
        loaded(tmp_path, imu)


def test_the_hash_of_the_limits_is_not_about_where_the_imu_is(tmp_path: Path) -> None:
    """Alerts are judged by the same limits, wherever it is."""
    known, auto = loaded(tmp_path, '{}'), loaded(tmp_path, '{mounting: auto}')
    assert limits_hash(known.settings) == limits_hash(auto.settings)


def test_the_base_frame_is_the_root_unless_said_otherwise(tmp_path: Path) -> None:
    """With the prefix of the robot's frames before it."""
    assert loaded(tmp_path, '{}').settings.frame == 'base_link'
    assert loaded(tmp_path, '{}', ', frame_prefix: r1/').settings.frame == 'r1/base_link'
    found = loaded(tmp_path, '{}', ', frame_prefix: r1/, base_frame: imu_link').settings
    assert found.frame == 'r1/imu_link'


def test_a_base_frame_that_is_no_link_is_told(tmp_path: Path) -> None:
    """It may be another name of the root, or a slip of the pen."""
    found = loaded(tmp_path, '{}', ', base_frame: chassis')
    assert found.settings.frame == 'chassis'
    assert any('chassis is no link of the URDF' in text for text in found.warnings)


def test_a_base_frame_that_moves_is_refused(tmp_path: Path) -> None:
    """Shapes in it would jump about."""
    with pytest.raises(BadConfig, match=r'robot\.base_frame: .*arm_link, on arm_joint'):
        loaded(tmp_path, '{}', ', base_frame: arm_link')


def test_numbers_of_a_mounting_are_read_as_before(tmp_path: Path) -> None:
    """Roll, pitch and yaw of the sensor's axes in those of the root link."""
    found = loaded(tmp_path, '{mounting_rpy_deg: [0, 0, 90], position_m: [1, 2, 3]}').settings.imu
    np.testing.assert_allclose(found.mounting, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    assert found.position == (1.0, 2.0, 3.0)
