"""kill -9 at random moments: what recorder, monitor, campaign and report leave behind."""

import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from random import Random
from typing import Any

from bag.bag_cases import write_mcap
from hardening.lossy import relayed
from hardening.outcome import Outcome
from hardening.robot import Task
from hardening.soak import critical
from hardening.wire import (
    NS,
    child,
    environment,
    listening,
    monitor,
    robot,
    running,
    tell,
)

from ugv_acceptance import BadBag
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import open_bag

CODE = 'from ugv_acceptance.cli import main; main()'
# Messages a second of the recorder.
RATE = 600
# Messages, and seconds lost.
Left = tuple[int, float]


def left_in(path: Path, killed: int, topic: str = '') -> Left | None:
    """Return messages (of a topic) and seconds lost in a recording; None: it cannot be read."""
    try:
        bag = open_bag(path)
        times = [m.log_time for m in messages(bag, [topic] if topic else bag.topics)]
    except BadBag:
        return None
    return len(times), (killed - max(times, default=killed)) / NS


def recorder(folder: Path, times: int, seed: int = 0) -> Outcome:
    """Kill a recorder; what it said is kept must be there, and at most the last second lost.

    A second is that of its messages: on a busy machine it may have stood still in its last one.
    """
    rng, readable, worst, lost, broken = Random(seed), 0, 0.0, 0, 0
    for k in range(times):
        path, counts = folder / f'recorded_{k}', folder / f'taken_{k}'
        with child('-m', 'hardening.recorder', str(path), str(counts)) as process:
            assert process.stdout is not None
            promised = int(process.stdout.readline())
            time.sleep(rng.uniform(0.0, 2.0))
            process.kill()
            killed = time.time_ns()
            promised = max([promised, *map(int, process.stdout.read().split())])
        left = left_in(path, killed)
        readable += left is not None
        worst = max(worst, left[1] if left else 0.0)
        lost = max(lost, int.from_bytes(counts.read_bytes(), 'little') - (left[0] if left else 0))
        broken += left is None or left[0] < promised
    text = f'recorder: {readable} of {times} readable, at most {worst:.2f} s lost'
    text += f', {broken} promises broken'
    return Outcome(text, readable == times and lost <= RATE and not broken)


def black_box(folder: Path, times: int, seed: int = 0) -> Outcome:
    """Kill a monitor while its black box writes; the alert that it told must be in the file."""
    rng, whole, worst, without = Random(seed), 0, 0.0, 0
    with listening() as (live, ears), robot(Task()) as driver:
        for k in range(times):
            path = folder / f'box_{k}'
            ears.alerts.clear()
            ears.verdicts.clear()
            with monitor(black_box=path) as process:
                running(live, ears)
                tell(driver, 'overload')
                live.until(lambda: any(map(critical, ears.alerts)))
                live.spin(rng.uniform(0.3, 4.0))
                process.kill()
                killed = time.time_ns()
            tell(driver, 'calm')
            left = [left_in(found, killed) for found in path.glob('*')]
            whole += bool(left) and None not in left
            worst = max([worst, *(x[1] for x in left if x)])
            told = [left_in(f, killed, '/acceptance_monitor/alerts') for f in path.glob('*')]
            without += not any(x and x[0] for x in told)
    text = f'monitor: {whole} of {times} left readable black boxes, at most {worst:.2f} s lost'
    text += f', {without} without the alert that was told'
    return Outcome(text, whole == times and worst <= 1.0 and not without)


def run_of(*words: str) -> 'subprocess.Popen[bytes]':
    """Start a verb."""
    quiet = subprocess.DEVNULL
    command = [sys.executable, '-c', CODE, *words]
    return subprocess.Popen(command, env=environment(), stdout=quiet, stderr=quiet)


def fleet(recording: Path, folder: Path, count: int) -> Path:
    """Make recordings that differ: each lost other messages."""
    folder.mkdir()
    for k in range(count):
        (folder / f'run_{k}').mkdir()
        write_mcap(folder / f'run_{k}' / 'run.mcap', relayed(recording, '10 % lost', k))
    return folder


