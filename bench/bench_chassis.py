"""Brakes, turns, swings and rattle in MuJoCo: which lifts and tips a verdict lets pass.

Then hours of ordinary driving as signals: how often it cries wolf.

    nice python -m bench.bench_chassis [trials] [hours]
"""

import math
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.chassis_trial import (
    CODES,
    GROUNDED,
    KINDS,
    LIFTED,
    START,
    Said,
    Verdict,
    trials,
    tried_all,
)
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.chassis.examination import ChassisExamination
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.samples import Batch, ImuColumns, JointStateColumns
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.type_aliases import Floats

SEED = 2026
# Length (s) of a drive whose posture and load stay as they are, and the rate of its IMU (Hz).
DRIVE, HZ = 600.0, 100.0


def main() -> None:
    """Print both tables."""
    counts = [float(a) for a in sys.argv[1:]]
    count, hours = (counts + [480.0, 6.0][len(counts) :])[:2]
    settings = load().settings
    begin = time.perf_counter()
    verdicts = tried_all(settings, trials(settings.robot, int(count), SEED))
    print(f'{int(count)} trials, seed {SEED}, {time.perf_counter() - begin:.0f} s')
    for name, said in (
        ('200 Hz', [v.fast for v in verdicts]),
        ('100 Hz', [v.slow for v in verdicts]),
    ):
        print(f'\nIMU at {name}')
        print_trials(verdicts, said)
    ordinary(settings, hours)


def print_trials(verdicts: Sequence[Verdict], said: Sequence[Said]) -> None:
    """Print what was said of each kind of trial, by what really happened."""
    print(f'{"":8}{"tips":>6}{"passed":>8}{"danger before":>15}', end='')
    print(f'{"lifts":>7}{"passed":>8}{"nothing":>9}{"objected":>10}{"caution":>9}')
    for kind in KINDS:
        some = [(v, s) for v, s in zip(verdicts, said, strict=True) if v.trial.kind == kind]
        tips = [(v, s) for v, s in some if v.least < 0.0]
        lifts = [(v, s) for v, s in some if v.least >= 0.0 and v.lift > LIFTED]
        nothing = [s for v, s in some if v.least >= 0.0 and v.lift < GROUNDED]
        passed = [sum(s.verdict == 'PASS' for _, s in part) for part in (tips, lifts)]
        before = sum(s.danger <= v.tipped_at for v, s in tips)
        objected = sum(s.chassis != 'PASS' for s in nothing)
        cautions = sum(s.caution < math.inf for s in nothing)
        print(f'{kind:8}{len(tips):6}{passed[0]:8}{before:15}', end='')
        print(f'{len(lifts):7}{passed[1]:8}{len(nothing):9}{objected:10}{cautions:9}')


def ordinary(settings: Settings, hours: float) -> None:
    """Print the alerts of a chassis in hours of ordinary driving, none of which lifts anything."""
    rng, found, statements = np.random.default_rng(SEED), Counter[str](), Counter[str]()
    for _ in range(math.ceil(hours * 3600.0 / DRIVE)):
        batch, load_kg = drive(settings, rng)
        robot = replace(settings.robot, payload=Payload(load_kg))
        evaluator, examination = (
            RecordedEvaluator(replace(settings, robot=robot)),
            ChassisExamination(),
        )
        evaluator.start(START)
        examination.add(evaluator.batch(batch))
        end = START + round(DRIVE * 1e9)
        evaluator.finish(end)
        found.update(
            f'{a.rule.code} {a.rule.level}' for a in evaluator.watch.log if a.rule.code in CODES
        )
        statements.update(o.verdict for o in examination.statement(START, end).objections)
    print(f'\n{hours:g} h of ordinary driving: alerts {dict(found)}, objections {dict(statements)}')


def drive(settings: Settings, rng: np.random.Generator) -> tuple[Batch, float]:
    """Return a drive and its load (kg): starts, brakes, turns, slopes, rattle, spikes and noise."""
    n = round(DRIVE * HZ)
    t = np.arange(n) / HZ
    forward, yaw = _steps(rng, n, 1.5), _steps(rng, n, 0.8)
    pitch, roll = (np.radians(_steps(rng, n, 8.0, slow=2.0)) for _ in range(2))
    push = np.array([np.gradient(forward, t), forward * yaw, np.zeros(n)])
    omega = np.array([np.gradient(roll, t), np.gradient(pitch, t), yaw])
    loud, wave = rng.uniform(0.2, 2.0), 2.0 * np.pi * rng.uniform(10.0, 30.0) * t
    push += loud * np.array([np.sin(wave), np.sin(1.1 * wave + 1.0), 1.5 * np.sin(1.3 * wave)])
    omega += 0.02 * loud * np.array([np.sin(1.2 * wave), np.sin(0.9 * wave), np.zeros(n)])
    spikes = rng.integers(0, n, round(DRIVE / 20.0))
    push[:, spikes] += rng.normal(0.0, 12.0, (3, len(spikes)))
    up = np.array([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
    force = settings.robot.gravity * up + push + rng.normal(0.0, 0.05, (3, n))
    omega += rng.normal(0.0, 0.004, (3, n)) + rng.normal(0.0, 0.003, (3, 1))
    stamp = START + np.round(t * 1e9).astype(np.int64)
    zero = np.zeros(n)
    imu = ImuColumns(
        'imu_link', stamp, stamp, _quaternions(roll, pitch), omega.T, force.T, zero, zero, zero
    )
    q = np.tile([rng.uniform(-0.5, 0.5), 1.6, -2.2, math.pi], (n // 2, 1))
    joints = JointStateColumns(
        settings.robot.joint_names, stamp[::2] + 1, stamp[::2], q, np.zeros_like(q), q[:, :0]
    )
    return Batch([joints], [imu]), float(rng.uniform(0.0, 2.0))


def _steps(rng: np.random.Generator, n: int, most: float, slow: float = 0.25) -> Floats:
    """Return values that go on to another of up to `most` every few seconds, smoothly."""
    hold = rng.integers(round(2 * HZ), round(6 * HZ), n // round(2 * HZ))
    values = np.repeat(rng.uniform(-most, most, len(hold)), hold)[:n]
    width = round(2 * slow * HZ)
    shape = np.hanning(width + 2)
    smooth: Floats = np.convolve(values, shape / shape.sum(), mode='same')
    return smooth


def _quaternions(roll: Floats, pitch: Floats) -> Floats:
    r, p = roll / 2.0, pitch / 2.0
    parts = (
        np.sin(r) * np.cos(p),
        np.cos(r) * np.sin(p),
        -np.sin(r) * np.sin(p),
        np.cos(r) * np.cos(p),
    )
    return np.stack(parts, axis=1)


if __name__ == '__main__':
    main()
