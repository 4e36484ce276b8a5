"""Every offline verb for every robot: works, or says in one line why not; never a traceback.

    python -m bench.robot_verbs PATH... [--configs FOLDER] [--only ROBOT] [--out FOLDER]

A path is a URDF, a folder with URDFs, or a robot's YAML. The configuration of a URDF is the file of
its name in --configs, else what `init` writes for it. Each robot gets a recording: it stands still,
level, its joints where they start. Every verb runs as a process. The exit code is 1 if any ended in
a traceback, refused in more than one line, or ended with a code that no verb has.
"""

import argparse
import os
import select
import subprocess
import sys
import tempfile
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.cli import VERBS
from ugv_acceptance.config import Config, load
from ugv_acceptance.model.robot import Joint

START, SECONDS, PERIOD = 1_748_854_800_000_000_000, 4.0, 0.02
PATIENCE = 300.0  # s
MAPS = ('torque', 'rollover', 'payload', 'drag')
# Verbs whose exit code is a verdict.
JUDGE = ('evaluate', 'verify', 'campaign', 'run', 'init')


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a verb ended: its exit code and the last line it printed on standard error, else out."""

    verb: str
    code: int
    said: str
    lines: int
    traceback: bool

    @property
    def good(self) -> bool:
        """Whether it did its work, or refused it in one line."""
        done = (0, 1, 3) if self.verb in JUDGE else (0,)
        return not self.traceback and (self.code in done or self.refused)

    @property
    def refused(self) -> bool:
        """Whether it ended with one line that says why not."""
        return self.code == 2 and self.lines == 1

    @property
    def word(self) -> str:
        """What stands in the table."""
        if not self.good:
            return f'EXIT {self.code}'
        return 'says no' if self.code == 2 else 'works' if self.code == 0 else f'works {self.code}'


@dataclass(slots=True)
class Robot:
    """A robot on trial: its configuration, and what each verb did."""

    name: str
    path: Path
    folder: Path
    did: dict[str, Outcome] = field(default_factory=dict)


def started(joint: Joint) -> float:
    """Return where a joint starts: at 0, in the middle of a range without it."""
    low, high = joint.travel()
    return 0.0 if low <= 0.0 <= high else (low + high) / 2.0


def record(config: Config, folder: Path) -> None:
    """Record the robot standing still on level ground, with its joints where they start."""
    settings = config.settings
    robot, topics = settings.robot, config.topics
    model = [started(robot.joint(name)) for name in robot.joint_names]
    told = [(q - j.offset) / j.sign for q, j in zip(model, settings.joints, strict=True)]
    names = [j.topic_name for j in settings.joints]
    mounting = np.array(settings.imu.mounting)
    turned = Rotation.from_matrix(mounting).as_quat()
    up = mounting.T @ (0.0, 0.0, robot.gravity)
    rng = np.random.default_rng(1)
    with BagWriter(folder) as bag:
        for topic in (topics.joint_states, topics.imu):
            if topic.used:
                bag.add_topic(f'/{topic.name.lstrip("/")}', topic.type)
        for time in np.arange(0.0, SECONDS, PERIOD).tolist():
            stamp = START + round(time * 1e9)
            if topics.joint_states.used:
                data = joint_state_cdr(stamp, '', names, told, [0.0] * len(names))
                bag.write(f'/{topics.joint_states.name.lstrip("/")}', stamp, data)
            if topics.imu.used:
                rate, force = rng.normal(0.0, 1e-3, 3), up + rng.normal(0.0, 1e-2, 3)
                frame = topics.imu.frame_id or 'imu_link'
                data = imu_cdr(stamp, frame, turned, rate, force)
                bag.write(f'/{topics.imu.name.lstrip("/")}', stamp, data)


def environment() -> dict[str, str]:
    """Return the environment of a verb; a wheel's own mark would make it load wrong libraries."""
    kept = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    return kept | {'COLUMNS': '160', 'TERM': 'dumb', 'NO_COLOR': '1'}


def command(*words: object) -> list[str]:
    """Return the command line of a verb."""
    code = 'from ugv_acceptance.cli import main; main()'
    return [sys.executable, '-c', code, *map(str, words)]


