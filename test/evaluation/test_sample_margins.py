"""Margins of a live message: what is left out until asked for, and what is kept, is right."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import stability
from ugv_acceptance.model.statics import static_torque

SETTINGS = load().settings
ROBOT, NAMES = SETTINGS.robot, SETTINGS.robot.joint_names
ZERO = (0.0,) * len(NAMES)
T0, MS = 10**18, 1_000_000


class Robot:
    """A PackBot whose messages a live evaluator takes, 5 ms apart."""

    def __init__(self) -> None:
        self.evaluator = LiveEvaluator(SETTINGS)
        self.evaluator.start(T0)
        self.now = T0

    def joints(self, q: tuple[float, ...]) -> Margins | None:
        """Send joint positions (rad)."""
        self.now += 5 * MS
        return self.evaluator.joint_state(self.now, self.now, NAMES, q, ZERO, ZERO)

    def imu(self, roll: float) -> Margins | None:
        """Send an IMU message of a robot at rest that leans by `roll` (rad)."""
        self.now += 5 * MS
        turn = (math.sin(roll / 2), 0.0, 0.0, math.cos(roll / 2))
        force = (0.0, 9.81 * math.sin(roll), 9.81 * math.cos(roll))
        return self.evaluator.imu(self.now, self.now, turn, 0.0, (0.0, 0.0, 0.0), force)


ANGLES = st.floats(-1.2, 1.2)


@given(st.tuples(ANGLES, ANGLES, ANGLES, st.floats(-3.0, 3.0)), st.floats(-1.0, 1.0))
def test_tip_angles_and_state_are_those_of_all_margins(q: tuple[float, ...], roll: float) -> None:
    """To the last bit, whatever the posture, with flippers on the ground or above it."""
    robot = Robot()
    robot.joints(q)
    margins = robot.imu(roll)
    assume(margins is not None and not any(map(math.isnan, margins.angle)))
    assert margins is not None
    assert margins.stability.angle == margins.angle
    assert margins.stability.state == margins.state
    alone = stability(ROBOT, q, margins.gravity)
    assert margins.stability.moment == pytest.approx(tuple(map(float, alone.moment)), abs=1e-9)


@given(st.lists(st.sampled_from(['lower', 'lean', 'load', 'again']), min_size=1, max_size=8))
def test_what_is_kept_between_messages_is_never_out_of_date(acts: list[str]) -> None:
    """Margins after any changes are those of the last posture, load and attitude, computed anew."""
    robot, q, roll, load = Robot(), (0.0, 1.0, -0.5, 2.0), 0.0, ROBOT.payload
    robot.joints(q)
    robot.imu(roll)
    for act in acts:
        if act == 'lower':
            q = (q[0], q[1] - 0.05, *q[2:])
        elif act == 'lean':
            roll += 0.03
        elif act == 'load':
            load = Payload(load.mass + 0.5, load.cog)
            frame = ROBOT.payload_link or ''
            robot.evaluator.carry(robot.now, load.mass, load.cog, frame)
        robot.joints(q)
        margins = robot.imu(roll)
        assert margins is not None
        assert margins.torque == pytest.approx(
            tuple(static_torque(ROBOT, q, margins.gravity, load)), abs=1e-9
        )
        angles = stability(ROBOT, q, margins.gravity, load).angle
        assert margins.angle == pytest.approx(tuple(map(float, angles)), abs=1e-9)
