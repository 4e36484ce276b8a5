"""Random URDF trees, read by us and by Pinocchio: the same torques and centres of gravity."""

from pathlib import Path

import numpy as np
import pinocchio
import pytest
from config.robot_files import write_robot

from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.statics import centre_of_gravity, static_torque

KINDS = ('revolute', 'continuous', 'prismatic', 'fixed')


def numbers(values: np.ndarray) -> str:
    """Return numbers as an attribute of a URDF."""
    return ' '.join(repr(float(x)) for x in values)


def random_urdf(random: np.random.Generator, count: int) -> str:
    """Return a URDF with `count` joints of random kinds, branches, frames, axes and inertias."""
    parts = ['<robot name="r"><link name="l0"/>']
    for k in range(1, count + 1):
        kind, parent = random.choice(KINDS), int(random.integers(0, k))
        xyz, rpy, axis, centre, turn = random.uniform(-1, 1, (5, 3))
        a, b, c = random.uniform(1, 2, 3)
        parts.append(
            f'<joint name="j{k}" type="{kind}"><parent link="l{parent}"/><child link="l{k}"/>'
            f'<origin xyz="{numbers(xyz)}" rpy="{numbers(3 * rpy)}"/><axis xyz="{numbers(axis)}"/>'
            '<limit lower="-3" upper="3" effort="100" velocity="1"/></joint>'
            f'<link name="l{k}"><inertial><origin xyz="{numbers(centre)}" rpy="{numbers(turn)}"/>'
            f'<mass value="{random.uniform(0.1, 5)}"/><inertia ixx="{a}" iyy="{b}" izz="{c}"'
            ' ixy="0.01" ixz="0.02" iyz="0.03"/></inertial></link>'
        )
    return ''.join([*parts, '</robot>'])


def of_pinocchio(text: str, robot: Robot, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return gravity torques in our joint order, and the centre of gravity."""
    model = pinocchio.buildModelFromXML(text)
    data = model.createData()
    theirs, order = pinocchio.neutral(model), []
    for name, position in zip(robot.joint_names, q, strict=True):
        joint = model.joints[model.getJointId(name)]
        order.append(joint.idx_v)
        turns = joint.nq == 2  # a continuous joint is told by cosine and sine
        value = [np.cos(position), np.sin(position)] if turns else [position]
        theirs[joint.idx_q : joint.idx_q + joint.nq] = value
    torque = pinocchio.computeGeneralizedGravity(model, data, theirs)[order]
    moving, fixed = pinocchio.centerOfMass(model, data, theirs), model.inertias[0]
    mass = sum(inertia.mass for inertia in model.inertias[1:])
    # What is fixed to the world is no part of Pinocchio's centre of gravity.
    centre = (mass * moving + fixed.mass * fixed.lever) / (mass + fixed.mass)
    return torque, centre


@pytest.mark.parametrize('seed', range(20))
def test_a_random_tree_is_understood_as_pinocchio_does(tmp_path: Path, seed: int) -> None:
    """Static torques agree to 1e-9, centres of gravity to 1e-12."""
    random = np.random.default_rng(seed)
    text = random_urdf(random, int(random.integers(1, 9)))
    robot = load(write_robot(tmp_path, 'robot: {name: r}\nurdf: two.urdf\n', text)).settings.robot
    q = random.uniform(-1.5, 1.5, len(robot.joint_names))
    torque, centre = of_pinocchio(text, robot, q)
    np.testing.assert_allclose(
        static_torque(robot, q, (0.0, 0.0, -9.81)), torque, rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(centre_of_gravity(robot, q), centre, rtol=0, atol=1e-12)
