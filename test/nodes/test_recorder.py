"""The recorder on real DDS: every publisher is heard, and evaluate has what it needs."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import InertiaStamped
from nodes.live_case import FOLDED, Live, imu, joints, parameter, session_of
from nodes.tf2_type import provide_tf2_msgs
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Imu
from std_msgs.msg import Bool, String
from trajectory_msgs.msg import JointTrajectory

from ugv_acceptance import BadConfig
from ugv_acceptance.bag.encode import inertia_cdr, string_message
from ugv_acceptance.bag.raw import messages, offered
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.recorder import Recorder, Room
from ugv_acceptance.bag.recording import open_recording
from ugv_acceptance.bag.told_parameters import parameters_in
from ugv_acceptance.bag.transforms import transforms_cdr
from ugv_acceptance.cli.record import Asked, carry_out
from ugv_acceptance.config import load as configured
from ugv_acceptance.evaluation.alerts.rules import FAILURES
from ugv_acceptance.nodes.bag_player import message_type
from ugv_acceptance.nodes.recorder import RecorderNode
from ugv_acceptance.offline.evaluate import evaluate

OVERHANG = (0.0, 0.0, 0.0, 2.0)
HEAVY = 4.0
BEST, SURE = ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE
KEPT, LOST = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE


def qos(reliability: ReliabilityPolicy, durability: DurabilityPolicy = LOST) -> QoSProfile:
    """Return what a publisher offers."""
    make: Any = QoSProfile
    made: QoSProfile = make(depth=100, reliability=reliability, durability=durability)
    return made


@contextmanager
def recording(
    live: Live, folder: Path, *extra: str, room: Room | None = None, **named: Any
) -> Iterator[tuple[RecorderNode, list[str]]]:
    """Record into a folder for a while; gives the node, and what it told."""
    told: list[str] = []
    recorder = Recorder(folder, room or Room(reserve=0))
    node: RecorderNode = live.add(
        RecorderNode(recorder, configured().topics, extra, told.append, **named)
    )
    try:
        yield node, told
    finally:
        node.close()
        recorder.close()


def heard(node: RecorderNode, name: str) -> int:
    """Return how many messages of a topic came."""
    return next(topic.messages for topic in node.heard if topic.name == name)


def contents(folder: Path, topic: str) -> list[bytes]:
    """Return the messages of a topic in a recording."""
    return [message.data for message in messages(open_bag(folder), [topic])]


def text_of(data: bytes) -> str:
    """Return the text of a std_msgs/String."""
    return data[8:-1].decode()


def publisher(live: Live, name: str, kind: Any, topic: str, offer: QoSProfile) -> Any:
    """Return a publisher on a node of its own."""
    return live.add(rclpy.create_node(name)).create_publisher(kind, topic, offer)


@pytest.mark.parametrize('reliability', [BEST, SURE])
@pytest.mark.parametrize('durability', [LOST, KEPT])
def test_a_publisher_is_heard_and_told_as_it_offers(
    live: Live, tmp_path: Path, reliability: ReliabilityPolicy, durability: DurabilityPolicy
) -> None:
    """Whatever the offer: what it sends is recorded, what it keeps too, and so is the offer."""
    source = publisher(live, 'source', Imu, '/imu/data', qos(reliability, durability))
    source.publish(imu(stamp=1))
    keeps = (reliability, durability) == (SURE, KEPT)
    with recording(live, tmp_path / 'run') as (node, told):
        if keeps:
            live.until(lambda: heard(node, '/imu/data'))
        live.until(lambda: heard(node, '/imu/data') > 3, lambda: source.publish(imu(stamp=2)))
    assert not told
    offer = offered(open_bag(tmp_path / 'run'))['/imu/data']
    assert offer.reliability == ('reliable' if reliability == SURE else 'best_effort')
    assert offer.durability == ('transient_local' if durability == KEPT else 'volatile')
    assert contents(tmp_path / 'run', '/imu/data').count(imu(stamp=1)) == keeps


def test_publishers_that_differ_are_all_heard_once_and_told(live: Live, tmp_path: Path) -> None:
    """Two more come, with other offers: nothing is lost or doubled of the first, and it is said."""
    first = publisher(live, 'first', String, '/notes', qos(SURE))
    others: list[Any] = []
    count = 0

    def talk() -> None:
        nonlocal count
        count += 1
        for name, source in (('first', first), *others):
            source.publish(string_message(f'{name} {count}'))

    with recording(live, tmp_path / 'run', 'notes') as (node, told):
        live.until(lambda: heard(node, '/notes') > 5, talk)
        others.append(('loose', publisher(live, 'loose', String, '/notes', qos(BEST))))
        others.append(('keeper', publisher(live, 'keeper', String, '/notes', qos(SURE, KEPT))))
        since, until = count, 0.0

        def settled() -> bool:
            nonlocal until
            if told and not until:
                until = time.monotonic() + 4.0
            return bool(until) and time.monotonic() > until

        live.until(settled, talk)
        live.spin(0.3)
    texts = [text_of(data) for data in contents(tmp_path / 'run', '/notes')]
    assert len(texts) == len(set(texts))
    mine = [int(text.split()[1]) for text in texts if text.startswith('first')]
    assert mine == list(range(mine[0], count + 1))
    for name in ('loose', 'keeper'):
        numbers = [int(text.split()[1]) for text in texts if text.startswith(name)]
        assert len(numbers) > 10
        assert max(numbers) == count
        assert min(numbers) >= since
    words = ' '.join(told)
    assert '/first offers reliable and volatile' in words
    assert '/loose offers best effort and volatile' in words
    assert '/keeper offers reliable and transient local' in words
    text = (tmp_path / 'run' / 'metadata.yaml').read_text()
    rows = yaml.safe_load(text)['rosbag2_bagfile_information']['topics_with_message_count']
    (profiles,) = (
        row['topic_metadata']['offered_qos_profiles']
        for row in rows
        if row['topic_metadata']['name'] == '/notes'
    )
    assert len(profiles) == 3


def test_a_publisher_that_comes_again_is_heard_again(live: Live, tmp_path: Path) -> None:
    """A driver that was restarted, and one that offers something else after that."""
    with recording(live, tmp_path / 'run') as (node, _):
        before = 0
        for k, reliability in enumerate((SURE, SURE, BEST)):
            source = publisher(live, f'source_{k}', Imu, '/imu/data', qos(reliability))
            goal = before + 5
            live.until(lambda: heard(node, '/imu/data') >= goal, lambda: source.publish(imu()))  # noqa: B023
            live.nodes[-1].destroy_publisher(source)
            live.spin(0.5)
            before = heard(node, '/imu/data')


def test_latched_topics_of_all_publishers_are_recorded(live: Live, tmp_path: Path) -> None:
    """Both nodes that told /tf_static long ago, the URDF, and they stand in each further file."""
    provide_tf2_msgs()
    kind, latched = message_type('tf2_msgs/msg/TFMessage'), qos(SURE, KEPT)
    frames = [transforms_cdr([('base', name, (0, 0, 0), (0, 0, 0, 1))]) for name in ('a', 'b')]
    for k, data in enumerate(frames):
        publisher(live, f'frames_{k}', kind, '/tf_static', latched).publish(data)
    urdf = string_message('<robot name="x"/>')
    publisher(live, 'state', String, '/robot_description', latched).publish(urdf)
    room = Room(part_seconds=1.0, reserve=0)
    with recording(live, tmp_path / 'run', room=room) as (node, _):
        live.until(lambda: heard(node, '/tf_static') == 2 and heard(node, '/robot_description'))
        goal = node.recorder.parts + 2
        live.until(lambda: node.recorder.parts >= goal)
    last = max((tmp_path / 'run').glob('*.mcap'), key=lambda path: path.stat().st_mtime_ns)
    assert sorted(contents(last, '/tf_static')) == sorted(frames)
    assert contents(last, '/robot_description') == [urdf]


def test_further_topics_of_any_type_are_recorded(live: Live, tmp_path: Path) -> None:
    """By their publishers' type; one that is not installed is said, and ends nothing."""
    source = publisher(live, 'camera', CameraInfo, '/camera_info', qos(BEST))
    with recording(live, tmp_path / 'run', '/camera_info', 'nobody') as (node, _):
        live.until(lambda: heard(node, '/camera_info'), lambda: source.publish(CameraInfo()))
        states = {topic.name: topic for topic in node.heard}
        assert states['/nobody'].missing == 'nobody publishes /nobody'
    assert open_bag(tmp_path / 'run').topics['/camera_info'].type == 'sensor_msgs/msg/CameraInfo'


