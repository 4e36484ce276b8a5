"""What the verb paper adds from MuJoCo: tables of joints and of simulated tipping."""

import numpy as np
import pytest

from ugv_acceptance.cli.paper_simulation import simulated_arm, simulated_joints, simulated_truth
from ugv_acceptance.config import load
from ugv_acceptance.studies.offsets import table_2
from ugv_acceptance.studies.planar import PAPER, planar_torque


def test_every_random_case_is_counted_once() -> None:
    """The confusion matrix holds all cases, and none differs far from the boundary."""
    table = simulated_truth(load().settings.robot, 6)
    assert sum(int(cell) for row in table[1:4] for cell in row[1:] if cell) == 6
    assert table[4][1] == '0'


def test_mujoco_needs_the_torques_of_the_closed_form() -> None:
    """The torques at 7.2 deg/s differ from equations (1), (2) by the offsets alone."""
    simulated, found = simulated_arm()
    static = np.stack(planar_torque(PAPER, np.pi / 6.0, simulated.theta2), axis=-1)
    assert np.abs(simulated.torque - static).max() < 1.2
    assert found == pytest.approx(table_2(), rel=1e-6)


def test_joints_of_the_simulated_vehicle() -> None:
    """The elbow turns at 7.2 deg/s; the shoulder bears weight and torque of Figure 4's sweep."""
    table = simulated_joints(load().settings.robot, free=False)
    rows = {row[0]: row[1:] for row in table[1:]}
    assert rows['elbow_joint'][4] == '7.20'
    low, high = (float(x) for x in rows['shoulder_joint'][3].split(' to '))
    tau1 = planar_torque(PAPER, np.pi / 6.0, np.linspace(0.0, 2.0 * np.pi, 201))[0]
    assert (low, high) == pytest.approx((tau1.min(), tau1.max()), abs=0.1)
