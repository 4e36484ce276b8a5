"""A restarted driver counts as one source; two live publishers are two, whatever their names."""

import os
import random
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

import pytest
from nodes.live_case import Driver, Live, session_of

from ugv_acceptance.monitoring.publisher_identity import OUTLIVED, Publisher, Voices
from ugv_acceptance.nodes.monitor.node import Monitor

PUBLISHER = """
import sys, time
sys.path.insert(0, sys.argv[1])
import rclpy
from nodes.live_case import Driver
rclpy.init()
driver = Driver(sys.argv[2])
while True:
    driver.send()
    time.sleep(0.01)
"""
INPUTS = ('imu', 'joint_states')


@contextmanager
def started(name: str) -> Iterator['subprocess.Popen[bytes]']:
    """Run a driver of this name in a process of its own; kill it at the end, if not before."""
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    command = [sys.executable, '-c', PUBLISHER, str(Path(__file__).parents[1]), name]
    process = subprocess.Popen(command, env=environment)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def taken(monitor: Monitor) -> int:
    """Return how many messages of the input that has fewest were taken."""
    counts = session_of(monitor).counts
    return min(int(counts[name].taken) for name in INPUTS)


def more(monitor: Monitor, messages: int = 100) -> Callable[[], bool]:
    """Return whether so many more messages were taken, to be asked later."""
    before = taken(monitor)
    return lambda: taken(monitor) >= before + messages


def known(monitor: Monitor) -> list[int]:
    """Return how many publishers ROS knows of each input."""
    assert monitor._inputs is not None
    heard = monitor._inputs.subscriptions
    return [monitor.count_publishers(heard[name].topic_name) for name in INPUTS]


def second(ears: Driver) -> dict[str, str]:
    """Return what was said of second publishers, by the input."""
    said = [a for a in ears.alerts if 'SECOND_PUBLISHER' in a.name]
    return {a.name.split()[-1]: a.message for a in said}


def restarted(ears: Driver) -> list[str]:
    """Return the nodes that the diagnostics of the inputs call restarted."""
    lines = [ears.diagnostics.get(f'acceptance_monitor: Input {name}') for name in INPUTS]
    return [v.value for line in lines if line for v in line.values if v.key == 'restarted']


def listening(live: Live) -> tuple[Monitor, Driver]:
    """Return a monitor whose inputs nobody publishes, and a node that hears what it says."""
    live.alone()
    monitor, ears = live.monitor(), live.driver('ears')
    for publisher in (ears.joints, ears.imu):
        ears.destroy_publisher(publisher)
    live.until(lambda: known(monitor) == [0, 0])
    live.until(lambda: ears.diagnostics)
    return monitor, ears


def come_back(live: Live, monitor: Monitor) -> None:
    """Wait until the driver that was killed speaks again and is known twice."""
    live.until(lambda: known(monitor) == [2, 2])
    live.until(more(monitor, 300))  # some looks later


def test_a_driver_that_was_killed_and_came_back_is_one_source(live: Live) -> None:
    """A restarted driver raises no second-publisher alert while DDS still knows the dead one."""
    monitor, ears = listening(live)
    with started('driver') as process:
        live.until(more(monitor))
        process.kill()
        process.wait()
        with started('driver'):
            come_back(live, monitor)
            assert known(monitor) == [2, 2]
            assert second(ears) == {}
            live.until(lambda: restarted(ears) == ['/driver', '/driver'])
            assert 'joint_states' not in {a.rule.subject for a in session_of(monitor).active}


def test_two_drivers_of_one_name_at_once_are_named(live: Live) -> None:
    """Processes of the same name that both speak raise the alert on both inputs."""
    monitor, ears = listening(live)
    with started('driver'):
        live.until(more(monitor))
        with started('driver'):
            live.until(lambda: len(second(ears)) == len(INPUTS))
    for message in second(ears).values():
        assert 'has 2 publishers: /driver, /driver' in message


def test_another_beside_a_driver_that_came_back_is_named(live: Live) -> None:
    """A restart hides nobody: a further driver of that very name raises the alert."""
    monitor, ears = listening(live)
    with started('driver') as process:
        live.until(more(monitor))
        process.kill()
        process.wait()
        with started('driver'):
            come_back(live, monitor)
            with started('driver'):
                live.until(lambda: len(second(ears)) == len(INPUTS))
    assert all('/driver' in message for message in second(ears).values())


