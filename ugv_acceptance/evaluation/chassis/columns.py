"""motion.py for columns: the IMU messages of a part of a recording, with the same alerts.

What filters could give at most is found for groups of rows; filters and margins are computed only
where the robot may turn or be pushed, and only the episodes of that are gone through row by row.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import feed
from ugv_acceptance.evaluation.chassis.filter_columns import (
    GROUP,
    RawColumns,
    RawRows,
    bounds,
    filtered,
    stretches,
)
from ugv_acceptance.evaluation.chassis.filters import BLOCK, PUSH
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
    ChassisMotion,
    Episodes,
    no_witness,
    run_tipping,
    stance_kernel,
    witnessed,
)
from ugv_acceptance.evaluation.margin_table import NO_CHASSIS_ROWS, ChassisRows, MarginRows
from ugv_acceptance.evaluation.samples import ImuColumns
from ugv_acceptance.evaluation.settings import ImuInput, Settings
from ugv_acceptance.model.edges import SIDES
from ugv_acceptance.model.mechanics import posture_of
from ugv_acceptance.model.row_selection import pick
from ugv_acceptance.model.stability import STANDING, many_stances, many_standing
from ugv_acceptance.model.tipping import inertia_of
from ugv_acceptance.type_aliases import Floats, Times

Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]
Lost = tuple[NDArray[np.intp], Times]


@dataclass(frozen=True, slots=True)
class _Part:
    """IMU messages of a part of a recording that may be anything but calm, one row each.

    `at` (m,) is which of the part's messages, `which` its row of margins; `elapsed`, `step` (ns)
    those of the filters, `segment` counts how often these began anew in the part. `y` (11, m) is
    what they gave, `gravity` (3, m) m/s2. `true` and `alone` say where the accelerometer shows
    gravity, and where no orientation witnesses the rate.
    """

    at: Indices
    which: Indices
    elapsed: Times
    step: Times
    segment: Times
    y: Floats
    gravity: Floats
    true: Mask
    alone: Mask


@dataclass(slots=True)
class ChassisColumns:
    """Takes the IMU messages of a recording part by part, with the signals of `motion`."""

    motion: ChassisMotion
    raw: RawColumns = field(init=False)

    def __post_init__(self) -> None:
        self.raw = RawColumns(self.motion.filter.mounting)

    def place(self, settings: Settings) -> None:
        """Take settings with another place of the IMU."""
        self.motion.place(settings)
        self.raw.mounting = self.motion.filter.mounting

    def take(
        self, segments: Sequence[ImuColumns], rows: MarginRows, load: Sequence[Any], lost: Lost
    ) -> ChassisRows:
        """Take a part: feed the signals; return what stands out.

        `rows` are its margins, `load` mass and centre of gravity (floats or arrays) of the payload
        in each row of `rows.pairs.joints`; `lost` when margins became unknown: before which known
        row, and the time (ns).
        """
        columns = [s for s in segments if len(s.log_time)]
        motion = self.motion
        if not columns:
            for time in lost[1] if motion.busy else ():
                motion.lose(int(time))
            return NO_CHASSIS_ROWS
        with np.errstate(all='ignore'):
            time, stamp, vectors, measured, alone = _in_order(columns, motion.settings.imu)
            gravity = rows.pairs.imu.gravity[1:].T
            raw = self.raw.take(time, stamp, vectors, gravity)
            gyro = measured & _turned(motion, vectors[:3]) & rows.pairs.imu.gyro_trusted[1:]
            which = np.flatnonzero(np.diff(rows.pairs.of_imu, prepend=0) > 0)
            front, left, rear, right = rows.angle.T
            least = np.minimum(np.minimum(front, left), np.minimum(rear, right))[which]
            true, fast = raw.true[raw.lead :], raw.fast[raw.lead :]
            judged = fast & gyro & (least > 0.0) & rows.known[which]
            raised = rows.state[which] != STANDING
            limits = _limits(least, raised, gravity)
            part = self._part(raw, which, judged, limits, (gravity, alone))
            spin, hard, _ = limits
            at = (spin[part.at], hard[part.at], raised[part.at])
            found = _judge(motion, part, rows, load, at)
            _go_on(motion, part, int(raw.fresh[raw.lead :].sum()))
            _feed(motion, (time, judged, which), rows, (part.at, *found.values), lost)
        known, step = rows.known[which], raw.step[raw.lead :] * 1e-9
        believed = judged & true
        believed[part.at] |= found.believed
        slow = known & ~fast & (raw.elapsed[raw.lead :] >= BLOCK)
        seconds = (
            float(step[mask].sum()) for mask in (known, judged, believed, known & ~gyro, slow)
        )
        return ChassisRows(*found.columns, *seconds)

    def _part(
        self,
        raw: RawRows,
        which: Indices,
        judged: Mask,
        limits: tuple[Floats, Floats, Mask],
        told: tuple[Floats, Mask],
    ) -> _Part:
        """Return the judged rows that may not be calm, filtered."""
        lead, (gravity, alone) = raw.lead, told
        spin, hard, raised = limits
        n = len(which)
        bound = bounds(raw, self.motion.filter.reach)
        flat, up, off = (
            np.repeat(b, GROUP)[lead : lead + n] for b in (bound.flat, bound.up, bound.off)
        )
        pushed = judged & (off > hard)
        elapsed, segment = raw.elapsed[lead:], np.cumsum(raw.fresh[lead:], dtype=np.int64)
        at = _last(elapsed, segment, pushed, self.motion.episodes.hard_at)
        wanted = judged & ((np.where(raised, flat + up, flat) > spin) | (elapsed - at < BACK))
        at = np.flatnonzero(wanted)
        y = np.empty((11, len(at)))
        done = 0
        for warm, first, end in stretches(raw, np.concatenate((np.zeros(lead, np.bool_), wanted))):
            some = at[done : done + int(wanted[first - lead : end - lead].sum())]
            y[:, done : done + len(some)] = filtered(raw, warm, end)[:, some + lead - warm]
            done += len(some)
        return _Part(
            at, which[at], elapsed[at], raw.step[lead:][at], segment[at], y, gravity[:, at],
            raw.true[lead:][at], alone[at],
        )  # fmt: skip


def _limits(least: Floats, raised: Mask, gravity: Floats) -> tuple[Floats, Floats, Mask]:
    """Return the squared rate and the push from which a row is looked at closer, and `raised`."""
    spin = SPIN * least * np.abs(least) - SPIN_LESS
    return spin, HARD * gravity[2] * np.minimum(least - LOW, HARD_UP_TO), raised


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


def _last(elapsed: Times, segment: Times, mask: Mask, before: int) -> Times:
    """Return `elapsed` of when `mask` was last true in the segment; LONG_AGO if it was not.

    `before` is that of before these rows, in whose segment (0) they begin.
    """
    place = np.maximum.accumulate(np.where(mask, np.arange(len(mask)), -1))
    here = (place >= 0) & (segment[place] == segment)
    return np.where(here, elapsed[place], np.where(segment == 0, before, LONG_AGO))


@dataclass(frozen=True, slots=True)
class _Found:
    """The signals' values in the part's rows, the first fields of ChassisRows, and ...

    ... in which rows the accelerometer was believed, if only for the sake of an episode.
    """

    values: tuple[Floats, ...]
    columns: tuple[Indices, Floats, Floats, Mask, Mask]
    believed: Mask


def _judge(
    motion: ChassisMotion,
    part: _Part,
    rows: MarginRows,
    load: Sequence[Any],
    limits: tuple[Floats, Floats, Mask],
) -> _Found:
    """Look closer at a part's rows."""
    spin, hard, raised = limits
    push, rate, lagging, level = part.y[:3], part.y[3:6], part.y[6:9], part.y[9:]
    flat, up = rate[0] * rate[0] + rate[1] * rate[1], rate[2] * rate[2]
    spins = np.where(raised, flat + up, flat) > spin
    off = np.sqrt((push * push).sum(axis=0))
    off += motion.filter.reach * (np.abs(rate - lagging).sum(axis=0) / PUSH + flat + up)
    of = motion.episodes
    hard_at = _last(part.elapsed, part.segment, off > hard, of.hard_at)
    pushed = part.elapsed - hard_at < BACK
    most = (1.0 - FALL) * motion.settings.robot.gravity**2
    pushed &= (push * part.gravity).sum(axis=0) <= most
    trusted_at = _last(part.elapsed, part.segment, pushed & part.true, of.trusted_at)
    pushed &= part.elapsed - trusted_at <= HELD
    margin, effective, against, frequency = _margins(motion, part, rows, load, spins | pushed)
    values = [np.full(margin.shape, NOTHING) for _ in range(4)]
    angle = rows.angle[part.which]
    turns = spins[:, None] & (angle - margin > MATTERS)
    effective = np.where(angle - effective > MATTERS, effective, np.inf)
    values[0] = np.where(turns, -margin, NOTHING)
    sure = part.alone | witnessed(tuple(rate), tuple(part.gravity), tuple(level))
    values[1] = np.where(sure[:, None], values[0], NOTHING)
    denied = (values[0] >= 0.0) & ~sure[:, None]
    values[2][pushed] = -effective[pushed]
    look = _Look(part, pushed, trusted_at, (effective, against, frequency))
    believed = _episodes(of, look, values, denied)
    if len(part.at):
        of.trusted_at, of.hard_at = int(trusted_at[-1]), int(hard_at[-1])
    columns = part.which, -values[1], -values[2], values[3] >= LIFT, denied
    return _Found(tuple(values), columns, believed)


