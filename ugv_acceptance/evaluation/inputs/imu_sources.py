"""Two IMUs on one topic: their values fall into two clusters between which the messages jump."""

import numpy as np

from ugv_acceptance.type_aliases import Floats

# Separation of the clusters in standard deviations, and share of messages that jump.
SEPARATED, JUMPS = 6.0, 0.2
# Fewest samples in a window.
FEWEST, FEWEST_PAIRS = 40, 10
# Separation along one of the axes that is looked at along the principal axis as well.
COARSE = 3.0
ROUNDS = 8


def suspected(pairs: float, jumps: float) -> bool:
    """Return whether so many of the pairs of samples that were looked at jump as two sources do."""
    return pairs >= FEWEST_PAIRS and jumps > JUMPS / 2.0 * pairs


def two_sources(x: Floats, apart: float) -> bool:
    """Return whether values (n, k) form two clusters at least `apart` apart, and jump between them.

    A coarse look along each axis comes before that along the principal one.
    """
    return len(x) >= FEWEST and _split(x, apart) and _clustered(x, apart)


def same_sign(q: Floats) -> Floats:
    """Return quaternions (n, 4) with the sign that is nearer to the first."""
    return np.where(((q * q[:1]).sum(axis=1) < 0.0)[:, None], -q, q)


def _split(x: Floats, apart: float) -> bool:
    """Return whether values (n, k) fall into two parts along some axis."""
    above = x > (x.max(axis=0) + x.min(axis=0)) / 2.0
    n = above.sum(axis=0)
    upper = (x * above).sum(axis=0) / np.maximum(n, 1)
    lower = (x * ~above).sum(axis=0) / np.maximum(len(x) - n, 1)
    inside = np.sqrt(((x - np.where(above, upper, lower)) ** 2).mean(axis=0))
    distance = upper - lower
    return bool(((distance > COARSE * inside) & (distance > apart / 2.0)).any())


def _clustered(x: Floats, apart: float) -> bool:
    """Return whether values (n, k) form two clusters along their principal axis."""
    x = x - x.mean(axis=0)
    if not np.isfinite(x).all():
        return False
    along = x @ np.linalg.svd(x, full_matrices=False)[2][0]
    above = along > (along.max() + along.min()) / 2.0
    for _ in range(ROUNDS):
        if above.all() or not above.any():
            return False
        upper, lower = along[above], along[~above]
        middle = (upper.mean() + lower.mean()) / 2.0
        above = along > middle
    if above.all() or not above.any():
        return False
    upper, lower = along[above], along[~above]
    distance = upper.mean() - lower.mean()
    inside = np.sqrt((upper.var() * len(upper) + lower.var() * len(lower)) / len(along))
    jumps = (above[1:] != above[:-1]).mean()
    return bool(distance > apart and distance > SEPARATED * inside and jumps > JUMPS)
