"""Simulated IMUs on a vehicle that drives, turns and shakes, and the ways in which they go wrong.

All is drawn from a seed. Attitude comes from scipy's Rotation, so that the checks under test are
held against formulas that they do not share.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from ugv_acceptance.evaluation.samples import ImuColumns
from ugv_acceptance.type_aliases import Floats, Times

NS = 1_000_000_000
T0 = 1_700_000_000 * NS
G = 9.80665


@dataclass(frozen=True)
class ImuRun:
    """Messages of an IMU: `time` of receipt and `stamp` (ns), orientation, rate, acceleration.

    `frame` (n,) is 0 or 1, which frame_id a message names; `bad_from` (s) when the fault begins.
    """

    time: Times
    stamp: Times
    q: Floats
    w: Floats
    a: Floats
    frame: Times
    bad_from: float = 0.0

    @property
    def seconds(self) -> Floats:
        """Seconds since the first message."""
        found: Floats = (self.time - self.time[0]) / NS
        return found

    def columns(self) -> list[ImuColumns]:
        """Return the messages as columns, one table a frame_id."""
        parts = []
        for k in np.unique(self.frame):
            some = self.frame == k
            zero = np.zeros(int(some.sum()))
            table = self.time[some], self.stamp[some], self.q[some], self.w[some], self.a[some]
            parts.append(ImuColumns(f'imu_{k}', *table, zero, zero, zero))
        return parts


def _wander(rng: np.random.Generator, n: int, width: float, size: float) -> Floats:
    """Return smooth noise (n,) of that root mean square, `width` samples long."""
    x = gaussian_filter1d(rng.normal(size=n + int(8 * width)), width)[int(4 * width) :][:n]
    found: Floats = x * size / max(float(np.sqrt(np.mean(x**2))), 1e-12)
    return found


def good_run(
    seed: int, seconds: float = 60.0, hz: float = 100.0, vibration: float | None = None
) -> ImuRun:
    """Return a run in which nothing is wrong: slopes, turns, driving up to 3 m/s2, vibration."""
    rng = np.random.default_rng(seed)
    n = int(seconds * hz)
    t = np.arange(n) / hz
    moving = np.clip(_wander(rng, n, 4 * hz, 1.5) + 0.5, 0.0, 1.0)
    tilt = np.radians(rng.uniform(2.0, 15.0))
    roll, pitch = (_wander(rng, n, 0.7 * hz, tilt / 2) * moving for _ in range(2))
    yaw = np.cumsum(_wander(rng, n, 0.8 * hz, rng.uniform(0.2, 0.8)) * moving) / hz
    attitude = Rotation.from_euler('ZYX', np.column_stack((yaw, pitch, roll)))
    steps = (attitude[:-1].inv() * attitude[1:]).as_rotvec() * hz
    rate = np.vstack((steps, steps[-1:]))
    speed = np.clip(_wander(rng, n, 1.2 * hz, 1.0), -1.0, 2.0) * moving
    along = np.clip(np.gradient(speed, 1.0 / hz), -3.0, 3.0)
    ahead = attitude.apply(np.tile((1.0, 0.0, 0.0), (n, 1)))
    turn = np.gradient(np.unwrap(yaw), 1.0 / hz)
    left = np.column_stack((-ahead[:, 1], ahead[:, 0], np.zeros(n)))
    push = ahead * along[:, None] + left * (speed * turn)[:, None]
    force = attitude.inv().apply(push + (0.0, 0.0, G))
    shake = rng.uniform(0.0, 5.0) if vibration is None else vibration
    force += rng.normal(0.0, 0.3, (n, 3)) + rng.normal(0.0, shake, (n, 3)) * moving[:, None]
    rate = rate + rng.uniform(-0.02, 0.02, 3) + rng.normal(0.0, 0.02, (n, 3))
    rate += rng.normal(0.0, 0.02 * shake, (n, 3)) * moving[:, None]
    error = Rotation.from_rotvec(
        np.column_stack([_wander(rng, n, 2 * hz, np.radians(1.0)) for _ in range(3)])
    )
    time = T0 + np.round(t * NS).astype(np.int64)
    q = (attitude * error).as_quat()
    return ImuRun(time, time, q, rate, force, np.zeros(n, np.int64))


def tilted_by(run: ImuRun, degrees: float, axis: tuple[float, ...] = (1.0, 0.0, 0.0)) -> ImuRun:
    """Return a run whose orientation is wrong by a constant tilt."""
    wrong = Rotation.from_rotvec(np.radians(degrees) * np.array(axis))
    return replace(run, q=(Rotation.from_quat(run.q) * wrong).as_quat())


def _stuck(run: ImuRun, rng: np.random.Generator) -> ImuRun:
    q = np.tile(run.q[0], (len(run.q), 1)) + rng.normal(0.0, 1e-5, run.q.shape)
    return replace(run, q=q / np.linalg.norm(q, axis=1)[:, None])


def _drifting(run: ImuRun, _: np.random.Generator) -> ImuRun:
    drift = Rotation.from_rotvec(np.radians(run.seconds)[:, None] * (0.0, 1.0, 0.0))
    return replace(run, q=(Rotation.from_quat(run.q) * drift).as_quat())


def _mounted(run: ImuRun, rng: np.random.Generator) -> ImuRun:
    turns = [('x', 180.0), ('x', 90.0), ('x', -90.0), ('y', 90.0), ('y', -90.0), ('y', 180.0)]
    axis, degrees = turns[int(rng.integers(len(turns)))]
    turn = Rotation.from_euler(axis, degrees, degrees=True)
    back = turn.inv()
    q = (Rotation.from_quat(run.q) * turn).as_quat()
    return replace(run, q=q, w=back.apply(run.w), a=back.apply(run.a))


def _frozen(run: ImuRun, rng: np.random.Generator) -> ImuRun:
    k = int(len(run.q) * rng.uniform(0.2, 0.7))
    n = max(int(0.12 * len(run.q)), 150)
    q, w, a = (v.copy() for v in (run.q, run.w, run.a))
    for v in (q, w, a):
        v[k : k + n] = v[k]
    return replace(run, q=q, w=w, a=a, bad_from=float(run.seconds[k]))


def _two_sources(run: ImuRun, rng: np.random.Generator) -> ImuRun:
    other = tilted_by(run, 90.0)
    turn = Rotation.from_euler('x', 90.0, degrees=True).inv()
    some = rng.random(len(run.q)) < 0.5
    some[::2] = ~some[1::2][: len(some[::2])] if len(some) % 2 == 0 else some[::2]
    force = np.where(some[:, None], turn.apply(run.a), run.a)
    return replace(run, q=np.where(some[:, None], other.q, run.q), a=force)


def _axes(run: ImuRun, _: np.random.Generator) -> ImuRun:
    return replace(run, w=run.w[:, [1, 2, 0]])


# What goes wrong: name -> the run with the fault, and the codes of which one must come.
Fault = Callable[[ImuRun, np.random.Generator], ImuRun]
FAULTS: dict[str, tuple[Fault, frozenset[str]]] = {
    'tilt 30': (lambda r, _: tilted_by(r, 30.0), frozenset({'IMU_CONTRADICTION'})),
    'tilt 20': (lambda r, _: tilted_by(r, 20.0, (0.6, 0.8, 0.0)), frozenset({'IMU_CONTRADICTION'})),
    'tilt 10': (lambda r, _: tilted_by(r, 10.0, (0.0, 1.0, 0.0)), frozenset({'IMU_CONTRADICTION'})),
    'tilt 5': (lambda r, _: tilted_by(r, 5.0), frozenset({'IMU_CONTRADICTION'})),
    'stuck': (_stuck, frozenset({'IMU_ROTATION', 'IMU_CONTRADICTION'})),
    'drift 1 deg/s': (_drifting, frozenset({'IMU_CONTRADICTION'})),
    'conjugate': (
        lambda r, _: replace(r, q=r.q * (-1.0, -1.0, -1.0, 1.0)),
        frozenset({'IMU_ROTATION', 'IMU_CONTRADICTION', 'IMU_RATES'}),
    ),
    'order w x y z': (
        lambda r, _: replace(r, q=r.q[:, [3, 0, 1, 2]]),
        frozenset({'IMU_CONTRADICTION', 'IMU_MOUNTING', 'IMU_ROTATION'}),
    ),
    'gyro in deg/s': (lambda r, _: replace(r, w=np.degrees(r.w)), frozenset({'IMU_RATES'})),
    'gyro axes': (_axes, frozenset({'IMU_RATES', 'IMU_ROTATION'})),
    'acceleration in g': (lambda r, _: replace(r, a=r.a / G), frozenset({'IMU_UNIT'})),
    'mounting': (_mounted, frozenset({'IMU_MOUNTING'})),
    'frozen': (_frozen, frozenset({'IMU_FROZEN'})),
    'two sources': (_two_sources, frozenset({'IMU_TWO_SOURCES'})),
}


def lossy(run: ImuRun, seed: int, share: float = 0.3) -> ImuRun:
    """Return a run of which that share of the messages is lost at random."""
    keep = np.random.default_rng(seed).random(len(run.q)) >= share
    keep[0] = True
    return ImuRun(*(v[keep] for v in (run.time, run.stamp, run.q, run.w, run.a, run.frame)))


def jittery(run: ImuRun, seed: int, jitter: float = 0.02) -> ImuRun:
    """Return a run whose receipt and stamps come up to `jitter` (s) late."""
    late = np.random.default_rng(seed).uniform(0.0, jitter * NS, len(run.q))
    time = np.sort(run.time + late.astype(np.int64))
    return replace(run, time=time, stamp=time)


def bursty(run: ImuRun, length: float = 0.1) -> ImuRun:
    """Return a run whose messages come in bursts, stamps at receipt."""
    step = int(length * NS)
    time = -(-run.time // step) * step + np.arange(len(run.q)) % 16 * 1000
    time = np.maximum.accumulate(time)
    return replace(run, time=time, stamp=time)


def shocked(run: ImuRun, seed: int, size: float = 60.0) -> ImuRun:
    """Return a run with a shock of that size (m/s2) in a second, one sample long, any direction."""
    rng = np.random.default_rng(seed)
    a = run.a.copy()
    at = rng.choice(len(a), int(run.seconds[-1]), replace=False)
    a[at] += rng.normal(0.0, size / np.sqrt(3.0), (len(at), 3))
    return replace(run, a=a)
