"""Simulate a fleet's acceptance campaign: `python -m bench.make_fleet FOLDER`.

Half of the runs have firmware fw1, half fw2, which fails more rarely; a run an hour, short. Among
them are a copy, a file that breaks off and one that is no recording. The same seed gives the same
messages. Only the times of receipt say when a run was: its stamps do not, of which CLOCK warns.
Prints how many runs are of each kind.
"""

import argparse
import shutil
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.config import load
from ugv_acceptance.run.catalogue import case_of
from ugv_acceptance.run.messages import TYPES, messages, topics_of
from ugv_acceptance.run.record import QOS, play
from ugv_acceptance.simulation.corruption import Corruption, overload

HOUR = 3_600_000_000_000
# What may go wrong, equally often: scenario, and how many seconds of it it takes.
TROUBLE = (
    ('tilt', None),
    ('swing', None),
    ('reach', None),
    ('overreach', None),
    ('fault-dead', 10.0),
    ('fault-nan', 10.0),
)
# Share of runs in trouble, a firmware.
SHARES = {'fw1': 0.2, 'fw2': 0.06}


@dataclass(frozen=True, slots=True)
class Run:
    """A run to make: its folder below the fleet's, scenario, length (s), seed and start (ns)."""

    folder: str
    scenario: str
    seconds: float | None
    seed: int
    start: int


def runs(count: int, seconds: float, seed: int) -> Iterator[Run]:
    """Yield `count` runs; those without trouble are quiet work of `seconds`."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        firmware = 'fw1' if k < count // 2 else 'fw2'
        troubled = rng.random() < SHARES[firmware]
        kind, length = TROUBLE[rng.integers(len(TROUBLE))] if troubled else ('work', seconds)
        yield Run(f'{firmware}/run_{k:04d}', kind, length, seed + k, k * HOUR)


def make(made: Run, into: Path) -> str:
    """Simulate a run and record it; return its scenario."""
    config = load()
    case = case_of(made.scenario, config.settings.robot, made.seed, made.seconds)
    corruption = Corruption(case.faults, config.settings.robot.joint_names)
    found = [
        message
        for k, part in enumerate(play(config, case, made.seed))
        for message in messages(config, part, corruption, made.seed + k, overload(case.faults))
    ]
    folder = into / made.folder
    folder.parent.mkdir(parents=True, exist_ok=True)
    with BagWriter(folder) as bag:
        for source, topic in topics_of(config).items():
            bag.add_topic(topic, TYPES[source], QOS[source])
        for topic, time, cdr in sorted(found, key=lambda message: message[1]):
            bag.write(topic, made.start + time, cdr)
    return made.scenario


def spoil(into: Path, names: list[str]) -> None:
    """Add the faults of real fleets: a copy, a truncated file, and one that is no recording."""
    shutil.copytree(into / names[0], into / 'copies' / 'run_0000_again')
    whole = next((into / names[-1]).glob('*.mcap')).read_bytes()
    broken = into / 'damaged'
    broken.mkdir()
    (broken / 'breaks_off.mcap').write_bytes(whole[: len(whole) // 2])
    (broken / 'no_recording.mcap').write_bytes(b'not a recording')


def main() -> None:
    """Make the fleet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folder', type=Path, help='a new folder')
    parser.add_argument('--runs', type=int, default=220)
    parser.add_argument('--seconds', type=float, default=10.0, help='of a run of quiet work')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--workers', type=int, default=2)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True)
    planned = list(runs(arguments.runs, arguments.seconds, arguments.seed))
    with ProcessPoolExecutor(arguments.workers) as pool:
        kinds = Counter(pool.map(partial(make, into=arguments.folder), planned))
    spoil(arguments.folder, [run.folder for run in planned])
    for kind, count in sorted(kinds.items()):
        print(f'{count:5d} {kind}')


if __name__ == '__main__':
    main()
