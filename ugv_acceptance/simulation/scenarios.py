"""The fixed scenarios: those of the PackBot that ships, and by roles those of any robot."""

from collections.abc import Callable
from math import pi, radians

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.simulation.fixed_runs import FIXED
from ugv_acceptance.simulation.poses import STOWED, is_packbot
from ugv_acceptance.simulation.scenario import Command, Scenario
from ugv_acceptance.simulation.shape import ramp

RIGHT = -pi / 2


def _arm(shoulder_deg: float, elbow_deg: float) -> tuple[tuple[str, float], ...]:
    return (('shoulder_joint', radians(shoulder_deg)), ('elbow_joint', radians(elbow_deg)))


def gentle() -> Scenario:
    """On level ground with 1 kg: lift, look around, drive, fold again. No alert is due."""
    return Scenario(
        'gentle',
        28.0,
        start=STOWED,
        payload=Payload(1.0),
        commands=(
            Command(2.0, joints=_arm(70, -60), speed=0.35),
            Command(8.0, joints=(('turret_joint', radians(30)),), speed=0.3),
            Command(12.0, joints=(('turret_joint', 0.0),), speed=0.3),
            Command(16.0, drive=(0.15, 0.0)),
            Command(18.5, drive=(0.0, 0.0)),
            Command(20.0, joints=_arm(115, -140), speed=0.35),
        ),
        joint_rate=100.0,
        imu_rate=200.0,
    )


def overreach() -> Scenario:
    """On a side slope with 4 kg: the shoulder saturates, then the arm turns downhill."""
    return Scenario(
        'overreach',
        29.0,
        start=STOWED,
        payload=Payload(0.0),
        commands=(
            Command(2.0, payload=Payload(4.0)),
            Command(3.0, slope=(radians(12), RIGHT), slope_rate=0.06),
            Command(7.5, joints=_arm(62, -75), speed=0.45),
            Command(11.5, joints=_arm(75, -150), speed=0.5),
            Command(15.5, joints=(('turret_joint', RIGHT),), speed=0.5),
            Command(21.0, joints=_arm(60, -85), speed=0.25),
        ),
        joint_rate=100.0,
        imu_rate=200.0,
    )


def fetch() -> Scenario:
    """On level ground: reach down, lift 2 kg, climb a ramp with it, come back, set it down."""
    return Scenario(
        'fetch',
        40.0,
        start=STOWED,
        payload=Payload(0.0),
        commands=(
            Command(2.0, joints=_arm(40, -70), speed=0.5),
            Command(6.5, payload=Payload(2.0), payload_time=1.0),
            Command(8.0, joints=_arm(95, -120), speed=0.35),
            Command(13.0, drive=(0.2, 0.0)),
            Command(20.0, drive=(0.0, 0.0)),
            Command(22.0, drive=(-0.2, 0.0)),
            Command(29.0, drive=(0.0, 0.0)),
            Command(31.0, joints=_arm(40, -70), speed=0.35),
            Command(36.0, payload=Payload(0.0)),
            Command(37.0, joints=_arm(70, -100), speed=0.35),
        ),
        joint_rate=100.0,
        imu_rate=200.0,
        blocks=ramp(0.6, radians(10)),
        lean=radians(10.5),
    )


SCENARIOS: dict[str, Callable[[], Scenario]] = {
    'gentle': gentle,
    'overreach': overreach,
    'fetch': fetch,
}


def scenario_of(name: str, robot: Robot) -> Scenario:
    """Return a fixed scenario by name: PackBot's own, or by the roles of the robot's joints."""
    return SCENARIOS[name]() if is_packbot(robot) else FIXED[name](robot)
