"""The live console's table of inputs: what is counted and shown is what was sent, by real DDS."""

import time
from collections.abc import Iterator

import pytest
from geometry_msgs.msg import InertiaStamped
from nodes.live_case import FOLDED, Driver, Live, imu, joints

from ugv_acceptance.bag.encode import joint_state_cdr
from ugv_acceptance.config import load
from ugv_acceptance.console.frame import Plain, frame_of
from ugv_acceptance.monitoring.drawing import figure_of
from ugv_acceptance.monitoring.session import INPUTS, InputCount
from ugv_acceptance.nodes.console_feed import ConsoleNode

CONFIG = load()
SECOND = 1_000_000_000
# Messages of each input in a frame of 50 ms: 50 Hz, 100 Hz; every fifth frame a payload: 4 Hz.
FRAME, FRAMES, OF_JOINTS, OF_IMU, PAYLOAD = 0.05, 100, (2, 3), 5, 5


@pytest.fixture
def console() -> Iterator[ConsoleNode]:
    """Return the console's node, which is spun by its snapshots alone."""
    node = ConsoleNode(CONFIG)
    yield node
    node.close()


class Robot:
    """A robot's driver that counts what it sends."""

    def __init__(self, live: Live, roll: float) -> None:
        self.driver: Driver = live.driver()
        self.load = self.driver.create_publisher(InertiaStamped, 'payload', 10)
        self.roll = roll
        self.sent = dict.fromkeys(INPUTS, 0)

    def heard(self) -> bool:
        """Return whether somebody listens to all inputs."""
        return self.driver.connected() and bool(self.load.get_subscription_count())

    def send(self, frame: int) -> None:
        """Publish what is due in a frame."""
        for _ in range(OF_JOINTS[frame % 2]):
            self.driver.joints.publish(joints(FOLDED))
            self.sent['joint_states'] += 1
        for _ in range(OF_IMU):
            self.driver.imu.publish(imu(self.roll))
            self.sent['imu'] += 1
        if frame % PAYLOAD == 0:
            message = InertiaStamped()
            message.header.frame_id = CONFIG.settings.robot.payload_link or ''
            message.inertia.m = 1.0
            self.load.publish(message)
            self.sent['payload'] += 1


def taken(console: ConsoleNode) -> dict[str, int]:
    """Return what the console has counted."""
    return {name: count.taken for name, count in console.session.counts.items()}


def rows(console: ConsoleNode) -> dict[str, Plain]:
    """Return the inputs as the page and the terminal are given them."""
    settings = console.settings
    shown = frame_of(console.snapshot(), settings, figure_of(settings.robot))['inputs']
    return {row['name']: row for row in shown}


def really(log: list[tuple[float, dict[str, int]]], name: str) -> tuple[float, float]:
    """Return the least and the largest rate (Hz) sent over 1.5 to 4 s at the end of the log."""
    rates = [
        (sent[name] - before[name]) / (now - then)
        for now, sent in log
        for then, before in log
        if 1.5 < now - then < 4.0 and now > log[-1][0] - 1.5
    ]
    return min(rates), max(rates)


# Without a roll the orientation is exactly that of a sensor that never looked.
@pytest.mark.parametrize('roll', [0.0, 0.2])
def test_what_is_shown_is_what_was_sent(live: Live, console: ConsoleNode, roll: float) -> None:
    """Of every input all messages are counted, and the Hz shown are those at which they came."""
    robot = Robot(live, roll)
    live.until(robot.heard)
    log, due = [], time.monotonic()
    for frame in range(FRAMES):
        robot.send(frame)
        live.until(lambda: console.snapshot() and taken(console) == robot.sent)
        log.append((time.monotonic(), dict(robot.sent)))
        due = max(due + FRAME, time.monotonic())
        time.sleep(max(due - time.monotonic(), 0.0))
    shown = rows(console)
    for name in INPUTS:
        least, most = really(log, name)
        assert 0.95 * least <= shown[name]['rate_hz'] <= 1.05 * most, (name, least, most)
        assert shown[name]['age_s'] is not None
    # On a busy machine one may have been late.
    fine = dict.fromkeys(INPUTS, ('OK', ''))
    live.until(
        lambda: fine == {k: (row['level'], row['text']) for k, row in rows(console).items()},
        lambda: robot.send(0),
    )


def test_what_cannot_be_read_is_counted_as_that(live: Live, console: ConsoleNode) -> None:
    """Joint states that are none are malformed, each of them, and none of them arrived."""
    robot = Robot(live, 0.0)
    live.until(robot.heard)
    broken = joint_state_cdr(1, '', ['a'], [0.0])[:-5]
    for _ in range(7):
        robot.driver.joints.publish(broken)
    count = console.session.counts['joint_states']
    live.until(lambda: console.snapshot() and count.malformed + count.taken == 7)
    assert (count.malformed, count.taken) == (7, 0)
    row = rows(console)['joint_states']
    assert (row['age_s'], row['rate_hz']) == (None, 0.0)


@pytest.mark.parametrize('hertz', [0.4, 1.0, 3.0, 50.0, 400.0])
def test_the_rate_is_that_between_messages(hertz: float) -> None:
    """Looked at once a second or a little later, an input of any rate shows that rate."""
    count, shown, sent = InputCount(), list[float | None](), 0
    for look in range(1, 30):
        now = look * SECOND + look % 7 * SECOND // 50
        while sent / hertz * SECOND <= now:
            count.taken, count.last, sent = sent + 1, int(sent / hertz * SECOND), sent + 1
        shown.append(count.rate(now, shown[-1] if shown else None))
    assert shown[8:] == pytest.approx([hertz] * len(shown[8:]))


def test_what_falls_silent_has_no_rate_and_begins_anew() -> None:
    """After two periods of silence it is 0 Hz; what comes again is not measured over the gap."""
    count, known, shown = InputCount(), None, []
    for look in range(1, 41):
        if look <= 5 or look > 30:
            count.taken, count.last = count.taken + 50, look * SECOND
        known = count.rate(look * SECOND, known)
        shown.append(known)
    assert shown[1:5] == [50.0] * 4
    assert shown[6:30] == [0.0] * 24
    assert shown[30] is None
    assert shown[31:] == [50.0] * 9
