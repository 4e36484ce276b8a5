"""Decides per joint what its effort means: torque, other sign, scaled, without gravity, or nothing.

All joints feel one load, and mostly one driver reports them all: so the load is common, and one
meaning for the whole arm is a hypothesis beside one for each joint. A meaning is named from a
probability of 95 % on.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.effort.arm import Arm
from ugv_acceptance.evaluation.effort.evidence import (
    KINDS,
    OTHER_UNIT,
    SCALE_WEIGHT,
    SCALES,
    STEP,
    Evidence,
    evidence_of,
    log_sum,
)
from ugv_acceptance.evaluation.effort.facts import (
    CONSTANT,
    IDLE,
    NONE,
    OTHER_SIGN,
    SATURATED,
    SCALED,
    TORQUE,
    UNKNOWN,
    UNLOADED,
    WITHOUT,
    ZERO_EFFORT,
    Ratio,
)
from ugv_acceptance.type_aliases import Floats

NAMES = (TORQUE, OTHER_SIGN, SCALED, WITHOUT, UNKNOWN)
# Probability of each of NAMES before anything is measured, of one for the whole arm, of the load
# declared; the least at which a meaning is named, of a joint whose torque varies and of another.
BEFORE = np.log((0.48, 0.12, 0.22, 0.16, 0.02))
WHOLE_ARM, AS_DECLARED, NAMED, SURE = 0.6, 0.5, 0.95, 0.99
# Efforts below this are zero (denormal numbers too), and closer than the share EQUAL of the largest
# they are one value.
ZERO, EQUAL = 1e-12, 1e-6
# Shares of the joint's largest static torque: what must vary to tell a scale, be there to tell
# anything, vary among efforts that are cut off, and among equal ones; share and number of postures
# that are cut off.
VARIES, LOADED, CUT, ALIKE, CUT_SHARE, CUT_LEAST = 0.15, 0.05, 0.05, 1e-4, 0.2, 3
# Below this probability of "none of these" a run is explained; so many changes of the load at most.
EXPLAINED, CUTS = 0.05, 3
# Number of the level of friction that is usual. A ratio fits if its mean chi-square is at most
# FITS, and is not told if it is known worse than by this share.
USUAL, FITS, VAGUE = 1, 4.0, 0.5
# Log-probability of one more change of the load.
CHANGE = -3.0


# A joint whose largest static torque (N m; N) is below this carries nothing.
WEIGHTLESS = 1e-6


@dataclass(frozen=True, slots=True)
class Named:
    """What one joint's effort means: one of FACTS, its probability, the ratio, where it is cut."""

    meaning: str
    probability: float = 0.0
    ratio: Ratio | None = None
    level: float = 0.0
    below: str = ''


@dataclass(frozen=True, slots=True)
class _Explained:
    """Postures explained with one load: log-evidence, probabilities (j, 5) and of loads (m,).

    `scales` (j, k) are probabilities of SCALES, if the effort is scaled.
    """

    evidence: float
    meanings: Floats
    loads: Floats
    scales: Floats


def name_meanings(arm: Arm) -> list[Named]:
    """Return what the effort of every joint means; `unknown` where nothing is certain."""
    count = arm.effort.shape[1]
    if not count:
        return []
    told = [_plain(arm, j) for j in range(count)]
    rows = np.array([rows for _, rows, _ in told]).reshape(count, -1).T
    open_ = [j for j in range(count) if told[j][0] in {'', SATURATED} and rows[:, j].any()]
    asked = [j for j in open_ if arm.sizes[j] > WEIGHTLESS]
    parts = _parts(arm, rows, asked)
    found = []
    for j in range(count):
        plain, _, level = told[j]
        if j not in asked:
            below = ''
            if plain == NONE and rows[:, j].any():
                loaded = np.abs(arm.torque[rows[:, j], j]).max() >= VARIES * arm.sizes[j]
                below = IDLE if loaded else ZERO_EFFORT
            sure = float(plain in {NONE, CONSTANT})
            found.append(Named(plain or UNKNOWN, sure, None, level, below))
            continue
        named = _named(arm, rows, parts, asked, j)
        if plain == SATURATED:
            named = Named(SATURATED, 1.0, named.ratio, level, named.meaning)
        found.append(named)
    return found


def _plain(arm: Arm, j: int) -> tuple[str, NDArray[np.bool_], float]:
    """Return what a joint's numbers say without the model, the rows to use, and where it is cut."""
    effort, torque = arm.effort[:, j], arm.torque[:, j]
    told = np.isfinite(effort)
    most = float(np.abs(effort[told]).max(initial=0.0))
    if most < ZERO:
        return NONE, told, most
    if np.ptp(effort[told]) <= EQUAL * most:
        varies = np.ptp(torque[told]) / arm.sizes[j]
        unsure = UNKNOWN if varies > ALIKE and told.sum() >= CUT_LEAST else ''
        return CONSTANT if varies > VARIES else unsure, told, most
    top = told & (np.abs(np.abs(np.where(told, effort, 0.0)) - most) <= EQUAL * most)
    several = top.sum() >= CUT_LEAST and top.sum() >= CUT_SHARE * told.sum()
    apart = np.ptp(np.abs(torque[top])) / arm.sizes[j] if several else 0.0
    if apart > CUT:
        return SATURATED, told & ~top, most
    # Equal efforts for torques that differ a little: cut off, or not; nothing is sure.
    return UNKNOWN if apart > ALIKE else '', told, most


