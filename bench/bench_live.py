"""Live path: CPU a message, latency from publishing to the margin, loss; beside three others.

    nice python -m bench.bench_live [--seconds 12] [--rounds 3] [--moving] [--before CHECKOUT]

Every round starts each listener anew with the same load: an empty raw subscriber on the events
executor (the floor), an empty decoded one, our monitor (margins of every message, its topics at
their default rate, each with a subscriber), a naive monitor, and with --before the monitor of an
earlier version, from a checkout of it. Medians of the rounds, without the first four seconds; the
ratios are to the floor of the same round.
"""

import argparse
import json
import os
import random
import signal
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
RATES = ('200+400', '1000+1000', '5000+5000')
MODES = ('raw', 'decoded', 'monitor', 'naive')
BEFORE = 'before'


def once(
    mode: str, rates: tuple[int, int], seconds: float, before: Path | None, load: str
) -> dict[str, float]:
    """Return figures of one listener under one load."""
    drop = '_ROS_WHEELS_BOOTSTRAP_COMPLETE'
    environment = {key: value for key, value in os.environ.items() if key != drop}
    environment['ROS_DOMAIN_ID'] = str(random.randint(1, 101))
    environment['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'

    def start(script: str, *words: object) -> 'subprocess.Popen[str]':
        command = [sys.executable, str(HERE / script), *map(str, words)]
        return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)

    tree = before if mode == BEFORE and before else HERE.parent
    listener = start('live_listener.py', 'monitor' if mode == BEFORE else mode, tree)
    sender = start('live_load.py', *rates, seconds, load)
    sent = sum(told(sender))
    listener.send_signal(signal.SIGINT)
    heard = told(listener)
    listener.wait()
    sender.wait()
    return figures(heard, sent)


def told(process: 'subprocess.Popen[str]') -> Any:  # noqa: ANN401 - JSON
    """Return the line of JSON that a process prints, decoded."""
    if process.stdout is None:
        sys.exit('expected a process whose output is read')
    return json.loads(process.stdout.readline())


def figures(heard: dict[str, Any], sent: int) -> dict[str, float]:
    """Return CPU (us a message), latency percentiles (ms) and loss (%)."""
    late = sorted(heard['latencies'])
    found = {'cpu_us': heard['cpu'] / len(late) * 1e6, 'taken': heard['taken'] / sent}
    for name, share in (('p50', 0.5), ('p99', 0.99), ('p99.9', 0.999)):
        found[name] = late[min(int(share * len(late)), len(late) - 1)] / 1e6
    return found


def medians(rows: dict[str, list[dict[str, float]]]) -> dict[str, dict[str, float]]:
    """Return the median of each figure of each listener, with its ratio to the first's CPU."""
    floor = next(iter(rows.values()))
    for runs in rows.values():
        for run, low in zip(runs, floor, strict=True):
            run['ratio'] = run['cpu_us'] / low['cpu_us']
    return {
        mode: {key: statistics.median(run[key] for run in runs) for key in runs[0]}
        for mode, runs in rows.items()
    }


def show(table: dict[str, dict[str, float]], rates: tuple[int, int]) -> None:
    """Print one line a listener."""
    print(f'{"":10}{"CPU us":>8}{"x raw":>7}{"core %":>8}', end='')
    print(f'{"p50 ms":>9}{"p99 ms":>9}{"p99.9":>9}{"loss %":>8}')
    for mode, row in table.items():
        core = row['cpu_us'] * row['taken'] * sum(rates) * 1e-4
        lost = 100 * (1 - row['taken'])
        print(f'{mode:10}{row["cpu_us"]:8.1f}{row["ratio"]:7.2f}{core:8.1f}', end='')
        print(f'{row["p50"]:9.3f}{row["p99"]:9.3f}{row["p99.9"]:9.3f}{lost:8.2f}')


def main() -> None:
    """Print a table for each load."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=12.0)
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--modes', nargs='*', default=MODES)
    parser.add_argument('--rates', nargs='*', default=RATES, help='Hz of joints + Hz of the IMU')
    parser.add_argument(
        '--moving', action='store_true', help='joints that swing, an IMU with noise'
    )
    parser.add_argument('--before', type=Path, help='checkout of an earlier version')
    options = parser.parse_args()
    load = 'moving' if options.moving else 'still'
    modes = [*options.modes, *([BEFORE] if options.before else [])]
    for words in options.rates:
        joints, imu = map(int, words.split('+'))
        rows: dict[str, list[dict[str, float]]] = {mode: [] for mode in modes}
        for _ in range(options.rounds):
            for mode, found in rows.items():
                found.append(once(mode, (joints, imu), options.seconds, options.before, load))
        print(
            f'\n{joints} Hz joints + {imu} Hz IMU, {load}, {options.rounds} x {options.seconds:g} s'
        )
        show(medians(rows), (joints, imu))


if __name__ == '__main__':
    main()