@dataclass(frozen=True, slots=True)
class _Look:
    """What the episodes need to know of a part: where it is pushed, and three of its margins.

    `margins` are that under effective gravity, minus the rate, and wn^2 (model/tipping.py).
    """

    part: _Part
    pushed: Mask
    trusted_at: Times
    margins: tuple[Floats, Floats, Floats]


def _episodes(of: Episodes, look: _Look, values: list[Floats], denied: Mask) -> Mask:
    """Go through the episodes row by row; return where the accelerometer was believed in one."""
    part, (effective, against, frequency) = look.part, look.margins
    believed, segment = np.zeros(len(part.at), np.bool_), 0
    low: Mask = np.asarray((effective < LOW).any(axis=1), np.bool_)
    since = part.elapsed - _last(part.elapsed, part.segment, low, of.newest)
    for k in np.flatnonzero(look.pushed & (since < BACK)).tolist():
        if part.segment[k] != segment:
            segment = int(part.segment[k])
            of.begin()
        elapsed, of.trusted_at = int(part.elapsed[k]), int(look.trusted_at[k])
        if not of.believed(elapsed):
            values[2][k] = NOTHING
            continue
        of.step(elapsed, float(part.step[k]) * 1e-9, effective[k].tolist(), against[k].tolist())
        believed[k], values[3][k] = True, of.turn
        contradicted = of.contradicted(frequency[k].tolist())
        denied[k] |= contradicted
    if len(part.at) and part.segment[-1] != segment:
        of.begin()
    return believed


