"""Who sent a command of an operator, and who may: over DDS, on one monitor for the module."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import InertiaStamped
from nodes.live_case import WARN, Driver, Live, live_nodes, parameter, session_of
from rcl_interfaces.msg import Log
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node
from std_srvs.srv import Trigger

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.nodes.monitor import sender_subscription
from ugv_acceptance.nodes.monitor.node import Monitor
from ugv_acceptance.nodes.runner_world import Guard

SPACE = '/guarded'
# The level of a line of the log.
WARNING = 30
COMMANDS: dict[str, dict[str, str]] = {
    'acknowledge': {},
    'reset': {},
    'shelve': {'code': 'TIP_OVER'},
    'unshelve': {'code': 'TIP_OVER'},
    'ground': {'kind': 'stairs'},
    'payload': {'mass_kg': '1'},
    'hand_may_touch': {'allowed': 'true'},
}
# What the monitor has when it comes up.
AT_FIRST: dict[str, dict[str, str]] = {
    'ground': {'kind': ''},
    'payload': {'mass_kg': '4'},
    'hand_may_touch': {'allowed': 'false'},
}


class Hand(Node):
    """A node that commands the monitor and hears its answers."""

    def __init__(self, name: str, space: str = SPACE) -> None:
        super().__init__(name, namespace=space)
        self.answers: list[DiagnosticStatus] = []
        self.out = self.create_publisher(DiagnosticStatus, 'acceptance_monitor/operator', 50)
        self.create_subscription(
            DiagnosticStatus, 'acceptance_monitor/operator_answer', self.answers.append, 50
        )

    def tell(self, do: str, number: str, **values: str) -> None:
        """Send a command in the name of Ada."""
        pairs = [KeyValue(key=k, value=v) for k, v in {**values, 'id': number}.items()]
        self.out.publish(DiagnosticStatus(name=do, hardware_id='Ada', values=pairs))


@dataclass
class Guarded:
    """A monitor that takes commands of /guarded/panel and /site/desk, and what they need."""

    live: Live
    monitor: Monitor
    driver: Driver
    panel: Hand
    stranger: Hand
    told: int = 0
    log: list[str] = field(default_factory=list)

    def answer(self, hand: Hand, do: str, **values: str) -> tuple[DiagnosticStatus, dict[str, str]]:
        """Have a node command, and return the answer with its values."""
        self.told += 1
        number = f'{hand.get_name()} {self.told}'
        hand.tell(do, number, **values)
        return self.heard(hand, number)

    def heard(self, hand: Hand, number: str) -> tuple[DiagnosticStatus, dict[str, str]]:
        """Wait for the answer to a command."""

        def found() -> list[tuple[DiagnosticStatus, dict[str, str]]]:
            every = [(a, {p.key: p.value for p in a.values}) for a in hand.answers]
            return [(a, values) for a, values in every if values['id'] == number]

        self.live.until(found, self.driver.send)
        return found()[0]

    def hear(self, line: Log) -> None:
        """Take a line of the monitor's log."""
        self.log.append(f'{"WARN" if line.level == WARNING else "INFO"} {line.msg}')

    def value(self, name: str) -> object:
        """Return a parameter of the monitor."""
        return self.monitor.get_parameter(name).value

    def alert(self, code: str, state: str) -> DiagnosticStatus:
        """Wait for a change of an alert."""

        def found() -> list[DiagnosticStatus]:
            every = [(a, {p.key: p.value for p in a.values}) for a in self.driver.alerts]
            return [a for a, v in every if (v['code'], v['state']) == (code, state)]

        self.live.until(found, self.driver.send)
        return found()[-1]


def guarded_file(folder: Path, repository: Path) -> str:
    """Write PackBot's configuration with two operators."""
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    urdf = repository / 'urdf' / 'packbot.urdf'
    path = folder / 'guarded.yaml'
    text = re.sub(r'(?m)^urdf:.*$', f'urdf: {urdf}', text)
    path.write_text(f'{text}\noperators: [panel, /site/desk]\n', 'utf-8')
    return str(path)


