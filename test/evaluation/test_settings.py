"""Settings that nobody gave: the defaults that the documentation promises."""

import math
import re
from pathlib import Path
from typing import Any

import pytest

from ugv_acceptance.evaluation.settings import Delays, ImuInput, JointInput, Limits
from ugv_acceptance.model.robot import Robot


def documented(repository: Path, key: str) -> list[str]:
    """Return the defaults that the table of the configuration's keys gives on a key's line."""
    text = (repository / 'docs' / 'robot_configuration.md').read_text('utf-8')
    (line,) = re.findall(rf'^\| `{re.escape(key)}`.*\| ([^|]*) \|$', text, re.MULTILINE)
    return [str(part).strip() for part in str(line).split(',')]


def test_defaults_are_those_of_the_documentation(repository: Path) -> None:
    """The default settings equal the table in docs/robot_configuration.md."""
    limits, delays, imu, joint = Limits((1.0,)), Delays(), ImuInput(), JointInput('x')
    deg = math.degrees
    found: dict[str, tuple[Any, ...]] = {
        'limits.torque_warn': (limits.torque_warn, limits.torque_error),
        'limits.torque_deadband_nm': (limits.torque_deadband,),
        'limits.tip_warn_deg': tuple(
            map(deg, (limits.tip_warn, limits.tip_error, limits.tip_deadband))
        ),
        'delays.tip_on_s': (
            delays.tip_on,
            delays.torque_on,
            delays.fault_on,
            delays.off,
            delays.tip_off,
        ),
        'delays.stale_after_s': (delays.stale_after, delays.stale_periods, delays.tick),
        'imu.rest_acceleration_mps2': (imu.rest_acceleration, imu.rest_rate),
        'imu.agreement_deg': (deg(imu.agreement), imu.agreement_delay),
        'imu.low_pass_s': (imu.low_pass,),
        'joints.NAME.effort_sign': (joint.effort_sign, joint.effort_scale),
        'gravity_mps2': (Robot('x', (), (), ()).gravity,),
    }
    for key, values in found.items():
        assert [float(x) for x in documented(repository, key)] == pytest.approx(values), key
    assert documented(repository, 'imu.attitude') == [imu.attitude]
    assert documented(repository, 'imu.specific_force') == [str(imu.specific_force).lower()]
    assert (joint.sign, joint.offset) == (1.0, 0.0)
    assert (limits.speed, limits.friction) == ((), math.inf)
    assert (imu.frame, imu.mounting[0], imu.position) == ('', (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
