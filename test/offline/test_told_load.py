"""A load that is told in messages nobody can read, or by two in turn: a guess, and no PASS."""

import struct
from collections.abc import Callable
from itertools import cycle, islice
from pathlib import Path

import pytest
import yaml
from evaluation.streams import settings

import ugv_acceptance as ugv
from ugv_acceptance.bag.encode import inertia_cdr
from ugv_acceptance.bag.metadata import NAME as METADATA
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.evaluation.inputs.payload import PayloadLog
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.offline.told_load import disputed_load

PAYLOAD = 'geometry_msgs/msg/InertiaStamped'
FLOAT = 'std_msgs/msg/Float64'
NINE_KG = b'\0\1\0\0' + struct.pack('<d', 9.0)
# Topic, type and content of a message of the load; None: as it was recorded.
Told = tuple[str, str, bytes | None]


def write(folder: Path, told: Callable[[float], list[Told]], source: Path) -> Path:
    """Write the recorded run of a robot that carries 1 kg, its load told otherwise (by time in s).

    Parts of 10 s each, since the topics of a part may have other types than those of another one.
    """
    bag = open_bag(source)
    names = list(bag.topics)
    held = [(m.log_time, m.topic, bag.topics[m.topic].type, m.data) for m in messages(bag, names)]
    said = []
    for time, topic, kind, data in held:
        if topic != '/payload':
            said.append((time, topic, kind, data))
            continue
        for name, type_, content in told((time - bag.start_ns) / 1e9):
            said.append((time, name, type_, data if content is None else content))
    parts = []
    for number in range(3):
        begin = bag.start_ns + number * 10 * 10**9
        end = begin + 10 * 10**9 if number < 2 else bag.end_ns + 1
        part = [one for one in said if begin <= one[0] < end]
        with BagWriter(folder / str(number)) as writer:
            for name, kind in {name: kind for _, name, kind, _ in part}.items():
                writer.add_topic(name, kind)
            for time, name, _, data in part:
                writer.write(name, time, data)
        (file,) = (folder / str(number)).glob('*.mcap')
        parts.append(file.rename(folder / f'run_{number}.mcap'))
    return folder


def judged(folder: Path) -> ugv.Evaluation:
    """Judge the parts."""
    return ugv.evaluate(sorted(folder.glob('*.mcap')))


@pytest.mark.parametrize(
    ('told', 'words'),
    [
        (lambda t: [('/payload', PAYLOAD, bytes(30) if t > 15.0 else None)], 'cannot be decoded'),
        (lambda t: [('/payload', *((FLOAT, NINE_KG) if t > 10.0 else (PAYLOAD, None)))], 'Float64'),
        (lambda t: [('/payload', *((FLOAT, NINE_KG) if t < 20.0 else (PAYLOAD, None)))], 'Float64'),
        (lambda _: [('/payload', FLOAT, NINE_KG)], 'Float64'),
        (
            lambda _: [('/a/payload', PAYLOAD, None), ('/b/payload', PAYLOAD, None)],
            '/a/payload and',
        ),
    ],
)
def test_a_load_that_is_not_read_is_no_pass(
    told: Callable[[float], list[Told]], words: str, repository: Path, tmp_path: Path
) -> None:
    """Undecodable, of another type (at first, later, always), or on two topics: it is told."""
    found = judged(write(tmp_path / 'run', told, repository / 'bags' / 'packbot_pass'))
    assert found.verdict == 'INCONCLUSIVE'
    assert any('the load is told' in reason and words in reason for reason in found.reasons)


@pytest.mark.parametrize(
    'told',
    [
        lambda _: [('/payload', PAYLOAD, None)],
        lambda _: [('/payload', PAYLOAD, None), ('/other/payload', PAYLOAD, NINE_KG)],
        lambda _: [('/load', PAYLOAD, None)],
    ],
)
def test_a_load_that_is_read_is_no_reason(
    told: Callable[[float], list[Told]], repository: Path, tmp_path: Path
) -> None:
    """On the topic of the configuration, whatever another one tells; else on the only one."""
    assert judged(write(tmp_path / 'run', told, repository / 'bags' / 'packbot_pass')).verdict == (
        'PASS'
    )


def test_a_load_of_which_metadata_alone_tells_is_lost(repository: Path, tmp_path: Path) -> None:
    """The file has no topic of the load, but metadata.yaml counts messages of it."""
    bag = open_bag(repository / 'bags' / 'packbot_pass')
    names = ['/joint_states', '/imu/data']
    folder = tmp_path / 'run'
    with BagWriter(folder) as writer:
        for name in names:
            writer.add_topic(name, bag.topics[name].type)
        for message in messages(bag, names):
            writer.write(message.topic, message.log_time, message.data)
    told = yaml.safe_load((folder / METADATA).read_text())
    about = told['rosbag2_bagfile_information']
    of = {'name': '/payload', 'type': PAYLOAD, 'serialization_format': 'cdr'}
    about['topics_with_message_count'].append({'topic_metadata': of, 'message_count': 3})
    (folder / METADATA).write_text(yaml.safe_dump(told))
    assert ugv.evaluate(folder).result['bag']['lost_messages'] == 3


@pytest.mark.parametrize(
    ('every', 'loads', 'kg'),
    [
        (1.0, (1.0, 0.2), '0.2 and 1 kg'),
        (2.0, (1.0, 0.2, 0.5), '0.2 and 0.5 and 1 kg'),
        (0.01, (0.0, 1.0), '0 and 1 kg'),
        (6.0, (1.0, 0.2), ''),
        (1.0, (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7), ''),
    ],
)
def test_a_load_that_two_tell_in_turn_is_disputed(
    every: float, loads: tuple[float, ...], kg: str
) -> None:
    """Quicker than one is set down and another one taken up; a load may be told to change."""
    told = PayloadLog(settings())
    told.payloads = [Payload(mass, (0.0, 0.0, 0.0)) for mass in islice(cycle(loads), 8)]
    told.since = [round(every * 1e9) * k for k in range(8)]
    said = [objection.reason for objection in disputed_load(told).objections]
    assert said == ([f'the load is told as {kg} in turn: two tell it'] if kg else [])


def test_a_run_whose_load_is_disputed_is_no_pass(repository: Path, tmp_path: Path) -> None:
    """The good run, told 1 kg and 0.2 kg in turn."""
    bag = open_bag(repository / 'bags' / 'packbot_pass')
    with BagWriter(tmp_path / 'run') as writer:
        for name, topic in bag.topics.items():
            writer.add_topic(name, topic.type)
        for k, message in enumerate(messages(bag, list(bag.topics))):
            writer.write(message.topic, message.log_time, message.data)
            if k % 200 == 0:
                light = inertia_cdr(message.log_time, 'gripper_link', 0.2, (0.0, 0.0, 0.0))
                writer.write('/payload', message.log_time, light)
    found = ugv.evaluate(tmp_path / 'run')
    assert found.verdict == 'INCONCLUSIVE'
    assert 'the load is told as 0.2 and 1 kg in turn: two tell it' in found.reasons
