"""Recordings of a PackBot that stands level while its joints do what a test says."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import ugv_acceptance as ugv
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.type_aliases import Floats, Times

NS = 1_000_000_000
EPOCH = 1_748_854_800 * NS + 123_456_789
NAMES = ('turret_joint', 'shoulder_joint', 'elbow_joint', 'flipper_joint')
# The arm folded over the tracks.
FOLDED = np.array([0.1, 1.117, 1.501, np.pi])


@dataclass(frozen=True, slots=True)
class Run:
    """Joint states (n,) of a run: receipt and stamp in ns, positions (n, 4); None is not told.

    `names` are those of the messages; `seconds` is how long the IMU goes on.
    """

    time: Times
    stamp: Times
    position: Floats
    velocity: Floats | None = None
    effort: Floats | None = None
    names: tuple[str, ...] = NAMES
    seconds: float = 10.0

    def changed(self, **other: Any) -> 'Run':
        """Return the run with other columns."""
        return replace(self, **other)


def rest(seconds: float = 10.0, hz: float = 50.0, noise: float = 0.0, seed: int = 1) -> Run:
    """Return a run at rest, with encoder noise (rad) and running stamps."""
    n = int(seconds * hz)
    time = EPOCH + (np.arange(n) * NS / hz).astype(np.int64)
    position = FOLDED + noise * np.random.default_rng(seed).standard_normal((n, 4))
    return Run(time, time, position, seconds=seconds)


def moved(run: Run, joint: int, way: Callable[[Floats], Floats]) -> Run:
    """Return a run with a joint moved by `way` of the seconds from its start."""
    position = run.position.copy()
    position[:, joint] += way((run.stamp - EPOCH) / 1e9)
    return replace(run, position=position)


def write(folder: Path, run: Run) -> Path:
    """Write the recording of a run."""
    messages: list[tuple[int, str, bytes]] = []
    for k, (time, stamp) in enumerate(zip(run.time.tolist(), run.stamp.tolist(), strict=True)):
        rows = [
            () if x is None else x[k].tolist() for x in (run.position, run.velocity, run.effort)
        ]
        messages.append((time, '/joint_states', joint_state_cdr(stamp, '', run.names, *rows)))
    for k in range(int(run.seconds * 100)):
        at = EPOCH + k * NS // 100
        wave = 1e-3 * np.sin(0.1 * k)
        force = (wave, -wave, 9.81 + wave)
        turned = (0.5 * wave, 0.0, 0.0, 1.0)
        cdr = imu_cdr(at, 'imu_link', turned, (wave, 0.0, 0.0), force)
        messages.append((at, '/imu/data', cdr))
    with BagWriter(folder) as bag:
        sensor = Qos(reliability='best_effort')
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState', sensor)
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu', sensor)
        for time, topic, cdr in sorted(messages, key=lambda m: m[0]):
            bag.write(topic, time, cdr)
    return folder


def judged(folder: Path, run: Run, **options: Any) -> ugv.Evaluation:
    """Write a run and evaluate it."""
    return ugv.evaluate(write(folder / f'run_{len(list(folder.iterdir()))}', run), **options)
