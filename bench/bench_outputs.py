"""Cost of what `evaluate` writes beside its verdict: CSV, annotated copy, report, in CPU time.

Each output is measured in a process of its own and printed as a ratio to `evaluate` of the same
recording in the same round: what the command costs with it, as a multiple of what it costs without.
The recordings are those of bench_evaluate; that of the report has as many alerts as a margin gives
that swings about its limit three times a second. With `--before` an older checkout is measured in
the same rounds.

    python -m bench.bench_outputs
    python -m bench.bench_outputs csv --minutes 60 --rounds 1
    python -m bench.bench_outputs annotate report --before ../before
"""

import argparse
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from bench.bench_reading import T0, make
from ugv_acceptance.bag.annotated import write_annotated
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.recording import Recording, open_recording
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.config import Config, load
from ugv_acceptance.config.identity import PARTS
from ugv_acceptance.evaluation.downsampling import StripRecorder
from ugv_acceptance.offline.annotation import Annotation
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.offline.evaluation import Evaluation
from ugv_acceptance.offline.judge import Options
from ugv_acceptance.offline.output import CsvSink
from ugv_acceptance.report.acceptance import acceptance_page

Stage = Callable[[Recording, Config, Path], None]
ROOT = Path(__file__).resolve().parents[1]
# Minutes of the recording that each output is made of.
MINUTES = {'csv': 60.0, 'annotate': 10.0, 'report': 26.0}
# The tilt of the recording with many alerts: its largest (rad), swings and messages a second.
TILT, SWINGS, RATE = 0.5, 3.0, 30
# Rounds, but of recordings from LONG minutes on only one: they take minutes themselves.
ROUNDS, LONG = 3, 30.0


def restless(folder: Path, seconds: float) -> None:
    """Record a robot that swings past its warning limit of tilt, without a gyro."""
    names = [joint.topic_name for joint in load().settings.joints]
    still = [0.0] * len(names)
    q = [0.0, 1.2, -1.2, 0.0]
    spread = ((1e-4,) * 9, (-1.0,) * 9, (1e-3,) * 9)
    with BagWriter(folder) as writer:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        for k in range(round(seconds * RATE)):
            now = T0 + k * (10**9 // RATE)
            roll = TILT * (0.5 - 0.5 * math.cos(2.0 * math.pi * SWINGS * k / RATE))
            turn = (math.sin(roll / 2.0), 0.0, 0.0, math.cos(roll / 2.0))
            down = (0.0, 9.81 * math.sin(roll), 9.81 * math.cos(roll))
            joints = joint_state_cdr(now, '', names, q, still, still)
            writer.write('/joint_states', now, joints)
            imu = imu_cdr(now, 'imu_link', turn, (0.0, 0.0, 0.0), down, spread)
            writer.write('/imu/data', now + 10**6, imu)


def hasty(config: Config) -> Config:
    """Return a configuration whose alerts of margins are raised and cleared without delay."""
    delays = replace(config.settings.delays, off=0.0, tip_on=0.0, tip_off=0.0, torque_on=0.0)
    return replace(config, settings=replace(config.settings, delays=delays))


def alone(recording: Recording, config: Config, _: Path) -> None:
    """Evaluate, and write nothing."""
    evaluate(recording, config=config)


def csv(recording: Recording, config: Config, folder: Path) -> None:
    """Evaluate with --csv."""
    with CsvSink(folder / 'margins.csv', config.settings, recording.start_ns) as sink:
        evaluate(recording, config=config, options=Options(tuple(sink.sinks), detail=True))


def annotate(recording: Recording, config: Config, folder: Path) -> None:
    """Evaluate with --annotate."""
    told = Annotation(evaluate(recording, config=config))
    write_annotated(folder / 'judged.mcap', recording.bag, told.types, told.said())


def report(recording: Recording, config: Config, folder: Path) -> None:
    """Evaluate with --report."""
    recorder = StripRecorder(config.settings, recording.start_ns)
    found: Evaluation = evaluate(recording, config=config, options=Options((recorder.add,)))
    page = acceptance_page(found.result, recorder.strips(), config.settings, PARTS)
    (folder / 'report.html').write_text(page, encoding='utf-8')


STAGES: dict[str, Stage] = {'csv': csv, 'annotate': annotate, 'report': report}


def measure(name: str, of: str, folder: Path) -> None:
    """Run one stage on the recording made for output `of`; print seconds of CPU and MB as JSON."""
    recording, config = open_recording(folder), load()
    if of == 'report':
        config = hasty(config)
    stage = STAGES.get(name, alone)
    with tempfile.TemporaryDirectory() as scratch:
        begun = time.process_time()
        stage(recording, config, Path(scratch))
        cpu = time.process_time() - begun
        size = sum(path.stat().st_size for path in Path(scratch).iterdir())
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({'cpu': cpu, 'peak': peak, 'size': size}))


