"""A recording made as messages come: parts that can be judged alone, and how it ends by itself."""

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from bag.bag_cases import IMU, JOINT_STATE
from rosbags.highlevel import AnyReader

from ugv_acceptance import BadBag
from ugv_acceptance.bag.encode import inertia_cdr
from ugv_acceptance.bag.raw import messages, offered
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.recorder import Recorder, Room, free_bytes
from ugv_acceptance.bag.recordings_kept import Keep, new_folder, prune
from ugv_acceptance.bag.writer import Qos

INERTIA, STRING = 'geometry_msgs/msg/InertiaStamped', 'std_msgs/msg/String'
BODY = b'\x00\x01\x00\x00' + bytes(400)
START = 1_700_000_000_000_000_000


def load(mass: float) -> bytes:
    """Return a message of a load (kg)."""
    return inertia_cdr(START, 'gripper_link', mass, (0.0, 0.0, 0.0))


def until(condition: Callable[[], object]) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < end, 'expected this to come true, it did not'
        time.sleep(0.01)


def split_run(folder: Path, parts: int = 3) -> list[Path]:
    """Record until there are so many files; return them."""
    recorder = Recorder(folder, Room(part_bytes=3_000, reserve=0), compression='')
    recorder.declare('/imu/data', IMU, [Qos('best_effort')])
    recorder.declare('/payload', INERTIA, [Qos()], lambda _: '')
    recorder.declare('/robot_description', STRING, [Qos()], lambda data: data)
    for mass in (1.0, 2.0):
        recorder.put('/payload', START, load(mass))
    for text in (b'one', b'two', b'one'):
        recorder.put('/robot_description', START, BODY[:4] + text)
    k = 0
    while recorder.parts < parts:
        k += 1
        recorder.put('/imu/data', START + k * 1_000_000, BODY)
        time.sleep(0.001)
    recorder.close()
    assert not recorder.trouble
    return sorted(folder.glob('*.mcap'))


def test_what_comes_is_read_back_in_order(tmp_path: Path) -> None:
    """All that was put is there once it is closed, with checksums, and nothing is odd."""
    recorder = Recorder(tmp_path / 'run', Room(reserve=0))
    recorder.declare('/imu/data', IMU, [Qos('best_effort')])
    for k in range(2_000):
        recorder.put('/imu/data', START + k, BODY + k.to_bytes(4, 'little'))
    recorder.close()
    bag = open_bag(tmp_path / 'run')
    held = [int.from_bytes(m.data[-4:], 'little') for m in messages(bag, ['/imu/data'])]
    assert held == list(range(2_000))
    assert (bag.protected, bag.salvaged, bag.findings) == ('all', None, ())


def test_it_is_on_the_disk_without_being_closed(tmp_path: Path) -> None:
    """A process that is killed now would leave what was put a moment ago."""
    recorder = Recorder(tmp_path / 'run', Room(reserve=0))
    recorder.declare('/imu/data', IMU, [Qos()])
    recorder.put('/imu/data', START, BODY)
    until(lambda: open_bag(tmp_path / 'run').topics.get('/imu/data'))
    assert open_bag(tmp_path / 'run').topics['/imu/data'].count == 1
    recorder.close()


def test_every_part_begins_with_what_lasts(tmp_path: Path) -> None:
    """Each file alone has the load in force and every description, once, before anything else."""
    first, *others = split_run(tmp_path / 'run')
    assert len(others) >= 2
    for part in others:
        found = list(messages(open_bag(part), ['/payload', '/robot_description']))
        assert [m.data for m in found if m.topic == '/payload'] == [load(2.0)]
        texts = [m.data[4:] for m in found if m.topic == '/robot_description']
        assert sorted(texts) == [b'one', b'two']
        inputs = [m.log_time for m in messages(open_bag(part), ['/imu/data'])]
        assert not inputs or max(m.log_time for m in found) <= min(inputs)
    assert open_bag(first).salvaged is None