def _explain(
    arm: Arm, rows: NDArray[np.bool_], asked: Sequence[int], part: slice
) -> _Explained | None:
    """Explain the postures of a part of the run with one load; None if no joint is told there."""
    loads = arm.loads()
    chosen = np.zeros_like(rows)
    chosen[part] = rows[part]
    live = [j for j in asked if chosen[:, j].any()]
    if not live:
        return None
    each = [evidence_of(arm.joint(j, chosen[:, j]), loads) for j in live]
    alone = [e.meanings + BEFORE for e in each]
    own = sum((log_sum(a) for a in alone), np.zeros(len(loads))) + np.log(1.0 - WHOLE_ARM)
    together = sum((e.meanings for e in each), np.zeros((len(loads), KINDS)))
    by_scale = sum((e.scaled for e in each), np.zeros((len(loads), len(SCALES))))
    together[:, 2] = log_sum(by_scale) + SCALE_WEIGHT
    together = together + BEFORE + np.log(WHOLE_ARM)
    common = log_sum(together)
    total = np.logaddexp(own, common) + _load_prior(loads)
    evidence = float(log_sum(total))
    weight = np.exp(total - evidence)
    share = np.exp(common - np.logaddexp(own, common))
    meanings = np.zeros((len(asked), KINDS))
    meanings[:] = np.exp(BEFORE)
    scales = np.zeros((len(asked), len(SCALES)))
    for k, j in enumerate(live):
        one = np.exp(alone[k] - log_sum(alone[k])[:, None])
        all_ = np.exp(together - common[:, None])
        mix = share[:, None] * all_ + (1.0 - share[:, None]) * one
        meanings[asked.index(j)] = weight @ mix
        scales[asked.index(j)] = _scales(each[k], by_scale, weight, share)
    return _Explained(evidence, meanings, weight, scales)


def _load_prior(loads: Floats) -> Floats:
    """Return the logarithm of the prior of each load: half on the declared one."""
    if len(loads) == 1:
        return np.zeros(1)
    rest = (1.0 - AS_DECLARED) / (len(loads) - 1)
    return np.log(np.where(loads == 0.0, AS_DECLARED, rest))


def _scales(one: Evidence, whole: Floats, weight: Floats, share: Floats) -> Floats:
    """Return the probabilities (k,) of SCALES, given that the effort is scaled."""
    found = np.zeros(len(SCALES))
    for table, part in ((one.scaled, weight * (1.0 - share)), (whole, weight * share)):
        normal = log_sum(table)
        good = np.isfinite(normal)
        if good.any():
            found += part[good] @ np.exp(table[good] - normal[good, None])
    total = found.sum()
    return found / total if total > 0.0 else found


def _parts(
    arm: Arm, rows: NDArray[np.bool_], asked: Sequence[int]
) -> list[tuple[slice, _Explained]]:
    """Return the run in parts of constant load: one, unless that explains nothing."""
    whole = _explain(arm, rows, asked, slice(0, len(rows)))
    if whole is None:
        return []
    parts = [(slice(0, len(rows)), whole)]
    while len(parts) <= CUTS and (len(parts) > 1 or _unexplained(whole)):
        best = max(
            (split for k in range(len(parts)) for split in _splits(arm, rows, asked, parts, k)),
            key=lambda split: split[0],
            default=None,
        )
        if best is None or best[0] <= 0.0:
            break
        parts = best[1]
    return parts


def _unexplained(found: _Explained) -> bool:
    return bool((found.meanings[:, -1] > EXPLAINED).any())


def _splits(
    arm: Arm,
    rows: NDArray[np.bool_],
    asked: Sequence[int],
    parts: list[tuple[slice, _Explained]],
    k: int,
) -> list[tuple[float, list[tuple[slice, _Explained]]]]:
    """Return every way to cut part number k in two, with what is gained by it."""
    span, whole = parts[k]
    found = []
    for cut in range(span.start + 1, span.stop):
        halves = (slice(span.start, cut), slice(cut, span.stop))
        told = [(half, _explain(arm, rows, asked, half)) for half in halves]
        good = [(half, one) for half, one in told if one is not None]
        if len(good) == len(told):
            gain = sum(one.evidence for _, one in good) - whole.evidence + CHANGE
            found.append((gain, [*parts[:k], *good, *parts[k + 1 :]]))
    return found


