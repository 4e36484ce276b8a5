"""`evaluate --annotate`: the recording as it was, and beside it what a monitor would have said."""

import csv
import json
import os
import sqlite3
import subprocess
import sys
from collections import defaultdict
from contextlib import closing
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from cli.here import ugv
from hypothesis import given
from hypothesis import strategies as st
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader as Ros2Reader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from ugv_acceptance.bag.annotated import write_annotated
from ugv_acceptance.bag.blocks import block_of
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.monitoring.footprint import TILTS

OFFLINE = (
    'import sys\nfrom ugv_acceptance.cli import main\ntry: main()\nfinally:'
    ' assert not {"rclpy", "diagnostic_msgs"} & set(sys.modules)'
)
# Log and publish time (ns), topic, content.
Message = tuple[int, int, str, bytes]


def annotate(bag: object, path: Path, *more: object) -> 'subprocess.CompletedProcess[str]':
    """Run the verb."""
    return ugv('evaluate', bag, '--annotate', path, *more)


def raw(path: Path) -> list[Message]:
    """Return all messages of an MCAP as the mcap package reads them, checksums looked at."""
    with path.open('rb') as file:
        messages = make_reader(file, validate_crcs=True).iter_messages()
        return [(m.log_time, m.publish_time, c.topic, m.data) for _, c, m in messages]