def test_two_publishers_of_one_process_are_named(live: Live) -> None:
    """A process that lives has no dead publishers: both are named before either speaks."""
    _, ears = listening(live)
    live.driver('twin')
    live.driver('twin')
    live.until(lambda: len(second(ears)) == len(INPUTS))
    assert all('/twin, /twin' in message for message in second(ears).values())


OLD, NEW = Publisher('/driver', bytes(16)), Publisher('/driver', bytes([1] * 16))
UNNAMED = Publisher('unknown', bytes([1] * 16), named=False)
STRANGER = Publisher('/stranger', bytes([2] * 16))


def both(*runs: list[int]) -> Voices:
    """Return voices that heard these numbers, known before and after as they would be."""
    voices = Voices()
    assert voices.present(0, [OLD]) == ['/driver']
    for run in runs:
        for number in run:
            voices.hear(number)
    return voices


@pytest.mark.parametrize('before', [1, 5, 1000])
@pytest.mark.parametrize('seed', range(5))
def test_lost_messages_make_no_second_voice(before: int, seed: int) -> None:
    """Of a driver that came back a third of the messages are lost: still one source."""
    lossy = random.Random(seed)
    new = [n for n in range(1, 3000) if lossy.random() > 0.3]
    assert both(list(range(1, before + 1)), new).present(1, [OLD, NEW]) == ['/driver']


@pytest.mark.parametrize('ahead', [0, 1, 2, 50, 100000])
@pytest.mark.parametrize('turns', ['in turn', 'at random'])
def test_voices_that_alternate_are_two(ahead: int, turns: str) -> None:
    """Publishers whose messages alternate are two, however far apart their numbers are."""
    lossy, heard = random.Random(ahead), list[int]()
    sources = count(ahead + 1), count(1)
    for k in range(20):
        heard.append(next(sources[k % 2 if turns == 'in turn' else lossy.randrange(2)]))
    voices = both(list(range(1, ahead + 1))[-100:], heard)
    assert voices.present(1, [OLD, NEW]) == ['/driver', '/driver']


def test_a_silent_second_is_named_when_a_dead_one_would_be_forgotten() -> None:
    """Known longer beside a later one than DDS keeps a dead one: it lives."""
    voices = both(list(range(1, 100)), list(range(1, 100)))
    assert voices.present(1, [OLD, NEW]) == ['/driver']
    assert voices.present(OUTLIVED, [OLD, NEW]) == ['/driver']
    assert voices.present(OUTLIVED + 2, [OLD, NEW]) == ['/driver', '/driver']


def test_a_driver_that_dies_again_and_again_is_one_source() -> None:
    """Each life ends before DDS forgets the last: many are known, one speaks."""
    voices, second_ns = Voices(), 1_000_000_000
    for life in range(60):
        for number in range(1, 50):
            voices.hear(number)
        alive = range(max(0, life - 20), life + 1)
        known_now = [Publisher('/driver', bytes([k] * 16)) for k in alive]
        assert voices.present(life * second_ns, known_now) == ['/driver']


def test_a_driver_that_came_back_is_one_source_before_its_name_comes() -> None:
    """DDS may tell a name seconds after the messages: till then it is no stranger."""
    voices = both(list(range(1, 100)), list(range(1, 50)))
    assert voices.present(1, [OLD, UNNAMED]) == ['/driver']
    assert voices.present(2, [OLD, NEW]) == ['/driver']


def test_a_voice_without_a_name_beside_a_driver_that_speaks_is_a_second() -> None:
    """Heard by turns it is a second source, whatever it will be called; alone it is one."""
    voices = both([1, 2, 100, 3, 101, 4, 102, 5])
    assert voices.present(1, [OLD, UNNAMED]) == ['/driver', 'unknown']
    assert Voices().present(1, [UNNAMED]) == ['unknown']
    assert len(Voices().present(1, [OLD, UNNAMED, STRANGER])) == 3


def test_a_name_that_comes_and_is_another_is_a_second_source_at_once() -> None:
    """A stranger that has said nothing yet is named as soon as its name is known."""
    voices = both(list(range(1, 100)))
    assert voices.present(1, [OLD, UNNAMED]) == ['/driver']
    assert voices.present(2, [OLD, STRANGER]) == ['/driver', '/stranger']


def test_without_numbers_two_of_one_name_are_two() -> None:
    """If the middleware gives no message numbers, two publishers of one name are two."""
    voices = Voices()
    voices.hear(None)
    assert voices.present(0, [OLD, NEW]) == ['/driver', '/driver']
