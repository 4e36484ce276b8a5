"""One joint's torque, as its effort tells it, against the static model: bias, scale, friction.

Only for efforts that are torques. In motion also what motion adds to the error, in N m: it matters
where it could use up the margin that was left, not where it is statistically sure.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.effort.quantiles import f_quantile
from ugv_acceptance.evaluation.effort.regression import Fit, independent_samples, least_squares
from ugv_acceptance.type_aliases import Floats, Json

# A joint slower than REST is at rest, one faster than MOVING in motion (rad/s or m/s).
REST, MOVING = 0.02, 0.05
# Least number of samples for any statement.
LEAST = 30
# A scale needs torques that differ this much (standard deviation, N m or N).
SPREAD = 0.5
ALPHA = 0.05
# Errors in motion stay below this many times their root mean square in 95 % of the samples.
WITHIN = 2.0
# Friction (N m, N m s/rad; N, N s/m) below this is rounding.
ROUNDING = 1e-6


@dataclass(frozen=True, slots=True)
class JointSamples:
    """One joint's samples (n,): measured torque, static torque, rate, margin, which are usable.

    `margin` is limit - |static torque|, infinite without a limit; `clipped` says that the effort
    stands at its limit, `slow` that all joints are at rest.
    """

    measured: Floats
    torque: Floats
    rate: Floats
    margin: Floats
    clipped: NDArray[np.bool_]
    slow: NDArray[np.bool_]

    @property
    def difference(self) -> Floats:
        """Measured minus static torque (n,), N m or N."""
        return self.measured - self.torque

    def rest(self) -> NDArray[np.bool_]:
        """Return which samples (n,) are of the robot at rest with a known effort."""
        return self.slow & np.isfinite(self.measured)

    def motion(self) -> NDArray[np.bool_]:
        """Return which samples (n,) are of this joint in motion with a known effort."""
        return (np.abs(np.nan_to_num(self.rate)) > MOVING) & np.isfinite(self.measured)


def counts(s: JointSamples) -> Json:
    """Return how many samples there are at the limit, at rest and in motion, for JSON."""
    return {
        'clipped_samples': int(s.clipped.sum()),
        'rest_samples': int(s.rest().sum()),
        'motion_samples': int(s.motion().sum()),
    }


def check_joint(s: JointSamples) -> Json:
    """Return the comparison of one joint whose effort is its torque, for JSON."""
    return {**at_rest(s), **friction(s), 'f_test': in_motion(s)}


def at_rest(s: JointSamples) -> Json:
    """Return bias, root mean square and scale at rest; None where they are not determined."""
    rest = s.rest()
    if rest.sum() < LEAST:
        return {'bias': None, 'rms': None, 'scale': None}
    difference, torque = s.difference[rest], s.torque[rest]
    ones = np.ones((len(difference), 1))
    scale = None
    if torque.std() > SPREAD:
        scale = least_squares(np.column_stack((torque, ones)), s.measured[rest])
    return {
        'bias': interval(least_squares(ones, difference)),
        'rms': float(np.sqrt((difference**2).mean())),
        'scale': interval(scale),
    }


def interval(fit: Fit | None, k: int = 0) -> Json | None:
    """Return coefficient number k with its 95 % interval for JSON; None if there is none."""
    if fit is None or not np.isfinite([fit.value[k], fit.half_width[k]]).all():
        return None
    value, half = float(fit.value[k]), float(fit.half_width[k])
    return {'value': value, 'low': value - half, 'high': value + half}


def friction(s: JointSamples) -> Json:
    """Return Coulomb (N m) and viscous (N m s/rad) friction, from the difference over the rate.

    `friction` is None if the run does not determine it; `friction_unknown` then says why.
    """
    motion = s.motion()
    rate = s.rate[motion]
    if len(rate) < LEAST:
        return {'friction': None, 'friction_unknown': 'too little motion'}
    # If all motion is in one direction, sign and bias are the same column: there is no fit.
    columns = np.column_stack((np.sign(rate), rate, np.ones(len(rate))))
    fit = least_squares(columns, s.difference[motion])
    if fit is None:
        return {'friction': None, 'friction_unknown': 'motion in one direction or at one speed'}
    found = {'coulomb': interval(fit), 'viscous': interval(fit, 1)}
    # Friction dissipates: a surely negative coefficient is inertia, or a load that moves the arm.
    if any(part is not None and part['high'] < -ROUNDING for part in found.values()):
        return {'friction': None, 'friction_unknown': 'masked by other forces'}
    return {'friction': found, 'friction_unknown': ''}


def in_motion(s: JointSamples) -> Json | None:
    """Return what motion adds to the error: F (equations 9 and 10), and N m against the margin.

    `matters` says that the error of 95 % of the samples in motion could use up the least margin
    left in motion; None if the joint has no limit.
    """
    moving = s.motion()
    rest, motion = s.difference[s.rest()], s.difference[moving]
    if min(len(rest), len(motion)) < LEAST or not (rest**2).sum() > 0.0:
        return None
    mean_squares = [float((x**2).sum()) / (len(x) - 1) for x in (motion, rest)]
    freedom = [max(independent_samples(x) - 1.0, 1.0) for x in (motion, rest)]
    added = float(np.sqrt(max(mean_squares[0] - mean_squares[1], 0.0)))
    left = float(s.margin[moving].min())
    return {
        'f': mean_squares[0] / mean_squares[1],
        'critical': f_quantile(freedom[0], freedom[1], 1.0 - ALPHA),
        'alpha': ALPHA,
        'freedom': freedom,
        'rms_motion': float(np.sqrt(mean_squares[0])),
        'rms_rest': float(np.sqrt(mean_squares[1])),
        'added': added,
        'margin': left if np.isfinite(left) else None,
        'matters': WITHIN * added > left if np.isfinite(left) else None,
    }