@pytest.fixture(scope='module')
def running(tmp_path_factory: pytest.TempPathFactory, repository: Path) -> Iterator[Guarded]:
    """Return a monitor that has margins and operators."""
    config = guarded_file(tmp_path_factory.mktemp('operators'), repository)
    with live_nodes() as live:
        monitor = live.monitor(config=config, arguments=('-r', f'__ns:={SPACE}'))
        panel, stranger = live.add(Hand('panel')), live.add(Hand('stranger'))
        made = Guarded(live, monitor, live.driver(namespace=SPACE), panel, stranger)
        panel.create_subscription(Log, '/rosout', made.hear, 100)
        live.until(
            lambda: (
                session_of(monitor).evaluator.margins is not None
                and panel.out.get_subscription_count()
                and stranger.out.get_subscription_count()
            ),
            made.driver.send,
        )
        yield made


@pytest.fixture
def site(running: Guarded) -> Guarded:
    """Return it as it came up, whatever its operator told it before."""
    for do, values in AT_FIRST.items():
        assert running.answer(running.panel, do, **values)[1]['result'] == 'done'
    # The parameter follows a load a little later.
    running.live.until(lambda: running.value('payload.mass_kg') == 4.0, running.driver.send)
    return running


@pytest.mark.parametrize('do', COMMANDS)
def test_a_stranger_is_refused(site: Guarded, do: str) -> None:
    """Whatever it commands, nothing is done; answer and log name the node beside its claim."""
    said, values = site.answer(site.stranger, do, **COMMANDS[do])
    assert (said.level[0], values['result']) == (WARN, 'refused')
    assert (said.hardware_id, values['from']) == ('Ada', '/guarded/stranger')
    assert said.message == (
        'sent by /guarded/stranger; only /guarded/panel, /site/desk may: `operators` in the'
        ' configuration'
    )
    line = f'WARN operator Ada (from /guarded/stranger): {said.message} (refused)'
    site.live.until(lambda: line in site.log, site.driver.send)
    assert [site.value(name) for name in ('ground.kind', 'payload.mass_kg', 'hand_may_touch')] == [
        '',
        4.0,
        False,
    ]


def test_a_stranger_raises_an_alert(site: Guarded) -> None:
    """A CAUTION names the node."""
    site.answer(site.stranger, 'ground', kind='flat')
    raised = {pair.key: pair.value for pair in site.alert('FOREIGN_OPERATOR', 'raised').values}
    assert raised['happened'] == (
        'a command from /guarded/stranger was refused: the configuration names others as operators'
    )


def test_an_operator_is_told_from_all_others(site: Guarded) -> None:
    """Several nodes publish on the topic; the command of the one that may is carried out."""
    said, values = site.answer(site.panel, 'ground', kind='flat')
    assert (values['result'], values['from']) == ('done', '/guarded/panel')
    assert site.value('ground.kind') == 'flat'
    line = f'INFO operator Ada (from /guarded/panel): {said.message}'
    site.live.until(lambda: line in site.log, site.driver.send)


def test_a_refused_number_is_free_for_an_operator(site: Guarded) -> None:
    """A stranger cannot have a command refused by sending its number first."""
    site.stranger.tell('ground', 'same', kind='stairs')
    assert site.heard(site.stranger, 'same')[1]['result'] == 'refused'
    site.panel.answers.clear()
    site.panel.tell('ground', 'same', kind='uneven')
    assert site.heard(site.panel, 'same')[1]['result'] == 'done'
    assert site.value('ground.kind') == 'uneven'


def test_an_acknowledged_alert_says_who_and_from_where(site: Guarded) -> None:
    """The person that the command claims, and the node that sent it, each on its own."""
    site.live.until(
        lambda: any('TIP_OVER' in a.name for a in site.driver.alerts),
        lambda: site.driver.send(roll=1.2),
    )
    site.answer(site.panel, 'acknowledge', code='TIP_OVER')
    values = {p.key: p.value for p in site.alert('TIP_OVER', 'acknowledged').values}
    assert (values['who'], values['from']) == ('Ada', '/guarded/panel')


