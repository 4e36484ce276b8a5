"""Every verb that takes a while ends when it is told to, as a terminal and as a supervisor tell it.

Ctrl-C on a terminal is SIGINT to all its processes; SIGTERM goes to the one that was started.
"""

import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

CODE = 'from ugv_acceptance.cli import main; main()'
BAGS = Path(__file__).parents[2] / 'bags'
BAG = str(BAGS / 'packbot_fail')
FILE = next((BAGS / 'packbot_fail').glob('*.mcap'))
# Seconds in which whatever is waited for comes, on a busy machine too.
PATIENCE = 100.0
SIGNALS = (signal.SIGINT, signal.SIGTERM)
Ready = Callable[['Started'], bool]


@dataclass
class Started:
    """A verb in a process of its own, and the files that it writes to."""

    process: 'subprocess.Popen[bytes]'
    folder: Path

    def out(self) -> str:
        """Return what it has printed."""
        return (self.folder / 'out').read_text()

    def errors(self) -> str:
        """Return what it has complained of."""
        return (self.folder / 'err').read_text()

    def children(self) -> list[int]:
        """Return the processes it has started."""
        return children(self.process.pid)


def children(pid: int) -> list[int]:
    """Return the processes that a process has started, theirs too."""
    with suppress(FileNotFoundError, ProcessLookupError):
        own = [int(x) for x in Path(f'/proc/{pid}/task/{pid}/children').read_text().split()]
        return own + [child for one in own for child in children(one)]
    return []


def gone(pid: int) -> bool:
    """Return whether a process has ended."""
    with suppress(FileNotFoundError, ProcessLookupError):
        return Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()[0] == 'Z'
    return True


def until(condition: Callable[[], bool], say: Callable[[], str]) -> None:
    """Wait until something comes true."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, say()
        time.sleep(0.02)


def environment() -> dict[str, str]:
    """Return the environment of a program of a person's: nothing for children of the wheels."""
    known = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    return {**known, 'TERM': 'xterm-256color', 'PYTHONUNBUFFERED': '1'}


@contextmanager
def started(folder: Path, words: tuple[str, ...]) -> Iterator[Started]:
    """Start a verb without a terminal, in a session of its own."""
    with (folder / 'out').open('wb') as out, (folder / 'err').open('wb') as err:
        process = subprocess.Popen(
            [sys.executable, '-c', CODE, *words],
            cwd=folder,
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=err,
            start_new_session=True,
        )
    try:
        yield Started(process, folder)
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()


def says(text: str) -> Ready:
    """Return whether it has printed this."""
    return lambda run: text in run.out()


def loaded(library: str) -> Ready:
    """Return whether it has loaded a library that only its work needs."""
    return lambda run: library in Path(f'/proc/{run.process.pid}/maps').read_text()


def on_the_net(run: Started) -> bool:
    """Return whether it has opened a socket: it is a node."""
    with suppress(FileNotFoundError):
        held = [fd.readlink() for fd in Path(f'/proc/{run.process.pid}/fd').iterdir()]
        return any(str(name).startswith('socket:') for name in held)
    return False


def working(run: Started) -> bool:
    """Return whether processes work for it: two, and the one that looks after what they share."""
    return len(run.children()) > 2


def records(run: Started) -> bool:
    """Return whether it writes a recording."""
    return any(run.folder.glob('made/*.mcap'))


