"""What kinds of faults of an IMU mean in words, and the unit an acceleration seems to have."""

import math

from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.inputs.imu_motion import SLACK, SOURCE_KINDS
from ugv_acceptance.evaluation.inputs.imu_placing import MOUNTING_KINDS, UNIT_KINDS
from ugv_acceptance.evaluation.inputs.imu_rates import GYRO_KINDS, ORIENTATION_KINDS

KINDS = {
    'IMU_RATES': GYRO_KINDS,
    'IMU_ROTATION': ORIENTATION_KINDS,
    'IMU_MOUNTING': MOUNTING_KINDS,
    'IMU_UNIT': UNIT_KINDS,
    'IMU_TWO_SOURCES': SOURCE_KINDS,
}
# Sizes of an acceleration at rest, as shares of g, and what they suggest.
SEEMS = (
    (-1.0, 0.04, UNIT_KINDS[4]),
    (0.04, 0.2, UNIT_KINDS[1]),
    (2.5, 4.5, UNIT_KINDS[2]),
    (70.0, 140.0, UNIT_KINDS[3]),
)


def found(alert: Alert) -> str:
    """Return what a check of the IMU found, by the kind that is the alert's peak; '' if none."""
    kinds = KINDS.get(alert.rule.code, ())
    kind = int(alert.peak) if math.isfinite(alert.peak) else 0
    return kinds[kind] if 0 <= kind < len(kinds) else ''


def seems(alert: Alert) -> str:
    """Return the unit that an acceleration so far from gravity seems to have, '' if none."""
    share = 1.0 - alert.peak if alert.peak <= 1.0 else 1.0 + alert.peak
    words = [word for low, high, word in SEEMS if low <= share < high]
    return f': {words[0]}' if words else ''


def window(alert: Alert) -> float:
    """Return the length (s) of the window that contradicts: the alert reaches back SLACK more."""
    return max(alert.rule.reach - SLACK, 0) / 1e9