def measured(name: str, of: str, folder: Path, code: Path) -> dict[str, float]:
    """Return what a stage costs in a process of its own with the package in the folder `code`."""
    command = [sys.executable, __file__, '--stage', name, '--of', of, '--bag', str(folder)]
    path = os.pathsep.join((str(code), str(ROOT)))
    env = {**os.environ, 'PYTHONPATH': path, 'OPENBLAS_NUM_THREADS': '1', 'MPLBACKEND': 'agg'}
    done = subprocess.run(command, capture_output=True, check=True, env=env, cwd=code)
    row: dict[str, float] = json.loads(done.stdout)
    return row


def rounds(name: str, folder: Path, codes: dict[str, Path], count: int) -> Iterator[str]:
    """Yield a line for each version: medians of some rounds, in each of which all were measured."""
    found: dict[str, list[tuple[dict[str, float], dict[str, float]]]] = {c: [] for c in codes}
    for _ in range(count):
        for code, place in codes.items():
            found[code].append(
                (measured('alone', name, folder, place), measured(name, name, folder, place))
            )
    for code, pairs in found.items():
        ratio = statistics.median(made['cpu'] / least['cpu'] for least, made in pairs)
        least, made = (statistics.median(one[k]['cpu'] for one in pairs) for k in (0, 1))
        peaks = [statistics.median(one[k]['peak'] for one in pairs) for k in (0, 1)]
        yield (
            f'{name:9} {code:7} {least:9.2f} {made:9.2f} {ratio:6.2f} {made - least:9.2f} '
            f'{peaks[0]:7.0f} {peaks[1]:7.0f} {pairs[0][1]["size"] / 1e6:9.1f}'
        )


def main() -> None:
    """Make the recordings that are needed and print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('outputs', nargs='*', help=f'of {", ".join(STAGES)}; all by default')
    parser.add_argument('--minutes', type=float, help='length of the recording')
    parser.add_argument('--rounds', type=int)
    parser.add_argument('--before', type=Path, help='an older checkout, measured beside this one')
    parser.add_argument('--stage', help='run one stage in this process')
    parser.add_argument('--of', help='the output whose recording it is')
    parser.add_argument('--bag', type=Path)
    asked = parser.parse_args()
    if asked.stage:
        measure(asked.stage, asked.of, asked.bag)
        return
    if unknown := set(asked.outputs) - set(STAGES):
        parser.error(f'expected outputs of {", ".join(STAGES)}, got {", ".join(unknown)}')
    codes = {'now': ROOT} | ({'before': asked.before.resolve()} if asked.before else {})
    print(f'{"":17} {"evaluate":>9} {"with it":>9} {"ratio":>6} {"it alone":>9}', end='')
    print(f' {"MB":>7} {"MB with":>7} {"MB written":>9}')
    with tempfile.TemporaryDirectory() as scratch:
        for name in asked.outputs or STAGES:
            minutes = asked.minutes or MINUTES[name]
            folder = Path(scratch) / f'{name}_run'
            if name == 'report':
                restless(folder, 60.0 * minutes)
            else:
                make(folder, 60.0 * minutes, 'zstd', heavy=False)
            count = asked.rounds or (1 if minutes >= LONG else ROUNDS)
            for line in rounds(name, folder, codes, count):
                print(line, flush=True)


if __name__ == '__main__':
    main()
