"""`~/check`: may the arm move so? One running monitor answers over real DDS, for the whole module.

Its driver sends what each test needs; every test leaves the robot at rest, told and permitted.
"""

import math
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Duration
from diagnostic_msgs.msg import DiagnosticStatus
from nodes.live_case import (
    ERROR,
    FOLDED,
    NAMES,
    OK,
    STALE,
    Driver,
    Live,
    live_nodes,
    parameter,
    session_of,
)
from rclpy.serialization import serialize_message
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from ugv_acceptance.bag.trajectory import trajectory_from
from ugv_acceptance.nodes.monitor.node import Monitor

SPACE = '/asked'
SHOULDER = NAMES.index('shoulder_joint')
Values = dict[str, str]


def motion(*ways: float, names: tuple[str, ...] = NAMES, start: int = 0) -> JointTrajectory:
    """Return a motion of the shoulder away from where it stands, half a second for each of ways."""
    made = JointTrajectory(joint_names=list(names))
    made.header.stamp.sec, made.header.stamp.nanosec = divmod(start, 10**9)
    for k, way in enumerate(ways, start=1):
        q = [p + way * (j == SHOULDER) for j, p in enumerate(FOLDED)][: len(names)]
        after = Duration(sec=k // 2, nanosec=k % 2 * 500_000_000)
        made.points.append(JointTrajectoryPoint(positions=q, time_from_start=after))
    return made


def name_of(message: JointTrajectory) -> str:
    """Return what names a trajectory in its answers."""
    return trajectory_from(serialize_message(message)).sha256


@dataclass
class Answer:
    """An answer that was heard."""

    level: int
    text: str
    values: Values


@dataclass
class Site:
    """A monitor, and a driver that sends `pose` all the time, and asks."""

    live: Live
    monitor: Monitor
    driver: Driver
    pose: tuple[float, ...] = FOLDED
    sways: bool = False
    silent: bool = False
    due: float = 0.0
    answers: list[Answer] = field(default_factory=list)

    def __post_init__(self) -> None:
        at = 'acceptance_monitor/check'
        self.out = self.driver.create_publisher(JointTrajectory, at, 50)
        self.driver.create_subscription(DiagnosticStatus, f'{at}_result', self._hear, 50)

    def _hear(self, status: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in status.values}
        self.answers.append(Answer(status.level[0], status.message, values))

    def send(self) -> None:
        """Send posture and attitude 25 times a second, never twice the same to the last digit."""
        if not self.silent and time.monotonic() >= self.due:
            self.due = time.monotonic() + 0.04
            lean = math.sin(5.0 * self.due)
            self.driver.send(self.pose, (0.1 if self.sways else 1e-4) * lean)

    def until(self, condition: Callable[[], Any]) -> None:
        """Spin and send until a condition holds."""
        self.live.until(condition, self.send)

    def of(self, message: JointTrajectory, *results: str) -> list[Answer]:
        """Return what was heard about a trajectory with one of some results."""
        mine = [a for a in self.answers if a.values['trajectory_sha256'] == name_of(message)]
        return [a for a in mine if a.values['result'] in results]

    def ask(self, message: JointTrajectory) -> Answer:
        """Ask, again every three seconds as a client does, and return the answer."""
        results = ('permitted', 'refused', 'not_known')
        before, again = len(self.of(message, *results)), 0.0

        def answered() -> bool:
            nonlocal again
            if time.monotonic() >= again:
                again = time.monotonic() + 3.0
                self.out.publish(message)
            return len(self.of(message, *results)) > before

        self.until(answered)
        return self.of(message, *results)[before]

    def permitted(self, message: JointTrajectory) -> Answer:
        """Ask until the motion is permitted: the robot must have been at rest for a while."""
        self.until(lambda: self.ask(message).values['result'] == 'permitted')
        return self.of(message, 'permitted')[-1]

    def withdrawn(self, message: JointTrajectory) -> Answer:
        """Wait until a permission is withdrawn; return what is said."""
        self.until(lambda: self.of(message, 'withdrawn'))
        return self.of(message, 'withdrawn')[-1]

    def tell(self, do: str, **values: str) -> None:
        """Tell the monitor something as an operator does."""
        self.driver.operate(do, 'Ada', **values)


@contextmanager
def begun() -> Iterator[Site]:
    """Start a monitor, and wait until it has margins and hears questions and its operator."""
    with live_nodes() as live:
        # A busy machine stops this process for a second now and then: that is no silence here.
        space = ('-r', f'__ns:={SPACE}')
        monitor = live.monitor(arguments=space, delays__stale_after_s=2.0, delays__off_s=0.0)
        site = Site(live, monitor, live.driver(namespace=SPACE))
        site.until(lambda: session_of(monitor).evaluator.margins is not None)
        node = site.driver
        site.until(lambda: site.out.get_subscription_count() and node.hand.get_subscription_count())
        site.until(lambda: node.count_publishers(f'{SPACE}/acceptance_monitor/check_result'))
        yield site


@pytest.fixture(scope='module')
def running() -> Iterator[Site]:
    """Return a monitor that has margins, and hears questions."""
    with begun() as site:
        yield site


@pytest.fixture
def site(running: Site) -> Site:
    """Return it with the robot at rest, on flat ground that was told, with a load that was told."""
    running.pose, running.sways, running.silent = FOLDED, False, False
    running.tell('payload', mass_kg='1')
    running.tell('ground', kind='flat')
    running.tell('hand_may_touch', allowed='false')
    running.permitted(motion(0.05, 0.0))
    running.answers.clear()
    return running


def test_a_motion_is_permitted_or_refused_with_the_reason(site: Site) -> None:
    """Whoever asks gets an answer about that very trajectory, and until when it holds."""
    asked = site.monitor.get_clock().now().nanoseconds
    said = site.ask(motion(0.1, 0.0))
    assert (said.level, said.values['result']) == (OK, 'permitted')
    assert said.values['payload_by'] == 'operator'
    assert 0 < int(said.values['valid_until_ns']) - asked <= 62 * 10**9
    said = site.ask(motion(-0.4, -0.8, -1.2))
    assert (said.level, said.values['result']) == (ERROR, 'refused')
    assert 'on the way to point' in said.text


def silent(site: Site) -> None:
    """Let the driver be silent."""
    site.silent = True
    site.until(lambda: session_of(site.monitor).evaluator.margins is None)


def another(site: Site) -> None:
    """Let another node publish joint states too."""
    other: Any = site.live.driver('another', SPACE)
    site.until(lambda: session_of(site.monitor).faults.active)
    site.live.executor.remove_node(other)
    site.live.nodes.remove(other)
    other.destroy_node()


def swaying(site: Site) -> None:
    """Let the robot sway."""
    site.sways = True
    site.until(lambda: abs(session_of(site.monitor).evaluator.margins.gravity[1]) > 0.5)


def unlevel(site: Site) -> None:
    """Tell stairs, on which nobody knows yet whether the robot begins to tip."""
    site.tell('ground', kind='stairs')
    site.until(lambda: site.monitor.get_parameter('ground.kind').value == 'stairs')


def hand(site: Site) -> None:
    """Let the arm touch the ground."""
    site.tell('hand_may_touch', allowed='true')
    site.until(lambda: site.monitor.get_parameter('hand_may_touch').value)


MISSING = {
    'silent': (silent, 'NO DATA'),
    'another driver': (another, 'SECOND_PUBLISHER'),
    'swaying': (swaying, 'attitude changed|leans otherwise'),
    'stairs': (unlevel, 'stairs'),
    'hand': (hand, 'hand_may_touch'),
}


@pytest.mark.parametrize('state', sorted(MISSING))
def test_where_something_is_missing_nothing_is_permitted(site: Site, state: str) -> None:
    """A permission that stands is withdrawn, and the answer to a question is: not known."""
    site.permitted(motion(0.1, 0.0))
    bring, reason = MISSING[state]
    bring(site)
    said = site.ask(motion(0.2, 0.0))
    assert (said.level, said.values['result']) == (STALE, 'not_known')
    assert re.search(reason, said.values['reasons'])
    assert site.withdrawn(motion(0.1, 0.0)).level == STALE
    site.silent = False


def test_a_monitor_that_is_not_active_permits_nothing(site: Site) -> None:
    """It withdraws what it permitted, and answers; one that comes up anew has to be told anew."""
    monitor: Any = site.monitor
    site.permitted(motion(0.1, 0.0))
    monitor.trigger_deactivate()
    assert site.withdrawn(motion(0.1, 0.0)).values['cause'] == 'monitor'
    said = site.ask(motion(0.12, 0.0))
    assert (said.values['result'], said.text) == (
        'not_known',
        'not known: the monitor is not active',
    )
    monitor.trigger_activate()
    site.until(lambda: session_of(site.monitor).evaluator.margins is not None)
    assert site.permitted(motion(0.1, 0.0)).values['payload_by'] == 'operator'
    monitor.trigger_deactivate()
    monitor.trigger_cleanup()
    monitor.trigger_configure()
    monitor.trigger_activate()
    site.until(lambda: session_of(site.monitor).evaluator.margins is not None)
    site.until(lambda: not session_of(site.monitor).level)
    reasons = site.ask(motion(0.14, 0.0)).values['reasons']
    assert 'nobody told the payload' in reasons
    assert 'nobody told the ground' in reasons


def test_a_payload_is_told_by_a_parameter_too(site: Site) -> None:
    """Also one that is as heavy as before: somebody has said it. The answer says who."""
    for mass in (1.0, 0.5):
        site.monitor.set_parameters_atomically([parameter('payload__mass_kg', mass)])
        said = site.permitted(motion(0.1, 0.0))
        assert said.values['payload_by'] == 'parameter payload.mass_kg'
        assert float(said.values['payload_kg']) == mass
    site.tell('payload', mass_kg='2')
    assert site.withdrawn(motion(0.1, 0.0)).values['cause'] == 'payload'
    assert site.permitted(motion(0.1, 0.0)).values['payload_by'] == 'operator'


def test_a_permission_that_is_not_used_expires(site: Site) -> None:
    """Two seconds later it is taken back."""
    site.permitted(motion(0.1, 0.0))
    site.until(lambda: site.of(motion(0.1, 0.0), 'expired'))
    assert not site.of(motion(0.1, 0.0), 'withdrawn')


def test_the_gate_of_the_documentation_goes_on_a_permission_alone(site: Site) -> None:
    """Its code, as printed: it names trajectories as the monitor does, and goes only if it may."""
    page = (Path(__file__).parents[2] / 'docs/ros_interface.md').read_text(encoding='utf-8')
    (code,) = re.findall(r'```python\n(import hashlib.*?)```', page, re.DOTALL)
    names: dict[str, Any] = {
        'JointTrajectory': JointTrajectory,
        'DiagnosticStatus': DiagnosticStatus,
    }
    exec(code, names)  # noqa: S102 - our own documentation
    gone: list[JointTrajectory] = []
    gate = names['Gate'](site.driver, gone.append)
    site.until(gate.out.get_subscription_count)
    for message, goes in ((motion(-0.5, -1.0, -1.5), False), (motion(0.1, 0.0), True)):
        assert names['sha256_of'](message) == name_of(message)

        def asked(message: JointTrajectory = message) -> bool:
            due = time.monotonic() > gate.asked + 3.0  # as whoever hears no answer
            if (gate.waiting is None or due) and not gone:
                gate.ask(message)
            return bool(gone or site.of(message, 'refused'))

        site.until(asked)
        assert bool(gone) is goes


def test_neither_noise_nor_a_flood_keeps_the_monitor_from_its_work(site: Site) -> None:
    """Malformed and huge questions by the hundred: margins go on, the last question is answered."""
    before = session_of(site.monitor).evaluator.evaluated
    huge = motion(*[0.1, 0.0] * 5000)
    noise = [b'', b'\x00\x01\x00\x00' + b'\xff' * 60, serialize_message(huge)[:-500_000]]
    for k in range(200):
        site.out.publish(noise[k % 2])
        if k % 50 == 0:
            site.out.publish(huge)
            site.out.publish(noise[2])
        site.until(lambda: True)
        site.send()
    desk = site.monitor.motions.questions
    site.until(lambda: not desk.computing)
    site.until(lambda: session_of(site.monitor).evaluator.evaluated >= before + 300)
    assert desk.malformed
    assert site.ask(motion(0.1, 0.0)).values['result'] == 'permitted'
    assert not session_of(site.monitor).active
