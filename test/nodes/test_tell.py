"""`ugv-acceptance tell`, in processes of its own, and the console: the monitor answers both.

One monitor serves the whole module; its driver sends what each test needs.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import InertiaStamped
from nodes.live_case import ERROR, FOLDED, Driver, Live, live_nodes, parameter, session_of

from ugv_acceptance import BadConfig, BadSample
from ugv_acceptance.cli.tell import values_of
from ugv_acceptance.config import load
from ugv_acceptance.console.snapshot import Awaited
from ugv_acceptance.evaluation.alerts.alarms import State
from ugv_acceptance.nodes.console_feed import ConsoleNode
from ugv_acceptance.nodes.monitor.node import Monitor
from ugv_acceptance.nodes.operator_client import OperatorClient

CODE = 'from ugv_acceptance.cli import main; main()'
STRETCHED = (0.0, 0.0, 0.0, 2.0)
# With it the monitor and its driver keep apart from those of other tests.
SPACE = '/told'
NAMED = ('--ros-args', '-r', f'__ns:={SPACE}')


def words(*told: str) -> 'subprocess.Popen[str]':
    """Start `tell`."""
    env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    command = [sys.executable, '-c', CODE, 'tell', *told]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, env=env, stdout=pipe, stderr=pipe, text=True)


@dataclass
class Site:
    """A monitor with its driver, which sends `pose` all the time; loads heard on the topic."""

    live: Live
    monitor: Monitor
    driver: Driver
    pose: tuple[float, ...] = FOLDED
    loads: list[InertiaStamped] = field(default_factory=list)

    def send(self) -> None:
        """Send the pose."""
        self.driver.send(self.pose)

    def until(self, condition: Callable[[], Any]) -> None:
        """Spin and send until a condition holds."""
        self.live.until(condition, self.send)

    def tell(self, *told: str) -> tuple[int, str, str]:
        """Run `tell` against this monitor; return exit code, output and errors."""
        process = words(*told, *NAMED)
        self.until(lambda: process.poll() is not None)
        out, errors = process.communicate()
        return process.returncode, out, errors

    def verdict(self) -> dict[str, str]:
        """Return the values of the newest verdict; none before the first."""
        newest = self.driver.verdicts[-1:]
        return {pair.key: pair.value for status in newest for pair in status.values}

    def states(self, code: str) -> set[State]:
        """Return the states of the alarms with a code."""
        table = session_of(self.monitor).alarm_tracker.alarms.table
        return {alarm.state for (name, _, _), alarm in table.items() if name == code}


@pytest.fixture(scope='module')
def running() -> Iterator[Site]:
    """Return a monitor that has margins."""
    with live_nodes() as live:
        monitor = live.monitor(payload__mass_kg=4.0, arguments=('-r', f'__ns:={SPACE}'))
        made = Site(live, monitor, live.driver(namespace=SPACE))
        made.driver.create_subscription(InertiaStamped, 'payload', made.loads.append, 10)
        made.until(lambda: session_of(monitor).evaluator.margins is not None)
        yield made


@pytest.fixture
def site(running: Site) -> Site:
    """Return it as it came up, with the robot folded, whatever was told before."""
    running.pose = FOLDED
    told = {'payload__mass_kg': 4.0, 'ground__kind': '', 'hand_may_touch': False}
    asked = running.monitor.set_parameters_atomically([parameter(k, v) for k, v in told.items()])
    assert asked.successful, asked.reason
    running.until(lambda: not session_of(running.monitor).level)
    for do in ('acknowledge', 'reset'):
        running.driver.operate(do, 'Ada')
    running.until(lambda: not running.states('TIP_OVER'))
    running.until(lambda: running.verdict().get('payload_kg') == '4')
    running.driver.alerts.clear()
    running.loads.clear()
    return running


@contextmanager
def console_of(site: Site) -> Iterator[ConsoleNode]:
    """Give a console beside the monitor, which is spun by its snapshots alone."""
    console = ConsoleNode(load(), namespace=SPACE)
    try:
        site.until(lambda: console.snapshot().black_box)
        yield console
    finally:
        console.close()


def answered(site: Site, console: ConsoleNode, do: str, values: dict[str, Any]) -> str:
    """Return the answer to a console's command, which its snapshots bring."""
    return heard(site, console, console.command(do, values))


