"""The black box keeps the seconds about a critical alert, also of a process that is killed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from nodes.live_case import Live, imu, joints
from rosbags.highlevel import AnyReader

from ugv_acceptance.bag.encode import inertia_cdr
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Alert, Rule
from ugv_acceptance.nodes.monitor.black_box import AFTER, BEFORE, BlackBox, Channel

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
TOPICS = {
    'joint_states': Channel('/joint_states', 'sensor_msgs/msg/JointState'),
    'imu': Channel('/imu/data', 'sensor_msgs/msg/Imu'),
    'payload': Channel('/payload', 'geometry_msgs/msg/InertiaStamped', 'reliable', lasting=True),
    'alerts': Channel('/acceptance_monitor/alerts', 'diagnostic_msgs/msg/DiagnosticArray'),
}
TIP = Alert(Rule('TIP_OVER', 'front', ERROR, -0.1, -0.12, 0, SECOND), 0, 0.0)
# A DiagnosticArray without a status.
NOTHING = bytes([0, 1, 0, 0]) + bytes(8) + (1).to_bytes(4, 'little') + bytes(8)


def box_in(folder: Path | None) -> BlackBox:
    """Return a black box that must not report a problem."""
    problems: list[str] = []
    box = BlackBox(folder, TOPICS, time.monotonic_ns, problems.append)
    assert not problems
    return box


def feed(box: BlackBox, begin: int, end: int, step: int = SECOND // 10) -> None:
    """Give it both inputs from `begin` to before `end` (ns), with ticks."""
    for now in range(begin, end, step):
        box.keep(now, 'joint_states', joints(stamp=now))
        box.keep(now, 'imu', imu(stamp=now))
        box.advance(now)


def saved(box: BlackBox) -> list[Path]:
    """Return the recordings once they are in their files."""
    box.close()
    return box.saved


def times(path: Path, topic: str = '/imu/data') -> np.ndarray:
    """Return the log times (ns) of a topic in a recording."""
    found = messages(open_bag(path), [topic])
    return np.array([message.log_time for message in found])


def test_it_holds_the_time_before_and_after(tmp_path: Path) -> None:
    """Thirty seconds before the alert and ten after it, and the file is finished by itself."""
    box, now = box_in(tmp_path), START + 60 * SECOND
    feed(box, START, now)
    box.alerts(now, [TIP], NOTHING)
    feed(box, now, now + 20 * SECOND)
    (path,) = saved(box)
    assert (path / 'metadata.yaml').is_file()
    found = times(path)
    assert found[0] == now - BEFORE
    assert found[-1] == now + AFTER
    assert len(found) == len(times(path, '/joint_states')) == 401


def test_a_second_alert_prolongs_the_recording(tmp_path: Path) -> None:
    """What follows within ten seconds belongs to the same recording; the alerts are in it."""
    box, now = box_in(tmp_path), START + 5 * SECOND
    feed(box, START, now)
    box.alerts(now, [TIP], NOTHING)
    feed(box, now, now + 8 * SECOND)
    box.alerts(now + 8 * SECOND, [TIP], NOTHING)
    feed(box, now + 8 * SECOND, now + 30 * SECOND)
    (path,) = saved(box)
    assert times(path)[-1] == now + 8 * SECOND + AFTER
    assert times(path, '/acceptance_monitor/alerts').tolist() == [now, now + 8 * SECOND]


def test_who_saw_the_alert_is_in_its_recording(tmp_path: Path) -> None:
    """Changes that raise nothing, as an acknowledgement is, start no recording but are kept."""
    box, now = box_in(tmp_path), START + 5 * SECOND
    feed(box, START, now)
    box.alerts(now - SECOND, [], NOTHING)
    assert not box.saved
    box.alerts(now, [TIP], NOTHING)
    feed(box, now, now + 2 * SECOND)
    box.alerts(now + 2 * SECOND, [], NOTHING)
    (path,) = saved(box)
    kept = times(path, '/acceptance_monitor/alerts').tolist()
    assert kept == [now - SECOND, now, now + 2 * SECOND]


def test_each_later_alert_has_its_own_past(tmp_path: Path) -> None:
    """A new recording begins with the seconds before its alert, though an old one had them."""
    box, now = box_in(tmp_path), START
    for _ in range(2):
        feed(box, now, now + 12 * SECOND)
        now += 12 * SECOND
        box.alerts(now, [TIP], NOTHING)
    feed(box, now, now + 12 * SECOND)
    first, second = saved(box)
    assert times(first)[0] == times(second)[0] == START


def test_the_payload_in_force_is_in_the_recording(tmp_path: Path) -> None:
    """A payload declared long before is written at the recording's beginning."""
    box = box_in(tmp_path)
    box.keep(START, 'payload', inertia_cdr(START, 'gripper_link', 3.0, (0.0, 0.0, 0.0)))
    feed(box, START + SECOND, START + 50 * SECOND)
    box.alerts(START + 50 * SECOND, [TIP], NOTHING)
    (path,) = saved(box)
    assert times(path, '/payload').tolist() == [times(path)[0]]


