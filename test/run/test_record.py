"""A simulated run as a recording: the same seed gives the same bytes, other tools read it."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from rosbags.highlevel import AnyReader

from ugv_acceptance import BadBag, BadConfig
from ugv_acceptance.bag.raw import Offered, offered
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.config import load
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.run.catalogue import case_of, names
from ugv_acceptance.run.fault_text import fault_from
from ugv_acceptance.run.record import lasting, record
from ugv_acceptance.simulation.faults import KINDS

CONFIG = load()
ROBOT = CONFIG.settings.robot


def recorded(
    folder: Path, name: str = 'gentle', seconds: float = 2.0, seed: int = 1, fault: str = ''
) -> Path:
    """Record a run and return its folder."""
    faults = (fault_from(fault, ROBOT),) if fault else ()
    record(CONFIG, case_of(name, ROBOT, seed, seconds, faults), seed, folder)
    return folder


def mcap(folder: Path) -> bytes:
    """Return the bytes of a recording."""
    return (folder / f'{folder.name}_0.mcap').read_bytes()


@pytest.mark.parametrize('fault', ['', 'dropped', 'reordered'])
def test_the_same_seed_gives_the_same_bytes(tmp_path: Path, fault: str) -> None:
    """A run can be made again anywhere, faults included."""
    one = recorded(tmp_path / 'a' / 'run', fault=fault)
    two = recorded(tmp_path / 'b' / 'run', fault=fault)
    assert mcap(one) == mcap(two)


def test_another_seed_gives_other_bytes(tmp_path: Path) -> None:
    """The seed is what the noise is drawn from."""
    one, two = (recorded(tmp_path / str(s) / 'run', seed=s) for s in (1, 2))
    assert mcap(one) != mcap(two)


def test_rosbags_reads_what_is_recorded(tmp_path: Path) -> None:
    """A rosbag2 folder with metadata: message counts and types as another reader sees them."""
    folder = recorded(tmp_path / 'run', seconds=3.0)
    with AnyReader([folder]) as reader:
        counts = {c.topic: (c.msgtype, c.msgcount) for c in reader.connections}
    assert counts['/joint_states'] == ('sensor_msgs/msg/JointState', 301)
    assert counts['/imu/data'] == ('sensor_msgs/msg/Imu', 601)
    assert counts['/payload'][1] == 3


def test_the_load_is_declared_before_anything_that_is_measured(tmp_path: Path) -> None:
    """Else the first margins would be those of the load that the configuration assumes."""
    with AnyReader([recorded(tmp_path / 'run')]) as reader:
        topics = [connection.topic for connection, _, _ in reader.messages()]
    assert topics[:2] == ['/robot_description', '/payload']


def test_a_recording_holds_the_robot_it_is_of(tmp_path: Path, repository: Path) -> None:
    """Its URDF is told once, latched, so that the recording can be judged without the file."""
    folder = recorded(tmp_path / 'run', seconds=1.5)
    text = (repository / 'msg_configs' / 'packbot.yaml').read_text('utf-8')
    bare = tmp_path / 'robot.yaml'
    bare.write_text(re.sub(r'(?m)^urdf:.*$', '', text), 'utf-8')
    told, filed = evaluate(folder, config=bare), evaluate(folder)
    assert told.result['robot']['description'] == 'recorded'
    assert told.result['robot']['urdf_sha256'] == filed.result['robot']['urdf_sha256']
    assert told.result['stability'] == filed.result['stability']
    assert offered(open_bag(folder))['/robot_description'] == Offered('reliable', 'transient_local')


def test_every_chunk_has_a_checksum_and_no_more_than_half_a_second(tmp_path: Path) -> None:
    """A damaged or cut file loses little, and says so."""
    path = next(recorded(tmp_path / 'run', seconds=3.0).glob('*.mcap'))
    with path.open('rb') as stream:
        kinds = [type(r).__name__ for r in StreamReader(stream, validate_crcs=True).records]
    assert 'Message' in kinds
    with path.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    spans = [c.message_end_time - c.message_start_time for c in summary.chunk_indexes]
    assert max(spans) <= 500_000_000


def test_a_run_in_stretches_loses_no_message(tmp_path: Path) -> None:
    """What comes late from one stretch is written in the next; log times never fall."""
    folder = recorded(tmp_path / 'run', 'work', seconds=11.0, fault='late=0.4')
    with AnyReader([folder]) as reader:
        times = [(c.topic, t) for c, t, _ in reader.messages()]
    assert sum(topic == '/joint_states' for topic, _ in times) == 2201
    assert sum(topic == '/imu/data' for topic, _ in times) == 4401
    assert (np.diff([t for _, t in times]) >= 0).all()


def test_a_folder_in_use_is_refused(tmp_path: Path) -> None:
    """No recording is written over."""
    recorded(tmp_path / 'run', seconds=0.5)
    with pytest.raises(BadBag, match='expected a new or empty folder'):
        recorded(tmp_path / 'run', seconds=0.5)


# What the monitor has to say of each fault; None: a fault it cannot see in its inputs.
TOLD: dict[str, str | None] = {
    'dropped': None,
    'late': 'INPUT_STALE',
    'reordered': None,
    'duplicated': None,
    'dead': 'INPUT_STALE',
    'nan': 'INPUT_INVALID',
    'dead-encoder': 'INPUT_INCOMPLETE',
    'frozen-encoder': None,
    'effort-missing': None,
    'imu-bias': 'IMU_INCONSISTENT',
    'wrong-mounting': None,
    'identity-orientation': None,
    'clock-jump': 'CLOCK',
    'second-publisher': 'POSITION_LEAP',  # live, its publisher is told too: SECOND_PUBLISHER
    'heavy-payload': None,
    'weak-motor': None,
}


@pytest.mark.parametrize('kind', KINDS)
def test_a_fault_is_told_or_known_to_be_hidden(tmp_path: Path, kind: str) -> None:
    """A fault that shows in the inputs raises its alert; on level ground the others raise none."""
    folder = recorded(tmp_path / 'run', f'fault-{kind}', seconds=9.0)
    result = evaluate(folder, config=CONFIG).result
    codes = {alert['code'] for alert in result['alerts']}
    assert codes == (set() if TOLD[kind] is None else {TOLD[kind]}) or TOLD[kind] in codes


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('gravity', 'expected one of dropped, late'),
        ('nan:shoulder_joint', 'expected joint_states, imu after the colon'),
        ('frozen-encoder', 'expected turret_joint, shoulder_joint'),
        ('effort-missing:imu', 'expected no subject'),
        ('dropped=2', 'expected an amount from 0 to 1, got 2'),
        ('late=fast', 'expected a number'),
        ('late=1.2.3', 'expected a number'),
        ('dead@5-3', 'expected an end after the start'),
        ('weak-motor:elbow_joint@3', 'expected no times'),
    ],
)
def test_a_fault_that_makes_no_sense_is_refused(text: str, said: str) -> None:
    """The message says what was expected and what came."""
    with pytest.raises(BadConfig, match=said):
        fault_from(text, ROBOT)


def test_an_unknown_scenario_is_refused() -> None:
    """The message lists all there are."""
    with pytest.raises(BadConfig, match='expected one of gentle, overreach') as error:
        case_of('gentl', ROBOT, 1, None)
    assert all(name in str(error.value) for name in names())


@pytest.mark.parametrize('seconds', [0.0, -1.0, 1e6, math.nan])
def test_a_run_of_no_length_is_refused(seconds: float) -> None:
    """A run must be longer than 0 s and shorter than a million seconds."""
    with pytest.raises(BadConfig, match='seconds: expected a number above 0'):
        case_of('gentle', ROBOT, 1, seconds)


def test_a_jolt_is_no_saturation() -> None:
    """A motor at its limit for a moment is no saturation; a lasting one counts from its start."""
    stamp = np.arange(0.0, 2.0, 0.1)
    held = (stamp > 0.45) & (stamp < 0.55) | (stamp > 0.95) & (stamp < 1.35)
    assert lasting(held, stamp, 0.2) == pytest.approx(1.0)
    assert lasting(held, stamp, 0.5) == np.inf
