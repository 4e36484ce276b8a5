"""Named postures of a robot file: read, refused where wrong, and used by their names."""

import re
from pathlib import Path

import pytest
from config.robot_files import YAML, write_robot

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.robot_description import describe, posture_from
from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Pose

POSES = """poses:
  STOW: {lift_deg: 45, slide_cm: 20}
  reach-out: {lift: 0.5}
  HOME: {}
"""


def test_poses_are_read_in_si_and_radians(tmp_path: Path) -> None:
    """Degrees, lengths and bare numbers become rad and m, in the order of the file."""
    poses = load(write_robot(tmp_path, YAML + POSES)).settings.robot.poses
    assert [pose.name for pose in poses] == ['STOW', 'reach-out', 'HOME']
    assert dict(poses[0].positions) == pytest.approx({'lift': 0.7853981633974483, 'slide': 0.2})
    assert poses[1] == Pose('reach-out', (('lift', 0.5),))


def test_a_joint_whose_name_ends_like_a_unit_is_itself(tmp_path: Path) -> None:
    """A joint named lift_deg is that joint, not lift in degrees."""
    yaml = 'robot: {name: r}\nurdf: two.urdf\nposes: {UP: {lift_deg: 0.25}}\n'
    urdf = (
        '<robot name="r"><link name="a"><inertial><mass value="1"/></inertial></link>'
        '<joint name="lift_deg" type="continuous"><parent link="a"/><child link="b"/></joint>'
        '<link name="b"/></robot>'
    )
    robot = load(write_robot(tmp_path, yaml, urdf)).settings.robot
    assert robot.poses == (Pose('UP', (('lift_deg', 0.25),)),)


@pytest.mark.parametrize(
    ('poses', 'said'),
    [
        ('{UP: {lfit_deg: 3}}', r'UP.lfit_deg: .* joint, got "lfit_deg"; did you mean lift\?'),
        ('{UP: {wing: 3}}', r'poses.UP.wing: expected a measured joint, got "wing"'),
        ('{UP: {lift_deg: 86}}', r'expected -1.5 .. 1.5 rad, the range of lift.*, got 1.50098'),
        ('{UP: {slide_m: -0.2}}', r'expected -0.1 .. 0.3 m, the range of slide .*, got -0.2 m'),
        ('{UP: {lift_m: 1}}', r'poses.UP.lift_m: expected an angle .*, got the unit m'),
        ('{UP: {slide_deg: 1}}', r'expected a length .*, got the unit deg'),
        ('{UP: {lift: high}}', r'poses.UP.lift: expected an angle .*, got "high"'),
        ('{UP: {lift: .nan}}', r'expected a finite number'),
        ('{UP: {lift: null}}', r'poses.UP.lift: expected an angle .*, got None'),
        ('{UP: {lift: 0.1, lift_deg: 3}}', r'poses.UP.lift_deg: given twice, as lift'),
        ('{UP: 3}', r'poses.UP: expected joints with positions.*, got 3'),
        ('{UP: }', r'poses.UP: expected joints with positions.*, got None'),
        ('{"a b": {lift: 0}}', r'poses.a b: expected a name of letters.*, got "a b"'),
        ('{"a=b": {lift: 0}}', r'expected a name of letters, digits, - and _'),
        ('[UP]', r'poses: expected '),
    ],
)  # fmt: skip
def test_a_wrong_pose_is_refused_at_load(tmp_path: Path, poses: str, said: str) -> None:
    """One line with file, line and field: unknown joints, wrong units, places out of range."""
    with pytest.raises(BadConfig) as error:
        load(write_robot(tmp_path, f'{YAML}poses: {poses}\n'))
    assert re.search(said, str(error.value)), str(error.value)
    assert re.match(r'\S+two\.yaml:13: ', str(error.value))
    assert '\n' not in str(error.value)


def test_a_held_joint_is_no_part_of_a_pose(tmp_path: Path) -> None:
    """A pose moves what is measured; a joint that is held does not move."""
    yaml = 'robot: {name: r}\nurdf: two.urdf\njoints: {lift: {}}\nheld: {slide: 0.1}\n'
    with pytest.raises(BadConfig, match='expected a measured joint, got "slide_m"'):
        load(write_robot(tmp_path, f'{yaml}poses: {{UP: {{slide_m: 0.1}}}}\n'))


@pytest.mark.parametrize(
    ('text', 'q'),
    [
        ('', [0, 0]),
        ('STOW', [0.7853981633974483, 0.2]),
        (' reach-out ', [0.5, 0]),
        ('STOW,slide=1cm', [0.7853981633974483, 0.01]),
        ('HOME, lift=0.2rad', [0.2, 0]),
        ('lift=0.2rad', [0.2, 0]),
    ],
)
def test_a_posture_may_name_a_pose(tmp_path: Path, text: str, q: list[float]) -> None:
    """A pose, with or without positions of joints that replace the pose's; the rest is at 0."""
    robot = load(write_robot(tmp_path, YAML + POSES)).settings.robot
    assert posture_from(robot, text) == pytest.approx(q)


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('STOWE', r'expected a pose \(STOW, reach-out, HOME\), got "STOWE"; did you mean STOW\?'),
        ('stow', r'got "stow"; did you mean STOW\?'),
        ('lift=1deg,STOW', 'expected name=value'),
        ('STOW,HOME', 'expected name=value'),
        ('STOW,lfit=1deg', r'measured joint \(lift, slide\), got lfit; did you mean lift\?'),
    ],
)  # fmt: skip
def test_an_unknown_pose_or_joint_is_named_with_the_nearest(
    tmp_path: Path, text: str, said: str
) -> None:
    """One line: what was expected, what came, what may have been meant; the pose comes first."""
    robot = load(write_robot(tmp_path, YAML + POSES)).settings.robot
    with pytest.raises(BadConfig, match=f'^--posture: .*{said}'):
        posture_from(robot, text)


def test_a_description_lists_the_poses(tmp_path: Path) -> None:
    """`model --json` tells each pose with the position of every measured joint."""
    poses = describe(load(write_robot(tmp_path, YAML + POSES)))['poses']
    assert poses[1] == {'name': 'reach-out', 'positions': {'lift': 0.5, 'slide': 0.0}}
    assert len(poses) == 3
