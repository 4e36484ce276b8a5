"""The console as people run it: real processes on loopback, ended by their handles."""

import os
import random
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from console.browser import Page

HERE = Path(__file__).parent
COMMAND = [sys.executable, '-u', '-c', 'from ugv_acceptance.cli import main; main()']
Process = subprocess.Popen[str]
# A hand that acknowledges and resets, each time after it was answered.
HAND = """
window.calming = true;
window.calmed = (async () => {
  const tell = words => new Promise(done => {
    const number = ++console_page.asked;
    console_page.waiting.set(number, done);
    console_page.socket.send(JSON.stringify({do: words, number}));
  });
  while (calming) {
    await tell('acknowledge');
    await tell('reset');
    await new Promise(done => setTimeout(done, 300));
  }
})(); 0
"""


@contextmanager
def running(*arguments: str, domain: int | None = None) -> Iterator[Process]:
    """Run a program of this project; it is killed at the end, stopped or not."""
    # The ROS wheels set this for their own children, whom it makes load the wrong libraries.
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    if domain is not None:
        environment |= {
            'ROS_DOMAIN_ID': str(domain),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        }
    process = subprocess.Popen(
        arguments,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def address_of(process: Process) -> str:
    """Return the address that a console prints when it listens."""
    said = []
    for line in process.stdout or ():
        if line.startswith('Console on '):
            # What it says later must not fill the pipe.
            threading.Thread(target=_drain, args=(process,), daemon=True).start()
            return line.split()[2]
        said.append(line)
    raise AssertionError(f'the console ended: {"".join(said)}')


def _drain(process: Process) -> None:
    try:
        for _ in process.stdout or ():
            pass
    except ValueError:
        # Closed at the end of the test.
        return


@contextmanager
def console(*arguments: str, domain: int | None = None) -> Iterator[tuple[str, Process]]:
    """Run a console on a free port; return its address and process."""
    with running(*COMMAND, 'console', '--port', '0', *arguments, domain=domain) as process:
        yield address_of(process), process


@dataclass
class Live:
    """A driver, a monitor and a console on a ROS domain of their own."""

    url: str
    domain: int
    driver: Process
    monitor: Process
    console: Process

    def pose(self, *q: float, roll: float = 0.0) -> None:
        """Let the robot stand so."""
        self.say(' '.join(map(str, (*q, roll))))

    def say(self, line: str) -> None:
        """Tell the driver."""
        assert self.driver.stdin is not None
        self.driver.stdin.write(f'{line}\n')
        self.driver.stdin.flush()


@contextmanager
def live_console() -> Iterator[Live]:
    """Run a driver, a monitor and a console."""
    # Within the tests conftest.py has claimed a domain.
    given = os.environ.get('ROS_DOMAIN_ID')
    domain = int(given) if given else random.SystemRandom().randint(1, 101)
    with ExitStack() as stack:
        driver = stack.enter_context(
            running(sys.executable, str(HERE / 'driver.py'), domain=domain)
        )
        # Its lines would fill a pipe nobody reads.
        monitor = stack.enter_context(
            running(*COMMAND, 'monitor', '--plain', '--every', '3600', domain=domain)
        )
        url, process = stack.enter_context(console(domain=domain))
        yield Live(url, domain, driver, monitor, process)


def calm(page: Page) -> None:
    """Acknowledge and reset in the page what was, until all is well and no card is left."""
    page.wait(
        '!!window.console_page?.frame && !["STALE", "ERROR"].includes(document.body.dataset.level)'
    )
    page.run(HAND)
    page.wait('document.body.dataset.level === "OK" && !document.querySelector(".card")')
    # What the hand did last must not reach into what follows.
    page.run('calming = false; calmed')