def test_a_name_that_cannot_be_a_topic_is_refused(live: Live, tmp_path: Path) -> None:
    """One line with the option and the name."""
    with pytest.raises(BadConfig, match=r'--topics 1\?'), recording(live, tmp_path / 'run', '1?'):
        pass


@pytest.mark.parametrize('name', ['1?', '/a//b', '{nothing}/a', ''])
def test_a_wrong_name_of_a_topic_leaves_no_folder_behind(tmp_path: Path, name: str) -> None:
    """It is refused before a recording is begun; nor is an older one deleted for it."""
    room = Room(reserve=0)
    topics, folder = configured().topics, tmp_path / 'run'
    asked = Asked('x', topics, folder, room, None, (name,), seconds=1.0, every=1.0, plain=True)
    with pytest.raises(BadConfig, match='--topics'):
        carry_out(asked, [])
    assert not any(tmp_path.iterdir())


def test_what_the_monitor_was_asked_and_permitted_is_recorded(live: Live, tmp_path: Path) -> None:
    """Its word for programs, planned motions, the answers to them: evidence, never missed."""
    node = live.add(rclpy.create_node('asking'))
    outs = [
        (node.create_publisher(kind, f'/acceptance_monitor/{name}', 10), kind)
        for name, kind in (
            ('ok', Bool),
            ('check', JointTrajectory),
            ('check_result', DiagnosticStatus),
        )
    ]

    def say() -> None:
        for out, kind in outs:
            out.publish(kind())

    with recording(live, tmp_path / 'run') as (recorder, _):
        states = {topic.name: topic for topic in recorder.heard}
        assert not any(states[out.topic_name].missing for out, _ in outs)
        live.until(lambda: all(heard(recorder, out.topic_name) for out, _ in outs), say)
    for out, _ in outs:
        assert contents(tmp_path / 'run', out.topic_name)


