"""The console beside a live robot: `python bench/bench_console.py`.

A driver (100 Hz joints, 200 Hz IMU), a monitor and a console are processes; a real Chromium paints.
Prints the time from a message's stamp to the screen, the processor's share, and what ten clients
change for the monitor.
"""

import os
import statistics
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from threading import Event, Thread

from websockets.sync.client import connect
from websockets.typing import Origin

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / 'test'))

from console.browser import Page, chromium  # noqa: E402 - the tests' helpers
from console.servers import Live, Process, live_console  # noqa: E402 - the same

SECONDS = 10.0
CLIENTS = 10
TICK = os.sysconf('SC_CLK_TCK')
# Records, at the refresh after each painted frame, its age since the newest joint state in it.
RECORDER = """
window.ages = []; window.changes = 0; let seen = 0, then = performance.now(); window.gaps = [];
(function look() {
  const page = console_page, now = performance.now();
  if (page.painted !== seen) {
    seen = page.painted;
    const f = page.frame, age = f.inputs[0].age_s;
    ages.push(Date.now() - 1000 * (f.time_s - age));
    gaps.push(now - then); then = now;
  }
  requestAnimationFrame(look);
})();
"""


def main() -> None:
    """Measure and print."""
    size = sum(file.stat().st_size for file in (ROOT / 'ugv_acceptance/console/static').iterdir())
    print(f'page, style and scripts                      {size / 1000:6.1f} kB   (bar 100)')
    os.environ['DRIVER_RATES'] = '100 200'
    with live_console() as robot, chromium() as browser, browser.page() as page:
        page.open(robot.url)
        page.wait('document.body.dataset.level === "OK"')
        robot_moves(robot)
        painted(page)
        share('console, one page', [robot.console])
        compare(robot)


def robot_moves(robot: Live) -> None:
    """Let the arm swing for as long as the bench lasts, so that maps and numbers change."""

    def swing() -> None:
        k = 0
        while robot.driver.poll() is None:
            k += 1
            try:
                robot.pose(0.02 * (k % 60), 2.0, -2.5, 2.0)
            except (BrokenPipeError, ValueError):
                return
            time.sleep(0.1)

    Thread(target=swing, daemon=True).start()


def painted(page: Page) -> None:
    """Print how old what is seen is, and whether a frame was dropped while maps are made anew."""
    page.run(RECORDER)
    time.sleep(SECONDS)
    ages = sorted(page.run('ages'))
    gaps = sorted(page.run('gaps.slice(1)'))
    p50, p99 = (ages[int(len(ages) * p)] for p in (0.5, 0.99))
    print(f"stamp of a frame's newest message to screen  {p50:6.1f} ms, {p99:.1f} p99 (bar 150)")
    rate, worst = len(ages) / SECONDS, gaps[int(len(gaps) * 0.99)]
    print(
        f'frames painted                               {rate:6.1f} a second, gap p99 {worst:.0f} ms'
    )


def spent(process: Process) -> float:
    """Return the seconds of processor a process has used."""
    fields = Path(f'/proc/{process.pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def share(what: str, processes: list[Process]) -> list[float]:
    """Print and return each process's share of a core over SECONDS."""
    before = [spent(p) for p in processes]
    time.sleep(SECONDS)
    shares = [100 * (spent(p) - b) / SECONDS for p, b in zip(processes, before, strict=True)]
    print(f'{what:44} ' + ' '.join(f'{x:6.1f} %' for x in shares) + ' of a core')
    return shares


def compare(robot: Live) -> None:
    """Print what ten clients change."""
    share('monitor | console, one client', [robot.monitor, robot.console])
    stop, counts = Event(), [0] * CLIENTS

    def take(k: int) -> None:
        origin = Origin(robot.url.rstrip('/'))
        with connect(robot.url.replace('http', 'ws') + 'live', origin=origin) as socket:
            while not stop.is_set():
                socket.recv()
                counts[k] += 1

    with ExitStack() as stack:
        threads = [Thread(target=take, args=(k,)) for k in range(CLIENTS)]
        for thread in threads:
            thread.start()
            stack.callback(thread.join)
        stack.callback(stop.set)
        start, before = time.monotonic(), list(counts)
        share(f'monitor | console, {CLIENTS} clients more', [robot.monitor, robot.console])
        took = time.monotonic() - start
        rates = [(after - b) / took for after, b in zip(counts, before, strict=True)]
    mean = statistics.fmean(rates)
    print(
        f'messages a client                            {mean:6.1f} a second, least {min(rates):.1f}'
    )


if __name__ == '__main__':
    main()
