"""Hours of the real monitor over DDS at 200 Hz joint states + 400 Hz IMU: memory, CPU, lateness.

    nice python -m bench.bench_soak alarms --hours 2 --domain 151 --out out/soak
    python -m bench.bench_soak --summary out/soak/{quiet,alarms,faults}.csv --picture soak.svg

Stretches: `quiet` (the robot stands), `alarms` (the arm swings out with a load that is too much,
every half minute; an operator acknowledges), `faults` (inputs drop out, the driver is killed and
started again, overloads are recorded by the black box, the URDF comes from the robot). Every 10 s a
row is written to OUT/STRETCH.csv, each change of an alert to OUT/STRETCH.alerts.csv. The robot, the
monitor and who listens are a process each; a machine with other work is told by its load.
"""

import argparse
import csv
import mmap
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

from rclpy.clock import Clock
from rclpy.clock_type import ClockType

from bench.soak_listener import Listener, Window
from bench.soak_robot import LATE, SIZE
from bench.soak_summary import draw, summarise
from ugv_acceptance.nodes.executor import end, ros, spin

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
EVERY = 10.0  # s between samples
# Seconds between faults, and after one in which an alert may still come: DDS takes long to see a
# new driver, and to forget one that was killed.
FAULT_EVERY, AFTER = 30.0, 12.0
# Seconds from the start in which alerts may come: the robot comes after the monitor.
BEGINNING = 30.0
# What goes wrong by turns -> how long (s).
FAULTS = {
    'silent imu': 1.5, 'killed': 1.0, 'overload': 3.0, 'silent joints': 1.5, 'half': 1.0,
    'nan': 0.5, 'garbage': 0.5, 'mute': 3.0,
}  # fmt: skip
# What the arm stretched out with its load must and may raise.
SWING_ALERTS = ('TORQUE_LIMIT', 'TORQUE_AHEAD', 'TIP_OVER', 'TIP_AHEAD', 'MARGIN_UNCERTAIN')
STRETCHES = ('quiet', 'alarms', 'faults')


