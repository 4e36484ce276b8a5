"""A planned motion in YAML: the forms that ROS's own tools print and take, and what is none."""

import math

import numpy as np
import pytest

from ugv_acceptance import BadConfig
from ugv_acceptance.config.trajectory_file import read_trajectory

# As `ros2 topic echo --full-length` prints it.
ECHOED = """\
header:
  stamp:
    sec: 0
    nanosec: 0
  frame_id: ''
joint_names:
- shoulder
- elbow
points:
- positions:
  - 0.5
  - -1
  velocities: []
  accelerations: []
  effort: []
  time_from_start:
    sec: 1
    nanosec: 500000000
- positions:
  - 0.7
  - -1.5
  velocities:
  - 0.0
  - 0.0
  accelerations: []
  effort: []
  time_from_start:
    sec: 3
    nanosec: 0
---
"""
SHORT = """\
joint_names: [shoulder, elbow]
points:
- {positions: [0.5, -1], time: 1.5}
- {positions: [0.7, -1.5], velocities: [0, 0], time_from_start: 3}
"""


@pytest.mark.parametrize(
    'text',
    [ECHOED, SHORT, 'trajectory:\n' + ''.join(f'  {line}\n' for line in SHORT.splitlines())],
)
def test_each_form_is_the_same_motion(text: str) -> None:
    """Echoed, with plain times, as the goal of an action; a point without rates is NaN there."""
    found = read_trajectory(text, 'm.yaml')
    assert found.names == ('shoulder', 'elbow')
    assert found.times.tolist() == [1.5, 3.0]
    assert found.positions.tolist() == [[0.5, -1.0], [0.7, -1.5]]
    assert found.velocities is not None
    assert np.isnan(found.velocities[0]).all()
    assert found.velocities[1].tolist() == [0.0, 0.0]
    assert found.accelerations is None


def test_nan_is_left_to_the_judge() -> None:
    """It is a number that a message may hold."""
    text = SHORT.replace('0.5', '.nan').replace('1.5}', '.inf}')
    found = read_trajectory(text, 'm.yaml')
    assert math.isnan(found.positions[0, 0])
    assert math.isinf(found.times[0])


@pytest.mark.parametrize(
    ('text', 'told'),
    [
        ('', 'm.yaml:1: expected a trajectory_msgs/JointTrajectory'),
        ('a: 1', 'm.yaml:1: expected a trajectory_msgs/JointTrajectory'),
        ('[1, 2', 'm.yaml:1: expected YAML'),
        (SHORT.replace('[shoulder, elbow]', 'shoulder'), 'm.yaml:1: joint_names: expected a list'),
        ('joint_names: [a]\npoints: []', 'm.yaml:2: points: expected a list of points'),
        (SHORT.replace('[0.5, -1]', '[0.5]'), 'm.yaml:3: points.0.positions: expected 2 numbers'),
        (SHORT.replace('[0.5, -1]', '[]'), 'm.yaml:3: points.0.positions: expected 2 numbers'),
        (SHORT.replace('-1]', 'yes]'), 'expected a number, got True'),
        (SHORT.replace('-1]', "'...']"), 'ros2 topic echo --full-length'),
        (SHORT.replace('time: 1.5', 'effort: []'), 'expected time_from_start'),
        (SHORT.replace('time: 1.5', 'time: 1, time_from_start: 1'), 'expected time_from_start'),
        (SHORT.replace('time: 1.5', 'time: {s: 1}'), 'expected sec and nanosec'),
        (SHORT.replace('velocities', 'velocity'), 'points.1.velocity: expected one of positions'),
        (SHORT.replace('velocities: [0, 0]', 'velocities: [0]'), 'velocities: expected 2 numbers'),
        (SHORT + '---\n' + SHORT, 'expected YAML'),
    ],
)  # fmt: skip
def test_what_is_none_is_told_in_one_line(text: str, told: str) -> None:
    """With file, line and field."""
    with pytest.raises(BadConfig) as error:
        read_trajectory(text, 'm.yaml')
    assert told in str(error.value)
    assert '\n' not in str(error.value)
