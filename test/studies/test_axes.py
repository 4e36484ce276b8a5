"""Which two joints a map varies, of robots of any names."""

from pathlib import Path

import pytest
from foreign_files import arm_alone, mobile_arm, rover, walker

from ugv_acceptance.config import load
from ugv_acceptance.studies.axes import arm_axes, map_axes


@pytest.mark.parametrize(
    ('make', 'arm'),
    [
        (mobile_arm, ('big_lift', 'mid_lift')),
        (arm_alone, ('big_lift', 'mid_lift')),
        (rover, ()),
        (walker, ()),
    ],
)
def test_the_axes_are_the_joints_that_lift(
    make: object, arm: tuple[str, ...], tmp_path: Path
) -> None:
    """They are found in the tree, whatever their names; legs and wheels are no axes of a map."""
    assert callable(make)
    settings = load(make(tmp_path)).settings
    assert arm_axes(settings.robot) == arm
    assert map_axes(settings.robot, settings.limits.torque) == arm


def test_packbots_axes_are_shoulder_and_elbow() -> None:
    """As they always were."""
    settings = load().settings
    assert arm_axes(settings.robot) == ('shoulder_joint', 'elbow_joint')
    assert map_axes(settings.robot, settings.limits.torque) == ('shoulder_joint', 'elbow_joint')


def test_a_joint_that_others_follow_is_no_axis_of_a_map(tmp_path: Path) -> None:
    """Torques over it are no sinusoid, so the next joint is taken."""
    path = mobile_arm(tmp_path)
    urdf = tmp_path / 'mobile_arm.urdf'
    head, tail = urdf.read_text().split('<joint name="roll_a"')
    axis, mimic = '<axis xyz="1 0 0"/>', '<mimic joint="mid_lift" multiplier="-1"/>'
    urdf.write_text(f'{head}<joint name="roll_a"{tail.replace(axis, axis + mimic, 1)}')
    path.write_text(path.read_text().replace('  roll_a: {}\n', ''))
    settings = load(path).settings
    assert arm_axes(settings.robot) == ('big_lift', 'mid_lift')
    first, second = map_axes(settings.robot, settings.limits.torque)
    assert first == 'big_lift'
    assert second not in {'mid_lift', 'roll_a'}
