"""Joints that carry the robot, live as in a recording: the same torques and alerts."""

import math

import numpy as np
import pytest
from evaluation.streams import MS, T0, Imu, Joints, Message, S, recorded, tilted, upright
from evaluation.test_live_equals_recorded import compare
from robots import tracked

from ugv_acceptance.evaluation.settings import Delays, ImuInput, JointInput, Limits, Settings

NAMES = ('turret', 'shoulder', 'elbow', 'flippers')


def settings(*, level: bool = False) -> Settings:
    """Return settings of a tracked robot whose flippers hold 30 N m; `level`: it has no IMU."""
    imu = ImuInput(attitude='level' if level else 'auto', agreement=9.0)
    joints = tuple(JointInput(name) for name in NAMES)
    limits = Limits((1e3, 1e3, 1e3, 30.0))
    return Settings(tracked(), joints, imu, limits, Delays(tip_on=0.02, torque_on=0.03, off=0.1))


def lifting(seed: int, count: int = 200) -> list[Message]:
    """Return a run in which flippers press the ground and let go, on slopes up to tipping."""
    rng = np.random.default_rng(seed)
    found: list[Message] = []
    for k in range(count):
        at = T0 + 20 * k * MS
        flipper = -0.6 + 0.8 * math.sin(0.05 * k)
        arm = (0.3 * math.sin(0.03 * k), 0.5, 0.3)
        lean = tilted(0.9 * math.sin(0.021 * k), 0.7 * math.sin(0.013 * k + seed))
        found += [
            Imu(at, lean, acceleration=upright(lean)),
            Joints(at + 10 * MS, NAMES, (*arm, flipper + 1e-3 * float(rng.normal()))),
        ]
    return found


@pytest.mark.parametrize('seed', range(2))
def test_live_and_recorded_are_equal_where_joints_carry(seed: int) -> None:
    """The same torques and alerts while flippers lift the robot, in any batches, past tipping."""
    compare(settings(), lifting(seed), [7, 100, 101, 350], [T0 + 700 * MS], S)


def test_a_flipper_beyond_its_limit_is_told_while_it_lifts() -> None:
    """TORQUE_LIMIT comes with the ground's reaction, and goes when the flippers are up."""
    _, evaluator = recorded(settings(), [lifting(0)], T0 + 5 * S)
    found = [a for a in evaluator.watch.log if a.rule.subject == 'flippers']
    assert {(a.rule.code, a.rule.level) for a in found if a.rule.code == 'TORQUE_LIMIT'} != set()
    assert any(a.end is not None for a in found)
    assert evaluator.carrying == {3}


def test_without_an_imu_the_reaction_is_taken_straight_up() -> None:
    """A base that was declared level has the same torques, though no tip-over margin."""
    messages = [m for m in lifting(0) if isinstance(m, Joints)]
    rows, evaluator = recorded(settings(level=True), [messages], T0 + 5 * S)
    flippers = np.concatenate([part.torque[part.known, 3] for part in rows])
    assert np.abs(flippers).max() > 30.0
    assert evaluator.carrying == {3}