def _go_on(motion: ChassisMotion, part: _Part, segment: int) -> None:
    """Forget the episodes if the filters began anew after the last row that was looked at."""
    if segment and (not len(part.at) or part.segment[-1] != segment):
        motion.episodes.begin()


def _margins(
    motion: ChassisMotion, part: _Part, rows: MarginRows, load: Sequence[Any], some: Mask
) -> list[Floats]:
    """Return the four results of model/tipping.py, each (m, 4); NaN but for `some` rows."""
    table = np.full((4, len(some), len(SIDES)), np.nan)
    at = np.flatnonzero(some)
    if not len(at):
        return list(table)
    j = rows.pairs.of_joints[part.which[at]]
    q = list(rows.pairs.joints.q[j].T)
    mass, *cog = [x[j] if isinstance(x, np.ndarray) else x for x in load]
    posture = posture_of(motion.mechanics, q, mass, (cog[0], cog[1], cog[2]))
    inertia = inertia_of(motion.mechanics).run(*q, mass, *cog)
    gravity, push, rate, lagging = part.gravity, part.y[:3], part.y[3:6], part.y[6:9]
    felt = np.concatenate((gravity, push - gravity, rate, (rate - lagging) / PUSH))[:, at]
    count = len(at)
    stances = many_stances(motion.mechanics, posture, count)
    for of, stance in many_standing(stances, count, np.arange(count), tuple(gravity[:, at])):
        if stance.edges is None:
            continue
        kernel = stance_kernel(motion.mechanics, stance, motion.settings.imu.position)
        found = run_tipping(kernel, stance, pick(tuple(inertia), of), pick(tuple(felt), of))
        for k, values in enumerate(found):
            for side, value in enumerate(values):
                table[k, at[of], side] = value
    return list(table)


def _feed(
    motion: ChassisMotion,
    judged_at: tuple[Times, Mask, Indices],
    rows: MarginRows,
    values: tuple[Any, ...],
    lost: Lost,
) -> None:
    """Feed the signals with the judged rows; what is not in `values` is calm."""
    (time, judged, which), (at, *tables) = judged_at, values
    if not motion.busy and not any((table > NOTHING).any() for table in tables):
        return
    number = np.cumsum(rows.known)[which[judged]]
    place = np.searchsorted(number, lost[0], side='right')
    time = np.insert(time[judged], place, lost[1])
    for signals, table in zip(motion.signals.all(), tables, strict=True):
        for signal, value in zip(signals, table.T, strict=True):
            whole = np.full(len(judged), NOTHING)
            whole[at] = value
            feed(signal, time, np.insert(whole[judged], place, NOTHING))
    motion.busy = not motion.signals.quiet()
