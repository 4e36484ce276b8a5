"""Intervals of an angle within one turn, and where a cosine stays between two bounds."""

import math

Intervals = tuple[tuple[float, float], ...]

TURN = 2.0 * math.pi


def where_cosine_between(lower: float, upper: float, shift: float = 0.0) -> Intervals:
    """Return where lower <= cos(x - shift) <= upper, as intervals of x in [0, 2 pi] (rad)."""
    if upper < -1.0 or lower > 1.0 or upper < lower:
        return ()
    if lower <= -1.0 and upper >= 1.0:
        return ((0.0, TURN),)
    near, far = math.acos(min(upper, 1.0)), math.acos(max(lower, -1.0))
    arcs = [(near, far), (TURN - far, TURN - near)]
    if lower <= -1.0:  # one arc through half a turn, or through 0: no seam in its middle
        arcs = [(near, TURN - near)]
    elif upper >= 1.0:
        arcs = [(-far, far)]
    parts: list[tuple[float, float]] = []
    for start, end in arcs:
        parts += wrap(start + shift, end + shift)
    return merge(parts)


def wrap(start: float, end: float) -> list[tuple[float, float]]:
    """Return an interval (rad) of at most one turn as one or two intervals inside [0, 2 pi]."""
    turns = math.floor(start / TURN)
    start, end = start - turns * TURN, end - turns * TURN
    if end <= TURN:
        return [(start, end)]
    return [(start, TURN), (0.0, end - TURN)]


def merge(parts: list[tuple[float, float]], slack: float = 1e-12) -> Intervals:
    """Return the union of intervals, in order; parts closer than `slack` become one."""
    found: list[tuple[float, float]] = []
    for start, end in sorted(parts):
        if found and start <= found[-1][1] + slack:
            found[-1] = (found[-1][0], max(end, found[-1][1]))
        else:
            found.append((start, end))
    return tuple(found)


def length(intervals: Intervals) -> float:
    """Return the total length (rad) of disjoint intervals."""
    return math.fsum(end - start for start, end in intervals)


def intersect(a: Intervals, b: Intervals) -> Intervals:
    """Return the intersection of two sets of intervals."""
    both = [
        (max(start, low), min(end, high))
        for start, end in a
        for low, high in b
        if max(start, low) <= min(end, high)
    ]
    return merge(both)
