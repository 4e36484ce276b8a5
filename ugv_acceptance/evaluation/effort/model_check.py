"""Compares measured efforts with static torques over a run, by least squares with intervals.

At rest: bias, scale and sign of each joint's effort, and the payload that would explain the
difference. In motion: friction, and the paper's F test of the moving part against that at rest.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtri, stdtrit

from ugv_acceptance.evaluation.downsampling import Sampler
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.type_aliases import Floats, Json

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Fit:
    """A least-squares fit: coefficients (k,) and half the width of each one's 95 % interval.

    `independent` is the number of independent samples that the n samples of a run are worth.
    """

    value: Floats
    half_width: Floats
    independent: float


def independent_samples(residual: Floats) -> float:
    """Return the number of independent samples that correlated residuals (n,) are worth.

    n (1 - r) / (1 + r) for the correlation r of neighbours, taken as at least 0.
    """
    n = len(residual)
    centred = residual - residual.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return float(n)
    r = min(max(float(centred[1:] @ centred[:-1]) / power, 0.0), 0.999)
    return n * (1.0 - r) / (1.0 + r)


def least_squares(columns: Floats, y: Floats) -> Fit | None:
    """Return the least-squares fit of y (n,) by columns (n, k); None if it is not determined."""
    n, k = columns.shape
    scale = np.sqrt((columns**2).sum(axis=0))
    if n <= k or not (scale > 0.0).all():
        return None
    scaled = columns / scale
    _, _, rank, singular = np.linalg.lstsq(scaled, y, rcond=None)
    if rank < k or singular[-1] < 1e-6 * singular[0]:
        return None
    inverse = np.linalg.inv(scaled.T @ scaled)
    value = inverse @ (scaled.T @ y)
    residual = y - scaled @ value
    worth = independent_samples(residual)
    freedom = max(worth - k, 1.0)
    variance = float(residual @ residual) / (n - k) * (n / max(worth, 1.0))
    deviation = np.sqrt(variance * np.diag(inverse))
    quantile = float(stdtrit(freedom, 0.5 + CONFIDENCE / 2.0))
    return Fit(value / scale, quantile * deviation / scale, worth)


# A joint slower than REST is at rest, one faster than MOVING in motion (rad/s or m/s).
REST, MOVING = 0.02, 0.05
# Time between samples (ns).
SPACING = 100_000_000
# Least number of samples for any statement.
LEAST = 30
# A scale needs torques that differ this much (standard deviation, N m or N), a payload this much
# torque per kg (N m/kg).
SPREAD, LEVER = 0.5, 0.5
ALPHA = 0.05
# An effort at this share of the joint's limit or above is clipped: it says nothing about the load.
CLIPPED = 0.99
# Friction (N m, N m s/rad; N, N s/m) below this is rounding.
ROUNDING = 1e-6


@dataclass(slots=True)
class ModelCheck:
    """Gathers samples of a run (at most ten a second) and compares them with the model."""

    settings: Settings
    _samples: Sampler = field(default_factory=lambda: Sampler(SPACING))

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording, but none of a robot that has tipped.

        It may rest on its arm, and then the efforts do not hold the arm against gravity.
        """
        self._samples.add(rows, standing=True)

    def _lever(self, q: Floats, gravity: Floats) -> Floats:
        robot = self.settings.robot
        one, none = (Payload(mass, robot.payload.cog) for mass in (1.0, 0.0))
        torque_gradient: Floats = static_torque(robot, q, gravity, one) - static_torque(
            robot, q, gravity, none
        )
        return torque_gradient

    def result(self) -> Json:
        """Return the comparison for JSON: by joint, payload fitting all, share of slow samples."""
        names = self.settings.robot.joint_names
        time, (effort, torque, rate, q, gravity) = self._samples.samples(len(names))
        torque_gradient = self._lever(q, gravity)
        slow = np.abs(np.nan_to_num(rate)).max(axis=1, initial=0.0) <= REST
        clipped = np.abs(effort) >= CLIPPED * np.array(self.settings.limits.torque)
        effort = np.where(clipped, np.nan, effort)
        columns = zip(effort.T, torque.T, torque_gradient.T, rate.T, clipped.T, strict=True)
        samples = [_Samples(*column, slow) for column in columns]
        return {
            'samples': len(time),
            'spacing_s': self._samples.spacing / 1e9,
            'speed_validity': self._speed_validity(rate),
            'payload': _pooled_payload(samples),
            'joints': {name: _joint(s) for name, s in zip(names, samples, strict=True)},
        }

    def _speed_validity(self, rate: Floats) -> Json:
        """Return the share of samples in which every joint was slow enough for the static model."""
        speeds = self.settings.limits.speed or (np.inf,) * rate.shape[1]
        bounds = np.array(speeds)
        judged = np.isfinite(bounds) & np.isfinite(rate).any(axis=0)
        if not judged.any():
            return {'share': None, 'joints': []}
        slow = (np.nan_to_num(np.abs(rate[:, judged])) <= bounds[judged]).all(axis=1)
        names = np.array(self.settings.robot.joint_names)[judged]
        return {'share': float(slow.mean()), 'joints': names.tolist()}


