"""A disk that is full and a folder that is read-only: one line, exit code 2, and nothing half."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hardening.kills import CODE, contents, fleet, left_in
from hardening.outcome import Outcome
from hardening.robot import Task
from hardening.soak import critical
from hardening.wire import child, environment, listening, monitor, robot, running, tell

# Bytes of the small disk, and those left on it when it is full.
SIZE, LEFT = 1 << 20, 1 << 15
# Verb -> its words, given a recording and a folder to write into.
VERBS: dict[str, Callable[[Path, Path], list[str]]] = {
    'evaluate --json': lambda bag, to: [
        'evaluate',
        str(bag),
        '--overwrite',
        '--json',
        str(to / 'result.json'),
    ],
    'evaluate --report': lambda bag, to: [
        'evaluate',
        str(bag),
        '--overwrite',
        '--report',
        str(to / 'page.html'),
    ],
    'evaluate --csv': lambda bag, to: [
        'evaluate',
        str(bag),
        '--overwrite',
        '--csv',
        str(to / 'margins.csv'),
    ],
    'simulate': lambda _, to: ['simulate', 'fetch', '--bag', str(to / 'simulated')],
    'campaign': lambda bag, to: ['campaign', str(bag), '--out', str(to / 'campaign')],
}


@contextmanager
def small_disk(folder: Path) -> Iterator[bool]:
    """Mount a disk of SIZE bytes on a folder; yields whether that was allowed."""
    folder.mkdir(exist_ok=True)
    command = ['mount', '-t', 'tmpfs', '-o', f'size={SIZE}', 'tmpfs', str(folder)]
    done = subprocess.run(command, capture_output=True, check=False)
    try:
        yield done.returncode == 0
    finally:
        if done.returncode == 0:
            subprocess.run(['umount', '-l', str(folder)], check=True)


def fill(folder: Path, left: int = LEFT) -> None:
    """Fill a disk until only so many bytes are left."""
    with (folder / 'filling').open('wb', buffering=0) as file:
        with suppress(OSError):
            while True:
                file.write(bytes(4096))
        file.truncate(file.tell() - left)


def say_why(done: 'subprocess.CompletedProcess[str]', *, no_more: bool = True) -> str:
    """Return what is wrong with how a verb ended that could not write; '' where nothing is."""
    lines = done.stderr.strip().splitlines()
    if done.returncode != 2:
        return f'exit code {done.returncode}'
    return '' if len(lines) == 1 or not no_more else f'{len(lines)} lines: {lines[-1:]}'


def verbs(recording: Path, folder: Path, state: str) -> Outcome:
    """Let each verb write onto a disk that is `full` or `read-only`; older files must stay."""
    bad = []
    for verb, words in VERBS.items():
        with small_disk(folder / 'disk') as allowed:
            if not allowed:
                return Outcome(f'{state}: needs the right to mount a small disk', None)
            disk = folder / 'disk'
            for name in ('result.json', 'page.html', 'margins.csv'):
                (disk / name).write_bytes(b'old')
            if state == 'full':
                fill(disk, 4096)
            else:
                command = ['mount', '-o', 'remount,ro', str(disk)]
                subprocess.run(command, check=True)
            done = subprocess.run(
                [sys.executable, '-c', CODE, *words(recording, disk)],
                env=environment(), capture_output=True, text=True, check=False,
            )  # fmt: skip
            why = say_why(done)
            kept = contents(disk / n for n in ('result.json', 'page.html', 'margins.csv'))
            if set(kept.values()) != {b'old'}:
                why += f' older files changed: { {n: len(c) for n, c in kept.items()} }'
            if why:
                bad.append(f'{verb}: {why}')
    text = f'{state}: {len(VERBS) - len(bad)} of {len(VERBS)} verbs end with 2, a line and no half'
    return Outcome('; '.join([text, *bad]), not bad)


def recorder(folder: Path) -> Outcome:
    """Record until the disk is full: what was promised must be there."""
    with small_disk(folder / 'disk') as allowed:
        if not allowed:
            return Outcome('recorder: needs the right to mount a small disk', None)
        path = folder / 'disk' / 'recorded'
        with child('-m', 'hardening.recorder', str(path)) as process:
            said, _ = process.communicate()
        promised, *_, last = [0, *said.split('\n')[:-2], said.strip().split('\n')[-1]]
        promised = int(said.split('\n')[-3])
        left = left_in(path, time.time_ns())
    text = f'recorder: "{last}", {promised} promised, {left[0] if left else 0} there'
    held = left is not None and left[0] >= promised and process.returncode == 3
    return Outcome(text, held)


def resumed(recording: Path, folder: Path) -> Outcome:
    """Fill the disk under a campaign, make room, run it again: it ends as one never disturbed."""
    runs = fleet(recording, folder / 'fleet', 4)

    def judge(out: Path) -> int:
        words = ['campaign', str(runs), '--out', str(out), '--workers', '1']
        command = [sys.executable, '-c', CODE, *words]
        done = subprocess.run(command, env=environment(), capture_output=True, check=False)
        return done.returncode

    judge(folder / 'whole')
    expected = contents((folder / 'whole' / 'runs').glob('*.json'))
    with small_disk(folder / 'disk') as allowed:
        if not allowed:
            return Outcome('campaign: needs the right to mount a small disk', None)
        fill(folder / 'disk', 40_000)
        first = judge(folder / 'disk' / 'out')
        before = contents((folder / 'disk' / 'out' / 'runs').glob('*.json'))
        (folder / 'disk' / 'filling').unlink()
        judge(folder / 'disk' / 'out')
        same = contents((folder / 'disk' / 'out' / 'runs').glob('*.json')) == expected
    whole = all(expected[name] == content for name, content in before.items())
    text = (
        f'campaign on a full disk: exit code {first}, {len(before)} of {len(expected)} results, '
        f'all whole: {whole}; resumed, the same as never disturbed: {same}'
    )
    return Outcome(text, first == 2 and whole and same and len(expected) == 4)


def watched(folder: Path, state: str) -> Outcome:
    """Let a black box write onto a disk that is `full` or `read-only`: the watch goes on."""
    with small_disk(folder / 'disk') as allowed, listening() as (live, ears):
        if not allowed:
            return Outcome(f'monitor, {state}: needs the right to mount a small disk', None)
        fill(folder / 'disk', 8192)
        if state == 'read-only':
            command = ['mount', '-o', 'remount,ro', str(folder / 'disk')]
            subprocess.run(command, check=True)
        box = folder / 'disk' / 'box'
        with robot(Task()) as driver, monitor(black_box=box) as process:
            running(live, ears)
            tell(driver, 'overload')
            live.until(lambda: any(map(critical, ears.alerts)))
            live.spin(3.0)
            tell(driver, 'calm')
            live.until(lambda: ears.first('cleared', 'TORQUE_LIMIT'))
            ears.verdicts.clear()
            live.spin(2.0)
            goes_on = process.poll() is None and bool(ears.verdicts)
    return Outcome(f'monitor, black box on a {state} disk: the watch goes on: {goes_on}', goes_on)
