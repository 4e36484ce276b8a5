"""Joint speeds up to which the static model holds: equations (9) and (10).

A joint that moves at a constant rate v adds v^2 c(q) to the torques, exactly; the error of the
static model is e = s + v^2 c, where s is the difference of the static and the true model at rest.
Its mean square is a polynomial of v^2, so F = MS(v) / MS(reference speed) and the speed at which F
is critical are closed forms.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtri

from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.model.statics import inverse_dynamics, static_torque
from ugv_acceptance.type_aliases import Floats

PAPER_CRITICAL = 1.227
PAPER_SAMPLES = 201
PAPER_SPEEDS_DEG_S = (1.0, 5.0, 7.2, 36.0, 72.0, 108.0, 144.0, 180.0)
REFERENCE_SPEED = math.radians(1.0)
# The static model's own error (N m rms) that the paper's Table 2 implies (see offsets.py).
REFERENCE_TORQUE = 1.0
# Torques (N m) below this are rounding errors of terms that cancel.
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class SpeedError:
    """The static model's mean square error of each joint's torque as a polynomial of joint speed.

    Coefficients (j,) of MS = rest + 2 v^2 mixed + v^4 moving, for e = s + v^2 c over a sweep:
    `rest` is the mean square of s (N2 m2), `mixed` the mean of s times c, `moving` that of c^2.
    """

    rest: Floats
    mixed: Floats
    moving: Floats

    def mean_square(self, speed: ArrayLike) -> Floats:
        """Return MS of equation (9), shape (..., j), for speeds (...) in rad/s."""
        square = np.asarray(speed, dtype=np.float64)[..., np.newaxis] ** 2
        result: Floats = self.rest + 2.0 * square * self.mixed + square**2 * self.moving
        return result

    def f_value(self, speed: ArrayLike, reference: float = REFERENCE_SPEED) -> Floats:
        """Return F of equation (10), shape (..., j), for speeds (...) in rad/s.

        NaN or infinite where there is no error at the `reference` speed (rad/s).
        """
        with np.errstate(divide='ignore', invalid='ignore'):
            ratio: Floats = self.mean_square(speed) / self.mean_square(reference)
        return ratio

    def speed_at(self, critical: float, reference: float = REFERENCE_SPEED) -> Floats:
        """Return the speed (j,) in rad/s at which F reaches `critical`; infinite if never."""
        excess = critical * self.mean_square(reference) - self.rest
        with np.errstate(divide='ignore', invalid='ignore'):
            root = np.sqrt(self.mixed**2 + self.moving * excess)
            square = np.where(self.moving > 0.0, (root - self.mixed) / self.moving, np.inf)
            result: Floats = np.sqrt(square)
        return result


def mean_square(error: ArrayLike, axis: int = 0) -> Floats:
    """Return the sum of squares divided by N - 1 along an axis: equation (9)."""
    error = np.asarray(error, dtype=np.float64)
    result: Floats = (error**2).sum(axis=axis) / (error.shape[axis] - 1)
    return result


def critical_value(alpha: float = 0.05, samples: int = PAPER_SAMPLES) -> float:
    """Return the critical value of F at significance `alpha` for two sweeps of `samples` each."""
    return float(fdtri(samples - 1, samples - 1, 1.0 - alpha))


def speed_error(
    robot: Robot,
    q: ArrayLike,
    joint: int,
    static: Robot | None = None,
    payload: Payload | None = None,
    gravity: ArrayLike | None = None,
) -> SpeedError:
    """Return the static model's error while joint number `joint` moves through postures `q` (n, j).

    `robot` is the truth, `static` the model whose static torque is compared with it; left out it is
    the same robot, so that only the motion differs. `gravity` (m/s2) is that on level ground unless
    given.
    """
    q = np.asarray(q, dtype=np.float64)
    down = (0.0, 0.0, -robot.gravity) if gravity is None else gravity
    rate = np.zeros(q.shape[-1])
    rate[joint] = 1.0
    moving = inverse_dynamics(robot, q, rate, np.zeros_like(rate), np.zeros(3), payload)
    rest = static_torque(robot, q, down, payload) - static_torque(static or robot, q, down, payload)
    moving, rest = (np.where(np.abs(x) < _ROUNDING, 0.0, x) for x in (moving, rest))
    n = len(q) - 1
    return SpeedError(
        (rest**2).sum(axis=0) / n,
        (rest * moving).sum(axis=0) / n,
        (moving**2).sum(axis=0) / n,
    )


def paper_sweep(theta1: float, samples: int = PAPER_SAMPLES) -> Floats:
    """Return the paper's postures (samples, 2): theta2 over one turn, both ends counted."""
    theta2 = np.linspace(0.0, 2.0 * math.pi, samples)
    return np.stack([np.full_like(theta2, theta1), theta2], axis=-1)


def speed_limit(
    robot: Robot,
    postures: ArrayLike,
    payload: Payload | None = None,
    reference: ArrayLike = REFERENCE_TORQUE,
    critical: float | None = None,
    gravity: ArrayLike | None = None,
) -> Floats:
    """Return the rate (j,) of each joint, moving alone, up to which the static model is valid.

    rad/s (m/s if prismatic), infinite where no rate loads any joint. `reference` is the static
    model's own error (N m rms, one number or one per joint), to which F relates the error of the
    motion. That error is taken over `postures` (n, j); F is judged at every joint, against the
    critical value for n samples unless `critical` is given.
    """
    q = np.asarray(postures, dtype=np.float64)
    bound = critical_value(samples=len(q)) if critical is None else critical
    own = np.broadcast_to(np.asarray(reference, dtype=np.float64) ** 2, q.shape[-1:])
    limits = np.empty(q.shape[-1])
    for joint in range(q.shape[-1]):
        moving = speed_error(robot, q, joint, payload=payload, gravity=gravity).moving
        error = SpeedError(own, np.zeros_like(own), moving)
        limits[joint] = error.speed_at(bound, reference=0.0).min()
    return limits
