"""The monitor and the robot's own description on /robot_description."""

import re
from pathlib import Path
from typing import Any

import pytest
import rclpy
from nodes.live_case import OK, STALE, WARN, Live, levels, session_of
from rclpy.lifecycle import TransitionCallbackReturn
from std_msgs.msg import String

from ugv_acceptance.bag.told_robot import descriptions_in
from ugv_acceptance.nodes.monitor import own_description
from ugv_acceptance.nodes.monitor.node import Monitor
from ugv_acceptance.nodes.monitor.own_description import QOS
from ugv_acceptance.offline.evaluate import evaluate

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE
MASS = re.compile(r'(<link name="chassis_link">.*?<mass value=")([0-9.]+)', re.DOTALL)


@pytest.fixture(scope='module')
def urdf(repository: Path) -> str:
    """Return the URDF that ships."""
    return (repository / 'urdf' / 'packbot.urdf').read_text('utf-8')


@pytest.fixture(scope='module')
def bare(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the configuration that ships, without the URDF that it names."""
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    path = tmp_path_factory.mktemp('bare') / 'robot.yaml'
    path.write_text(re.sub(r'(?m)^urdf:.*$', '', text), 'utf-8')
    return str(path)


def heavier(urdf: str) -> str:
    """Return a URDF with a chassis that is heavier by 2 kg."""
    return MASS.sub(lambda found: f'{found[1]}{float(found[2]) + 2:g}', urdf)


class Teller:
    """What robot_state_publisher is to a robot: tells its description to whoever asks."""

    def __init__(self, live: Live, text: str | bytes, name: str = 'teller', **node: Any) -> None:
        self.node = live.add(rclpy.create_node(name, **node))
        self._publisher = self.node.create_publisher(String, 'robot_description', QOS)
        self.tell(text)

    def tell(self, text: str | bytes) -> None:
        """Publish a text, or a message as it is."""
        self._publisher.publish(String(data=text) if isinstance(text, str) else text)


def trigger(monitor: Any, transition: str) -> Any:
    """Do as a lifecycle manager does."""
    return getattr(monitor, f'trigger_{transition}')()


def problem(monitor: Monitor) -> str:
    """Return what the verdict says."""
    return monitor.verdict().message


def test_a_monitor_without_a_urdf_comes_up_when_the_robot_tells_its_own(
    live: Live, urdf: str, bare: str
) -> None:
    """Until then it says STALE and what it waits for; then it has the margins of that robot."""
    monitor, driver = live.monitor(config=bare), live.driver()
    live.until(lambda: 'nobody publishes it' in problem(monitor), driver.send)
    assert monitor.verdict().level == STALE
    Teller(live, urdf)
    live.until(lambda: OK in levels(driver), driver.send)
    config = monitor.config
    assert config is not None
    assert (config.urdf_text.decode(), config.description) == (urdf, 'robot_description')
    status = driver.diagnostics['acceptance_monitor: Monitor']
    assert {p.key: p.value for p in status.values}['urdf_sha256'] == config.urdf_sha256


def test_a_lifecycle_manager_waits_for_the_description(
    live: Live, urdf: str, bare: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`configure` waits a few seconds; without a description it fails, and can be tried again."""
    monitor = live.monitor(config=bare, autostart=False)
    with monkeypatch.context() as patient:
        patient.setattr(own_description, 'WAIT', 0.1)
        assert trigger(monitor, 'configure') == FAILURE
    assert 'nobody publishes it' in problem(monitor)
    Teller(live, urdf)
    assert trigger(monitor, 'configure') == SUCCESS
    assert trigger(monitor, 'activate') == SUCCESS


def test_of_two_publishers_none_is_taken(live: Live, urdf: str, bare: str) -> None:
    """Which of them is the robot cannot be told: no margins, and both are named."""
    first, _ = Teller(live, urdf, 'one'), Teller(live, urdf, 'other')
    monitor, driver = live.monitor(config=bare), live.driver()
    live.until(lambda: '/one and /other: stop all but one' in problem(monitor), driver.send)
    assert monitor.verdict().level == STALE
    first.node.destroy_publisher(first._publisher)
    live.until(lambda: OK in levels(driver), driver.send)


@pytest.mark.parametrize(
    'text',
    ['', b'\x00\x01\x00\x00\x05\x00\x00\x00\xff\xfe\xfd\xfc\x00'],
)
def test_no_message_ends_the_monitor(live: Live, urdf: str, bare: str, text: str | bytes) -> None:
    """An unreadable description gives STALE and the reason; a good one after it brings it up."""
    teller = Teller(live, text)
    monitor, driver = live.monitor(config=bare), live.driver()
    live.until(lambda: '/robot_description' in problem(monitor), driver.send)
    live.until(lambda: 'nobody' not in problem(monitor) and 'none yet' not in problem(monitor))
    assert monitor.verdict().level == STALE
    assert monitor.session is None
    teller.tell(urdf)
    live.until(lambda: OK in levels(driver), driver.send)


def test_a_configured_urdf_that_is_not_the_robots_is_never_ok(live: Live, urdf: str) -> None:
    """CONFIG_DIFFERS names the first difference; it ends when the robot tells the configured."""
    teller = Teller(live, heavier(urdf))
    monitor, driver = live.monitor(), live.driver()
    live.until(lambda: monitor.own.heard)
    live.until(lambda: session_of(monitor).evaluator.margins is not None, driver.send)
    live.until(lambda: WARN in levels(driver), driver.send)
    assert OK not in levels(driver)
    assert 'link chassis_link: mass' in driver.verdicts[-1].message
    assert 'kg in the file' in driver.verdicts[-1].message
    teller.tell(urdf)
    live.until(lambda: OK in levels(driver), driver.send)


def test_the_configured_urdf_told_by_the_robot_is_ok(live: Live, urdf: str) -> None:
    """Other bytes of the same robot are no difference."""
    Teller(live, f'{urdf}<!-- expanded by xacro -->')
    monitor, driver = live.monitor(), live.driver()
    live.until(lambda: monitor.own.heard, driver.send)
    live.until(lambda: levels(driver).count(OK) > 2, driver.send)
    assert not [a for a in driver.alerts if 'CONFIG_DIFFERS' in a.name]


def test_a_description_that_changes_is_told_and_not_taken(live: Live, urdf: str, bare: str) -> None:
    """The URDF in force stays until the monitor is activated anew, which takes the new one."""
    teller = Teller(live, urdf)
    monitor, driver = live.monitor(config=bare), live.driver()
    live.until(lambda: OK in levels(driver), driver.send)
    teller.tell(heavier(urdf))
    live.until(lambda: any('CONFIG_DIFFERS' in a.name for a in driver.alerts), driver.send)
    assert 'kg when it was taken' in problem(monitor)
    config = monitor.config
    assert config is not None
    assert config.urdf_text.decode() == urdf
    live.until(lambda: len(monitor.own.heard) == 1, driver.send)  # the old one counts no longer
    trigger(monitor, 'deactivate')
    assert trigger(monitor, 'activate') == SUCCESS
    taken = monitor.config
    assert taken is not None
    assert taken.urdf_text.decode() == heavier(urdf)
    driver.verdicts.clear()
    live.until(lambda: OK in levels(driver), driver.send)


def test_it_is_relative_and_can_be_named(live: Live, bare: str, tmp_path: Path) -> None:
    """In a namespace it hears the robot of that namespace, on the topic of the configuration."""
    named = tmp_path / 'robot.yaml'
    text = Path(bare).read_text('utf-8')
    assert 'topics:' in text
    named.write_text(
        text.replace('topics:', 'topics:\n  robot_description: {name: base_description}'), 'utf-8'
    )
    monitor = live.monitor(config=str(named), arguments=('-r', '__ns:=/r1'))
    live.until(lambda: '/r1/base_description: nobody' in problem(monitor))


def test_the_black_box_holds_the_robot(live: Live, urdf: str, tmp_path: Path) -> None:
    """Its recordings hold the URDF in force, and what the robot told; `evaluate` sees both."""
    Teller(live, heavier(urdf))
    monitor, driver = live.running(black_box=str(tmp_path))
    live.until(lambda: monitor.own.heard, driver.send)
    live.until(lambda: list(tmp_path.glob('*')), lambda: driver.send(roll=0.7))
    trigger(monitor, 'deactivate')
    (folder,) = tmp_path.glob('*')
    found = evaluate(folder)
    told = descriptions_in(found.recording, 'robot_description')
    assert told.texts == (urdf.encode(), heavier(urdf).encode())
    assert found.verdict != 'PASS'
    safeguards = {s['name']: s for s in found.result['safeguards']}
    assert 'CONFIG_DIFFERS' in safeguards['robot_description']['reasons'][0]
