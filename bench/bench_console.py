"""The console beside a live robot: `python -m bench.bench_console`.

A driver (joints and IMU at 200 and 400 Hz, or at DRIVER_RATES), a monitor and a console are
processes; a real Chromium paints. Prints the time from a message's stamp to the screen, frames that
were dropped while maps are made anew, the processor's share, and what ten, then 220 more clients
change for the monitor.
"""

import json
import os
import signal
import statistics
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import Event, Thread

from websockets.sync.client import connect
from websockets.typing import Origin

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / 'test'))

from console.browser import Page, chromium  # noqa: E402 - the tests' helpers
from console.crowd import deaf, silent  # noqa: E402 - the same
from console.servers import Live, Process, live_console, running  # noqa: E402 - the same

SECONDS = 10.0
CLIENTS, DEAF, SILENT = 10, 20, 200
TICK = os.sysconf('SC_CLK_TCK')
# At each refresh of the screen: its interval; what was painted in the one before: number and age
# since the stamp of its newest message; how many maps had come by then.
RECORDER = """
window.ages = []; window.numbers = []; window.refreshes = []; window.maps = 0;
let seen = console_page.painted, then = performance.now();
const count = e => { maps += e.data.startsWith('{"kind":"map"'); };
console_page.socket.addEventListener('message', count);
(function look() {
  const page = console_page, now = performance.now();
  refreshes.push(now - then); then = now;
  if (page.painted !== seen) {
    seen = page.painted;
    numbers.push(seen);
    ages.push(Date.now() - 1000 * page.frame.stamp_s);
  }
  requestAnimationFrame(look);
})();
"""


# When the page first says NO DATA: ms since the last frame.
WATCHER = """
window.lost = null;
(function look() {
  if (document.body.dataset.level === 'STALE') lost ??= performance.now() - console_page.last;
  requestAnimationFrame(look);
})();
"""


def main() -> None:
    """Measure and print."""
    size = sum(file.stat().st_size for file in (ROOT / 'ugv_acceptance/console/static').iterdir())
    print(f'page, style and scripts                      {size / 1000:6.1f} kB   (bar 100)')
    os.environ.setdefault('DRIVER_RATES', '200 400')
    with live_console() as robot, chromium() as browser, browser.page() as page:
        page.open(robot.url)
        page.wait('document.body.dataset.level === "OK"')
        robot_moves(robot)
        painted(page)
        frozen(robot, page)
        share('console, one page', [robot.console])
        compare(robot)
        crowd(robot)


def robot_moves(robot: Live) -> None:
    """Move the arm for as long as the bench lasts, so that maps and numbers change."""

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
    """Print the age of what the page shows, and the frames missed while maps are recomputed."""
    page.run(RECORDER)
    began = time.monotonic()
    time.sleep(SECONDS)
    took = time.monotonic() - began
    ages, numbers, refreshes, maps = page.run('[ages, numbers, refreshes, maps]')
    line = "stamp of a frame's newest message to screen"
    print(f'{line:44} {quantile(ages, 0.5):6.1f} ms, {quantile(ages, 0.99):.1f} p99 (bar 150)')
    made = numbers[-1] - numbers[0] + 1
    print(
        f'{"maps a second":44} {maps / took:6.1f}, meanwhile {made - len(numbers)} of {made}'
        ' frames dropped'
    )
    print(
        f'{"refreshes of the screen":44} {quantile(refreshes, 0.5):6.1f} ms apart,'
        f' {quantile(refreshes, 0.99):.1f} p99, {max(refreshes):.0f} at most'
    )


def frozen(robot: Live, page: Page) -> None:
    """Print how long after a stopped server's last frame the page shows that it is silent."""
    page.run(WATCHER)
    robot.console.send_signal(signal.SIGSTOP)
    time.sleep(2.0)
    robot.console.send_signal(signal.SIGCONT)
    print(f'{"stopped server seen after":44} {page.run("lost"):6.0f} ms (bar 500)')
    page.wait('document.body.dataset.level === "OK"')


def quantile(values: list[float], share: float) -> float:
    """Return the value below which this share of all lies."""
    return sorted(values)[int(len(values) * share)]


def spent(process: Process) -> float:
    """Return the CPU seconds that a process has used."""
    fields = Path(f'/proc/{process.pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def share(what: str, processes: list[Process]) -> list[float]:
    """Print and return each process's share of a core (measured for SECONDS)."""
    before = [spent(p) for p in processes]
    time.sleep(SECONDS)
    shares = [100 * (spent(p) - b) / SECONDS for p, b in zip(processes, before, strict=True)]
    print(f'{what:44} ' + ' '.join(f'{x:6.1f} %' for x in shares) + ' of a core')
    return shares


def compare(robot: Live) -> None:
    """Print the CPU share of monitor and console without and with ten clients."""
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


def crowd(robot: Live) -> None:
    """Print the effect of clients that ask nothing or read nothing on monitor and other clients."""
    delays('monitor, message to margins', robot)
    with ExitStack() as stack:
        for make in (deaf,) * DEAF + (silent,) * SILENT:
            stack.enter_context(make(robot.url))
        before = resident(robot.console)
        delays(f'beside {SILENT} silent and {DEAF} deaf clients', robot)
        grown = (resident(robot.console) - before) / 1e6
        print(f'{"memory that they cost the console":44} {grown:6.1f} MB')
        with connect(
            robot.url.replace('http', 'ws') + 'live', origin=Origin(robot.url.rstrip('/'))
        ) as socket:
            count, end = 0, time.monotonic() + SECONDS / 2
            while time.monotonic() < end:
                count += '"frame"' in str(socket.recv())[:20]
        print(
            f'{"frames of a client that reads, beside them":44} {2 * count / SECONDS:6.1f} a second'
        )


def delays(what: str, robot: Live) -> None:
    """Print how long a second monitor takes from a message's stamp to its margins."""
    with listening(robot) as heard:
        time.sleep(SECONDS)
    told = [latency / 1e6 for latency in heard[200:]]
    p50, p99 = quantile(told, 0.5), quantile(told, 0.99)
    print(f'{what:44} {p50:6.2f} ms, {p99:.2f} p99, of {len(told)} messages (bar 5)')


@contextmanager
def listening(robot: Live) -> Iterator[list[float]]:
    """Run a second monitor beside; the list holds its latencies (ns) afterwards."""
    heard: list[float] = []
    words = (str(ROOT / 'bench' / 'live_listener.py'), 'monitor', str(ROOT))
    with running(sys.executable, *words, domain=robot.domain) as process:
        yield heard
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=20)
        heard += json.loads(said.splitlines()[-1])['latencies']


def resident(process: Process) -> int:
    """Return the memory (bytes) of a process."""
    return int(Path(f'/proc/{process.pid}/statm').read_text().split()[1]) * 4096


if __name__ == '__main__':
    main()
