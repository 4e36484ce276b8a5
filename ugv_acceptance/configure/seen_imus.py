"""What Imu messages tell of a robot that stands: specific force and orientation, by frame."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.bag.cdr import ImuSample
from ugv_acceptance.configure.evidence import SeenImu
from ugv_acceptance.evaluation.settings import ImuInput
from ugv_acceptance.model.attitude import NORM_SLACK, rotation_of
from ugv_acceptance.model.robot import Matrix, Vector
from ugv_acceptance.type_aliases import Floats, Times

Mask = NDArray[np.bool_]

# Messages are kept this often (ns), so many of a frame at most, of so many frames.
_EVERY, _ROWS, _FRAMES = 10_000_000, 8000, 8
# Whether the sensor turns is judged over this time (ns). The first rest that lasts LEAST is taken,
# up to MOST of it: robots start upright.
_WINDOW, _LEAST, _MOST = 500_000_000, 2_000_000_000, 10_000_000_000
# Larger numbers are no measurements.
ABSURD = 1e9
_QUATERNION, _RATE, _FORCE = slice(0, 4), slice(4, 7), slice(7, 10)


@dataclass(slots=True)
class _Frame:
    """The messages kept of one frame: times (ns), and rows of quaternion, rate and force."""

    count: int = 0
    times: list[int] = field(default_factory=list)
    rows: list[tuple[float, ...]] = field(default_factory=list)


@dataclass(slots=True)
class ImusSeen:
    """Folds the messages of one topic; each frame that they name is an IMU of its own.

    `undeclared` is what the messages say, by a covariance of -1, that they do not hold.
    """

    frames: dict[str, _Frame] = field(default_factory=dict)
    undeclared: set[str] = field(default_factory=set)

    def take(self, now: int, sample: ImuSample) -> None:
        """Take a message received at `now` (ns)."""
        frame = self.frames.get(sample.frame_id)
        if frame is None:
            if len(self.frames) >= _FRAMES:
                return
            frame = self.frames[sample.frame_id] = _Frame()
        frame.count += 1
        turned, rate, force = (
            sample.orientation,
            sample.angular_velocity,
            sample.linear_acceleration,
        )
        if sample.orientation_covariance_0 == -1.0:
            turned = (math.nan,) * 4
            self.undeclared.add('orientation')
        if sample.angular_velocity_covariance_0 == -1.0:
            rate = (math.nan,) * 3
        if sample.linear_acceleration_covariance_0 == -1.0:
            force = (math.nan,) * 3
            self.undeclared.add('acceleration')
        late = not frame.times or now - frame.times[-1] >= _EVERY
        if late and len(frame.rows) < _ROWS:
            frame.times.append(now)
            row = (*turned, *rate, *force)
            frame.rows.append(tuple(v if -ABSURD < v < ABSURD else math.nan for v in row))

    def seen(self, topic: str) -> tuple[tuple[SeenImu, ...], list[str]]:
        """Return an IMU for each frame, the one with most messages first, and what is doubtful."""
        order = sorted(self.frames, key=lambda name: -self.frames[name].count)
        found, doubts = [], []
        if len(order) > 1:
            named = ', '.join(repr(name) for name in order)
            doubts.append(f'the messages of {topic} name several frames: {named}')
        for name in order:
            frame = self.frames[name]
            table = np.array(frame.rows, np.float64)
            rest = _rest(np.array(frame.times, np.int64), table[:, _RATE])
            if rest is None:
                rest = np.ones(len(table), bool)
                doubts.append(f'the IMU of {topic} never rests: all of its messages are averaged')
            force = _mean(table[rest, _FORCE])
            found.append(SeenImu(topic, name, force, _orientation(table[rest, _QUATERNION])))
        if 'acceleration' in self.undeclared:
            doubts.append(f'{topic} declares, by a covariance of -1, that it has no acceleration')
        return tuple(found), doubts


def _rest(time: Times, rate: Floats) -> Mask | None:
    """Return which rows (n,) are the first rest that lasts, else the longest; None: no rest."""
    number = (time - time[0]) // _WINDOW
    still = []
    for k in range(int(number.max()) + 1 if len(number) else 0):
        rows = rate[number == k]
        known = rows[np.isfinite(rows).all(axis=1)]
        turns = float(np.linalg.norm(known.mean(axis=0))) if len(known) else 0.0
        still.append(bool(len(rows)) and turns < ImuInput().rest_rate)
    spells = list(_spells(still))
    if not spells:
        return None
    long = [spell for spell in spells if (spell[1] - spell[0]) * _WINDOW >= _LEAST]
    first, last = long[0] if long else max(spells, key=lambda spell: spell[1] - spell[0])
    last = min(last, first + _MOST // _WINDOW)
    return np.asarray((number >= first) & (number < last))


def _spells(still: list[bool]) -> Iterator[tuple[int, int]]:
    """Yield first and after last number of each run of windows at rest."""
    at = 0
    for rests, run in groupby(still):
        length = len(list(run))
        if rests:
            yield at, at + length
        at += length


def _mean(rows: Floats) -> Vector | None:
    known = rows[np.isfinite(rows).all(axis=1)]
    if not len(known):
        return None
    x, y, z = known.mean(axis=0).tolist()
    return (x, y, z)


def _orientation(rows: Floats) -> Matrix | None:
    """Return the mean rotation of those quaternions that are one; None if none is."""
    norm = np.linalg.norm(rows, axis=1)
    known = rows[np.abs(norm - 1.0) <= NORM_SLACK]
    if not len(known):
        return None
    same = known * np.where(known @ known[0] < 0.0, -1.0, 1.0)[:, None]
    mean = same.mean(axis=0)
    x, y, z, w = (mean / np.linalg.norm(mean)).tolist()
    return rotation_of(x, y, z, w)