def contents(paths: Iterable[Path]) -> dict[str, bytes]:
    """Return the content of each file by its name."""
    return {path.name: path.read_bytes() for path in paths if path.is_file()}


def _took(*words: str) -> float:
    """Run a verb to its end; return the seconds it took."""
    start = time.monotonic()
    run_of(*words).wait()
    return time.monotonic() - start


def campaign(recording: Path, folder: Path, times: int, seed: int = 0) -> Outcome:
    """Kill a campaign again and again, each time resumed; it must end as one never killed."""
    rng, runs = Random(seed), fleet(recording, folder / 'fleet', times + 4)

    def words(out: str) -> tuple[str, ...]:
        return 'campaign', str(runs), '--out', str(folder / out), '--workers', '2'

    took = _took(*words('whole'))
    expected = contents((folder / 'whole' / 'runs').glob('*.json'))
    half = orphans = 0
    for _ in range(times):
        process = run_of(*words('killed'))
        # A campaign that is resumed has less to do: all kills together take about three of them.
        time.sleep(rng.uniform(0.5, 1.0 + 3.0 * took / times))
        workers = children(process.pid)
        process.kill()
        process.wait()
        orphans += not gone(workers)
        found = contents((folder / 'killed' / 'runs').glob('*.json'))
        half += any(expected.get(name) != content for name, content in found.items())
        page = folder / 'killed' / 'campaign.html'
        half += page.is_file() and not page.read_bytes().rstrip().endswith(b'</html>')
    _took(*words('killed'))
    same = contents((folder / 'killed' / 'runs').glob('*.json')) == expected
    text = f'campaign of {len(expected)} runs: killed {times} times, {half} times half a result'
    text += f', {orphans} times workers that went on; at last the same results: {same}'
    return Outcome(text, same and not half and not orphans and len(expected) == times + 4)


def children(pid: int) -> list[int]:
    """Return the children of a process, and theirs; none where it has ended."""
    try:
        tasks = [path.read_text() for path in Path(f'/proc/{pid}/task').glob('*/children')]
    except OSError:
        return []
    below = [int(child) for text in tasks for child in text.split()]
    return [*below, *(grandchild for child in below for grandchild in children(child))]


def gone(pids: Iterable[int], patience: float = 10.0) -> bool:
    """Wait until processes have ended; return whether all have."""
    end = time.monotonic() + patience
    while living := [pid for pid in pids if _lives(pid)]:
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return not living


def _lives(pid: int) -> bool:
    try:
        return Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()[0] != 'Z'
    except OSError:
        return False


def report(recording: Path, folder: Path, times: int, seed: int = 0) -> Outcome:
    """Kill an evaluation that writes over older results: each file is the old or the new one."""
    rng, names = Random(seed), ('result.json', 'report.html', 'junit.xml')
    options = ['--overwrite']
    for option, name in zip(('--json', '--report', '--junit'), names, strict=True):
        options += [option, str(folder / name)]
    took = _took('evaluate', str(recording), *options)
    whole, half = _ends(contents(folder / name for name in names)), 0
    for _ in range(times):
        for name in names:
            (folder / name).write_bytes(b'old')
        process = run_of('evaluate', str(recording), *options)
        time.sleep(rng.uniform(0.3, 1.05) * took)
        process.kill()
        process.wait()
        found = _ends(contents(folder / name for name in names))
        half += any(found[name] not in (whole[name], (3, b'old')) for name in names)
    text = f'report: killed {times} times, {half} times a file neither old nor whole'
    return Outcome(text, not half and len(whole) == len(names))


def _ends(found: dict[str, bytes]) -> dict[str, Any]:
    """Return size and end of each file: what it says of when it was made is elsewhere."""
    return {name: (len(content), content[-40:]) for name, content in found.items()}