@dataclass(frozen=True, slots=True)
class _Samples:
    """One joint's samples (n,): measured effort, static torque, rate, and which are usable.

    `torque_gradient` is the torque per kg of payload (N m/kg; N/kg), `slow` says that all joints
    are at rest, `clipped` that the effort stands at its limit.
    """

    effort: Floats
    torque: Floats
    torque_gradient: Floats
    rate: Floats
    clipped: NDArray[np.bool_]
    slow: NDArray[np.bool_]

    @property
    def difference(self) -> Floats:
        """Measured effort minus static torque (n,), N m or N."""
        return self.effort - self.torque

    def rest(self) -> NDArray[np.bool_]:
        """Return which samples (n,) are of the robot at rest with a known effort."""
        return self.slow & np.isfinite(self.effort)

    def motion(self) -> NDArray[np.bool_]:
        """Return which samples (n,) are of this joint in motion with a known effort."""
        return (np.abs(np.nan_to_num(self.rate)) > MOVING) & np.isfinite(self.effort)


def _joint(s: _Samples) -> Json:
    told = np.isfinite(s.effort)
    if told.sum() < LEAST:
        return {'effort': 'not recorded' if not told.any() else 'too few samples'}
    if np.ptp(s.effort[told]) == 0.0:
        return {'effort': f'constant at {s.effort[told].max():g}'}
    return {
        'effort': 'recorded',
        'clipped_samples': int(s.clipped.sum()),
        'rest_samples': int(s.rest().sum()),
        'motion_samples': int(s.motion().sum()),
        **_rest(s),
        **_friction(s),
        'f_test': _f_test(s),
    }


def _rest(s: _Samples) -> Json:
    rest = s.rest()
    if rest.sum() < LEAST:
        return {'bias': None, 'scale': None, 'sign': 'unknown', 'payload_kg': None}
    difference, torque, torque_gradient = (
        s.difference[rest],
        s.torque[rest],
        s.torque_gradient[rest],
    )
    ones = np.ones((len(difference), 1))
    scale = None
    if torque.std() > SPREAD:
        scale = least_squares(np.column_stack((torque, ones)), s.effort[rest])
    payload = None
    if np.sqrt((torque_gradient**2).mean()) > LEVER:
        payload = least_squares(torque_gradient[:, None], difference)
    return {
        'bias': _interval(least_squares(ones, difference)),
        'rms': float(np.sqrt((difference**2).mean())),
        'scale': _interval(scale),
        'sign': _sign(scale),
        'payload_kg': _interval(payload),
    }


def _sign(scale: Fit | None) -> str:
    if scale is None or abs(scale.value[0]) <= scale.half_width[0]:
        return 'unknown'
    return 'same' if scale.value[0] > 0.0 else 'opposite'


def _interval(fit: Fit | None, k: int = 0) -> Json | None:
    """Return coefficient number k with its 95 % interval for JSON; None if there is none."""
    if fit is None or not np.isfinite([fit.value[k], fit.half_width[k]]).all():
        return None
    value, half = float(fit.value[k]), float(fit.half_width[k])
    return {'value': value, 'low': value - half, 'high': value + half}


def _friction(s: _Samples) -> Json:
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
    found = {'coulomb': _interval(fit), 'viscous': _interval(fit, 1)}
    # Friction dissipates: a surely negative coefficient is inertia, or a load that moves the arm.
    if any(part is not None and part['high'] < -ROUNDING for part in found.values()):
        return {'friction': None, 'friction_unknown': 'masked by other forces'}
    return {'friction': found, 'friction_unknown': ''}


def _f_test(s: _Samples) -> Json | None:
    """Return the F test of the mean square error in motion against that at rest (eq. 9, 10)."""
    rest, motion = s.difference[s.rest()], s.difference[s.motion()]
    if min(len(rest), len(motion)) < LEAST or not (rest**2).sum() > 0.0:
        return None
    mean_squares = [float((x**2).sum()) / (len(x) - 1) for x in (motion, rest)]
    freedom = [max(independent_samples(x) - 1.0, 1.0) for x in (motion, rest)]
    f = mean_squares[0] / mean_squares[1]
    critical = float(fdtri(freedom[0], freedom[1], 1.0 - ALPHA))
    return {
        'f': f,
        'critical': critical,
        'alpha': ALPHA,
        'freedom': freedom,
        'rms_motion': float(np.sqrt(mean_squares[0])),
        'rms_rest': float(np.sqrt(mean_squares[1])),
        'static_model_holds': f < critical,
    }


def _pooled_payload(samples: list[_Samples]) -> Json | None:
    """Return the payload (kg) in addition to the declared one that best fits all joints at rest."""
    columns, y = [], []
    for s in samples:
        rest = s.rest()
        if rest.sum() < LEAST or np.sqrt((s.torque_gradient[rest] ** 2).mean()) <= LEVER:
            continue
        spread = float(np.std(s.difference[rest])) or 1e-6
        columns.append(s.torque_gradient[rest] / spread)
        y.append(s.difference[rest] / spread)
    if not columns:
        return None
    fit = least_squares(np.concatenate(columns)[:, None], np.concatenate(y))
    return _interval(fit)
