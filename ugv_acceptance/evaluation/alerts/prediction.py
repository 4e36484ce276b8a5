"""Short-horizon prediction: time to a limit from the last half second of margins.

Also finds weak motors and frozen encoders from the same history. One sample every 50 ms of receipt
time (a *look*) is kept, so that other messages cost one comparison. Live looks wait until time
passes (`judge`) and are judged one at a time (prediction_live.py); those of a recording as columns.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ugv_acceptance.evaluation.alerts.prediction_limits import (
    CHANGED,
    EVEN,
    GROWN,
    HIGH,
    JUMP,
    KEPT,
    LAG,
    LATER,
    LEAPT,
    LOAD_RATE,
    LONGEST,
    LOW,
    MOST,
    NOISE,
    OVER,
    SOON,
    SPACING,
    STUCK,
    TILT_RATE,
    WEAK,
)
from ugv_acceptance.evaluation.alerts.prediction_live import LivePrediction, Look
from ugv_acceptance.evaluation.alerts.state_machine import Signal, feed
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.type_aliases import Floats, Times


def time_to(limit: ArrayLike, now: ArrayLike, then: ArrayLike, seconds: float) -> Floats:
    """Return the time (s) until a value reaches `limit`, extrapolated along a straight line.

    The value is `now` and, `seconds` later, `then`. 0 where it is past the limit already, infinite
    where it does not rise, NaN where it is not known.
    """
    bound, start, end = (np.asarray(x, dtype=np.float64) for x in (limit, now, then))
    with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
        left = (bound - start) * seconds / (end - start)
    left = np.where(start >= bound, 0.0, np.where(end <= start, np.inf, left))
    result: Floats = np.where(np.isnan(start) | np.isnan(end) | np.isnan(bound), np.nan, left)
    return result


SignalOf = Callable[[str, str, tuple[float, float], float], Signal]


@dataclass(slots=True)
class Prediction:
    """The rules on rates of change, and the history of looks they are judged on.

    One signal per side (`tip`, in order of SIDES) or per joint (the others). `due` (ns) is when the
    next look is to be taken.
    """

    tip: list[Signal]
    torque: list[Signal]
    effort: list[Signal]
    weak: list[Signal]
    frozen: list[Signal]
    due: int = 0
    _waiting: deque[Look] = field(default_factory=lambda: deque(maxlen=MOST))
    _live: LivePrediction = field(init=False)
    _time: Times = field(default_factory=lambda: np.empty(0, np.int64))
    _looks: Floats = field(init=False)
    _since: Floats = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.torque)
        self._live = LivePrediction(n)
        self._looks = np.empty((0, len(SIDES) + 3 * n))
        self._since = np.full((3, 2 * n), np.nan)

    def _rules(self) -> tuple[list[Signal], ...]:
        return self.tip, self.torque, self.effort, self.weak, self.frozen

    def signals(self) -> list[Signal]:
        """Return the signals of all rules, in a fixed order."""
        return [signal for rule in self._rules() for signal in rule]

    def keep(
        self,
        now: int,
        angle: Sequence[Any],
        torque: Sequence[float],
        effort: Sequence[float],
        q: Sequence[float],
    ) -> None:
        """Keep a live sample at `now` (ns) for the next `judge`; call it only from `due` on."""
        self.due = now - now % SPACING + SPACING
        self._waiting.append(Look(now, tuple(angle), tuple(torque), tuple(effort), tuple(q)))

    def judge(self, limit: Sequence[float]) -> None:
        """Judge the live samples kept since the last call; `limit` (j,) are torque limits."""
        while self._waiting:
            look = self._waiting.popleft()
            for signals, values in zip(self._rules(), self._live.step(look, limit), strict=True):
                for signal, value in zip(signals, values, strict=True):
                    # A small value cannot change a quiet signal.
                    if value >= signal.on or not signal.quiet:
                        signal.step(look.time, value)

    def rows(self, rows: MarginRows, limit: Sequence[float]) -> None:
        """Judge the next part of a recording; `limit` (j,) are torque limits (N m; N)."""
        at = np.flatnonzero(rows.known)
        cell = rows.time[at] // SPACING
        at = at[np.diff(cell, prepend=self.due // SPACING - 1) > 0]
        if not len(at):
            return
        time, joints, row = rows.time[at], rows.pairs.joints, rows.pairs.of_joints[at]
        self.due = int(time[-1] - time[-1] % SPACING + SPACING)
        looks = np.hstack((rows.angle[at], rows.torque[at], joints.effort[row], joints.q[row]))
        self._judge(time, looks, np.array(limit))

    def _judge(self, time: Times, looks: Floats, limit: Floats) -> None:
        """Feed the signals with new looks (n, 4 + 3 j): angle, torque, effort, position."""
        values = self.values(time, looks, limit)
        for signals, some in zip(self._rules(), values, strict=True):
            for signal, column in zip(signals, some.T, strict=True):
                feed(signal, time, column)

    def values(self, time: Times, looks: Floats, limit: Floats) -> list[Floats]:
        """Return what each rule says of new looks (n, 4 + 3 j), and keep them.

        The rules are in order of the fields of prediction_live.Values; arrays (n, sides or joints).
        """
        old, sides, n = len(self._time), len(SIDES), len(limit)
        time, looks = np.concatenate((self._time, time)), np.concatenate((self._looks, looks))
        angle, tau, effort, q = np.split(looks, [sides, sides + n, sides + 2 * n], axis=1)
        with np.errstate(invalid='ignore', over='ignore', divide='ignore'):
            found = [
                _ahead(time, angle, TILT_RATE),
                _ahead(time, limit - np.abs(tau), LOAD_RATE * limit),
                np.where(np.isfinite(limit), np.abs(effort), 0.0),
                _weak(time, tau, effort, limit) * _standing(angle),
                self._frozen(old, tau, effort, q) / limit,
            ]
        untold = np.isnan(tau)  # the ground may carry the arm
        for k in (1, 3, 4) if untold.any() else ():
            found[k][untold] = -np.inf
        self._time, self._looks = time[-KEPT:], looks[-KEPT:]
        return [some[old:] for some in found]

    def _frozen(self, old: int, tau: Floats, effort: Floats, q: Floats) -> Floats:
        """Return how much effort (n, j) in N m (N) changed while each joint's position did not.

        The change of the static torque is taken off, also that of a load that is declared while the
        effort stays; 0 until a position stood for STUCK looks, to the last bit or but for noise;
        what changed in noise counts less. `_since` holds looks, effort less torque, and effort at
        the last change of each position, for either kind.
        """
        n = q.shape[1]
        open_ = np.stack((np.hstack((effort - tau,) * 2), np.hstack((effort,) * 2)))
        change = self._changed(old, open_, _moved(q))
        found: Floats = np.maximum(change[:, :n], change[:, n:] * (CHANGED / LEAPT))
        return found

    def _changed(self, old: int, open_: Floats, moved: NDArray[np.bool_]) -> Floats:
        """Return the least that both of `open_` (2, n, m) changed since each `moved` (n, m)."""
        rows = np.arange(len(moved))[:, None]
        if old:
            moved[:old] = False
        before = ~np.logical_or.accumulate(moved)
        at = np.maximum.accumulate(np.where(moved, rows, 0))
        looks, *then = self._since
        looks = np.where(before, looks + rows - old + 1, rows - at)
        held = [
            np.where(before, known, np.take_along_axis(values, at, 0))
            for known, values in zip(then, open_, strict=True)
        ]
        self._since = np.array([looks[-1], *(one[-1] for one in held)])
        least: Floats = np.abs(open_ - np.array(held)).min(axis=0)
        return np.where(looks >= STUCK, least, 0.0)


def _moved(q: Floats) -> NDArray[np.bool_]:
    """Return (n, 2 j) whether each position changed by a bit; by more than its noise.

    Over LAG looks, so that a slow motion counts.
    """
    moved = np.ones((len(q), 2 * q.shape[1]), np.bool_)
    exact, noisy = moved[:, : q.shape[1]], moved[:, q.shape[1] :]
    exact[1:] = q[1:] != q[:-1]
    for k in range(1, min(LAG, len(q))):
        noisy[k] = ~(np.abs(q[k] - q[0]) <= NOISE)
    noisy[LAG:] = ~(np.abs(q[LAG:] - q[:-LAG]) <= NOISE)
    return moved


def _ahead(time: Times, left: Floats, slowest: Any) -> Floats:  # noqa: ANN401 - float or (m,)
    """Return minus the time (n, m) in s until the margin `left` is used up; NaN without a rate.

    Rates slower than `slowest` (per second) do not count.
    """
    found = np.full(left.shape, np.nan)
    if len(time) > OVER:
        step = (time[OVER:] - time[:-OVER])[:, None]
        now, rate = left[OVER:], (left[OVER:] - left[:-OVER]) / step * 1e9
        shrinks = rate <= -slowest
        if shrinks.any():
            shrinks &= _steady(-left, OVER)
        seconds = time_to(0.0, -now, np.where(shrinks, -now - rate, -np.inf), 1.0)
        found[OVER:] = np.where(step <= LONGEST, -seconds, np.nan)
    return found


def _weak(time: Times, tau: Floats, effort: Floats, limit: Floats) -> Floats:
    """Return 1 (n, j) where effort is constant below its limit while the static torque grows."""
    found, over = np.zeros(tau.shape), KEPT - 1
    grown = np.abs(tau[over:]) - np.abs(tau[:-over]) >= GROWN * limit
    if grown.any():
        even = _largest(effort, KEPT) + _largest(-effort, KEPT) <= EVEN * limit
        share = np.abs(effort[over:]) / limit
        even &= (share >= LOW) & (share <= HIGH)
        soon = time[over:] - time[:-over] <= 2 * KEPT * SPACING
        found[over:] = even & grown & soon[:, None] & _steady(np.abs(tau), over)
    return found


def _standing(angle: Floats) -> NDArray[np.bool_]:
    """Return (n, 1) whether none of the last KEPT looks was past tipping.

    A robot that has tipped may rest on its arm, and efforts then say nothing about motors.
    """
    tipped = np.convolve((angle < 0.0).any(axis=1), np.ones(KEPT))[: len(angle)]
    standing: NDArray[np.bool_] = (tipped == 0.0)[:, None]
    return standing


def _steady(values: Floats, over: int) -> NDArray[np.bool_]:
    """Return where values (n, m) rose over `over` looks, but not mostly in a single step.

    A newly declared payload makes a step of all margins, which is not a rate.
    """
    largest = _largest(values[1:] - values[:-1], over)
    steady: NDArray[np.bool_] = largest <= JUMP * (values[over:] - values[:-over])
    return steady


def _largest(values: Floats, over: int) -> Floats:
    """Return the running maximum of each column of values (n, m) over `over` rows; NaN wins."""
    last = len(values) - over + 1
    return reduce(np.maximum, [values[k : last + k] for k in range(over)])


def foresight_of(settings: Settings, signal: SignalOf) -> Prediction:
    """Return the prediction rules of a robot; `signal` makes one from code, subject, limits, delay.

    The limits are (on, off), the delay is in s.
    """
    names, limits, delays = settings.robot.joint_names, settings.limits, settings.delays
    ahead, levels = (-SOON, -LATER), [limits.torque_warn * limit for limit in limits.torque]
    at = [(level, level - min(limits.torque_deadband, level / 2.0)) for level in levels]
    return Prediction(
        [signal('TIP_AHEAD', side, ahead, delays.tip_on) for side in SIDES],
        [signal('TORQUE_AHEAD', name, ahead, delays.torque_on) for name in names],
        [
            signal('EFFORT_LIMIT', name, effort, delays.torque_on)
            for name, effort in zip(names, at, strict=True)
        ],
        [signal('MOTOR_WEAK', name, (WEAK, WEAK), 0.0) for name in names],
        [signal('ENCODER_FROZEN', name, (CHANGED, CHANGED), delays.torque_on) for name in names],
    )
