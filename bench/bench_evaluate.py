"""Cost of judging a recording: CPU per message and peak memory, beside the cost of reading alone.

Makes (or takes) recordings of 6 joints at 200 Hz and an IMU at 400 Hz, then measures each stage
in a process of its own: unpacking alone (the floor), columns, margins and alerts, the whole of
`evaluate`. One run prints all ratios. `python -m bench.bench_evaluate --minutes 10 60`

`--start` measures whole processes instead: verbs with a short recording, beside a Python that does
nothing and one that imports NumPy; with `--before CHECKOUT` an earlier version in the same rounds.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
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


# Whole processes: what is measured -> Python's code, and the words after it.
VERB = 'from ugv_acceptance.cli import main; main()'
NODE = 'import ugv_acceptance.cli.node_programs, ugv_acceptance.nodes.monitor.node'
PROCESSES: dict[str, tuple[str, str]] = {
    'pass': ('pass', ''),
    'import numpy': ('import numpy', ''),
    '--version': (VERB, '--version'),
    '--help': (VERB, '--help'),
    'evaluate --help': (VERB, 'evaluate --help'),
    'TAB after ev': (VERB, ''),
    'model': (VERB, 'model'),
    'check': (VERB, 'check test/cli/little_motion.yaml'),
    'info': (VERB, 'info {bag}'),
    'doctor': (VERB, 'doctor {bag}'),
    'evaluate': (VERB, 'evaluate {bag}'),
    'watch': (VERB, 'watch {bag}'),
    'monitor, imported': (NODE, ''),
}
TAB = {
    '_UGV_ACCEPTANCE_COMPLETE': 'complete_bash',
    'COMP_WORDS': 'ugv-acceptance ev',
    'COMP_CWORD': '1',
}


def processes(bag: Path, rounds: int, before: Path | None) -> None:
    """Print the CPU of whole processes, in turn, with compiled modules at hand."""
    versions = [ROOT, *([before.resolve()] if before else [])]
    found: dict[tuple[Path, str], list[float]] = {}
    with tempfile.TemporaryDirectory() as cache:
        for turn in range(rounds + 1):
            for name in PROCESSES:
                for version in versions:
                    cpu = _cpu(name, bag.resolve(), version, cache)
                    if turn:  # the first one compiles
                        found.setdefault((version, name), []).append(cpu)
    least = min(found[ROOT, 'import numpy'])
    print(f'{bag.name}, best of {rounds}')
    print(f'{"process":20} {"CPU s":>8} {"x numpy":>8}', *(['before  x numpy'] if before else []))
    for name in PROCESSES:
        some = (min(found[version, name]) for version in versions)
        print(f'{name:20}', *(f'{cpu:8.3f} {cpu / least:8.1f}' for cpu in some))


def _cpu(name: str, bag: Path, version: Path, cache: str) -> float:
    """Return the CPU (s) of a process of a version, whose modules are found by its folder."""
    code, words = PROCESSES[name]
    env = {**os.environ, 'OPENBLAS_NUM_THREADS': '1', 'PYTHONPYCACHEPREFIX': cache}
    env |= {'PYTHONPATH': str(version), **(TAB if name.startswith('TAB') else {})}
    env.pop('PYTHONDONTWRITEBYTECODE', None)
    command = [sys.executable, '-c', code, *words.format(bag=bag).split()]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdout=quiet, stderr=quiet, env=env, cwd=version) as child:
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
    parser.add_argument(
        '--before', type=Path, help='with --start: the checkout of an earlier version'
    )
    parser.add_argument('--stage', choices=STAGES, help='run one stage on --bag')
    arguments = parser.parse_args()
    if arguments.stage:
        measure(arguments.stage, arguments.bag)
    elif arguments.start:
        short = ROOT / 'bags' / 'packbot_pass'
        processes(arguments.bag or short, arguments.rounds, arguments.before)
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