@cache
def decoded(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Return (log time, message) of every topic as mcap-ros2-support decodes them."""
    found: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    with path.open('rb') as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, content in reader.iter_decoded_messages():
            found[channel.topic].append((message.log_time, content))
    return found


@pytest.fixture(scope='module')
def failed(tmp_path_factory: pytest.TempPathFactory, repository: Path) -> Path:
    """Return a folder with the annotated run that fails, and its result and CSV."""
    folder = tmp_path_factory.mktemp('annotated')
    words = ['evaluate', repository / 'bags' / 'packbot_fail', '--annotate', folder / 'run.mcap']
    words += ['--json', folder / 'result.json', '--csv', folder / 'margins.csv']
    command = [sys.executable, '-c', OFFLINE, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
    assert done.returncode == 1, done.stderr
    return folder


def test_recorded_messages_are_the_same_bytes(failed: Path, repository: Path) -> None:
    """Log time, publish time and content of all, in their order; no ROS was loaded for it."""
    before = raw(repository / 'bags' / 'packbot_fail' / 'packbot_fail_0.mcap')
    topics = {topic for _, _, topic, _ in before}
    after = [message for message in raw(failed / 'run.mcap') if message[2] in topics]
    assert len(before) > 8000
    assert after == before


def test_rosbags_reads_it_too(failed: Path, repository: Path) -> None:
    """Every message, ours and theirs, by its own decoder."""
    counts: dict[str, int] = defaultdict(int)
    with AnyReader([failed / 'run.mcap']) as reader:
        for connection, _, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            counts[connection.topic] += 1
    assert counts == {topic: len(found) for topic, found in decoded(failed / 'run.mcap').items()}
    with Ros2Reader(repository / 'bags' / 'packbot_fail') as reader2:
        for connection in reader2.connections:
            assert counts[connection.topic] == connection.msgcount


def test_margins_are_the_columns_of_the_evaluation(failed: Path) -> None:
    """To the last bit those of the CSV (its angles, in degrees, to twelve digits)."""
    rows = [r for r in csv.DictReader((failed / 'margins.csv').open()) if r['state'] != 'unknown']
    found = decoded(failed / 'run.mcap')
    topics = [
        found[f'/acceptance_monitor/{word}']
        for word in ('static_torque', 'torque_margin', 'stability')
    ]
    assert [len(topic) for topic in topics] == [len(rows)] * 3
    assert len(rows) > 8000
    for row, (_, torque), (_, margin), (_, tip) in zip(rows, *topics, strict=True):
        stamp = torque.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == int(row['stamp_ns'])
        for k, name in enumerate(torque.name):
            assert repr(torque.position[k]) == row[f'{name}_position_rad']
            assert repr(torque.effort[k]) == row[f'{name}_static_torque_nm']
            assert repr(margin.effort[k]).removeprefix('inf') == row[f'{name}_torque_margin_nm']
        assert tuple(tip.name) == TILTS
        for k, side in enumerate(SIDES):
            assert repr(tip.effort[k]) == row[f'{side}_moment_nm']
            degrees = tip.position[k] * 57.29577951308232
            assert degrees == pytest.approx(float(row[f'{side}_angle_deg']), rel=1e-12)


def test_alerts_are_those_of_the_result(failed: Path) -> None:
    """Raised and cleared when it says so, with the same advice."""
    result = json.loads((failed / 'result.json').read_text())
    found = decoded(failed / 'run.mcap')['/acceptance_monitor/alerts']
    start = min(time for time, *_ in raw(failed / 'run.mcap'))
    said = []
    for log_time, array in found:
        for status in array.status:
            values = {pair.key: pair.value for pair in status.values}
            assert int(values['time_ns']) == log_time
            said.append((values['state'], values['code'], values['subject'], values['level'],
                         round((log_time - start) / 1e9, 6), values['do']))  # fmt: skip
    raised, cleared = [], []
    for a in result['alerts']:
        key = (a['code'], a['subject'], a['level'])
        raised.append(('raised', *key, round(a['start_s'], 6), a['advice']))
        if a['end_s'] is not None:
            cleared.append(('cleared', *key, round(a['end_s'], 6)))
    assert sorted(s for s in said if s[0] == 'raised') == sorted(raised)
    assert sorted(s[:5] for s in said if s[0] == 'cleared') == sorted(cleared)
    assert any(a['advice_computed'] for a in result['alerts'])


def test_the_verdict_is_there_each_second_and_follows_the_alerts(failed: Path) -> None:
    """Its level is never below that of an active alert, and it is ERROR while the robot tips."""
    result = json.loads((failed / 'result.json').read_text())
    found = decoded(failed / 'run.mcap')
    start = min(time for time, *_ in raw(failed / 'run.mcap'))
    verdicts = found['/acceptance_monitor/verdict']
    times = [time for time, _ in verdicts]
    assert max(b - a for a, b in pairwise(times)) <= 10**9
    levels = {'WARN': 1, 'ERROR': 2, 'STALE': 3}
    for time, status in verdicts:
        at = (time - start) / 1e9
        active = [
            levels[a['level']]
            for a in result['alerts']
            if a['start_s'] < at - 1e-6 and (a['end_s'] is None or at < a['end_s'] - 1e-6)
        ]
        assert status.level >= max(active, default=0)
    assert {status.level for _, status in verdicts} >= {0, 1, 2}
    assert len(found['/diagnostics']) == len(verdicts)


def test_markers_are_drawn_ten_times_a_second(failed: Path) -> None:
    """Each with the support polygon closed."""
    found = decoded(failed / 'run.mcap')['/acceptance_monitor/markers']
    # In 29 s, but for the one in which the arm lies on the ground.
    assert len(found) == pytest.approx(282, abs=3)
    for _, array in found:
        outline = {marker.ns: marker for marker in array.markers}['support'].points
        assert (outline[0].x, outline[0].y) == (outline[-1].x, outline[-1].y)


def test_polygon_and_centre_come_with_each_drawing(failed: Path) -> None:
    """Of the same moment, stamp and frame, and the same points, as those of a live monitor."""
    found = decoded(failed / 'run.mcap')
    words = ('markers', 'support_polygon', 'center_of_mass')
    drawings, polygons, centers = (found[f'/acceptance_monitor/{word}'] for word in words)
    assert len(drawings) == len(polygons) == len(centers) > 200
    for (at, array), (told, outline), (_, center) in zip(drawings, polygons, centers, strict=True):
        marker = {marker.ns: marker for marker in array.markers}
        assert told == at
        assert outline.header.frame_id == center.header.frame_id == 'base_link'
        stamps = [m.header.stamp for m in (outline, center, marker['cog'])]
        assert len({(s.sec, s.nanosec) for s in stamps}) == 1
        drawn = [(p.x, p.y, p.z) for p in marker['support'].points[:-1]]
        single = [pytest.approx(corner, abs=1e-6) for corner in drawn]
        assert [(p.x, p.y, p.z) for p in outline.polygon.points] in ([], single)
        assert (center.point.x, center.point.y) == (
            marker['cog'].points[0].x,
            marker['cog'].points[0].y,
        )
    assert any(outline.polygon.points for _, outline in polygons)


def test_the_word_for_a_gate_of_motion_is_not_made(failed: Path) -> None:
    """A recording that is played must not tell a robot's gate that it may open."""
    assert not [topic for topic in decoded(failed / 'run.mcap') if topic.endswith('/ok')]


def test_every_chunk_has_a_checksum(failed: Path, tmp_path: Path) -> None:
    """A byte that is changed inside a chunk is found."""
    data = bytearray((failed / 'run.mcap').read_bytes())
    assert open_bag(failed / 'run.mcap').protected == 'all'
    data[len(data) // 2] ^= 0xFF
    path = tmp_path / 'broken.mcap'
    path.write_bytes(data)
    with pytest.raises((McapError, ValueError, OSError)):
        raw(path)


def test_what_the_monitor_said_then_is_kept_apart(failed: Path, tmp_path: Path) -> None:
    """A recording that holds the monitor's topics keeps them; ours get names of their own."""
    path = tmp_path / 'twice.mcap'
    assert annotate(failed / 'run.mcap', path).returncode == 1
    before, after = raw(failed / 'run.mcap'), raw(path)
    topics = {topic for _, _, topic, _ in before}
    # Of the same moment the order of several topics is nobody's.
    assert sorted(m for m in after if m[2] in topics) == sorted(before)
    mine = {topic for _, _, topic, _ in after} - topics
    assert len(mine) == 9
    assert {topic.split('/')[1] for topic in mine} == {'acceptance_evaluation'}


def test_nothing_is_overwritten_unasked(repository: Path, tmp_path: Path) -> None:
    """One line and exit code 2; with --overwrite it is replaced, but never the recording itself."""
    bag, path = repository / 'bags' / 'packbot_gap', tmp_path / 'out.mcap'
    path.write_text('mine')
    done = annotate(bag, path)
    assert done.returncode == 2
    assert 'it exists' in done.stderr
    assert path.read_text() == 'mine'
    assert annotate(bag, path, '--overwrite').returncode == 3
    assert raw(path)
    copy = tmp_path / 'copy.mcap'
    copy.write_bytes((bag / 'packbot_gap_0.mcap').read_bytes())
    done = annotate(copy, copy, '--overwrite')
    assert done.returncode == 2
    assert 'the recording itself' in done.stderr
    assert copy.read_bytes() == (bag / 'packbot_gap_0.mcap').read_bytes()
    assert not list(tmp_path.glob('*.part'))


def test_while_an_input_is_silent_nothing_is_drawn_and_the_verdict_is_stale(
    repository: Path, tmp_path: Path
) -> None:
    """No margins, no markers, no OK."""
    path, result = tmp_path / 'gap.mcap', tmp_path / 'gap.json'
    annotate(repository / 'bags' / 'packbot_gap', path, '--json', result)
    inputs = json.loads(result.read_text())['inputs']
    gaps = [gap for source in ('joint_states', 'imu') for gap in inputs[source]['first_gaps_s']]
    start, found = min(time for time, *_ in raw(path)), decoded(path)
    (since, until), *_ = sorted(gaps, key=lambda gap: gap[0] - gap[1])
    within = {
        word: [m for t, m in found[f'/acceptance_monitor/{word}']
               if since + 0.01 < (t - start) / 1e9 < until - 0.01]
        for word in ('stability', 'markers', 'verdict')
    }  # fmt: skip
    assert not within['stability']
    assert not within['markers']
    assert within['verdict']
    assert {status.level for status in within['verdict']} == {3}


@pytest.mark.parametrize(
    'name',
    ['abitobot', 'rosbag2_recorded/split', 'rosbag2_recorded/killed', 'rosbag2_recorded/fastwrite'],
)
def test_recordings_of_others_are_copied_whole(
    name: str, shared_bags: Path, tmp_path: Path
) -> None:
    """Chunked or not, split or broken off: what the stream holds is there, and their schemas."""
    bag, path = open_bag(shared_bags / name), tmp_path / 'out.mcap'
    count = write_annotated(path, bag, {}, [])
    after = raw(path)
    assert len(after) == count == sum(topic.count for topic in bag.topics.values())
    if bag.salvaged is None:
        before = [m for member in bag.paths for m in raw(member)]
        assert sorted(after) == sorted(before)
    with path.open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert {c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()} == {
        name: topic.type for name, topic in bag.topics.items()
    }


def test_an_old_recording_becomes_an_mcap(shared_bags: Path, tmp_path: Path) -> None:
    """ROS 1: as many messages, at the same times, that decode as ROS 2."""
    bag, path = (
        open_bag(shared_bags / 'fuse_turtlebot3' / 'fuse_turtlebot3.bag'),
        tmp_path / 'out.mcap',
    )
    write_annotated(path, bag, {}, [])
    found = decoded(path)
    with AnyReader([shared_bags / 'fuse_turtlebot3' / 'fuse_turtlebot3.bag']) as reader:
        times = [t for c, t, _ in reader.messages() if c.topic == '/joint_states']
    assert [time for time, _ in found['/joint_states']] == times
    assert found['/joint_states'][0][1].name


def test_a_recording_that_breaks_off_is_copied_up_to_there(tmp_path: Path) -> None:
    """SQLite with a number for a message: what came before it is in the copy."""
    folder = tmp_path / 'run'
    with Ros2Writer(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        kind = 'std_msgs/msg/Empty'
        connection = writer.add_connection('/a', kind, typestore=get_typestore(Stores.ROS2_JAZZY))
        for time in range(1, 9):
            writer.write(connection, time, b'\0\1\0\0')
    (path,) = folder.glob('*.db3')
    with closing(sqlite3.connect(path)) as db:
        db.execute('UPDATE messages SET data = 7 WHERE id = 5')
        db.commit()
    assert write_annotated(tmp_path / 'out.mcap', open_bag(folder), {}, []) == 4
    assert [m[0] for m in raw(tmp_path / 'out.mcap')] == [1, 2, 3, 4]


channels = st.lists(st.tuples(st.sampled_from(['cdr', 'json', 'x']), st.booleans()), min_size=1)
moments = st.tuples(st.integers(0, 40), st.integers(0, 5), st.integers(0, 2), st.binary(max_size=9))


@given(channels, st.lists(moments, max_size=40), st.lists(st.integers(0, 40), max_size=10))
def test_any_messages_are_merged_with_what_is_said(
    kinds: list[tuple[str, bool]], written: list[tuple[int, int, int, bytes]], said: list[int]
) -> None:
    """Of any encoding, with or without schema, in any order of times: none is lost or changed."""
    folder = Path(os.environ['ROS_LOG_DIR'])
    source, path = folder / f'{os.getpid()}_in.mcap', folder / f'{os.getpid()}_out.mcap'
    with source.open('wb') as file:
        writer = Writer(file, chunk_size=64, compression=CompressionType.LZ4)
        writer.start('ros2')
        schema = writer.register_schema('a/msg/B', 'ros2msg', b'int32 x')
        made = [
            writer.register_channel(f'/t{k}', kind, schema if typed else 0, {'k': str(k)})
            for k, (kind, typed) in enumerate(kinds)
        ]
        wanted = []
        for log_time, published, which, data in written:
            k = which % len(made)
            writer.add_message(made[k], log_time, data, published)
            wanted.append((log_time, published, f'/t{k}', data))
        writer.finish()  # type: ignore[no-untyped-call]
    ours = [block_of([(t, t, 0, b'\0\1\0\0')]) for t in sorted(said)]
    types = {'/said': 'std_msgs/msg/Empty'}
    count = write_annotated(path, open_bag(source), types, ours)
    found = raw(path)
    assert count == len(written)
    assert sorted(m for m in found if m[2] != '/said') == sorted(wanted)
    assert [m[0] for m in found if m[2] == '/said'] == sorted(said)
    assert [m[0] for m in found] == sorted(m[0] for m in found)