def environment(domain: int) -> dict[str, str]:
    """Return the environment of children; the wheels' loader must start anew in each."""
    kept = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    told = {'ROS_DOMAIN_ID': str(domain), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
    return kept | told | {'PYTHONPATH': str(ROOT)}


def usage_of(pid: int) -> dict[str, float]:
    """Return memory (MB), CPU time (s), threads and open files of a process."""
    place = Path('/proc', str(pid))
    lines = (place / 'status').read_text(encoding='ascii', errors='replace').splitlines()
    status = dict(line.split(':', 1) for line in lines if ':' in line)
    times = (place / 'stat').read_text(encoding='ascii', errors='replace').rpartition(')')[2]
    cpu = sum(map(int, times.split()[11:13])) / os.sysconf('SC_CLK_TCK')
    memory = {
        name: int(status[key].split()[0]) / 1024.0
        for name, key in (('rss_mb', 'VmRSS'), ('anon_mb', 'RssAnon'), ('file_mb', 'RssFile'))
    }
    fds = len(list((place / 'fd').iterdir()))
    return memory | {'cpu_s': cpu, 'threads': int(status['Threads']), 'fds': fds}


@dataclass
class Robot:
    """The robot's process and its counter of messages sent."""

    environment: dict[str, str]
    counter: Path
    process: 'subprocess.Popen[str]' = field(init=False)
    count: mmap.mmap = field(init=False)

    def __post_init__(self) -> None:
        self.counter.write_bytes(bytes(SIZE))
        with self.counter.open('r+b') as file:
            self.count = mmap.mmap(file.fileno(), SIZE)
        self.start()

    def start(self) -> None:
        """Start it."""
        command = [sys.executable, str(HERE / 'soak_robot.py'), str(self.counter)]
        self.process = subprocess.Popen(
            command, env=self.environment, stdin=subprocess.PIPE, text=True
        )

    def do(self, what: str) -> None:
        """Tell it what to do from now on."""
        if self.process.stdin is not None:
            self.process.stdin.write(f'{what}\n')
            self.process.stdin.flush()

    def kill(self) -> None:
        """Kill it and wait until it is gone."""
        self.process.kill()
        self.process.communicate()

    def sent(self) -> tuple[int, int]:
        """Return how many joint states and IMU messages were sent, by all its lives."""
        both = self.count[:8], self.count[8:16]
        joints, imu = (int.from_bytes(told, 'little') for told in both)
        return joints, imu

    def late(self) -> float:
        """Return by how much it was late to send at most (ms) since the last call."""
        largest = int.from_bytes(self.count[LATE : LATE + 8], 'little') / 1e6
        self.count[LATE : LATE + 8] = bytes(8)
        return largest


@dataclass
class Plan:
    """What goes wrong when; `began` and `ended` are the last fault's monotonic times (s)."""

    stretch: str
    robot: Robot
    start: float = field(default_factory=time.monotonic)
    faults: int = 0
    without: int = 0
    heard: bool = True
    what: str = ''
    began: float = 0.0
    ended: float = 0.0

    def expects(self, code: str) -> bool:
        """Return whether an alert may be raised now."""
        self.heard, now = True, time.monotonic()
        if now - self.start < BEGINNING:
            return True
        if self.stretch == 'alarms':
            return code in SWING_ALERTS
        return self.stretch == 'faults' and bool(self.what or now < self.ended + AFTER)

    def step(self) -> None:
        """Begin or end a fault if it is time to."""
        now = time.monotonic()
        if self.what and now > self.began + FAULTS[self.what]:
            if self.what == 'killed':
                self.robot.start()
            self.robot.do('calm')
            self.what, self.ended = '', now
        due = self.start + BEGINNING + self.faults * FAULT_EVERY
        if self.stretch == 'faults' and not self.what and now > due:
            self.without += not self.heard
            self.what = list(FAULTS)[self.faults % len(FAULTS)]
            self.began, self.heard = now, False
            self.faults += 1
            if self.what == 'killed':
                self.robot.kill()
            else:
                self.robot.do(self.what)


def share(late: list[float], part: float) -> float:
    """Return a percentile of the lateness (ms); NaN: no margin came."""
    ordered = sorted(late)
    return ordered[min(int(part * len(ordered)), len(ordered) - 1)] if ordered else float('nan')


@dataclass
class Sampler:
    """Writes a row about all three processes since the last one."""

    file: TextIO
    monitor: int
    blocks: Path
    plan: Plan
    listener: Listener
    before: dict[str, float] = field(default_factory=dict)
    found: dict[str, dict[str, float]] = field(default_factory=dict)
    when: float = field(default_factory=time.monotonic)
    writer: Any = None

    def sample(self) -> None:
        """Write a row and begin a new window."""
        now, heard = time.monotonic(), self.listener.window
        self.listener.window = Window()
        pids = {'': self.monitor, 'robot_': self.plan.robot.process.pid, 'ears_': os.getpid()}
        found = {name: usage_of(pid) for name, pid in pids.items() if Path(f'/proc/{pid}').exists()}
        # A robot that was just killed: as it was.
        self.found = found = self.found | found
        cpu = {f'{name}cpu_pct': of['cpu_s'] for name, of in found.items()}
        shares = {
            name: 100.0 * max(cpu[name] - self.before.get(name, cpu[name]), 0.0) / (now - self.when)
            for name in cpu
        }
        self.before, self.when = cpu, now
        row: dict[str, object] = {'t_s': now - self.plan.start, **found[''], **shares}
        row |= {'robot_rss_mb': found['robot_']['rss_mb'], 'ears_rss_mb': found['ears_']['rss_mb']}
        row |= {'blocks': self.blocks.read_text(encoding='ascii') or 0, 'margins': len(heard.late)}
        row |= {f'late_p{n}_ms': share(heard.late, n / 100) for n in (50, 99, 100)}
        row |= {'robot_late_ms': self.plan.robot.late()}
        row |= {'verdict_gap_s': heard.gap, 'sent': sum(self.plan.robot.sent())}
        row |= {'missed': self.listener.behind, 'raised': heard.raised}
        row |= {'unexpected': heard.unexpected, 'acknowledged': heard.acknowledged}
        row |= {'refused': heard.refused, 'faults': self.plan.faults, 'silent': self.plan.without}
        row |= {'load': os.getloadavg()[0]}
        if self.writer is None:
            self.writer = csv.DictWriter(self.file, list(row))
            self.writer.writeheader()
        self.writer.writerow(
            {k: round(v, 3) if isinstance(v, float) else v for k, v in row.items()}
        )
        self.file.flush()


@contextmanager
def running(stretch: str, folder: Path, domain: int) -> Iterator[tuple[int, Path]]:
    """Run the monitor for a while; give its process id and the file of its blocks."""
    blocks = folder / f'{stretch}.blocks'
    blocks.write_text('0', encoding='ascii')
    words = [] if stretch != 'faults' else ['-p', f'black_box:={folder / "black_box"}']
    if stretch == 'faults':
        config = (ROOT / 'msg_configs' / 'packbot.yaml').read_text(encoding='utf-8')
        told = folder / 'packbot_told.yaml'
        told.write_text(config.replace('urdf: ../urdf/packbot.urdf', ''), encoding='utf-8')
        words += ['-p', f'config:={told}']
    command = [sys.executable, str(HERE / 'soak_monitor.py'), str(blocks), '--ros-args', *words]
    with (folder / f'{stretch}.monitor.log').open('w', encoding='utf-8') as log:
        process = subprocess.Popen(
            [*command, '--'], env=environment(domain), stdout=log, stderr=subprocess.STDOUT
        )
        try:
            yield process.pid, blocks
        finally:
            process.terminate()
            process.wait()


def soak(stretch: str, seconds: float, folder: Path, domain: int) -> None:
    """Run a stretch for so long (s)."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'black_box').mkdir(exist_ok=True)
    # The listener is a node of this process; it joins the same domain.
    os.environ |= environment(domain)
    with ExitStack() as stack:
        monitor, blocks = stack.enter_context(running(stretch, folder, domain))
        robot = Robot(environment(domain), folder / f'{stretch}.sent')
        stack.callback(robot.kill)
        plan = Plan(stretch, robot)
        robot.do('swing' if stretch == 'alarms' else 'calm')
        alerts = stack.enter_context((folder / f'{stretch}.alerts.csv').open('w', newline=''))
        rows = stack.enter_context((folder / f'{stretch}.csv').open('w', newline=''))
        told = csv.writer(alerts)

        def log(change: tuple[object, ...]) -> None:
            told.writerow((round(time.monotonic() - plan.start, 3), plan.what, *change))
            alerts.flush()

        stop = stack.enter_context(ros())
        listener = Listener(
            plan.expects, robot.sent, log, operator=stretch == 'alarms', markers=stretch == 'alarms'
        )
        sampler = Sampler(rows, monitor, blocks, plan, listener)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        listener.create_timer(EVERY, sampler.sample, clock=steady)
        listener.create_timer(0.1, plan.step, clock=steady)
        listener.create_timer(0.5, listener.acknowledge, clock=steady)
        spin(listener, stop, lambda: time.monotonic() > plan.start + seconds)
        end(listener)


def main() -> None:
    """Run a stretch, or sum up what was written."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('stretch', nargs='?', choices=STRETCHES)
    parser.add_argument('--hours', type=float, default=2.0)
    parser.add_argument('--domain', type=int, default=150)
    parser.add_argument('--out', type=Path, default=Path('out/soak'))
    parser.add_argument('--summary', type=Path, nargs='+', default=[])
    parser.add_argument('--picture', type=Path)
    options = parser.parse_args()
    paths = options.summary
    if options.stretch:
        soak(options.stretch, options.hours * 3600.0, options.out, options.domain)
        paths = [options.out / f'{options.stretch}.csv']
    for path in paths:
        print(summarise(path))
    if options.picture:
        draw(paths, options.picture)


if __name__ == '__main__':
    main()
