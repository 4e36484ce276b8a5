"""The player: every message, its bytes, order, quality of service and time."""

import os
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer as McapWriter
from nodes.live_case import OK, Live, imu, joints, levels, parameter, session_of
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from ugv_acceptance import BadBag, BadConfig
from ugv_acceptance.bag.raw import Offered
from ugv_acceptance.bag.writer import BagWriter, Qos
from ugv_acceptance.nodes.bag_player import Play, Player, play_from, qos_of
from ugv_acceptance.nodes.executor import Stop
from ugv_acceptance.nodes.replay_stamps import NS

T0 = 1_700_000_000 * NS


def write(folder: Path, count: int = 40, period: int = 5_000_000) -> tuple[Path, list[bytes]]:
    """Record joint states, and an Imu topic that is best effort; return the former."""
    path = folder / 'run'
    sent = [joints((0.1, 0.01 * k, 0.0, 0.0), T0 + k * period) for k in range(count)]
    with BagWriter(path) as writer:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState', Qos())
        quick = Qos(reliability='best_effort')
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu', quick)
        for k, data in enumerate(sent):
            writer.write('/joint_states', T0 + k * period, data)
    return path, sent


def listener(live: Live, heard: list[bytes]) -> Node:
    """Return a node that keeps every JointState as bytes."""
    node: Node = live.add(Node('listener'))
    qos = qos_of(Offered())
    node.create_subscription(JointState, 'joint_states', heard.append, qos, raw=True)
    # All topics have a subscriber: nobody is waited for.
    node.create_subscription(Imu, 'imu/data', lambda _: None, qos_of(Offered('best_effort')))
    return node


def player(live: Live, play: Play) -> Player:
    """Return a player that somebody listens to."""
    # A name of its own: the graph may still hold the player of the test before.
    return Player(live.add(Node(f'bag_player_{time.monotonic_ns()}')), play)


def play_all(live: Live, play: Play) -> list[bytes]:
    """Play to a listener; return what it heard."""
    heard: list[bytes] = []
    listener(live, heard)
    player_ = player(live, play)
    player_.wait_for_subscribers(Stop())
    player_.run(Stop())
    live.until(lambda: len(heard) >= player_.published)
    return heard


def test_every_message_comes_as_it_was_recorded(live: Live, tmp_path: Path) -> None:
    """Bytes and order are those of the recording."""
    path, sent = write(tmp_path)
    assert play_all(live, Play(path, restamp=False)) == sent


def test_topics_can_be_chosen(live: Live, tmp_path: Path) -> None:
    """Only the topics asked for are played."""
    path, _ = write(tmp_path)
    assert list(player(live, Play(path, topics=('/imu/data',))).publishers) == ['/imu/data']


def test_the_recorded_quality_of_service_is_offered(live: Live, tmp_path: Path) -> None:
    """A topic that was best effort is offered as best effort, a reliable one as reliable."""
    path, _ = write(tmp_path)
    playing = player(live, Play(path))

    def offers(topic: str) -> list[Any]:
        found = playing.node.get_publishers_info_by_topic(topic)
        return [i.qos_profile for i in found if i.node_name == playing.node.get_name()]

    topics = ('/joint_states', '/imu/data')
    live.until(lambda: all(offers(topic) for topic in topics))
    offered = {topic: offers(topic)[0] for topic in topics}
    assert offered['/joint_states'].reliability == ReliabilityPolicy.RELIABLE
    assert offered['/imu/data'].reliability == ReliabilityPolicy.BEST_EFFORT
    assert offered['/imu/data'].durability == DurabilityPolicy.VOLATILE


def test_restamped_messages_carry_the_time_of_replay(live: Live, tmp_path: Path) -> None:
    """All stamps move by the same time, to now; all other bytes stay."""
    path, sent = write(tmp_path)
    before = time.time_ns()
    heard = play_all(live, Play(path))
    shifts = {stamp_of(a) - stamp_of(b) for a, b in zip(heard, sent, strict=True)}
    assert len(shifts) == 1
    assert before <= stamp_of(heard[0]) <= time.time_ns()
    assert [data[12:] for data in heard] == [data[12:] for data in sent]


def stamp_of(data: bytes) -> int:
    """Return the header stamp (ns)."""
    sec, nanosec = struct.unpack_from('<iI', data, 4)
    return int(sec) * NS + int(nanosec)


@pytest.mark.parametrize(
    ('given_', 'expected'),
    [
        ({}, True),
        ({'clock': True}, False),
        ({'clock': True, 'restamp': True}, True),
        ({'restamp': False}, False),
        ({'clock': False, 'restamp': False}, False),
    ],
)
def test_stamps_move_unless_the_clock_is_told(
    live: Live, given_: dict[str, bool], *, expected: bool
) -> None:
    """The node's stamps are told anew by default, not with `clock`; what is given counts."""
    values = [parameter(name, value) for name, value in ({'bag': 'run'} | given_).items()]
    node = live.add(Node('bag_player', parameter_overrides=values))
    assert play_from(node).restamp is expected
    assert node.get_parameter('restamp').value is expected


