"""How well each meaning of effort explains what one joint measured at rest, by Gaussian evidence.

e ~ N(k (tau + l x), k^2 C): tau is the static torque with the declared load, l the torque per kg, x
the load beyond the declared one, k the scale. C is the model's own error, which all postures share,
plus friction and an offset.
"""

from dataclasses import dataclass

import numpy as np

from ugv_acceptance.type_aliases import Floats

# Friction as a share of the joint's largest static torque, and how likely it is; offset, noise.
FRICTION, LIKELY = (0.005, 0.03, 0.10, 0.20), np.log((0.3, 0.35, 0.3, 0.05))
OFFSET, NOISE = 0.02, 0.004
# Scales that count as 1; those of another unit lie between the two last, but not near 1.
NEAR_ONE = np.array((0.95, 1.0, 1.05))
NOT_ONE, STEP, SPAN = (0.8, 1.25), 0.03, np.log(1000.0)
_GRID = np.exp(np.arange(-SPAN, SPAN + STEP / 2, STEP))
SCALES = np.concatenate((_GRID, -_GRID))
OTHER_UNIT = (np.abs(SCALES) < NOT_ONE[0]) | (np.abs(SCALES) > NOT_ONE[1])
# Weight of one scale of the grid: log-uniform, either sign.
SCALE_WEIGHT = float(np.log(STEP / (4.0 * SPAN)))
# What is left where gravity is compensated, in whatever unit: smaller than this share of the static
# torque; and in SEVERAL postures, up to LITTLE of it, unless it surely correlates with it (t test).
SMALL, LITTLE, ALIKE, SEVERAL = 0.05, 0.3, 3.5, 4
# What it costs that efforts which follow nothing may be of any size.
ANY_SIZE = 3.0
# Rows of `Evidence.meanings`: torque, other sign, scaled, without gravity, none of these.
KINDS = 5
LOG_2PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, slots=True)
class Joint:
    """What one joint measured in P postures, and what the model says of them.

    `effort`, `torque` with the declared load, `lever` per kg (P,) N m, `declared` kg (P,), `errors`
    (s, P) of the model, `size` the joint's largest static torque (N m; N).
    """

    effort: Floats
    torque: Floats
    lever: Floats
    declared: Floats
    errors: Floats
    size: float

    def covariances(self) -> list[Floats]:
        """Return the covariance (P, P) of the torque for each level of friction."""
        shared = self.errors.T @ self.errors + (OFFSET * self.size) ** 2
        one = np.eye(len(self.effort)) * self.size**2
        return [shared + (share**2 + NOISE**2) * one for share in FRICTION]


@dataclass(frozen=True, slots=True)
class Evidence:
    """Logarithms of likelihoods of one joint: (m, 5) by load and meaning, (m, k) by load and scale.

    Loads are those asked for, scales are SCALES; the prior of the scale is not in `scaled`.
    """

    meanings: Floats
    scaled: Floats


def log_sum(values: Floats, axis: int = -1) -> Floats:
    """Return log(sum(exp(values))) along an axis, without overflow; -inf of nothing."""
    top = values.max(axis=axis, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    with np.errstate(divide='ignore'):
        found = np.log(np.exp(values - top).sum(axis=axis)) + np.squeeze(top, axis)
    result: Floats = found
    return result


def evidence_of(joint: Joint, loads: Floats) -> Evidence:
    """Return how well each meaning explains a joint's efforts, for each extra load (m,) kg."""
    y, n = joint.effort, len(joint.effort)
    mean = joint.torque + loads[:, None] * joint.lever
    parts: list[list[Floats]] = [[], [], [], []]
    for covariance, likely in zip(joint.covariances(), LIKELY, strict=True):
        weight: Floats = np.linalg.inv(covariance)
        constant = likely - 0.5 * (np.linalg.slogdet(covariance)[1] + n * LOG_2PI)
        a, b, c = _products(y, weight, mean)

        def fit(k: Floats, a: float = a, b: Floats = b, c: Floats = c) -> Floats:
            inverse = 1.0 / k
            size = -0.5 * a * inverse**2 - n * np.log(np.abs(k))
            found: Floats = size + b[:, None] * inverse - 0.5 * c[:, None]
            return found

        parts[0].append(log_sum(fit(NEAR_ONE)) + constant - np.log(3.0))
        parts[1].append(log_sum(fit(-NEAR_ONE)) + constant - np.log(3.0))
        parts[2].append(fit(SCALES) + constant)
        parts[3].append(_without(joint, loads, weight) + constant)
    scaled = log_sum(np.array(parts[2]), 0)
    scaled[:, ~OTHER_UNIT] = -np.inf
    torque, opposite, without = (log_sum(np.array(part), 0) for part in (*parts[:2], parts[3]))
    anything = _anything(y)
    without = np.logaddexp(without, _idle(joint, anything)) - np.log(2.0)
    other = np.full(len(loads), anything - ANY_SIZE)
    columns = (torque, opposite, log_sum(scaled) + SCALE_WEIGHT, without, other)
    return Evidence(np.stack(columns, axis=1), scaled)


def _products(y: Floats, weight: Floats, mean: Floats) -> tuple[float, Floats, Floats]:
    """Return y'Wy, and m'Wy and m'Wm of each row of `mean`."""
    weighted = mean @ weight
    return float(y @ weight @ y), weighted @ y, (weighted * mean).sum(axis=1)


def _without(joint: Joint, loads: Floats, weight: Floats) -> Floats:
    """Return the log-density (m,) less its constant of efforts that leave gravity out.

    The load may be left in or compensated as declared.
    """
    found = []
    for carried in (loads[:, None] + joint.declared, loads[:, None] + 0.0 * joint.declared):
        a, b, c = _products(joint.effort, weight, carried * joint.lever)
        scales = np.concatenate((NEAR_ONE, -NEAR_ONE))
        found.append(-0.5 * (a - 2.0 * np.outer(scales, b) + np.outer(scales**2, c)))
    density: Floats = log_sum(np.concatenate(found), 0) - np.log(12.0)
    return density


def _anything(y: Floats) -> float:
    """Return the log-density of efforts that follow nothing, only as large as they are."""
    size, n = max(float(np.sqrt((y**2).mean())), 1e-9), len(y)
    spread = 0.5 * np.eye(n) + 1.0
    found = []
    for part in (0.3 * size, size):
        covariance = part**2 * spread
        fit = float(y @ np.linalg.solve(covariance, y))
        found.append(-0.5 * (fit + np.linalg.slogdet(covariance)[1] + n * LOG_2PI) - np.log(2.0))
    return float(log_sum(np.array(found)))


def _idle(joint: Joint, anything: float) -> float:
    """Return the log-density of the little that is left where gravity is compensated."""
    y, torque = joint.effort, joint.torque
    least = max(float(np.sqrt((torque**2).mean())), SMALL * joint.size)
    share = float(np.sqrt((y**2).mean())) / least
    if len(y) < SEVERAL:
        return anything if share <= SMALL else -np.inf
    parts = y - y.mean(), torque - torque.mean()
    size = np.sqrt((parts[0] @ parts[0]) * (parts[1] @ parts[1]))
    alike = abs(parts[0] @ parts[1]) * np.sqrt(len(y) - 2.0 + ALIKE**2) > ALIKE * size
    return -np.inf if alike or share > LITTLE else anything