def heard(site: Site, console: ConsoleNode, asked: Awaited) -> str:
    """Return an answer; 20 snapshots a second bring it, as those of a page do."""
    said, due = asked(), 0.0

    def show() -> None:
        nonlocal said, due
        site.send()
        if said is None and time.monotonic() >= due:
            due = time.monotonic() + 0.05
            console.snapshot()
            said = asked()

    site.live.until(lambda: said is not None, show)
    return str(said)


def keys(console: ConsoleNode, code: str) -> list[str]:
    """Return the keys of a code's alerts."""
    return [row.key for row in console.book.rows.values() if row.code == code]


def test_the_ground_is_told_by_name_and_note(site: Site) -> None:
    """The monitor takes the kind of ground; the answer says what it was before."""
    done = site.tell('ground', 'stairs', '--by', 'Ada', '--note', 'at the gate')
    assert done == (0, 'ground is now stairs; before: flat (not entered)\n', '')
    assert site.monitor.get_parameter('ground.kind').value == 'stairs'
    site.until(lambda: site.verdict()['ground'] == 'stairs')


def test_a_load_is_told_to_monitor_and_recorders(site: Site) -> None:
    """The load is in force at the monitor, on its topic and in the verdict."""
    code, said, _ = site.tell('payload', '2.5kg', '--at', '10cm,0,0')
    assert (code, said) == (0, 'payload is now 2.5 kg at 0.1, 0, 0 m in gripper_link\n')
    assert session_of(site.monitor).evaluator.payload.mass == 2.5
    site.until(lambda: site.loads)
    assert (site.loads[0].inertia.m, site.loads[0].inertia.com.x) == (2.5, 0.1)
    site.until(lambda: site.verdict()['payload_kg'] == '2.5')
    assert site.verdict()['payload_cog_m'] == '0.1,0,0'
    assert not site.states('SECOND_PUBLISHER')


def test_an_alarm_is_acknowledged_then_reset_and_neither_before_its_time(site: Site) -> None:
    """Each step is answered in a line; what cannot be done is refused with the reason."""
    site.pose = STRETCHED
    site.until(lambda: site.driver.verdicts[-1].level[0] == ERROR and site.states('TIP_OVER'))
    site.pose = FOLDED
    site.until(lambda: site.driver.verdicts[-1].message.startswith('over now'))
    code, out, refusal = site.tell('reset')
    assert (code, out) == (1, '')
    assert (
        'refused: reset: acknowledge first: TIP_OVER front (DANGER) is over, not acknowledged'
        in refusal
    )
    code, said, _ = site.tell('acknowledge', 'tip_over', '--by', 'Ada', '--note', 'stands well')
    assert code == 0
    assert 'TIP_OVER front (DANGER), over, latched until reset' in said
    change = [a for a in site.driver.alerts if 'TIP_OVER front' in a.name][-1]
    assert {'Ada', 'stands well'} <= {pair.value for pair in change.values}
    assert site.states('TIP_OVER') == {State.LATCHED}
    assert site.tell('reset')[:2] == (0, 'reset: TIP_OVER front (DANGER)\n')
    assert not site.states('TIP_OVER')