@pytest.mark.parametrize('options', [(), ('--clock',), ('--clock', '--restamp'), ('--no-restamp',)])
def test_the_verb_moves_stamps_unless_the_clock_is_told(
    live: Live, tmp_path: Path, options: tuple[str, ...]
) -> None:
    """`replay` alone tells stamps anew, with --clock it leaves them; either can be asked for."""
    path, sent = write(tmp_path)
    heard: list[bytes] = []
    before = time.time_ns()
    listener(live, heard)
    with replaying(path, *options) as process:
        live.until(lambda: len(heard) == len(sent))
        process.wait(timeout=60)
    if options in {(), ('--clock', '--restamp')}:
        assert before < stamp_of(heard[0]) < time.time_ns()
    else:
        assert heard == sent


@contextmanager
def replaying(*words: str | Path) -> Iterator['subprocess.Popen[bytes]']:
    """Run `replay` in a process of its own, which ends with the test."""
    environment = {k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'}
    code = 'from ugv_acceptance.cli import main; main()'
    command = [sys.executable, '-c', code, 'replay', *map(str, words)]
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as process:
        try:
            yield process
        finally:
            process.terminate()


def simulated(folder: Path) -> Path:
    """Record 6 s of a robot at rest, logged in real time, whose stamps begin at 12.3 s."""
    path, began = folder / 'simulated', 12_300_000_000
    with BagWriter(path) as writer:
        writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState', Qos())
        writer.add_topic('/imu/data', 'sensor_msgs/msg/Imu', Qos(reliability='best_effort'))
        for k in range(600):
            now = k * 10_000_000
            writer.write('/joint_states', T0 + now, joints(stamp=began + now))
            writer.write('/imu/data', T0 + now + 2_000_000, imu(stamp=began + now))
    return path


@pytest.mark.parametrize(
    ('which', 'options'),
    [
        ('recorded', ()),
        ('recorded', ('--rate', '3')),
        ('recorded', ('--loop',)),
        ('simulated', ('--loop',)),
    ],
)
def test_a_live_monitor_beside_a_replay_says_ok(
    live: Live, tmp_path: Path, repository: Path, options: tuple[str, ...], which: str
) -> None:
    """A run that passes is OK live, at any rate and again and again: no word of stamps."""
    live.alone()
    path = repository / 'bags' / 'packbot_pass' if which == 'recorded' else simulated(tmp_path)
    ears, monitor = live.driver('ears'), live.monitor()
    for publisher in (ears.joints, ears.imu):
        ears.destroy_publisher(publisher)
    counts = session_of(monitor).counts
    with replaying(path, *options) as process:
        enough = 1000 if '--loop' in options and which == 'simulated' else 500
        live.until(lambda: counts['imu'].taken > enough and OK in levels(ears))
        live.until(lambda: process.poll() is not None or counts['imu'].taken > 2 * enough)
        verdict = monitor.verdict()
    assert not [a.name for a in ears.alerts if 'CLOCK' in a.name]
    assert verdict.level == OK or process.poll() is not None, verdict.message


def test_a_recorded_clock_is_left_out_of_a_replay_of_now(live: Live, tmp_path: Path) -> None:
    """It tells another time than the stamps do: it is played when asked for, or without restamp."""
    path = foreign(tmp_path / 'run.mcap', 'sensor_msgs/msg/Imu', clock=True)
    playing = player(live, Play(path))
    assert list(playing.publishers) == ['/t0']
    assert list(playing.skipped) == ['/clock']
    assert '/clock' in player(live, Play(path, restamp=False)).publishers
    assert '/clock' in player(live, Play(path, topics=('/clock',))).publishers


@pytest.mark.parametrize(
    ('last', 'kind'),
    [('ok', 'std_msgs/msg/Bool'), ('check_result', 'diagnostic_msgs/msg/DiagnosticStatus')],
)
def test_a_recorded_word_for_gates_of_motion_is_left_out(
    live: Live, tmp_path: Path, last: str, kind: str
) -> None:
    """A robot's gate would take a permission of then for one of now: only who names it plays it."""
    path, word = tmp_path / 'run', f'/r1/acceptance_monitor/{last}'
    with BagWriter(path) as writer:
        for name in (word, '/t'):
            writer.add_topic(name, kind)
            writer.write(name, T0, b'\x00\x01\x00\x00\x01')
    playing = player(live, Play(path))
    assert list(playing.publishers) == ['/t']
    assert list(playing.skipped) == [word]
    assert list(player(live, Play(path, topics=(word,))).publishers) == [word]


@pytest.mark.parametrize(
    ('play', 'error', 'text'),
    [
        ({'rate': 0.0}, BadConfig, 'rate'),
        ({'topics': ('/nothing',)}, BadBag, '/joint_states'),
        ({'bag': Path('/nowhere')}, BadBag, '/nowhere'),
    ],
)
def test_what_cannot_be_played_is_refused(
    live: Live, tmp_path: Path, play: dict[str, Any], error: type[Exception], text: str
) -> None:
    """A rate of nothing, a topic or a recording that is not there: one sentence."""
    path, _ = write(tmp_path)
    with pytest.raises(error, match=text):
        player(live, Play(**({'bag': path} | play)))


def test_a_stopped_player_ends_at_once(live: Live, tmp_path: Path) -> None:
    """Asked to stop it publishes no more."""
    path, _ = write(tmp_path, count=10, period=NS * 100)
    playing = player(live, Play(path))
    stop = Stop(asked=True)
    playing.run(stop)
    assert playing.published == 0


def test_it_tells_how_far_it_is(live: Live, tmp_path: Path) -> None:
    """Progress goes up to the length of the recording."""
    path, _ = write(tmp_path)
    playing = player(live, Play(path, rate=10.0))
    seen: list[float] = []
    playing.run(Stop(), seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(playing.bag.duration_s)


def test_a_loop_begins_again_and_the_clock_with_it(live: Live, tmp_path: Path) -> None:
    """Looping it starts over; /clock tells the time of the recording, not that of the replay."""
    path, sent = write(tmp_path)
    heard: list[bytes] = []
    clocks: list[int] = []
    node, stop = listener(live, heard), Stop()

    def on_clock(message: Any) -> None:
        clocks.append(message.clock.sec * NS + message.clock.nanosec)

    node.create_subscription(Clock, '/clock', on_clock, 1000)
    playing = player(live, Play(path, loop=True, clock=True, restamp=False))

    def third_time(_: float) -> None:
        stop.asked = playing.published >= 2.5 * len(sent)

    playing.wait_for_subscribers(Stop())
    playing.run(stop, third_time)
    live.until(lambda: len(heard) == playing.published)
    assert heard[: 2 * len(sent)] == sent * 2
    live.until(lambda: clocks)
    assert {T0 <= now < T0 + NS for now in clocks} == {True}


def foreign(path: Path, *kinds: str, clock: bool = False) -> Path:
    """Write an MCAP with a message of each of these types, whose content means nothing."""
    names = {f'/t{k}': kind for k, kind in enumerate(kinds)}
    names |= {'/clock': 'rosgraph_msgs/msg/Clock'} if clock else {}
    with path.open('wb') as file:
        writer = McapWriter(file)
        writer.start('ros2', 'test')
        for name, kind in names.items():
            schema = writer.register_schema(kind, 'ros2msg', b'')
            channel = writer.register_channel(name, 'cdr', schema)
            writer.add_message(channel, T0, bytes([0, 1, 0, 0]), T0)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_what_is_not_installed_is_left_out_and_said(live: Live, tmp_path: Path) -> None:
    """Topics of other types are played all the same."""
    kinds = ('no_such_msgs/msg/Thing', 'sensor_msgs/msg/NoSuchThing', 'sensor_msgs/msg/Imu')
    playing = player(live, Play(foreign(tmp_path / 'run.mcap', *kinds)))
    assert list(playing.publishers) == ['/t2']
    assert playing.skipped == {
        '/t0': 'type no_such_msgs/msg/Thing is not installed',
        '/t1': 'type sensor_msgs/msg/NoSuchThing is not installed',
    }


def test_a_recording_of_nothing_that_is_installed_is_refused(live: Live, tmp_path: Path) -> None:
    """What cannot be published is named."""
    path = foreign(tmp_path / 'run.mcap', 'no_such_msgs/msg/Thing')
    with pytest.raises(BadBag, match=r'expected a topic that can be published: .*no_such_msgs'):
        player(live, Play(path))


def test_a_message_without_room_for_a_stamp_does_not_end_the_replay(
    live: Live, tmp_path: Path
) -> None:
    """With restamp, a message that was cut off goes out as it is."""
    playing = player(live, Play(foreign(tmp_path / 'run.mcap', 'sensor_msgs/msg/Imu')))
    playing.run(Stop())
    assert playing.published == 1


PROGRAM = 'from ugv_acceptance.nodes.bag_player import main; main()'


def test_the_node_plays_what_its_parameters_say(live: Live, tmp_path: Path) -> None:
    """A process of its own: the recording, its topics, and how many messages there were."""
    path, sent = write(tmp_path)
    heard: list[bytes] = []
    listener(live, heard)
    given = (f'bag:={path}', 'topics:=["/joint_states"]', 'rate:=2.0', 'restamp:=false')
    options = [word for text in given for word in ('-p', text)]
    command = [sys.executable, '-c', PROGRAM, '--ros-args', *options]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        live.until(lambda: len(heard) == len(sent))
        _, said = process.communicate(timeout=60)
    assert process.returncode == 0
    assert heard == sent
    assert f'{len(sent)} messages published' in said


def test_the_node_needs_a_recording() -> None:
    """Without one it ends with code 2 and one line."""
    done = subprocess.run(
        [sys.executable, '-c', PROGRAM], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        'ugv-acceptance: parameter bag: expected the path of a recording, got none'
    ]
