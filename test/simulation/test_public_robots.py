"""The public robots of ../shared/robots in MuJoCo, against the model: each made from the URDF."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from ugv_acceptance.config.urdf import read_urdf
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.statics import centre_of_gravity, static_torque
from ugv_acceptance.simulation.vehicle import Build, gravity_on_slope, vehicle_of

ROBOTS = Path(__file__).resolve().parents[2].parent / 'shared' / 'robots'
NAMES = (
    *('anymal_c', 'b1', 'dingo', 'go2', 'husky', 'husky_ur5', 'jackal', 'leo', 'summit_xl'),
    *('tb3_manip', 'tiago', 'z1'),
)


def robot_of(name: str) -> Robot:
    """Return a public robot with every joint measured that follows no other."""
    path = ROBOTS / name / f'{name}.urdf'
    if not path.exists():
        pytest.skip(f'{path} is absent: the public robots are not part of this project')
    urdf = read_urdf(path.read_bytes(), path.name)
    follow = {mimic.joint for mimic in urdf.mimics}
    free = (j.name for j in urdf.joints if j.kind != 'fixed' and j.name not in follow)
    return Robot(name, urdf.links, urdf.joints, tuple(free))


@pytest.mark.parametrize('name', NAMES)
def test_torque_and_balance_at_rest_are_those_of_mujoco(name: str) -> None:
    """Resting torques agree to 1e-8 N m and the centre of gravity to 1e-9 m, in any posture."""
    robot = robot_of(name)
    vehicle = vehicle_of(robot, Build(base='fixed', motors=False))
    rng = np.random.default_rng(5)
    for k in range(5):
        q = rng.uniform(-3.0, 3.0, len(robot.joint_names))
        gravity = gravity_on_slope(9.81, 0.1 * k, float(k))
        vehicle.model.opt.gravity[:] = gravity
        data = mujoco.MjData(vehicle.model)
        data.qpos[vehicle.position] = q
        mujoco.mj_inverse(vehicle.model, data)
        torque = data.qfrc_inverse[vehicle.rate]
        np.testing.assert_allclose(torque, static_torque(robot, q, gravity), rtol=1e-9, atol=1e-8)
        found = data.subtree_com[vehicle.root] - data.xpos[vehicle.root]
        np.testing.assert_allclose(found, centre_of_gravity(robot, q), rtol=0.0, atol=1e-9)