def test_where_no_monitor_is_says_where_it_was_looked_for(site: Site) -> None:
    """Exit code 2, with topic and domain; a monitor of another namespace is named."""
    node = site.live.add(rclpy.create_node('elsewhere', namespace='/nowhere'))
    client = OperatorClient(node)
    site.until(lambda: f'one is in the namespace {SPACE}' in client.where())
    process = words('ground', 'flat', '--within', '0.5', '--ros-args', '-r', '__ns:=/nowhere')
    site.until(lambda: process.poll() is not None)
    out, error = process.communicate()
    assert (process.returncode, out) == (2, '')
    domain = os.environ['ROS_DOMAIN_ID']
    assert f'no monitor hears on /nowhere/acceptance_monitor/operator, ROS domain {domain}' in error


@pytest.mark.parametrize(
    ('do', 'values', 'reason'),
    [
        ('ground', {'kind': 'lava'}, "ground: expected one of flat, uneven, stairs, got 'lava'"),
        ('payload', {'mass_kg': 'much'}, "mass_kg: expected a number, got 'much'"),
        ('payload', {'mass_kg': '1', 'cog_m': '1,2'}, 'cog_m: expected three numbers'),
        ('payload', {'mass_kg': '-1'}, 'payload: expected a mass from 0 to 100000 kg, got -1 kg'),
        ('hand_may_touch', {'allowed': 'perhaps'}, 'expected allowed: true or false'),
        ('explode', {}, 'name: expected one of acknowledge, shelve, unshelve, reset, ground'),
    ],
)
def test_a_refusal_is_answered(site: Site, do: str, values: dict[str, str], reason: str) -> None:
    """What the monitor does not do is answered with a reason, and changes nothing."""
    heard: list[DiagnosticStatus] = []
    at = 'acceptance_monitor/operator_answer'
    listener = site.driver.create_subscription(DiagnosticStatus, at, heard.append, 50)
    before = session_of(site.monitor).settings
    number = f'{do} {sorted(values.items())}'

    def ask() -> None:
        # Until both sides know each other an answer may be lost; a command counts once.
        site.driver.operate(do, 'Ada', id=number, **values)
        site.send()

    def answers() -> list[dict[str, str]]:
        told = [{pair.key: pair.value for pair in status.values} for status in heard]
        return [values for values in told if values['id'] == number]

    site.live.until(answers, ask)
    assert answers()[0]['result'] == 'refused'
    assert any(reason in status.message for status in heard)
    assert session_of(site.monitor).settings == before
    site.driver.destroy_subscription(listener)


def test_a_command_that_comes_again_is_done_once(site: Site) -> None:
    """A client that heard no answer sends its command again, under its id: it counts once."""
    for kind in ('uneven', 'flat', 'uneven'):
        site.driver.operate('ground', 'Ada', kind=kind, id=kind)
    site.driver.operate('hand_may_touch', 'Ada', allowed='true')
    site.until(lambda: site.monitor.get_parameter('hand_may_touch').value)
    assert site.monitor.get_parameter('ground.kind').value == 'flat'


def test_a_console_says_what_the_monitor_answered(site: Site) -> None:
    """Whatever an operator does on page or terminal, the text is the answer of the monitor."""
    with console_of(site) as console:
        site.until(lambda: console.snapshot().known)
        said = answered(site, console, 'ground', {'kind': 'flat', 'by': 'Ada'})
        assert said == 'ground is now flat; before: flat (not entered)'
        site.pose = STRETCHED
        site.until(lambda: console.snapshot() and len(keys(console, 'TIP_OVER')) == 2)
        asked = {'keys': [*keys(console, 'TIP_OVER'), 'of-another-time'], 'note': 'seen'}
        said = answered(site, console, 'acknowledge', asked)
        assert said.count('TIP_OVER front') == 2
        assert site.states('TIP_OVER') == {State.ACTIVE_ACKNOWLEDGED}
        with pytest.raises(BadSample, match='no alert of this card offers that'):
            answered(site, console, 'reset', asked)
        load = {'mass_kg': -1.0, 'cog_m': [0.0, 0.0, 0.0]}
        with pytest.raises(BadSample, match='refused: payload: expected a mass from 0'):
            answered(site, console, 'payload', load)


