"""A chassis in motion: live and recorded raise the same alerts, whatever it does."""

import math
from collections.abc import Callable
from random import Random

import hypothesis
import numpy as np
from evaluation.streams import MS, T0, Imu, Joints, Message, S, live, settings, tilted, upright
from evaluation.test_live_equals_recorded import compare
from hypothesis import example, given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.chassis.filter_columns import recursion
from ugv_acceptance.evaluation.settings import Delays, ImuInput
from ugv_acceptance.model.robot import IDENTITY, Matrix

YAWED = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def rough(seed: int, seconds: float, *, faults: bool) -> list[Message]:
    """Return a run of brakes, turns and shocks, some of which tip the robot, at random."""
    random, found = Random(seed), []
    pushes = [_pulse(random, 12.0, seconds) for _ in range(4)]
    turns = [_pulse(random, 4.0, seconds) for _ in range(4)]
    period = random.choice([5, 10, 10, 16, 20, 30])
    pitch, arm = random.uniform(-0.3, 0.3), random.uniform(-1.0, 0.2)
    for k in range(int(seconds * 1000 / period)):
        t = k * period / 1000
        push = [sum(p(t)[axis] for p in pushes) for axis in range(2)]
        rate = [sum(p(t)[axis] for p in turns) for axis in range(2)]
        pitch += rate[1] * period / 1000
        lean = tilted(0.0, max(-1.2, min(1.2, pitch)))
        up = upright(lean)
        felt = (up[0] + push[0], up[1] + push[1], up[2] + random.gauss(0.0, 0.3))
        time = T0 + MS + k * period * MS
        stamp, gyro = time, 0.0
        omega: tuple[float, ...] = (rate[0], rate[1], 0.01 + random.gauss(0.0, 0.02))
        if faults and random.random() < 0.03:
            stamp = random.choice([0, time - S, time + 7 * MS])
            gyro = random.choice([0.0, -1.0])
            omega = random.choice([omega, (0.0, 0.0, 0.0), (math.nan, 0.0, 0.0)])
        if not (faults and random.random() < 0.05):
            found.append(Imu(time, lean, omega, felt, 0.0, stamp, omega_covariance_0=gyro))
    joints = [
        Joints(T0 + k * 20 * MS, position=(arm + 0.1 * math.sin(k / 30), 0.1 * math.sin(k / 9)))
        for k in range(int(seconds * 50))
        if not (faults and random.random() < 0.05)
    ]
    return sorted([*found, *joints], key=lambda m: m.time)


def _pulse(random: Random, size: float, seconds: float) -> Callable[[float], tuple[float, float]]:
    begin, length = random.uniform(0.6, seconds), random.uniform(0.02, 0.8)
    x, y = random.uniform(-size, size), random.uniform(-size, size)
    return lambda t: (x, y) if begin <= t < begin + length else (0.0, 0.0)


@hypothesis.settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 10**9),
    st.lists(st.integers(0, 900), max_size=6),
    st.lists(st.integers(0, 6000), max_size=10),
    st.booleans(),
    st.sampled_from([IDENTITY, YAWED]),
)
# An excess that settles by less and less.
@example(seed=14711, cuts=[], ticks=[], faults=False, mounting=YAWED)
def test_a_rough_run_gives_the_same_alerts(
    seed: int,
    cuts: list[int],
    ticks: list[int],
    faults: bool,  # noqa: FBT001 - drawn
    mounting: Matrix,
) -> None:
    """Brakes, turns, lifts, gaps, bad stamps and lost messages: the same alerts in any batches."""
    imu = ImuInput(position=(0.1, 0.05, 0.2), mounting=mounting)
    told = settings(imu, Delays(tip_on=0.02, torque_on=0.03, off=0.1))
    compare(told, rough(seed, 4.0, faults=faults), cuts, [T0 + t * MS for t in ticks], S)


def test_rough_runs_raise_every_alert_of_a_chassis() -> None:
    """The runs above are rough enough for each of the alerts, and calm enough for none."""
    told, kinds, silent = settings(), set(), 0
    for seed in range(60):
        _, alerts = live(told, rough(seed, 4.0, faults=False), T0 + 5 * S)
        mine = {(a.rule.code, a.rule.level) for a in alerts if a.rule.code in CODES}
        kinds |= mine
        silent += not mine
    assert {code for code, _ in kinds} == CODES
    assert ('TIP_MOVING', 2) in kinds
    assert silent > 2


CODES = {'TIP_MOVING', 'ACCELERATION', 'TRACK_LIFT'}


@given(st.integers(0, 10**9), st.integers(1, 400))
def test_a_recursion_in_pieces_is_the_recursion(seed: int, n: int) -> None:
    """Cut into pieces that run side by side, a filter gives what it gives one by one."""
    rng = np.random.default_rng(seed)
    keep, x, y = rng.uniform(0.0, 1.0, n), rng.normal(size=(3, n)), rng.normal(size=3)
    keep[rng.random(n) < 0.1] = 0.0
    found = recursion(keep, x, y)
    for k in range(n):
        y = x[:, k] + keep[k] * (y - x[:, k])
        np.testing.assert_allclose(found[:, k], y, rtol=1e-12, atol=1e-12)