# What runs until it is told to has done all that was asked: 0. What was to bring a result has none.
DONE = dict.fromkeys(SIGNALS, 0)
BROKEN_OFF = {number: 128 + number for number in SIGNALS}
TOLD_TO = {
    'monitor': (('monitor', '--plain'), says('NO DATA'), DONE),
    'console': (('console', '--port', '0'), says('Console on'), DONE),
    'console BAG': (('console', BAG, '--port', '0'), says('Console on'), DONE),
    'watch': (('watch',), says('NO DATA'), DONE),
    'watch BAG': (('watch', BAG), says('OK'), DONE),
    'foxglove': (('foxglove', '--port', '0'), says('Foxglove WebSocket'), DONE),
    'replay': (('replay', BAG, '--loop'), on_the_net, DONE),
    'demo': (('demo', '--rate', '0.2'), says('NO DATA'), BROKEN_OFF),
    'tell': (('tell', 'reset', '--within', '600'), on_the_net, BROKEN_OFF),
    'doctor': (('doctor', '--seconds', '600'), on_the_net, BROKEN_OFF),
    # What was recorded until then is judged and filed: inconclusive (3). It has sockets a moment
    # before that begins.
    'run': (('run', '--sim'), on_the_net, None),
    'run fast': (('run', '--sim', '--fast'), loaded('mujoco'), None),
    'simulate': (('simulate', 'work', '-s', '9000', '-o', 'made'), records, BROKEN_OFF),
    'campaign': (('campaign', 'runs', '--workers', '2'), working, BROKEN_OFF),
    'evaluate': (('evaluate', *[BAG] * 300), loaded('_multiarray_umath'), BROKEN_OFF),
    'plan': (('plan', '--points', '20'), loaded('_multiarray_umath'), BROKEN_OFF),
    'paper': (('paper', '--truth', '100000'), loaded('mujoco'), BROKEN_OFF),
    'risk': (('risk', '--samples', '1e10', '--workers', '2'), working, BROKEN_OFF),
    'map': (('map', 'rollover', '--steps', '5001'), loaded('_multiarray_umath'), BROKEN_OFF),
}


@pytest.mark.parametrize('name', TOLD_TO)
def test_a_verb_ends_when_it_is_told_to(name: str, tmp_path: Path) -> None:
    """SIGINT and SIGTERM end it and all it has started, with a code of its own and no traceback."""
    words, ready, codes = TOLD_TO[name]
    with ExitStack() as stack:
        runs = {}
        for number in SIGNALS:
            folder = tmp_path / number.name
            many(folder / 'runs')
            runs[number] = stack.enter_context(started(folder, words))
        for number, run in runs.items():
            end_it(run, number, ready)
            assert 'Traceback' not in run.errors() + run.out()
            assert run.process.returncode in ((codes[number],) if codes else (3, 128 + number)), (
                run.errors()
            )
            assert '\x1b' not in run.out(), 'codes for a terminal where there is none'


def test_a_stopped_campaign_says_how_to_go_on(tmp_path: Path) -> None:
    """How many runs are judged, where their results are, and the command; nothing on a pipe."""
    # So few that workers are given one at a time: results come soon, on a busy machine too.
    many(tmp_path / 'my runs', 31)
    words = ('campaign', 'my runs', '--workers', '2', '-o', 'all')
    with started(tmp_path, words) as run:
        end_it(
            run, signal.SIGINT, lambda run: working(run) and any(run.folder.glob('all/runs/*.json'))
        )
        told = ' '.join(run.errors().split())
        assert run.process.returncode == BROKEN_OFF[signal.SIGINT]
    found = re.search(r'stopped: (\d+) of 31 runs are judged, their results are in all/runs', told)
    assert found, told
    assert int(found[1]) < 31
    assert "ugv-acceptance campaign 'my runs' --workers 2 -o all" in told
    assert run.out() == ''


