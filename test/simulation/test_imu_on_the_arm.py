"""An IMU on the turret or the arm, simulated by MuJoCo: gravity is as by one on the chassis."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.samples import Batch, ImuColumns, JointStateColumns
from ugv_acceptance.evaluation.settings import ImuInput, Settings
from ugv_acceptance.model.robot import Matrix, Payload
from ugv_acceptance.simulation.scenario import Command, ImuLog, JointLog, Noise, Recording, Scenario
from ugv_acceptance.simulation.simulation import BUILD
from ugv_acceptance.simulation.stretches import run
from ugv_acceptance.type_aliases import Floats

SETTINGS = load().settings
EXACT = Noise(**{f.name: 1e-12 if f.name.endswith('step') else 0.0 for f in fields(Noise)})
PLACE = (0.1, 0.02, 0.05)
# On a side slope the arm lifts and turns about, then the robot turns on the spot.
MOVES = Scenario(
    'arm moves',
    9.0,
    (('shoulder_joint', 0.8), ('elbow_joint', -0.4), ('flipper_joint', 2.0)),
    slope=(math.radians(10.0), -math.pi / 2.0),
    payload=Payload(1.0),
    commands=(
        Command(1.0, (('turret_joint', 1.0), ('shoulder_joint', 1.4)), speed=0.4),
        Command(5.0, drive=(0.0, 0.3)),
    ),
    # The motors act at the joints' rate: at twice that the arm's acceleration would alternate.
    imu_rate=200.0,
    noise=EXACT,
)  # fmt: skip


def turned() -> Matrix:
    """Return the sensor's axes in those of its link: turned all ways."""
    a, b, c = Rotation.from_euler('xyz', [170.0, -80.0, 20.0], degrees=True).as_matrix().tolist()
    return tuple(a), tuple(b), tuple(c)


def gravity_of(told: Settings, joints: JointLog, imu: ImuLog) -> tuple[Floats, list[str]]:
    """Return gravity at each IMU message (n, 3), in base axes, and the IMU's alerts."""
    evaluator = RecordedEvaluator(told)
    start = 1_700_000_000_000_000_000
    evaluator.start(start)
    at = [start + np.round(log.stamp * 1e9).astype(np.int64) for log in (joints, imu)]
    names = tuple(joint.topic_name for joint in told.joints)
    zero = np.zeros(len(at[1]))
    part = Batch(
        [JointStateColumns(names, at[0], at[0], joints.position, joints.velocity, joints.effort)],
        [ImuColumns('imu', at[1], at[1], imu.orientation, imu.angular_velocity,
                    imu.linear_acceleration, zero, zero, zero)],
    )  # fmt: skip
    rows = evaluator.batch(part)
    codes = [a.rule.code for a in evaluator.watch.log if a.rule.subject == 'imu']
    return rows.pairs.imu.gravity[1:], codes


def recorded(link: str) -> Recording:
    """Return the run with the IMU on a link."""
    build = replace(BUILD, imu_position=PLACE, imu_rotation=turned(), imu_link=link)
    return run(SETTINGS.robot, MOVES, 0, build)


@pytest.fixture(scope='module')
def on_the_chassis() -> Floats:
    """Return gravity by an IMU on the chassis."""
    found = recorded('base_link')
    imu = ImuInput(mounting=turned(), position=PLACE, attitude='orientation', noise_free=True)
    return gravity_of(replace(SETTINGS, imu=imu), found.joints, found.imu)[0]


@pytest.mark.parametrize('link', ['turret_link', 'arm_link_1'])
def test_gravity_is_as_by_an_imu_on_the_chassis(link: str, on_the_chassis: Floats) -> None:
    """To what the joints turn between their messages; by the acceleration to what shakes it."""
    found = recorded(link)
    for attitude, most in (('orientation', 0.1), ('accelerometer', 2.5)):
        imu = ImuInput(
            mounting=turned(), position=PLACE, link=link, attitude=attitude, noise_free=True
        )
        told = replace(SETTINGS, imu=imu)
        gravity, codes = gravity_of(told, found.joints, found.imu)
        cosine = (gravity * on_the_chassis).sum(axis=1) / 9.81**2
        apart = np.degrees(np.arccos(np.minimum(cosine, 1.0)))
        late = np.arange(len(apart)) > 100
        assert np.isfinite(apart[late]).all()
        assert apart[late].max() < most
        assert codes == []


def test_without_the_joints_it_would_be_far_off(on_the_chassis: Floats) -> None:
    """The test above would find a mounting that is taken as fixed."""
    found = recorded('arm_link_1')
    imu = ImuInput(mounting=turned(), position=PLACE, attitude='orientation', noise_free=True)
    gravity, codes = gravity_of(replace(SETTINGS, imu=imu), found.joints, found.imu)
    assert np.nanmax(np.linalg.norm(gravity - on_the_chassis, axis=1)) > 3.0
    assert codes == ['IMU_MOUNTING']
