"""Cost of judging a recording: CPU per message and peak memory, beside the cost of reading alone.

Makes (or takes) recordings of 6 joints at 200 Hz and an IMU at 400 Hz, then measures each stage
in a process of its own: unpacking alone (the floor), columns, margins and alerts, the whole of
`evaluate`. One run prints all ratios. `python -m bench.bench_evaluate --minutes 10 60`

`--start` measures whole processes instead: `ugv-acceptance evaluate` of a short recording beside a
Python that does nothing, one that imports NumPy, and one that imports SciPy's special functions.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from bench.bench_reading import floor, make
from ugv_acceptance.bag.reader import choose_topics, open_bag
from ugv_acceptance.bag.recording import open_recording
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.offline.evaluate import evaluate

Stage = Callable[[], object]
LIVE_MESSAGES = 40_000
ROOT = Path(__file__).resolve().parents[1]


def unpack(folder: Path) -> Stage:
    """Read and unpack every chunk, nothing else."""
    run: Stage = floor(next(folder.glob('*.mcap')))
    return run


def columns(folder: Path) -> Stage:
    """Decode every message into columns."""
    bag = open_bag(folder)
    topics = choose_topics(bag)
    return lambda: sum(1 for _ in bag.batches(topics))


def margins(folder: Path) -> Stage:
    """Give batches as they are read to the evaluator: margins and alerts, no criteria."""
    bag, settings = open_bag(folder), load(None).settings
    topics = choose_topics(bag)

    def run() -> object:
        evaluator = RecordedEvaluator(settings)
        evaluator.start(bag.start_ns)
        for batch in bag.batches(topics):
            evaluator.batch(batch)
        return evaluator

    return run


def whole(folder: Path) -> Stage:
    """Do all that `evaluate` does except printing: hash, margins, alerts, criteria, summary."""
    recording, config = open_recording(folder), load()
    return lambda: evaluate(recording, config=config)


def live(_: Path) -> Stage:
    """Give single messages to the live evaluator, as the monitor does."""
    settings = load(None).settings
    names = tuple(joint.topic_name for joint in settings.joints)
    zero = [0.0] * len(names)

    def run() -> object:
        evaluator = LiveEvaluator(settings)
        evaluator.start(0)
        for k in range(LIVE_MESSAGES // 2):
            now = k * 1_000_000
            q = [0.1, 1.0 + 1e-5 * (k % 1000), -0.5, 3.0, *zero][: len(names)]
            evaluator.joint_state(now, now, names, q, zero, zero)
            tilt = (0.01, 0.0, 0.0, 0.99995)
            evaluator.imu(now + 500_000, now, tilt, 0.01, (0.0, 0.0, 0.0), (0.0, 0.2, 9.81))
        return evaluator

    return run


STAGES = {'unpack': unpack, 'columns': columns, 'margins': margins, 'whole': whole, 'live': live}


def measure(name: str, folder: Path) -> None:
    """Run one stage in this process and print CPU and wall seconds and peak memory as JSON."""
    run = STAGES[name](folder)
    cpu, wall = time.process_time(), time.perf_counter()
    run()
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({'cpu': cpu, 'wall': wall, 'peak': peak}))


def best_of(name: str, folder: Path, rounds: int) -> dict[str, float]:
    """Return the round with the least CPU time."""
    command = [sys.executable, __file__, '--stage', name, '--bag', str(folder)]
    # A version named by PYTHONPATH comes before this one; threads as the command line sets them.
    path = os.pathsep.join(filter(None, (os.environ.get('PYTHONPATH'), str(ROOT))))
    env = {**os.environ, 'PYTHONPATH': path, 'OPENBLAS_NUM_THREADS': '1'}
    rows = [
        json.loads(subprocess.run(command, capture_output=True, check=True, env=env).stdout)
        for _ in range(rounds)
    ]
    best: dict[str, float] = min(rows, key=lambda row: row['cpu'])
    return best


def table(folder: Path, rounds: int) -> None:
    """Print all stages of one recording."""
    messages = sum(topic.count for topic in open_bag(folder).topics.values())
    print(f'\n{folder.name}: {messages:,} messages, best of {rounds}')
    print(f'{"stage":8} {"CPU s":>8} {"wall s":>8} {"us a message":>13} {"x floor":>8} {"MB":>6}')
    least = 0.0
    for name in STAGES:
        row = best_of(name, folder, rounds)
        least = least or row['cpu']
        count = LIVE_MESSAGES if name == 'live' else messages
        ratio = '' if name == 'live' else f'{row["cpu"] / least:.1f}'
        print(
            f'{name:8} {row["cpu"]:8.2f} {row["wall"]:8.2f} {row["cpu"] / count * 1e6:13.2f} '
            f'{ratio:>8} {row["peak"]:6.0f}'
        )


def processes(bag: Path, rounds: int) -> None:
    """Print the CPU of whole processes, in turn, with compiled modules at hand."""
    verb = 'from ugv_acceptance.cli import main; main()'
    commands = {
        'pass': ('pass',),
        'import numpy': ('import numpy',),
        'import scipy.special': ('import scipy.special',),
        '--version': (verb, '--version'),
        'evaluate': (verb, 'evaluate', str(bag)),
    }
    found: dict[str, list[float]] = {name: [] for name in commands}
    with tempfile.TemporaryDirectory() as cache:
        env = {**os.environ, 'OPENBLAS_NUM_THREADS': '1', 'PYTHONPYCACHEPREFIX': cache}
        env.pop('PYTHONDONTWRITEBYTECODE', None)
        for turn in range(rounds + 1):
            for name, words in commands.items():
                cpu = _cpu((sys.executable, '-c', *words), env)
                if turn:  # the first one compiles
                    found[name].append(cpu)
    least = min(found['import numpy'])
    print(f'{bag.name}, best of {rounds}')
    print(f'{"process":20} {"CPU s":>8} {"x numpy":>8}')
    for name, some in found.items():
        print(f'{name:20} {min(some):8.3f} {min(some) / least:8.1f}')


def _cpu(command: Sequence[str], env: dict[str, str]) -> float:
    """Return the CPU (s) of a process."""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, env=env) as child:
        _, _, usage = os.wait4(child.pid, 0)
        child.returncode = 0
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    """Make the recordings asked for and print a table of each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--minutes', type=float, nargs='*', default=[10.0])
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--bag', type=Path, help='a recording made before')
    parser.add_argument('--start', action='store_true', help='measure whole processes')
    parser.add_argument('--stage', choices=STAGES, help='run one stage on --bag')
    arguments = parser.parse_args()
    if arguments.stage:
        measure(arguments.stage, arguments.bag)
    elif arguments.start:
        short = ROOT / 'bags' / 'packbot_pass'
        processes(arguments.bag or short, arguments.rounds)
    elif arguments.bag:
        table(arguments.bag, arguments.rounds)
    else:
        with tempfile.TemporaryDirectory() as scratch:
            for minutes in arguments.minutes:
                folder = Path(scratch) / f'minutes_{minutes:g}'
                make(folder, 60.0 * minutes, 'zstd', heavy=False)
                table(folder, arguments.rounds)


if __name__ == '__main__':
    main()