@pytest.mark.parametrize('number', SIGNALS)
@pytest.mark.parametrize('words', [('watch',), ('doctor', '--seconds', '600')])
def test_who_waits_for_the_description_of_the_robot_ends(
    words: tuple[str, ...], number: signal.Signals, tmp_path: Path
) -> None:
    """A signal that comes before the robot's own URDF has come is heard, and is no bad input."""
    text = (Path(__file__).parents[2] / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    (tmp_path / 'bare.yaml').write_text(re.sub(r'(?m)^urdf:.*$', '', text), 'utf-8')
    with started(tmp_path, (*words, '-c', 'bare.yaml')) as run:
        end_it(run, number, on_the_net)
        assert (run.process.returncode, run.errors()) == (BROKEN_OFF[number], '')


def many(folder: Path, count: int = 200) -> None:
    """Fill a folder with recordings that take a while to be judged."""
    folder.mkdir(parents=True)
    for k in range(count):
        (folder / f'run{k}.mcap').symlink_to(FILE)


def end_it(run: Started, number: signal.Signals, ready: Ready) -> None:
    """Tell it to end once it is at work, and wait until it and its children are gone."""

    def at_work() -> bool:
        assert run.process.poll() is None, run.out() + run.errors()
        return ready(run)

    until(at_work, lambda: f'never at work: {run.out()} {run.errors()}')
    helpers = run.children()
    if number is signal.SIGINT:
        os.killpg(run.process.pid, number)
    else:
        run.process.send_signal(number)
    until(lambda: run.process.poll() is not None, lambda: f'{number.name} is not heard')
    until(lambda: all(map(gone, helpers)), lambda: 'a process it started goes on')


# Loses the first signal as a callback of an import does, and the second as a careless library.
LOSES = """
import signal, time, weakref
from ugv_acceptance.cli.termination import ended_by_signals
class Thing: pass
def callback(_):
    signal.raise_signal(signal.SIGTERM)
with ended_by_signals() as told:
    thing = Thing()
    watched = weakref.ref(thing, callback)
    del thing
    assert told() == 143
    try:
        time.sleep(1000)
    except BaseException:
        pass
    try:
        time.sleep(1000)
    finally:
        end = time.monotonic() + 1.0
        while time.monotonic() < end: pass
        print('closed')
"""


def test_a_signal_is_not_lost() -> None:
    """A signal whose exception is swallowed raises again, but not while files are being closed."""
    done = subprocess.run(
        [sys.executable, '-c', LOSES], capture_output=True, text=True, check=False, timeout=PATIENCE
    )
    assert (done.returncode, done.stdout, done.stderr) == (143, 'closed\n', '')


@dataclass
class Screen:
    """A terminal with a verb on it; `text` is what came to it, `modes` what it had before."""

    mine: int
    theirs: int
    modes: list[Any]
    process: 'subprocess.Popen[bytes]'
    text: str = ''

    def shows(self, what: str) -> bool:
        """Take what came; return whether this is in it."""
        while select.select([self.mine], [], [], 0.0)[0]:
            self.text += os.read(self.mine, 65536).decode(errors='replace')
        return what in self.text

    def ended(self) -> bool:
        """Take what came; return whether the verb has ended."""
        over = self.process.poll() is not None
        self.shows('')
        return over


@contextmanager
def on_a_screen(*words: str) -> Iterator[Screen]:
    """Start a verb on a terminal of its own."""
    mine, theirs = pty.openpty()
    modes = termios.tcgetattr(theirs)
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack('4H', 40, 120, 0, 0))
    process = subprocess.Popen(
        [sys.executable, '-c', CODE, *words],
        env=environment(),
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
    )
    try:
        yield Screen(mine, theirs, modes, process)
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()
        os.close(mine)
        os.close(theirs)


LEAVE: dict[str, Callable[[Screen], object]] = {
    'q': lambda screen: os.write(screen.mine, b'q'),
    'Ctrl-C': lambda screen: os.write(screen.mine, b'\x03'),
    'SIGINT': lambda screen: screen.process.send_signal(signal.SIGINT),
    'SIGTERM': lambda screen: screen.process.send_signal(signal.SIGTERM),
}


@pytest.mark.parametrize('words', [('watch',), ('watch', BAG)], ids=['live', 'bag'])
def test_watch_gives_the_terminal_back(words: tuple[str, ...]) -> None:
    """Ended by key or signal, `watch` returns 0 and restores the terminal's modes and screen."""
    with ExitStack() as stack:
        screens = {how: stack.enter_context(on_a_screen(*words)) for how in LEAVE}
        for how, screen in screens.items():
            until(lambda s=screen: s.shows('Leave'), lambda s=screen: s.text)  # type: ignore[misc]
            LEAVE[how](screen)
            until(screen.ended, lambda how=how: f'{how} is not heard')  # type: ignore[misc]
            assert screen.process.returncode == 0, screen.text[-2000:]
            assert 'Traceback' not in screen.text
            assert termios.tcgetattr(screen.theirs) == screen.modes
            for entered, left in (('\x1b[?1049h', '\x1b[?1049l'), ('\x1b[?25l', '\x1b[?25h')):
                assert screen.text.rindex(left) > screen.text.rindex(entered), how