def test_what_nobody_publishes_is_told(live: Live, tmp_path: Path) -> None:
    """Each input, the URDF, the monitor; not what is said only now and then."""
    # DDS still lists publishers of processes that other tests killed, on the usual names.
    with recording(live, tmp_path / 'run', namespace='/nobody') as (node, _):
        live.spin(0.3)
        missing = [topic.missing for topic in node.heard if topic.missing]
    for name in ('joint_states', 'imu/data', 'payload', 'robot_description'):
        assert f'nobody publishes /nobody/{name}' in missing
    assert not [text for text in missing if 'operator' in text]


def test_messages_lost_on_their_way_are_counted(live: Live, tmp_path: Path) -> None:
    """By the numbers their publisher gives them: more came than the queue holds."""
    source = publisher(live, 'source', Imu, '/imu/data', qos(BEST))
    with recording(live, tmp_path / 'run') as (node, _):
        live.until(lambda: heard(node, '/imu/data') > 3, lambda: source.publish(imu()))
        (topic,) = (topic for topic in node.topics if topic.name == '/imu/data')
        live.until(lambda: topic.publishers == 1, lambda: source.publish(imu()))
        before, data = heard(node, '/imu/data'), imu()
        for _ in range(8_000):
            source.publish(data)
        live.until(
            lambda: topic.messages - before + topic.lost >= 8_000, lambda: source.publish(data)
        )
        assert topic.lost


def wait(live: Live, driver: Any, seconds: float, q: tuple[float, ...] = FOLDED) -> None:
    """Let the robot stand like this for a while."""
    live.spin(seconds, lambda: (driver.joints.publish(joints(q)), driver.imu.publish(imu())))


