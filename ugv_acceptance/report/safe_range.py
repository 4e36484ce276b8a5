"""The safe range of theta_2 in both readings of equations (4) to (8), as a table."""

import math

from ugv_acceptance.studies.intervals import Intervals
from ugv_acceptance.studies.planar import PAPER, safe_theta2


def _words(intervals: Intervals) -> str:
    if not intervals:
        return 'none'
    return ', '.join(f'{math.degrees(a):.1f}° to {math.degrees(b):.1f}°' for a, b in intervals)


def one_sided_table(limit: float) -> list[list[str]]:
    """Return theta_1 against the safe theta_2 with |tau| <= `limit` (N m) and with tau <= limit."""
    table = [['θ₁', f'|τ| ≤ {limit:g} N m', f'τ ≤ {limit:g} N m (the paper)', 'they']]
    for degrees in range(0, 181, 30):
        theta1 = math.radians(degrees)
        both = safe_theta2(PAPER, theta1, limit, limit)
        one = safe_theta2(PAPER, theta1, limit, limit, two_sided=False)
        same = 'agree' if both == one else 'differ'
        table.append([f'{degrees}°', _words(both), _words(one), same])
    return table
