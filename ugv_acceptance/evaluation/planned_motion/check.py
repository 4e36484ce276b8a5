"""Judges a planned motion: the answer to `May the arm move so?`."""

from ugv_acceptance.evaluation.planned_motion.answer import NOT_KNOWN, CheckedMotion
from ugv_acceptance.evaluation.planned_motion.request import Conditions, Trajectory
from ugv_acceptance.evaluation.settings import Settings


def check_motion(
    settings: Settings,
    trajectory: Trajectory,
    conditions: Conditions,
) -> CheckedMotion:
    """Return whether the robot may carry out a motion; it raises nothing, whatever is asked."""
    del settings, trajectory, conditions
    return CheckedMotion(NOT_KNOWN, ('this check is not written yet',))