def test_a_console_goes_on_while_a_busy_monitor_has_not_answered(site: Site) -> None:
    """The command does not wait, frames are made all the time, and a late answer is told."""
    with console_of(site) as console:
        asked = console.command('ground', {'kind': 'flat', 'by': 'Ada'})
        # Nobody spins the monitor: it stands still for longer than a page may.
        until = time.monotonic() + 0.8
        while time.monotonic() < until:
            console.snapshot()
            assert asked() is None
        assert heard(site, console, asked).startswith('ground is now flat')


def test_a_console_follows_what_the_monitor_says_of_itself(site: Site) -> None:
    """Its load is that of the monitor, whoever told it; black box and running time are shown."""
    with console_of(site) as console:
        site.until(lambda: console.snapshot().known)
        site.monitor.set_parameters_atomically([parameter('payload__mass_kg', 1.25)])
        site.until(lambda: console.snapshot().payload.mass == 1.25)
        shown = console.snapshot()
        assert shown.black_box == 'off'
        assert 0.0 <= shown.running < 600.0


@pytest.mark.parametrize(
    ('what', 'typed', 'options', 'values'),
    [
        ('acknowledge', [], {}, {}),
        ('shelve', ['clock'], {'length': '5min'}, {'code': 'CLOCK', 'seconds': '300.0'}),
        ('shelve', ['CLOCK'], {'length': '90s'}, {'code': 'CLOCK', 'seconds': '90.0'}),
        ('reset', ['TIP_OVER', 'left'], {}, {'code': 'TIP_OVER', 'subject': 'left'}),
        ('payload', ['1lb'], {}, {'mass_kg': '0.45359237'}),
        ('payload', ['2'], {'at': '1cm,0,-2mm'}, {'mass_kg': '2.0', 'cog_m': '0.01,0.0,-0.002'}),
        ('hand', ['not-allowed'], {}, {'allowed': 'false'}),
    ],
)
def test_what_is_typed_becomes_a_command(
    what: str, typed: list[str], options: dict[str, str], values: dict[str, str]
) -> None:
    """Units are taken as on every command line."""
    assert values_of(what, typed, **options) == values


@pytest.mark.parametrize(
    ('what', 'typed', 'options', 'reason'),
    [
        ('shout', [], {}, 'expected one of acknowledge, shelve'),
        ('shelve', [], {}, 'expected CODE'),
        ('shelve', ['TIP_OVR'], {}, 'did you mean TIP_OVER'),
        ('ground', ['lava'], {}, 'expected flat, uneven, stairs'),
        ('payload', ['2m'], {}, 'mass'),
        ('payload', ['2kg'], {'at': '1cm'}, '--at: expected three lengths'),
        ('payload', ['2kg'], {'at': '1,2,3'}, '--at: expected a length with its unit'),
        ('shelve', ['CLOCK'], {'length': 'long'}, '--for: expected a time'),
    ],
)
def test_what_cannot_be_told_is_said_before_anything_is_sent(
    what: str, typed: list[str], options: dict[str, str], reason: str
) -> None:
    """A wrong word, code, mass or place: what was expected, and what came."""
    with pytest.raises(BadConfig, match=reason):
        values_of(what, typed, **options)


def test_tab_completes_what_may_follow() -> None:
    """The shell is offered the kinds of ground, and the codes of alerts that begin so."""
    for typed, offered in (
        ('ground s', ['stairs']),
        ('reset TIP_O', ['TIP_OVER']),
    ):
        asked = {'COMP_WORDS': f'ugv-acceptance tell {typed}', 'COMP_CWORD': '3'}
        env = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
        command = [sys.executable, '-c', f'import sys; sys.argv[0] = "ugv-acceptance"; {CODE}']
        done = subprocess.run(
            command,
            env={**env, **asked, '_UGV_ACCEPTANCE_COMPLETE': 'complete_bash'},
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.split() == offered
