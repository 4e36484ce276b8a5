"""`ugv-acceptance demo`: plays a recording through real DDS into the monitor, then evaluates it."""

import os
import random
import socket
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

from ugv_acceptance import BadBag
from ugv_acceptance.cli.plain_text import has_utf8
from ugv_acceptance.cli.terminal_output import console_of, say

if TYPE_CHECKING:
    from ugv_acceptance.cli.monitor_text import Raised


BAG = 'packbot_fail'
WORKED, BROKEN = 0, 1


def demonstrate(bag: Path | None, rate: float, *, page: bool) -> int:
    """Run the demo, with or without the console's `page`; return its exit code.

    It is 0 where both the live run and the recording were judged.
    """
    from ugv_acceptance.cli.result_text import print_result
    from ugv_acceptance.offline.evaluate import evaluate

    console = console_of()
    path = find(bag)
    domain = free_domain()
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    _head(console, '1. Live: a recorded run, published through DDS, watched by the monitor')
    say(console, f'{escape(str(path))} at {rate:g} x real time, ROS domain {domain}')
    alerts, played = live(path, rate, console, page=page)
    _head(console, '2. The same run from the recording')
    result = evaluate(path).result
    print_result(result, console)
    return conclude(console, alerts, played, result)


def _head(console: Console, text: str) -> None:
    """Print the heading of a part."""
    console.print()
    console.rule(text, characters='-' if not has_utf8(sys.stdout) else '─')


def free_domain() -> int:
    """Return a ROS domain on whose discovery port no program of this machine listens."""
    candidates = random.SystemRandom().sample(range(1, 102), 101)
    for domain in candidates:
        with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(('', 7400 + 250 * domain))
            return domain
    return candidates[0]


def find(bag: Path | None) -> Path:
    """Return the recording to play: the given one, or the one that ships."""
    if bag is not None:
        return bag
    from ugv_acceptance.config import load

    # It lies beside the configuration that ships.
    place = load().path.parent.parent / 'bags' / BAG
    if not place.is_dir():
        raise BadBag(f'{place}: expected the recording that ships, found none')
    return place


def live(path: Path, rate: float, console: Console, *, page: bool) -> tuple['Raised', bool]:
    """Play the recording into the monitor; return its alerts and whether the player succeeded."""
    from ugv_acceptance.cli.monitor_text import watch

    play = ('replay', str(path), '--rate', str(rate))
    with ExitStack() as stack:
        if page:
            announce(stack.enter_context(verb('console', '--port', '0')), console)
        players: list[subprocess.Popen[str]] = []

        def over() -> bool:
            # Asked for the first time when the monitor listens: no message comes before it.
            if not players:
                players.append(stack.enter_context(verb(*play)))
            return players[0].poll() is not None

        alerts = watch(None, None, [], console, 2.0, over)
        return alerts, bool(players) and players[0].poll() == 0


@contextmanager
def verb(*words: str) -> Iterator['subprocess.Popen[str]']:
    """Run a verb in a process that ends when this one does; its output can be read.

    It has a session of its own: Ctrl-C reaches only this process, which ends the verb.
    """
    # The ROS wheels set this for their own children, whom it makes load the wrong libraries.
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    code = 'from ugv_acceptance.nodes.subprocess_node import end_with_parent; end_with_parent()'
    code += '; from ugv_acceptance.cli import main; main()'
    command, pipe = [sys.executable, '-u', '-c', code, *words], subprocess.PIPE
    with subprocess.Popen(  # noqa: S603 - our own command
        command, env=environment, stdin=pipe, stdout=pipe, text=True, start_new_session=True
    ) as process:
        try:
            yield process
        finally:
            process.terminate()


def announce(process: 'subprocess.Popen[str]', console: Console) -> None:
    """Print the console's address, or why there is no console; the demo goes on in both cases."""
    said = next(iter(process.stdout or ()), '').split()
    if len(said) > 2:
        text = f'Open {said[2]} in a browser on this machine to see it as an operator does.'
        say(console, text)


def conclude(console: Console, seen: 'Raised', played: bool, result: dict[str, Any]) -> int:
    """Print the results of the live run and of the evaluation; return the exit code."""
    from ugv_acceptance.evaluation.alerts.messages import level_words

    _head(console, '3. The result')
    recorded = Counter((a['code'], a['subject'], a['level']) for a in result['alerts'])
    both, only_live, only_bag = seen & recorded, seen - recorded, recorded - seen
    say(console, f'{both.total()} alerts were raised both live and from the recording.')
    for name, extra in (('live', only_live), ('from the recording', only_bag)):
        for code, subject, level in extra:
            why = ' (before it began and after it ended)' if code == 'INPUT_STALE' else ''
            say(console, f'only {name}: {level_words(level)} {code} {subject}{why}')
    verdict = result['verdict']
    say(console, f'The verdict on the recording is [bold]{verdict}[/].')
    if verdict == 'FAIL' and Path(result['bag']['path'][0]).name.startswith(BAG):
        say(console, 'FAIL is the right verdict: this run was made to break the limits.')
    if not played or not seen:
        say(console, '[bold red]The live part did not work:[/] try `ugv-acceptance doctor`.')
        return BROKEN
    say(console, 'Everything worked.')
    return WORKED


def demo(
    bag: Annotated[
        Path | None, typer.Option(help='Recording to play; packbot_fail, which ships, by default.')
    ] = None,
    rate: Annotated[float, typer.Option(help='Speed, as a multiple of real time.')] = 1.0,
    console: Annotated[
        bool, typer.Option(help='Serve the page as well, on a free port of this machine.')
    ] = True,
) -> None:
    """Play a recorded run into the live monitor, then evaluate the same recording.

    The address of the console is printed first: open it to see the run as an operator does. All
    runs on its own ROS domain of this machine. The exit code is 0 if everything worked; the run
    that ships fails on purpose, so that there is something to see.

    \b
    Examples:
      ugv-acceptance demo
      ugv-acceptance demo --bag bags/packbot_pass --rate 2 --no-console
    """  # noqa: D301 - typer's \b keeps the lines of the examples apart
    from ugv_acceptance.cli.demo import demonstrate

    raise typer.Exit(demonstrate(bag, rate, page=console))