def test_the_parts_are_one_recording(tmp_path: Path) -> None:
    """Our reader and rosbags read the folder as one: no message lost or doubled, none to find."""
    parts = split_run(tmp_path / 'run')
    bag = open_bag(tmp_path / 'run')
    times = [m.log_time for m in messages(bag, ['/imu/data'])]
    assert times == [START + k * 1_000_000 for k in range(1, len(times) + 1)]
    assert (len(bag.paths), bag.findings) == (len(parts), ())
    with AnyReader([tmp_path / 'run']) as reader:
        held = [t for c, t, _ in reader.messages() if c.topic == '/imu/data']
    assert held == times
    info = yaml.safe_load((tmp_path / 'run' / 'metadata.yaml').read_text())
    info = info['rosbag2_bagfile_information']
    assert [file['path'] for file in info['files']] == [path.name for path in parts]
    assert sum(file['message_count'] for file in info['files']) == info['message_count']


def test_a_part_ends_after_its_time(tmp_path: Path) -> None:
    """Also where little comes, so that a file is never open for long."""
    recorder = Recorder(tmp_path / 'run', Room(part_seconds=0.2, reserve=0))
    until(lambda: recorder.parts > 2)
    recorder.close()
    assert len(open_bag(tmp_path / 'run').paths) == recorder.parts


def test_what_was_offered_is_told_as_it_was(tmp_path: Path) -> None:
    """Every QoS that publishers offered, also one that came later, with its deadline."""
    recorder = Recorder(tmp_path / 'run', Room(reserve=0))
    first, later = Qos('best_effort', deadline=1_500_000_000), Qos('reliable', 'transient_local')
    recorder.declare('/imu/data', IMU, [first])
    recorder.declare('/imu/data', IMU, [first, later])
    recorder.put('/imu/data', START, BODY)
    recorder.close()
    text = (tmp_path / 'run' / 'metadata.yaml').read_text()
    (topic,) = yaml.safe_load(text)['rosbag2_bagfile_information']['topics_with_message_count']
    one, two = topic['topic_metadata']['offered_qos_profiles']
    assert one['deadline'] == {'sec': 1, 'nsec': 500_000_000}
    assert (one['reliability'], one['durability']) == ('best_effort', 'volatile')
    assert (two['reliability'], two['durability']) == ('reliable', 'transient_local')
    assert offered(open_bag(tmp_path / 'run'))['/imu/data'].reliability == 'best_effort'


def test_it_ends_before_the_disk_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once less is left than is to stay free it says so; what was put until then is whole."""
    recorder = Recorder(tmp_path / 'run', Room(reserve=1_000))
    recorder.declare('/imu/data', IMU, [Qos()])
    recorder.put('/imu/data', START, BODY)
    monkeypatch.setattr('ugv_acceptance.bag.recorder.free_bytes', lambda _: 999)
    until(lambda: recorder.trouble)
    recorder.put('/imu/data', START + 1, BODY)
    recorder.close()
    assert 'stay free' in recorder.trouble
    bag = open_bag(tmp_path / 'run')
    assert (bag.topics['/imu/data'].count, bag.findings, recorder.dropped) == (1, (), 1)


def test_it_does_not_begin_on_a_disk_without_room(tmp_path: Path) -> None:
    """One line says how much is there and how much is to stay free."""
    much = free_bytes(tmp_path) + 10**12
    with pytest.raises(BadBag, match='which are to stay free'):
        Recorder(tmp_path / 'run', Room(reserve=much))


LIMITED = """
import resource, signal, sys, time
from pathlib import Path
from ugv_acceptance.bag.recorder import Recorder, Room
from ugv_acceptance.bag.writer import Qos
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
recorder = Recorder(Path(sys.argv[1]), Room(reserve=0), compression='')
recorder.declare('/imu/data', 'sensor_msgs/msg/Imu', [Qos()])
k = 0
while not recorder.trouble:
    before = recorder.size
    for _ in range(20):
        k += 1
        recorder.put('/imu/data', k, bytes((0, 1, 0, 0)) + bytes(400))
    while recorder.size == before and not recorder.trouble:
        time.sleep(0.001)