def did(folder: Path, *words: object) -> Outcome:
    """Run a verb to its end."""
    done = subprocess.run(
        command(*words), cwd=folder, env=environment(), timeout=PATIENCE,
        capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    return outcome(str(words[0]), done.returncode, done.stdout, done.stderr)


def outcome(verb: str, code: int, out: str, err: str) -> Outcome:
    """Return how a verb ended."""
    told = [line for line in err.splitlines() if line.strip() and 'warning:' not in line]
    last = (told or out.strip().splitlines() or [''])[-1].strip()
    return Outcome(verb, code, last, len(told), 'Traceback' in err or 'Traceback' in out)


def page(folder: Path, *words: object) -> Outcome:
    """Serve the console's page, fetch it and its first frame, and end it."""
    with subprocess.Popen(
        command(*words, '--port', '0'), cwd=folder, env=environment(), text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as process:  # fmt: skip
        assert process.stdout is not None  # noqa: S101 - it is a pipe
        ready = select.select([process.stdout], [], [], PATIENCE)[0]
        line = process.stdout.readline() if ready else ''
        address = next((word for word in line.split() if word.startswith('http')), '')
        if address:
            with urllib.request.urlopen(address, timeout=10.0) as answer:  # noqa: S310 - our own page
                line = f'{line.strip()}: {len(answer.read())} bytes'
        process.terminate()
        out, err = process.communicate(timeout=PATIENCE)
    return outcome('console', process.returncode, line + out, err)


def verbs(robot: Robot) -> None:
    """Run every verb for a robot."""
    of, folder = ('--config', robot.path), robot.folder
    robot.did['model'] = did(folder, 'model', *of)
    bag = folder / 'runs' / 'still'
    try:
        record(load(robot.path), bag)
    except AcceptanceError as error:
        robot.did['record'] = Outcome('record', 2, str(error), 1, traceback=False)
    else:
        papers = ('--json', 'r.json', '--report', 'r.html', '--csv', 'm.csv')
        robot.did['evaluate'] = did(folder, 'evaluate', bag, *of, *papers)
        robot.did['verify'] = did(folder, 'verify', 'r.json')
        robot.did['campaign'] = did(folder, 'campaign', 'runs', *of, '--out', 'campaign')
        robot.did['console'] = page(folder, 'console', bag, *of)
        robot.did['watch'] = did(folder, 'watch', bag, *of)
    for kind in MAPS:
        words = ('--steps', '61', '--out', f'{kind}.svg')
        robot.did[f'map {kind}'] = did(folder, 'map', kind, *of, *words)
    robot.did['speed'] = did(folder, 'speed', *of)
    robot.did['risk'] = did(folder, 'risk', *of, '--samples', '2000')
    robot.did['plan'] = did(folder, 'plan', *of, '-o', 'plan.yaml', '--card', 'card.html')
    robot.did['run'] = did(folder, 'run', '--sim', '--fast', *of, '--out', 'run')
    robot.did['simulate'] = did(folder, 'simulate', *of, '-s', '3', '--bag', 'simulated')
    robot.did['paper'] = did(folder, 'paper', *of, '--no-simulate')


def robots(paths: list[Path], configs: Path | None, out: Path) -> list[Robot]:
    """Return the robots of all paths, with a configuration each."""
    found = []
    for path in [p for given in paths for p in files_of(given)]:
        name = path.parent.name if path.stem == 'robot' else path.stem
        robot = Robot(name, path, out / name)
        robot.folder.mkdir(parents=True)
        if path.suffix == '.urdf':
            robot.path = (configs or out) / f'{name}.yaml'
            if not robot.path.is_file():
                robot.path = robot.folder / f'{name}.yaml'
                begin(robot, path)
        found.append(robot)
    return found


def begin(robot: Robot, urdf: Path) -> None:
    """Write the configuration by `init`.

    Where the URDF alone does not tell what the robot stands on, a recording of its joints helps.
    """
    words = ('-o', robot.path, '--overwrite')
    robot.did['init'] = did(robot.folder, 'init', urdf, *words)
    if robot.path.is_file() and not load(robot.path).settings.robot.contacts:
        bare = robot.folder / 'bare.yaml'
        bare.write_text(f'robot: {{name: {robot.name}}}\nurdf: {urdf}\n', 'utf-8')
        bag = robot.folder / 'told'
        record(load(bare), bag)
        robot.did['init'] = did(robot.folder, 'init', urdf, bag, *words)


def files_of(path: Path) -> list[Path]:
    """Return a file itself, or every URDF below a folder."""
    return sorted(path.rglob('*.urdf')) if path.is_dir() else [path.absolute()]


def table(found: list[Robot]) -> None:
    """Print robots by verbs, then each refusal and fault."""
    names = list(dict.fromkeys(verb for robot in found for verb in robot.did))
    wide = max(map(len, names))
    print(' ' * wide, *(f'{robot.name:>10.10}' for robot in found))
    for verb in names:
        words = [robot.did[verb].word if verb in robot.did else '' for robot in found]
        print(f'{verb:{wide}}', *(f'{word:>10}' for word in words))
    for verb in names:
        for robot in found:
            end = robot.did.get(verb)
            if end is not None and (end.code == 2 or not end.good):
                print(f'{robot.name} {verb}: {end.word}: {end.said}')


def main() -> int:
    """Run everything; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else '')
    parser.add_argument('paths', nargs='+', type=Path)
    parser.add_argument('--configs', type=Path)
    parser.add_argument('--only', action='append', default=[])
    parser.add_argument('--out', type=Path)
    given = parser.parse_args()
    out = given.out or Path(tempfile.mkdtemp(prefix='robot_verbs_'))
    found = robots([p.absolute() for p in given.paths], given.configs, out.absolute())
    found = [robot for robot in found if not given.only or robot.name in given.only]
    able = [robot for robot in found if robot.path.is_file()]
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(verbs, able))
    table(found)
    bad = sum(not end.good for robot in found for end in robot.did.values())
    print(f'{len(found)} robots, {bad} ends that are neither work nor one line; files in {out}')
    live = sorted(set(VERBS) - {verb.split()[0] for robot in found for verb in robot.did})
    print(f'not run, for they need a live robot or ship with one: {", ".join(live)}')
    return 1 if bad else 0


if __name__ == '__main__':
    sys.exit(main())