def _named(
    arm: Arm,
    rows: NDArray[np.bool_],
    parts: Sequence[tuple[slice, _Explained]],
    asked: Sequence[int],
    j: int,
) -> Named:
    """Name the meaning of one joint from the parts of the run."""
    told = rows[:, j]
    if np.abs(arm.torque[told, j]).max() < LOADED * arm.sizes[j]:
        return Named(UNKNOWN, below=UNLOADED)
    at = asked.index(j)
    varying = [i for i in asked if _varies(arm, rows, i)]
    main = _main(arm, rows, parts, j)
    chance = main.meanings[at]
    k = int(chance.argmax())
    sure = float(chance[k])
    named = NAMES[k] if sure >= NAMED else UNKNOWN
    if varying and j not in varying and not _as_others(main, asked, varying, at):
        named = UNKNOWN
    if not varying and (len(asked) < 2 or not _agreed(arm, rows, asked, j)):
        named = UNKNOWN
    if any(_contradicts(arm, rows, part, (main, at, j)) for part in parts):
        named = UNKNOWN
    if named == SCALED:
        return Named(named, sure, _interval(main.scales[at]))
    return Named(named, sure, _ratio(arm, told, j) if named == UNKNOWN else None)


def _main(
    arm: Arm, rows: NDArray[np.bool_], parts: Sequence[tuple[slice, _Explained]], j: int
) -> _Explained:
    """Return the part of the run that tells most of a joint: it varies, and has most postures."""

    def told(part: tuple[slice, _Explained]) -> tuple[bool, int]:
        inside = _inside(rows, part[0])
        return _varies(arm, inside, j), int(inside[:, j].sum())

    return max(parts, key=told)[1]


def _inside(rows: NDArray[np.bool_], part: slice) -> NDArray[np.bool_]:
    inside = np.zeros_like(rows)
    inside[part] = rows[part]
    return inside


def _varies(arm: Arm, rows: NDArray[np.bool_], j: int) -> bool:
    torque = arm.torque[rows[:, j], j]
    return bool(len(torque) and np.ptp(torque) >= VARIES * arm.sizes[j])


def _as_others(main: _Explained, asked: Sequence[int], varying: Sequence[int], at: int) -> bool:
    """Return whether a joint whose torque does not vary is surely as all those that vary are."""
    kind = int(main.meanings[at].argmax())
    others = [main.meanings[asked.index(i), kind] for i in varying]
    return bool(main.meanings[at, kind] >= SURE and min(others) >= NAMED)


def _agreed(arm: Arm, rows: NDArray[np.bool_], asked: Sequence[int], j: int) -> bool:
    """Return whether another loaded joint stands beside j, where no torque varies."""
    return any(
        i != j and np.abs(arm.torque[rows[:, i], i]).max() >= VARIES * arm.sizes[i] for i in asked
    )


def _contradicts(
    arm: Arm,
    rows: NDArray[np.bool_],
    part: tuple[slice, _Explained],
    main: tuple[_Explained, int, int],
) -> bool:
    """Return whether a part in which joint j varies surely has another meaning or scale than main.

    `main` is the main part, the joint's number in it, and j. A single posture contradicts nothing:
    what touches the arm there looks like another scale.
    """
    (span, found), (best, at, j) = part, main
    if found is best or not _varies(arm, _inside(rows, span), j):
        return False
    k = int(found.meanings[at].argmax())
    if found.meanings[at, k] < NAMED or NAMES[k] == UNKNOWN:
        return False
    if k != int(best.meanings[at].argmax()):
        return True
    one, other = _interval(found.scales[at]), _interval(best.scales[at])
    apart = one is not None and other is not None and _apart(one, other)
    return NAMES[k] == SCALED and apart


def _apart(one: Ratio, other: Ratio) -> bool:
    return one.high < other.low or other.high < one.low


def _ratio(arm: Arm, told: NDArray[np.bool_], j: int) -> Ratio | None:
    """Return effort over static torque with the declared load, by generalised least squares.

    None where one ratio does not fit all postures, or is not determined to half of itself.
    """
    joint = arm.joint(j, told)
    weight = np.linalg.inv(joint.covariances()[USUAL])
    power = float(joint.torque @ weight @ joint.torque)
    if power <= 0.0:
        return None
    value = float(joint.torque @ weight @ joint.effort) / power
    left = joint.effort - value * joint.torque
    if not left @ weight @ left <= FITS * value**2 * len(left):
        return None
    half = 1.96 * abs(value) / np.sqrt(power)
    if half > VAGUE * abs(value):
        return None
    return Ratio(value, float(value - half), float(value + half))


def _interval(chances: Floats) -> Ratio | None:
    """Return the scale with its 95 % interval from the probabilities of SCALES."""
    order = np.argsort(SCALES)
    scales, chance = SCALES[order], np.where(OTHER_UNIT, chances, 0.0)[order]
    if not chance.sum() > 0.0:
        return None
    below = np.cumsum(chance) - 0.5 * chance
    low, high = np.interp((0.025, 0.975), below, scales)
    # The grid is no finer than a step: half a step to each side is not known.
    value = float(scales[chance.argmax()])
    half = 0.5 * STEP * abs(value)
    return Ratio(value, min(float(low), value) - half, max(float(high), value) + half)
