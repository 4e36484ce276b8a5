"""How much of the failure map a run visited, and how close to each boundary it came."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from ugv_acceptance.config import Config
from ugv_acceptance.model.blocks import Floats
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.plan.search import STEP_DEG, Arm, roles_of
from ugv_acceptance.run.verdicts import Seen


def coverage_of(config: Config, seen: Iterable[Seen]) -> dict[str, Any]:
    """Return the coverage of the arm's postures by what was recorded, for JSON.

    Cells are squares of the two arm joints' positions, `visited_deg` their lower corners (first
    joint -> second); only those that keep clear of ground and deck count. `inside` and `outside`
    are the closest approaches to the torque limit of each joint (a share of it) and to the tilt
    limit on each of SIDES (deg); None on a side the run was never on.
    """
    arm = Arm(config.settings, roles_of(config.settings))
    axes = [arm.robot.joint_names.index(name) for name in arm.roles.axes]
    reachable = cells(arm.grid[:, axes])
    visited: set[tuple[int, int]] = set()
    names = arm.robot.joint_names
    use, tilt = [np.empty((0, len(names)))], [np.empty((0, len(SIDES)))]
    for one in seen:
        _, q, used, left = one.joined()
        visited |= cells(q[:, axes])
        use.append(used)
        tilt.append(left)
    limits = config.settings.limits
    torque = np.concatenate(use) - limits.torque_error
    angle = np.degrees(limits.tip_error - np.concatenate(tilt))
    there: dict[str, list[float]] = {}
    for a, b in sorted(visited & reachable):
        there.setdefault(f'{a * STEP_DEG - 180.0:g}', []).append(b * STEP_DEG - 180.0)
    limited = [(n, k) for k, n in enumerate(names) if math.isfinite(limits.torque[k])]
    return {
        'cell_deg': STEP_DEG,
        'joints': list(arm.roles.axes),
        'cells_reachable': len(reachable),
        'cells_visited': len(visited & reachable),
        'share': round(len(visited & reachable) / max(len(reachable), 1), 4),
        'visited_deg': there,
        'torque_limit': {name: _approach(torque[:, k]) for name, k in limited},
        'tip_limit_deg': {side: _approach(angle[:, k]) for k, side in enumerate(SIDES)},
    }


def cells(q: Floats) -> set[tuple[int, int]]:
    """Return the cells that positions (n, 2) in rad lie in, whole turns taken off."""
    turned = (np.degrees(q) + 180.0) % 360.0
    turned = turned[np.isfinite(turned).all(axis=1)]
    return {(int(a), int(b)) for a, b in np.unique(np.floor(turned / STEP_DEG + 1e-6), axis=0)}


def _approach(beyond: Floats) -> dict[str, float | None]:
    """Return how close values came to zero from below (inside) and from above (outside)."""
    beyond = beyond[np.isfinite(beyond)]
    inside, outside = -beyond[beyond <= 0.0], beyond[beyond > 0.0]
    return {
        'inside': round(float(inside.min()), 4) if inside.size else None,
        'outside': round(float(outside.min()), 4) if outside.size else None,
    }