def test_rosbags_reads_it(tmp_path: Path) -> None:
    """A reader that is not ours decodes every message."""
    box = box_in(tmp_path)
    feed(box, START, START + 3 * SECOND)
    box.alerts(START + 3 * SECOND, [TIP], NOTHING)
    with AnyReader(saved(box)) as reader:
        kinds = [type(reader.deserialize(d, c.msgtype)).__name__ for c, _, d in reader.messages()]
    assert len(kinds) == 61
    assert kinds[-1] == 'diagnostic_msgs__msg__DiagnosticArray'


@pytest.mark.parametrize(
    'rule',
    [
        Rule('TIP_OVER', 'front', WARN, -0.1, -0.12, 0, 0),
        Rule('INPUT_INVALID', 'imu', ERROR, 0.5, 0.5, 0, 0),
    ],
)
def test_only_critical_alerts_are_recorded(tmp_path: Path, rule: Rule) -> None:
    """Neither a warning nor a fault of an input makes a recording."""
    box = box_in(tmp_path)
    feed(box, START, START + SECOND)
    box.alerts(START + SECOND, [Alert(rule, 0, 0.0)], NOTHING)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_said_and_survived(tmp_path: Path) -> None:
    """The problem is told in one line; messages are taken as before."""
    (tmp_path / 'file').write_text('')
    problems: list[str] = []
    box = BlackBox(tmp_path / 'file', TOPICS, time.monotonic_ns, problems.append)
    feed(box, START, START + SECOND)
    box.alerts(START + SECOND, [TIP], NOTHING)
    feed(box, START + SECOND, START + 2 * SECOND)
    box.close()
    assert len(problems) == 1
    assert 'black box' in problems[0]
    assert box.state.startswith('the last recording failed: ')


def test_an_alert_that_comes_and_goes_does_not_fill_the_disk(tmp_path: Path) -> None:
    """A session makes a fixed number of recordings at most."""
    box = box_in(tmp_path)
    box.most = 3
    for k in range(box.most + 2):
        now = START + k * 2 * AFTER
        feed(box, now, now + 1)
        box.alerts(now, [TIP], NOTHING)
        box.advance(now + AFTER + 1)
    assert len(saved(box)) == len(list(tmp_path.iterdir())) == 3


KILLED = """
import sys, time
from pathlib import Path
from nodes.test_black_box import *
box, now = box_in(Path(sys.argv[1])), START + 40 * SECOND
feed(box, START, now)
box.alerts(now, [TIP], NOTHING)
while not box.saved:
    time.sleep(0.01)
print('raised', flush=True)
for k in range(int(sys.argv[2])):
    feed(box, now + k * SECOND, now + (k + 1) * SECOND)
print('fed', flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize('after', [0, 4])
def test_a_process_killed_after_the_alert_leaves_the_recording(tmp_path: Path, after: int) -> None:
    """SIGKILL as soon as the past is said to be saved, or later, while the recording goes on.

    What came then is handed to the system by itself, with nothing more to come.
    """
    path = [str(Path(__file__).parents[1]), str(Path(__file__).parents[2])]
    code = f'import sys; sys.path[:0] = {path!r}\n{KILLED}'
    process = subprocess.Popen(
        [sys.executable, '-c', code, str(tmp_path), str(after)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b'raised\n'
    (found,) = tmp_path.iterdir()
    alert = START + 40 * SECOND
    if after:
        assert process.stdout.readline() == b'fed\n'
        end = time.monotonic() + 60
        while times(found)[-1] < alert + after * SECOND - SECOND // 10:
            assert time.monotonic() < end, times(found)[-1] - alert
            time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    written = times(found)
    assert written[0] == alert - BEFORE
    assert (np.diff(written) == SECOND // 10).all()
    assert written[-1] >= alert + after * SECOND - SECOND // 10
    assert times(found, '/acceptance_monitor/alerts').tolist() == [alert]


MONITOR = """
import sys
from ugv_acceptance.nodes.monitor.node import main
main(['--ros-args', '-p', f'black_box:={sys.argv[1]}'])
"""


def test_a_monitor_killed_after_a_critical_alert_leaves_the_recording(
    tmp_path: Path, live: Live
) -> None:
    """The node in a process of its own, over DDS, is killed when its recording appears."""
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    driver = live.driver()
    process = subprocess.Popen([sys.executable, '-c', MONITOR, str(tmp_path)], env=environment)
    try:
        live.until(driver.connected)
        live.until(
            lambda: list(tmp_path.glob('*/*.mcap')), lambda: driver.send((0.0, 0.0, 0.0, 2.0))
        )
        live.until(
            lambda: next(tmp_path.glob('*/*.mcap')).stat().st_size > 40_000,
            lambda: driver.send((0.0, 0.0, 0.0, 2.0)),
        )
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    (found,) = tmp_path.iterdir()
    assert len(times(found, '/joint_states')) > 5
    assert len(times(found, '/acceptance_monitor/alerts')) >= 1