@pytest.mark.parametrize('service', ['acknowledge', 'reset'])
def test_a_service_tells_no_caller_and_is_refused(site: Guarded, service: str) -> None:
    """It says what to do instead, and does nothing."""
    before = site.monitor.session
    answer = site.live.call(Trigger, f'{SPACE}/acceptance_monitor/{service}')
    assert not answer.success
    assert f'tell {service}' in answer.message
    assert site.monitor.session is before


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('payload.mass_kg', 2.0),
        ('payload.cog_m', [0.1, 0.0, 0.0]),
        ('ground.kind', 'stairs'),
        ('hand_may_touch', True),
    ],
)
def test_what_operators_declare_is_no_ones_parameter(
    site: Guarded, name: str, value: object
) -> None:
    """A parameter service does not tell who calls either; a limit can be set unless locked."""
    set_all = f'{SPACE}/acceptance_monitor/set_parameters_atomically'
    made: Any = parameter(name, value)
    given = [made.to_parameter_msg()]
    asked = SetParametersAtomically.Request(parameters=given)
    result = site.live.call(SetParametersAtomically, set_all, asked).result
    assert not result.successful
    assert f'{name}: `operators`' in result.reason
    assert site.value(name) != value


def test_a_load_on_its_topic_is_still_followed(site: Guarded) -> None:
    """The payload topic is an input: `allowed_publishers` says who may."""
    out = site.panel.create_publisher(InertiaStamped, 'payload', 10)
    load = InertiaStamped()
    load.header.frame_id, load.inertia.m = 'gripper_link', 1.5
    site.live.until(out.get_subscription_count, site.driver.send)
    out.publish(load)
    site.live.until(lambda: site.value('payload.mass_kg') == 1.5, site.driver.send)
    site.panel.destroy_publisher(out)


def test_the_parameter_follows_a_load_whatever_else_is_told_at_once(site: Guarded) -> None:
    """A load and something else told within a second: the load's parameter shows it too."""
    site.panel.tell('payload', 'both a load', mass_kg='2')
    site.panel.tell('hand_may_touch', 'and the hand', allowed='true')
    assert site.heard(site.panel, 'and the hand')[1]['result'] == 'done'
    site.live.until(lambda: site.value('payload.mass_kg') == 2.0, site.driver.send)


def test_diagnostics_say_who_may_command(site: Guarded) -> None:
    """As the configuration names them."""
    name = 'guarded/acceptance_monitor: Monitor'
    site.live.until(lambda: name in site.driver.diagnostics, site.driver.send)
    values = {p.key: p.value for p in site.driver.diagnostics[name].values}
    assert values['operators'] == 'panel, /site/desk'


def test_the_alert_goes_when_the_stranger_is_quiet(site: Guarded) -> None:
    """Some seconds after the last command it cleared by itself."""
    site.driver.alerts.clear()
    site.answer(site.stranger, 'reset')
    site.alert('FOREIGN_OPERATOR', 'cleared')


def test_a_run_that_may_not_command_does_not_begin(tmp_path: Path, repository: Path) -> None:
    """It tells the monitor the ground of each step: one line says what the list lacks."""
    config = load(guarded_file(tmp_path, repository))
    with pytest.raises(BadConfig, match=r'operators: expected /acceptance_runner among them, beca'):
        Guard(config, lambda _: None)


def test_who_cannot_be_told_for_sure_is_refused(
    tmp_path: Path, repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the identities of messages a command counts as sent by any publisher there is."""
    monkeypatch.setattr(sender_subscription, 'RCL', 'no_such_library.so')
    config, space = guarded_file(tmp_path, repository), '/unsure'
    with live_nodes() as live:
        monitor = live.monitor(config=config, arguments=('-r', f'__ns:={space}'))
        panel, stranger = live.add(Hand('panel', space)), live.add(Hand('stranger', space))
        site = Guarded(live, monitor, live.driver('panel', space), panel, stranger)
        topic = f'{space}/acceptance_monitor/operator'
        live.until(lambda: set(nodes_of(monitor, topic)) == {'panel', 'stranger'})
        _, values = site.answer(panel, 'ground', kind='stairs')
        assert values['result'] == 'refused'
        assert values['from'] == 'one of /unsure/panel, /unsure/stranger'
        stranger.destroy_publisher(stranger.out)
        live.until(lambda: set(nodes_of(monitor, topic)) == {'panel'})
        _, values = site.answer(panel, 'ground', kind='stairs')
        assert (values['result'], values['from']) == ('done', '/unsure/panel')


def nodes_of(node: Node, topic: str) -> list[str]:
    """Return the names of the nodes that publish a topic."""
    return [info.node_name for info in node.get_publishers_info_by_topic(topic)]