def test_evaluate_judges_the_recording_as_the_monitor_did(live: Live, tmp_path: Path) -> None:
    """The same alerts, the inputs complete, the parameters those in force: nothing to remark."""
    monitor, driver = live.running()
    load = driver.create_publisher(InertiaStamped, 'payload', 10)
    with recording(live, tmp_path / 'run') as (node, _):
        live.until(lambda: parameters_told(node) and heard(node, '/imu/data') > 50, driver.send)
        load.publish(inertia_cdr(time.time_ns(), 'gripper_link', HEAVY, (0.0,) * 3))
        wait(live, driver, 1.0)
        wait(live, driver, 1.0, OVERHANG)
    raised = {
        (values['code'], values['subject'])
        for values in ({v.key: v.value for v in status.values} for status in driver.alerts)
        if values['state'] == 'raised' and values['code'] in FAILURES
    }
    judged = evaluate(tmp_path / 'run')
    assert ('TORQUE_LIMIT', 'shoulder_joint') in raised
    assert {(a.code, a.subject) for a in judged.alerts if a.code in FAILURES} == raised
    unchecked = ' '.join(f'{one["what"]}: {one["why"]}' for one in judged.result['not_checked'])
    assert 'other parameters' not in unchecked
    assert judged.recording.findings == ()
    assert judged.result['bag']['protected'] == 'all'
    assert session_of(monitor).limits_hash == judged.result['limits_hash']


def parameters_told(node: RecorderNode) -> int:
    """Return how often the monitor's parameters were recorded."""
    return heard(node, '/acceptance_monitor/parameters_in_force')


def test_another_limit_or_load_of_the_monitor_is_never_passed_over(
    live: Live, tmp_path: Path
) -> None:
    """A limit set live is named with both values; a load that no message told keeps from a PASS."""
    monitor, driver = live.running(payload__mass_kg=HEAVY - 3.0)
    with recording(live, tmp_path / 'run') as (node, _):
        live.until(lambda: parameters_told(node) and heard(node, '/imu/data') > 50, driver.send)
        before = parameters_told(node)
        half = parameter('limits__torque_warn', 0.5)
        assert monitor.set_parameters([half])[0].successful
        live.until(lambda: parameters_told(node) > before, driver.send)
        wait(live, driver, 1.0)
    told = parameters_in(open_recording(tmp_path / 'run'))
    assert told[0].values['payload.mass_kg'] == HEAVY - 3.0
    assert told[-1].limits_hash == session_of(monitor).limits_hash
    judged = evaluate(tmp_path / 'run')
    assert judged.verdict == 'INCONCLUSIVE'
    assert any('the monitor carried 1 kg, 4 kg are judged here' in r for r in judged.reasons)
    (one,) = (n for n in judged.result['not_checked'] if 'live monitor' in n['what'])
    assert 'limits.torque_warn 0.5, here 0.8' in one['why']
    declared = evaluate(tmp_path / 'run', payload=HEAVY - 3.0)
    assert 'the monitor carried' not in ' '.join([*declared.reasons, str(declared.result)])


CODE = 'from ugv_acceptance.cli import main; main()'


def start(*words: str) -> 'subprocess.Popen[str]':
    """Start the verb."""
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    pipe = subprocess.PIPE
    command = [sys.executable, '-c', CODE, 'record', *words]
    return subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True)


def test_the_verb_says_what_it_recorded_and_what_to_do_next(live: Live, tmp_path: Path) -> None:
    """Ctrl-C ends it in order: topics, what is missing, the next command; exit code 0."""
    driver, folder = live.driver(), tmp_path / 'run 1'
    process = start('--out', str(folder), '--every', '0.5')
    live.until(driver.connected)
    # Its subscriptions follow the offers of a driver it has met: until then nothing is heard.
    live.until(lambda: sum(f.stat().st_size for f in folder.glob('*.mcap')) > 20_000, driver.send)
    wait(live, driver, 1.0)
    process.send_signal(signal.SIGINT)
    text, errors = process.communicate(timeout=60)
    assert process.returncode == 0, text + errors
    assert f"Judge it: ugv-acceptance evaluate '{folder}'" in text
    assert '/joint_states' in text
    assert 'nobody publishes /robot_description' in text
    assert 'left on the disk' in errors
    bag = open_bag(folder)
    assert bag.findings == ()
    assert bag.topics['/joint_states'].count > 10
