"""motion.py for columns: the IMU messages of a part of a recording, with the same alerts.

Filters and comparison run on whole columns; the margins are computed for the rows in which the
robot turns or is pushed, and only the episodes of those are gone through one by one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import feed
from ugv_acceptance.evaluation.chassis.filters import LEARNT, PUSH, SETTLED, SLOWEST, FeltRows
from ugv_acceptance.evaluation.chassis.motion import (
    BACK,
    FALL,
    HARD,
    HARD_UP_TO,
    HELD,
    LIFT,
    LONG_AGO,
    LOW,
    MATTERS,
    NOTHING,
    SPIN,
    SPIN_LESS,
    TRUE,
    ChassisMotion,
    no_witness,
    stance_kernel,
    witnessed,
)
from ugv_acceptance.evaluation.margin_table import NO_CHASSIS_ROWS, ChassisRows, MarginRows
from ugv_acceptance.evaluation.samples import ImuColumns
from ugv_acceptance.evaluation.settings import ImuInput
from ugv_acceptance.model.edges import SIDES
from ugv_acceptance.model.mechanics import posture_of
from ugv_acceptance.model.row_selection import pick
from ugv_acceptance.model.stability import STANDING, stances_of
from ugv_acceptance.model.tipping import inertia_of
from ugv_acceptance.type_aliases import Floats, Times

Mask = NDArray[np.bool_]
Lost = tuple[NDArray[np.intp], Times]
_Standout = tuple[NDArray[np.intp], Floats, Floats, Mask, Mask]


@dataclass(frozen=True, slots=True)
class _Part:
    """Columns of a part of a recording, one row an IMU message.

    `which` are the rows of margins, `gravity` (3, n) m/s2; `judged` says where all is there that is
    needed, `alone` where no orientation shows the rate, `true` where the accelerometer shows gravity,
       `spins` and `pushed` where margins are computed. `trusted_at` and `hard_at` (n,) are those of
    Episodes after each row.
    """

    time: Times
    felt: FeltRows
    gravity: Floats
    which: NDArray[np.intp]
    judged: Mask
    alone: Mask
    true: Mask
    spins: Mask
    pushed: Mask
    trusted_at: Times
    hard_at: Times


def take_columns(
    motion: ChassisMotion,
    segments: Sequence[ImuColumns],
    rows: MarginRows,
    load: Sequence[Any],
    lost: Lost,
) -> ChassisRows:
    """Take the IMU messages of a part of a recording; feed the signals; return what stands out.

    `rows` are the margins of the part, `load` mass and centre of gravity (floats or arrays) of the
    payload in each row of `rows.pairs.joints`; `lost` when margins became unknown: before which
    known row, and the time (ns).
    """
    columns = [s for s in segments if len(s.log_time)]
    if not columns:
        for time in lost[1] if motion.busy else ():
            motion.lose(int(time))
        return NO_CHASSIS_ROWS
    with np.errstate(all='ignore'):
        time, stamp, vectors, measured, alone = _in_order(columns, motion.settings.imu)
        felt = motion.filter.columns(
            time, stamp, vectors[:3], vectors[3:], rows.pairs.imu.gravity[1:].T
        )
        gyro = measured & _turned(motion, vectors[:3])
        part = _compare(motion, (time, felt), rows, (gyro, alone))
        values, found, believed = _judge(motion, part, rows, load)
        _feed(motion, part, rows, values, lost)
    known = rows.known[part.which]
    masks = (known, part.judged, part.true | believed, known & ~gyro, known & (felt.pace > SLOWEST))
    return ChassisRows(*found, *(float(felt.step[mask].sum()) for mask in masks))


def _in_order(
    columns: Sequence[ImuColumns], imu: ImuInput
) -> tuple[Times, Times, Floats, Mask, Mask]:
    """Return time, stamp, rate and force (6, n), as received.

    Then where the rate was measured, and where no orientation of the IMU's own witnesses it.
    """
    time = np.concatenate([s.log_time for s in columns])
    stamp = np.concatenate([s.stamp for s in columns])
    measured = np.concatenate([s.angular_velocity_covariance_0 for s in columns]) != -1.0
    alone = np.concatenate([s.orientation_covariance_0 for s in columns]) == -1.0
    alone |= no_witness(imu)
    table = np.empty((6, len(time)))
    for lines, name in ((table[:3], 'angular_velocity'), (table[3:], 'linear_acceleration')):
        np.concatenate([getattr(s, name).T for s in columns], axis=1, out=lines)
    if (np.diff(time) < 0).any():
        order = np.argsort(time, kind='stable')
        return time[order], stamp[order], table[:, order], measured[order], alone[order]
    return time, stamp, table, measured, alone


def _turned(motion: ChassisMotion, omega: Floats) -> Mask:
    """Return in which rows the gyro has shown any number but 0 so far."""
    if motion.turned:
        return np.ones(omega.shape[1], np.bool_)
    turned: Mask = np.logical_or.accumulate((omega != 0.0).any(axis=0))
    motion.turned = bool(turned[-1])
    return turned


def _compare(
    motion: ChassisMotion,
    felt_at: tuple[Times, FeltRows],
    rows: MarginRows,
    known: tuple[Mask, Mask],
) -> _Part:
    """Return the part with the rows in which the robot turns, or is or was just pushed."""
    (time, felt), (gyro, alone) = felt_at, known
    which = np.flatnonzero(np.diff(rows.pairs.of_imu, prepend=0) > 0)
    front, left, rear, right = rows.angle.T
    least = np.minimum(np.minimum(front, left), np.minimum(rear, right))[which]
    judged = (felt.elapsed >= SETTLED) & (felt.pace <= SLOWEST) & gyro & (least > 0.0)
    judged &= rows.known[which]
    (px, py, pz), (mx, my, mz) = felt.rate, felt.mean
    flat, up = px * px + py * py, pz * pz
    square = np.where(rows.state[which] == STANDING, flat, flat + up)
    spins = judged & (square > SPIN * least * np.abs(least) - SPIN_LESS)
    true = judged & (felt.elapsed >= LEARNT) & (mx * mx + my * my + mz * mz <= TRUE * TRUE)
    of, gravity = motion.episodes, rows.pairs.imu.gravity[1:].T
    alpha = np.abs(felt.rate - felt.lagging).sum(axis=0) / PUSH
    off = np.sqrt((felt.push * felt.push).sum(axis=0)) + motion.filter.reach * (alpha + flat + up)
    hard = judged & (off > HARD * gravity[2] * np.minimum(least - LOW, HARD_UP_TO))
    hard_at = _last(felt, hard, of.hard_at)
    most = (1.0 - FALL) * motion.settings.robot.gravity**2
    pushed = judged & (felt.elapsed - hard_at < BACK)
    pushed &= (felt.push * gravity).sum(axis=0) <= most
    trusted_at = _last(felt, pushed & true, of.trusted_at)
    pushed &= felt.elapsed - trusted_at <= HELD
    return _Part(
        time, felt, gravity, which, judged, alone, true, spins, pushed, trusted_at, hard_at
    )


def _last(felt: FeltRows, mask: Mask, before: int) -> Times:
    """Return `elapsed` of when `mask` was last true, in each row; LONG_AGO if not since the start.

    `before` is that of before these rows.
    """
    place = np.maximum.accumulate(np.where(mask, np.arange(len(mask)), -1))
    at = np.where(place >= 0, felt.elapsed[place], LONG_AGO)
    at[(place < felt.began) & (felt.began >= 0)] = LONG_AGO
    at[(place < 0) & (felt.began < 0)] = before
    return at


def _judge(
    motion: ChassisMotion, part: _Part, rows: MarginRows, load: Sequence[Any]
) -> tuple[list[Floats], _Standout, Mask]:
    """Return the values of the signals, the first fields of ChassisRows, and ...

    ... where the accelerometer was believed for the sake of an episode. No values: none matters.
    """
    some = np.flatnonzero(part.spins | part.pushed)
    shape = (len(part.time), len(SIDES))
    values = [np.full(shape, NOTHING) for _ in range(4)] if len(some) or motion.busy else []
    believed = np.zeros(shape[0], np.bool_)
    if not len(some):
        _go_on(motion, part, -1)
        none = NO_CHASSIS_ROWS.moving
        return values, (some, none, none, none > 0.0, none > 0.0), believed
    margin, effective, against, frequency = _margins(motion, part, rows, load, some)
    turns = part.spins[some, None] & (rows.angle[part.which[some]] - margin > MATTERS)
    values[0][some] = np.where(turns, -margin, NOTHING)
    felt = part.felt
    sure = part.alone[some] | witnessed(
        felt.rate[:, some], part.gravity[:, some], felt.level[:, some]
    )
    values[1][some] = np.where(sure[:, None], values[0][some], NOTHING)
    denied = (values[0][some] >= 0.0) & ~sure[:, None]
    of, segment = motion.episodes, -1
    for k in np.flatnonzero(part.pushed[some]).tolist():
        row = int(some[k])
        segment = _begin(motion, part, row, segment)
        elapsed, of.trusted_at = int(felt.elapsed[row]), int(part.trusted_at[row])
        if of.believed(elapsed):
            of.step(elapsed, float(felt.step[row]), effective[k].tolist(), against[k].tolist())
            believed[row], values[2][row], values[3][row] = True, -effective[k], of.turn
            denied[k] |= of.contradicted(frequency[k].tolist())
    _go_on(motion, part, segment)
    found = part.which[some], -values[1][some], -values[2][some], values[3][some] >= LIFT, denied
    return values, found, believed


def _begin(motion: ChassisMotion, part: _Part, row: int, segment: int) -> int:
    """Forget the episodes if the filters began anew since `segment`; return in which row."""
    began = int(part.felt.began[row])
    if began != segment:
        motion.episodes.begin()
    return began


def _go_on(motion: ChassisMotion, part: _Part, segment: int) -> None:
    """Leave the episodes as the last row does."""
    _begin(motion, part, -1, segment)
    motion.episodes.trusted_at = int(part.trusted_at[-1])
    motion.episodes.hard_at = int(part.hard_at[-1])


def _margins(
    motion: ChassisMotion,
    part: _Part,
    rows: MarginRows,
    load: Sequence[Any],
    some: NDArray[np.intp],
) -> list[Floats]:
    """Return the four results of model/tipping.py for some IMU rows, each (m, 4)."""
    j = rows.pairs.of_joints[part.which[some]]
    q = list(rows.pairs.joints.q[j].T)
    mass, *cog = [x[j] if isinstance(x, np.ndarray) else x for x in load]
    posture = posture_of(motion.mechanics, q, mass, (cog[0], cog[1], cog[2]))
    inertia = tuple(
        np.broadcast_to(x, len(some)) for x in inertia_of(motion.mechanics).run(*q, mass, *cog)
    )
    felt = part.felt
    alpha = (felt.rate - felt.lagging) / PUSH
    vectors = tuple(np.vstack((part.gravity, felt.push - part.gravity, felt.rate, alpha))[:, some])
    table = np.full((4, len(some), len(SIDES)), np.nan)
    for of, stance in stances_of(motion.mechanics, posture, len(some)):
        if stance.edges is None:
            continue
        kernel = stance_kernel(motion.mechanics, stance, motion.settings.imu.position)
        found = kernel.run(*stance.terms, stance.mass, *pick(inertia, of), *pick(vectors, of))
        for k, values in enumerate(found):
            for side, value in enumerate(values):
                table[k, of, side] = value
    return list(table)


def _feed(
    motion: ChassisMotion, part: _Part, rows: MarginRows, values: Sequence[Floats], lost: Lost
) -> None:
    """Feed the signals with the judged rows; with no `values` nothing is the matter in any."""
    if not values:
        return
    judged = part.judged
    number = np.cumsum(rows.known)[part.which[judged]]
    place = np.searchsorted(number, lost[0], side='right')
    time = np.insert(part.time[judged], place, lost[1])
    for signals, table in zip(motion.signals.all(), values, strict=True):
        for signal, value in zip(signals, table[judged].T, strict=True):
            feed(signal, time, np.insert(value, place, NOTHING))
    motion.busy = not motion.signals.quiet()
