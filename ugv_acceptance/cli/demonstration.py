"""The parts of the demo: a player in its own process, the monitor in this one, then the bag."""

import os
import random
import socket
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.markup import escape

from ugv_acceptance import BadBag

if TYPE_CHECKING:
    from ugv_acceptance.nodes.status import Status

BAG = 'packbot_fail'
WORKED, BROKEN = 0, 1


def demonstrate(bag: Path | None, rate: float) -> int:
    """Run the demo; return its exit code: 0 where live and recording were both judged."""
    from ugv_acceptance.cli.evaluate import judge_recording
    from ugv_acceptance.cli.summary import print_result
    from ugv_acceptance.config import load

    console = Console(highlight=False)
    path = find(bag)
    domain = free_domain()
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    console.rule('1. Live: a recorded run, published through DDS, watched by the monitor')
    console.print(
        f'{escape(str(path))} at {rate:g} x real time, ROS domain {domain}', soft_wrap=True
    )
    alerts, played = live(path, rate, console)
    console.rule('2. The same run from the recording')
    result = judge_recording([path], load(), compare_effort=False)
    print_result(result)
    return conclude(console, alerts, played, result)


def free_domain() -> int:
    """Return a ROS domain on whose discovery port no program of this machine listens."""
    candidates = random.SystemRandom().sample(range(1, 102), 101)
    for domain in candidates:
        with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(('', 7400 + 250 * domain))
            return domain
    return candidates[0]


def find(bag: Path | None) -> Path:
    """Return the recording to play: the one given, or the one that ships."""
    if bag is not None:
        return bag
    from ugv_acceptance.config import load

    # It lies beside the configuration that ships.
    place = load().path.parent.parent / 'bags' / BAG
    if not place.is_dir():
        raise BadBag(f'{place}: expected the recording that ships, found none')
    return place


def live(path: Path, rate: float, console: Console) -> tuple[list['Status'], bool]:
    """Play the recording into the monitor; return its alerts and whether the player succeeded."""
    from ugv_acceptance.cli.live_view import watch

    with player(path, rate) as process:
        alerts = watch(None, None, [], console, 2.0, lambda: process.poll() is not None)
        return alerts, process.poll() == 0


@contextmanager
def player(path: Path, rate: float) -> Iterator['subprocess.Popen[bytes]']:
    """Run `replay` in a process of its own."""
    # The ROS wheels set this for their own children, whom it makes load the wrong libraries.
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    code = 'from ugv_acceptance.cli import main; main()'
    command = [sys.executable, '-c', code, 'replay', str(path), '--restamp', '--rate', str(rate)]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL)  # noqa: S603
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def conclude(console: Console, alerts: list['Status'], played: bool, result: dict[str, Any]) -> int:
    """Say what came of it."""
    console.rule('3. What came of it')
    seen = Counter(
        (str(a.values['code']), str(a.values['subject']), str(a.values['level']))
        for a in alerts
        if a.values['state'] == 'raised'
    )
    recorded = Counter((a['code'], a['subject'], a['level']) for a in result['alerts'])
    both, only_live, only_bag = seen & recorded, seen - recorded, recorded - seen
    console.print(f'{both.total()} alerts came both live and from the recording.')
    for name, extra in (('live', only_live), ('from the recording', only_bag)):
        for code, subject, level in extra:
            why = ' (before it began and after it ended)' if code == 'INPUT_STALE' else ''
            console.print(f'only {name}: {level} {code} {subject}{why}')
    verdict = result['verdict']
    console.print(f'The verdict on the recording is [bold]{verdict}[/].')
    if verdict == 'FAIL' and Path(result['bag']['path'][0]).name.startswith(BAG):
        console.print('FAIL is the right verdict: this run was made to break the limits.')
    if not played or not seen:
        console.print('[bold red]The live part did not work:[/] try `ugv-acceptance doctor`.')
        return BROKEN
    console.print('Everything worked.')
    return WORKED