recorder.close()
print(recorder.trouble, recorder.size)
"""


def test_a_disk_that_takes_no_more_ends_it_with_the_last_whole_chunk(tmp_path: Path) -> None:
    """The error is told, no half of a record stays in the file, all before it can be read."""
    path = tmp_path / 'run'
    done = subprocess.run(
        [sys.executable, '-c', LIMITED, str(path)], capture_output=True, text=True, check=True
    )
    assert 'cannot be written: File too large' in done.stdout
    bag = open_bag(path)
    (file,) = bag.paths
    size = file.stat().st_size
    assert int(done.stdout.split()[-1]) == size
    assert bag.salvaged is not None
    assert f'at byte {size} of {size}' in bag.salvaged
    times = [m.log_time for m in messages(bag, ['/imu/data'])]
    assert times == list(range(1, len(times) + 1))
    assert len(times) >= 40


def test_an_unknown_type_is_refused_and_nothing_else_is_lost(tmp_path: Path) -> None:
    """Whoever declares it is told; other topics go on."""
    recorder = Recorder(tmp_path / 'run', Room(reserve=0))
    with pytest.raises(BadBag, match='my_msgs/msg/Foo'):
        recorder.declare('/foo', 'my_msgs/msg/Foo', [Qos()])
    recorder.declare('/joint_states', JOINT_STATE, [Qos()])
    recorder.put('/joint_states', START, BODY)
    recorder.close()
    assert open_bag(tmp_path / 'run').topics['/joint_states'].count == 1


def test_a_recording_is_never_replaced(tmp_path: Path) -> None:
    """Neither by the same folder, nor by the same name in the same second."""
    split_run(tmp_path / 'run')
    before = {path: path.read_bytes() for path in (tmp_path / 'run').iterdir()}
    with pytest.raises(BadBag, match='new or empty folder'):
        Recorder(tmp_path / 'run')
    assert {path: path.read_bytes() for path in (tmp_path / 'run').iterdir()} == before
    first = new_folder('my robot', START, tmp_path)
    first.mkdir()
    assert first.name == 'my_robot_20231114T221320Z'
    assert new_folder('my robot', START, tmp_path).name == 'my_robot_20231114T221320Z_2'


def kept(tmp_path: Path, names: list[str]) -> None:
    """Make recordings of 1,000 bytes each."""
    for name in names:
        (tmp_path / name).mkdir()
        (tmp_path / name / f'{name}_0.mcap').write_bytes(bytes(1_000))


@pytest.mark.parametrize('keep', [Keep(count=2), Keep(size=2_500)])
def test_only_the_oldest_recordings_of_this_robot_go(tmp_path: Path, keep: Keep) -> None:
    """By number and by size; never another robot's, never a folder that holds something else."""
    names = [f'rover_2026010{k}T000000Z' for k in range(1, 5)]
    others = ['rover_2_20250101T000000Z', 'rover', 'rover_notes']
    kept(tmp_path, names + others)
    kept(tmp_path, ['rover_20240101T000000Z'])
    (tmp_path / 'rover_20240101T000000Z' / 'notes.txt').write_text('mine')
    gone = prune('rover', keep, tmp_path / names[-1])
    assert [path.name for path in gone] == names[:2]
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {*names[2:], *others, 'rover_20240101T000000Z'}


def test_the_present_recording_stays_whatever_it_takes(tmp_path: Path) -> None:
    """It may be larger than all that is to be kept."""
    kept(tmp_path, ['rover_20260101T000000Z'])
    assert not prune('rover', Keep(size=10), tmp_path / 'rover_20260101T000000Z')
    assert (tmp_path / 'rover_20260101T000000Z').is_dir()
