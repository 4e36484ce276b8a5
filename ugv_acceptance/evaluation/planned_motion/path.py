"""Where the joints are between the points of a trajectory, and the moments that are looked at.

As joint_trajectory_controller has it: between two points that both have accelerations and rates
along a polynomial of degree 5, with rates of degree 3, else straight. A joint moves by no more
than STEP (SLIDE) between two moments, one that carries contact points (a flipper, on which the
margin hangs more steeply) by a part of it. Where the rate changes at once, a drive takes some time
for it: a critically damped position servo of natural frequency w, which is given the positions,
accelerates by at most 0.37 w of the change; 0.4 w where the arm's inertia is half of that which the
servo is tuned for, 0.5 w where it is next to none.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.planned_motion.request import CORNER
from ugv_acceptance.type_aliases import Floats

# The most a joint moves between two moments: rad, m; and the part of it of one that carries.
STEP, SLIDE, CARRYING = 0.035, 0.01, 0.1
# Moments at least between two points, by degree of the polynomial.
LEAST = {1: 1, 3: 4, 5: 6}
# Moments at most between two points: more would be no motion of a joint.
MOST = 4096
# Moments of a whole motion at most: they take a second and 0.1 GB.
MOST_IN_ALL = 100_000
# Changes of rate (rad/s, m/s) below are rounding.
_SMALL = 1e-9
# Bernstein's form of a polynomial of degree 5, from its powers.
_BERNSTEIN = np.array(
    [
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 1 / 5, 0.0, 0.0, 0.0, 0.0],
        [1.0, 2 / 5, 1 / 10, 0.0, 0.0, 0.0],
        [1.0, 3 / 5, 3 / 10, 1 / 10, 0.0, 0.0],
        [1.0, 4 / 5, 6 / 10, 4 / 10, 1 / 5, 0.0],
        [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
    ]
)


@dataclass(frozen=True, slots=True, eq=False)
class Knots:
    """Points that joints pass: `time` (n,) s, the others (n, m) in the robot's own sense.

    A row of NaN in `rate` or `acceleration` is a point without. `first` is the number of the
    trajectory's point, counted from 1, that the first knot is; 0: it is where the joints start.
    """

    time: Floats
    position: Floats
    rate: Floats
    acceleration: Floats
    first: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """The moments of a motion that are looked at: `time` (s,), the others (s, m).

    `point` (s,) is the number of the trajectory's point that the joints are on their way to.
    """

    time: Floats
    position: Floats
    rate: Floats
    acceleration: Floats
    point: NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """A motion: polynomials `powers` (n - 1, 6, m) of the share of the way between two knots.

    `length` (n - 1,) s is the time from knot to knot, `degree` (n - 1,) that of the polynomial. The
    motion stays between the least and the largest of the positions `hull` (n - 1, 6, m).
    """

    knots: Knots
    powers: Floats
    length: Floats
    degree: NDArray[np.intp]
    hull: Floats


def path_of(knots: Knots) -> Path:
    """Return the motion through some knots; one knot alone is no motion."""
    length = np.diff(knots.time)
    degree = _degrees(knots)
    t = length[:, None]
    q, q1 = knots.position[:-1], knots.position[1:]
    way = q1 - q
    powers = np.zeros((len(length), 6, q.shape[1]))
    powers[:, 0], powers[:, 1] = q, way
    cubic, quintic = degree == 3, degree == 5
    v, v1 = knots.rate[:-1] * t, knots.rate[1:] * t
    if cubic.any():
        shape = (v, 3.0 * way - 2.0 * v - v1, v + v1 - 2.0 * way)
        for k, part in enumerate(shape, start=1):
            powers[cubic, k] = part[cubic]
    if quintic.any():
        a, a1 = knots.acceleration[:-1] * t * t, knots.acceleration[1:] * t * t
        shape5 = (
            v,
            0.5 * a,
            10.0 * way - 6.0 * v - 4.0 * v1 - 1.5 * a + 0.5 * a1,
            -15.0 * way + 8.0 * v + 7.0 * v1 + 1.5 * a - a1,
            6.0 * way - 3.0 * (v + v1) - 0.5 * (a - a1),
        )
        for k, part in enumerate(shape5, start=1):
            powers[quintic, k] = part[quintic]
    hull: Floats = _BERNSTEIN @ powers
    return Path(knots, powers, length, degree, hull)


def _degrees(knots: Knots) -> NDArray[np.intp]:
    """Return the degree of the polynomial from each knot to the next."""
    rated: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(knots.rate), axis=1)
    more: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(knots.acceleration), axis=1)
    full = rated & more
    both, all_of = rated[:-1] & rated[1:], full[:-1] & full[1:]
    return np.where(all_of, 5, np.where(both, 3, 1)).astype(np.intp)


def steps_of(path: Path, most: Floats) -> NDArray[np.intp]:
    """Return in how many steps each way (n - 1,) between two knots is looked at.

    `most` (m,) is how far each joint may move in one.
    """
    travel = 5.0 * np.abs(np.diff(path.hull, axis=1)).max(axis=1, initial=0.0)
    steps = np.ceil(np.minimum(travel / most, MOST).max(axis=1, initial=0.0)).astype(np.intp)
    least = np.where(path.degree == 1, LEAST[1], np.where(path.degree == 3, LEAST[3], LEAST[5]))
    found: NDArray[np.intp] = np.clip(steps, least, MOST)
    return found


def samples_of(path: Path, steps: NDArray[np.intp], corner: float = CORNER) -> Samples:
    """Return the moments to look at, given in how many `steps` (n - 1,) to go from knot to knot.

    A drive takes up another rate within `corner` (s).
    """
    knots, n = path.knots, len(path.length)
    counts = steps + 1
    of = np.repeat(np.arange(n), counts)
    first = np.cumsum(counts) - counts
    share = (np.arange(len(of)) - first[of]) / steps[of]
    q, v, a = _at(path, of, share)
    time = knots.time[:-1][of] + share * path.length[of]
    inside = Samples(time, q, v, a, knots.first + 1 + of)
    return _joined(inside, _corners(path, inside, (first, counts), corner))


def _at(path: Path, of: NDArray[np.intp], share: Floats) -> tuple[Floats, Floats, Floats]:
    """Return positions, rates and accelerations (s, m) at shares of the way between two knots."""
    highest = int(path.degree.max(initial=1))
    # A joint's numbers lie side by side: all that follows is quicker.
    c = path.powers[:, : highest + 1].transpose(1, 2, 0)[:, :, of]
    q, v, a = (np.zeros(c.shape[1:]) for _ in range(3))
    for k in range(highest, -1, -1):
        q = q * share + c[k]
        if k >= 1:
            v = v * share + k * c[k]
        if k >= 2:
            a = a * share + k * (k - 1) * c[k]
    t = path.length[of]
    return q.T, (v / t).T, (a / (t * t)).T


def _corners(
    path: Path,
    inside: Samples,
    of: tuple[NDArray[np.intp], NDArray[np.intp]],
    corner: float,
) -> Samples:
    """Return the moments at which rates change at once: before it and after it.

    At first the joints stand, and in the end they stop: both are looked at too. Changes within
    `corner` (s) of each other add up. `of` are each way's first moment and number of moments.
    """
    first, counts = of
    knots, last = path.knots, first + counts - 1
    still = np.zeros((1, inside.rate.shape[1]))
    before = np.concatenate((still, inside.rate[last]))
    after = np.concatenate((inside.rate[first], still))
    change = after - before
    change[np.abs(change) < _SMALL] = 0.0
    total = np.concatenate((still, np.cumsum(change, axis=0)))
    end = np.searchsorted(knots.time, knots.time + corner, side='left')
    burst = (total[end] - total[:-1]) / corner
    at = np.flatnonzero((change != 0.0).any(axis=1))
    rows = np.concatenate((at, at, [0, len(knots.time) - 1]))
    rest = np.zeros((2, still.shape[1]))
    return Samples(
        knots.time[rows],
        knots.position[rows],
        np.concatenate((before[at], after[at], rest)),
        np.concatenate((burst[at], burst[at], rest)),
        np.maximum(knots.first + rows, 1),
    )


def _joined(a: Samples, b: Samples) -> Samples:
    if not len(b.time):
        return a
    return Samples(
        np.concatenate((a.time, b.time)),
        np.concatenate((a.position, b.position)),
        np.concatenate((a.rate, b.rate)),
        np.concatenate((a.acceleration, b.acceleration)),
        np.concatenate((a.point, b.point)),
    )
