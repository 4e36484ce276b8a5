"""What of a chassis in motion counts in a verdict, and what is told as not checked."""

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
from evaluation.streams import (
    T0,
    Imu,
    Joints,
    Message,
    S,
    recorded,
    run_of,
    settings,
    tilted,
    upright,
)

from ugv_acceptance.evaluation.chassis.examination import ChassisExamination
from ugv_acceptance.evaluation.criteria.statement import Statement
from ugv_acceptance.evaluation.settings import ImuInput, Settings

# Brake (m/s2) that takes more than all of the small robot's tilt to the front.
HARD = 16.0
# Yaw rate (rad/s) of the drive: nothing is at rest, so that no other check of the IMU speaks.
YAW = 0.2


def judged(messages: list[Message], told: Settings | None = None) -> Statement:
    """Return what the examination states of a recording of these messages."""
    end = messages[-1].time
    rows, _ = recorded(told or settings(), [messages], end)
    examination = ChassisExamination()
    for part in rows:
        examination.add(part)
    return examination.statement(T0, end)


def yawed(yaw: float, q: Sequence[float]) -> tuple[float, ...]:
    """Return an orientation turned about the world's vertical by `yaw` (rad)."""
    s, c = math.sin(yaw / 2), math.cos(yaw / 2)
    x, y, z, w = q
    return c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z


def driven(
    brake: float = 0.0,
    rate: float = 0.0,
    length: float = 0.4,
    *,
    hz: float = 100.0,
    units: float = 1.0,
    turns: bool = True,
) -> list[Message]:
    """Return 6 s in which the robot brakes (m/s2) from 3 s on and turns over its front (rad/s).

    The gyro tells the turn `units` times as fast; the orientation does not turn unless `turns`.
    """
    found: list[Message] = []
    pitch = 0.0
    for m in run_of(6.0, imu_hz=hz):
        if isinstance(m, Imu):
            on = 3.0 <= (m.time - T0) / 1e9 < 3.0 + length
            pitch += rate / hz if on else 0.0
            lean = yawed(YAW * (m.time - T0) / S, tilted(0.01, pitch if turns else 0.0))
            up = upright(lean)
            felt = (up[0] - (brake if on else 0.0), up[1], up[2])
            spin = units * (rate if on else 0.0)
            moved = replace(m, orientation=lean, acceleration=felt)
            found.append(replace(moved, omega=(0.0, spin, units * YAW)))
        else:
            found.append(m)
    return found


def verdicts(statement: Statement) -> list[str]:
    """Return the verdicts of the objections."""
    return [objection.verdict for objection in statement.objections]


def test_a_gentle_drive_is_no_objection() -> None:
    """Brakes that every edge bears are judged, and nothing is said against them."""
    statement = judged(driven(brake=2.0))
    assert not statement.objections
    result = statement.result['chassis_acceleration']
    assert isinstance(result, dict)
    assert result['judged_share'] > 0.9
    assert result['accelerometer_share'] > 0.99


def test_a_turn_that_goes_over_is_a_failure() -> None:
    """A robot that turns over its edge faster than it can stop fails, wherever it is then."""
    (tip, *_) = judged(driven(rate=3.0, length=0.15)).objections
    assert (tip.safeguard, tip.verdict) == ('chassis_acceleration', 'FAIL')
    assert tip.reason.startswith('at 3.')
    assert 'to the front' in tip.reason


def test_a_gyro_in_other_units_is_no_failure() -> None:
    """The orientation must turn as the gyro says: else the IMU contradicts itself."""
    statement = judged(driven(rate=0.06, length=2.0, units=180.0 / math.pi))
    assert set(verdicts(statement)) == {'INCONCLUSIVE'}


def test_an_orientation_that_is_stuck_is_no_failure() -> None:
    """A turn that only the gyro shows is a contradiction, too."""
    statement = judged(driven(rate=3.0, length=0.15, turns=False))
    assert set(verdicts(statement)) == {'INCONCLUSIVE'}


def test_a_brake_that_lifts_is_inconclusive() -> None:
    """Effective gravity near the edge and a turn of over a degree: an end of the tracks lifts."""
    (lift,) = judged(driven(brake=HARD, rate=0.3)).objections
    assert lift.verdict == 'INCONCLUSIVE'
    assert 'lifted' in lift.reason


def test_a_brake_past_tipping_without_a_turn_is_a_contradiction() -> None:
    """So long and no turn: accelerometer or gyro is wrong."""
    (denied,) = judged(driven(brake=HARD, length=1.0)).objections
    assert denied.verdict == 'INCONCLUSIVE'
    assert 'contradict' in denied.reason


def test_without_a_rate_nothing_is_checked() -> None:
    """A gyro that was not measured, or shows zeros only, is no gyro: told with its seconds."""
    run = driven(brake=2.0)
    for change in ({'omega_covariance_0': -1.0}, {'omega': (0.0, 0.0, 0.0)}):
        statement = judged([replace(m, **change) if isinstance(m, Imu) else m for m in run])
        assert not statement.objections
        (one,) = statement.not_checked
        assert (one.what, one.why) == (
            'chassis acceleration', 'the IMU measures no rate, or only zeros',
        )  # fmt: skip
        assert one.seconds == pytest.approx(6.0, abs=0.1)


def test_a_slow_imu_is_not_checked() -> None:
    """Below 50 messages a second a brake is over before it is seen; 50 are enough."""
    (one,) = judged(driven(brake=2.0, hz=25.0)).not_checked
    assert one.why == 'the IMU sends fewer than 50 messages a second'
    assert one.seconds == pytest.approx(5.5, abs=0.2)
    assert verdicts(judged(driven(brake=HARD, length=1.0, hz=50.0))) == ['INCONCLUSIVE']


def test_lost_messages_are_no_slow_imu() -> None:
    """Every third message of 100 Hz lost leaves enough."""
    run = driven(brake=HARD, length=1.0)
    lost = [m for m in run if isinstance(m, Imu)][::3]
    run = [m for m in run if m not in lost]
    assert verdicts(judged(run)) == ['INCONCLUSIVE']


def test_an_accelerometer_without_gravity_is_not_believed() -> None:
    """Where its driver subtracts gravity only the gyro counts, and that is told."""
    told = settings(ImuInput(attitude='orientation'))
    run = [
        replace(m, acceleration=(m.acceleration[0], 0.0, 0.0)) if isinstance(m, Imu) else m
        for m in driven(brake=2.0)
    ]
    statement = judged(run, told)
    assert not statement.objections
    (one,) = statement.not_checked
    assert one.what == 'braking and turning'
    assert one.seconds == pytest.approx(5.5, abs=0.2)


def test_a_long_brake_keeps_the_accelerometer() -> None:
    """What was believed when an episode began is believed through it, though the mean is off."""
    result = judged(driven(brake=HARD, length=1.8)).result['chassis_acceleration']
    assert isinstance(result, dict)
    assert result['contradictions'] == 1
    assert result['least_effective']['time_s'] > 3.0
    assert result['accelerometer_share'] > 0.7


def test_an_arm_that_moves_is_told() -> None:
    """The chassis does not feel the inertia of its arm, so that stands beside the verdict."""
    run = driven()
    moved = [
        replace(m, position=(0.1 + (m.time - T0) / S / 20, 0.0)) if isinstance(m, Joints) else m
        for m in run
    ]
    assert [one.what for one in judged(run).not_checked] == []
    assert [one.what for one in judged(moved).not_checked] == ['arm swings']
