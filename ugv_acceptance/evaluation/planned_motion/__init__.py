"""May the arm move so? Judges a planned motion of the joints before the robot carries it out.

In: `Trajectory` and `Conditions` (request.py). Out: `CheckedMotion` (answer.py), by `check_motion`
(check.py). path.py says where the joints are between two points, margins.py what that takes.
"""

from ugv_acceptance.evaluation.planned_motion.answer import (
    NOT_KNOWN,
    PERMITTED,
    REFUSED,
    CheckedMotion,
    JointUse,
    TiltLeft,
)
from ugv_acceptance.evaluation.planned_motion.check import MotionChecker, check_motion
from ugv_acceptance.evaluation.planned_motion.request import Conditions, Trajectory

__all__ = [
    'NOT_KNOWN',
    'PERMITTED',
    'REFUSED',
    'CheckedMotion',
    'Conditions',
    'JointUse',
    'MotionChecker',
    'TiltLeft',
    'Trajectory',
    'check_motion',
]
