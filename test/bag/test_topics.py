"""Which topics are read: by name, by type, or a clear error."""

from pathlib import Path

import pytest
from bag.bag_cases import (
    IMU,
    INERTIA,
    JOINT_STATE,
    cdr,
    imu,
    inertia,
    joint_state,
    write_mcap,
)
from mcap.writer import Writer

from ugv_acceptance import BadBag
from ugv_acceptance.bag.reader import Bag, Topics, choose_topics, open_bag


def topics_of(tmp_path: Path, held: dict[str, str]) -> Bag:
    """A bag with one message on each of these topics of these types."""
    content = {
        JOINT_STATE: cdr(joint_state()),
        IMU: cdr(imu()),
        INERTIA: cdr(inertia()),
        'std_msgs/msg/Empty': b'\x00\x01\x00\x00\x00',
    }
    messages = [(topic, kind, 5, content[kind]) for topic, kind in held.items()]
    return open_bag(write_mcap(tmp_path / 'run.mcap', messages))


def test_configured_topics_are_chosen(tmp_path: Path) -> None:
    """A configured name, with or without its slash, wins over others of the same type."""
    held = {'/joint_states': JOINT_STATE, '/wheels': JOINT_STATE, '/imu/data': IMU, '/b': IMU}
    chosen = choose_topics(topics_of(tmp_path, held), '/joint_states', 'imu/data')
    assert chosen == Topics('/joint_states', '/imu/data', None)


def test_topics_are_found_by_type(tmp_path: Path) -> None:
    """Where the configured names are absent, the one topic of each type is taken."""
    held = {'/r/joints': JOINT_STATE, '/r/imu': IMU, '/r/load': INERTIA, '/x': 'std_msgs/msg/Empty'}
    assert choose_topics(topics_of(tmp_path, held)) == Topics('/r/joints', '/r/imu', '/r/load')


def test_two_candidates_are_an_error_that_lists_the_bag(tmp_path: Path) -> None:
    """Two topics of the type are not guessed between; the error lists topics, types and counts."""
    bag = topics_of(tmp_path, {'/a': JOINT_STATE, '/b': JOINT_STATE, '/i': IMU})
    with pytest.raises(BadBag, match=rf'/a {JOINT_STATE} 1; /b {JOINT_STATE} 1; /i {IMU} 1'):
        choose_topics(bag)


def test_no_imu_only_where_allowed(tmp_path: Path) -> None:
    """A bag without IMU is an error unless the caller can do without."""
    bag = topics_of(tmp_path, {'/joint_states': JOINT_STATE})
    assert choose_topics(bag, imu_required=False).imu is None
    with pytest.raises(BadBag, match='imu/data'):
        choose_topics(bag)


def test_configured_topic_of_another_type_is_not_taken(tmp_path: Path) -> None:
    """A topic of the configured name but another type does not count."""
    bag = topics_of(tmp_path, {'/joint_states': 'std_msgs/msg/Empty', '/imu/data': IMU})
    with pytest.raises(BadBag, match='joint_states'):
        choose_topics(bag)


@pytest.mark.parametrize(
    ('held', 'words'),
    [
        ({'/imu/raw': IMU, '/imu/f': IMU}, '/imu/f and /imu/raw: set topics.imu.name'),
        ({'/joint_states': 'sensor_msgs/msg/Joy'}, 'got none: record a topic of type'),
    ],
)
def test_an_error_about_topics_says_what_to_do(
    tmp_path: Path, held: dict[str, str], words: str
) -> None:
    """Several candidates, and nothing at all, each say which key to set or what to record."""
    usual = {'/joint_states': JOINT_STATE, '/imu/data': IMU}
    kinds = {*held.values()}
    rest = {name: kind for name, kind in usual.items() if kind not in kinds}
    if not kinds & {JOINT_STATE, IMU}:
        rest.pop('/joint_states')
    content = {JOINT_STATE: cdr(joint_state()), IMU: cdr(imu())}
    messages = [(n, k, 5, content.get(k, b'\x00\x01\x00\x00')) for n, k in {**held, **rest}.items()]
    bag = open_bag(write_mcap(tmp_path / 'run.mcap', messages))
    with pytest.raises(BadBag) as error:
        choose_topics(bag)
    assert words in str(error.value)
    assert '\n' not in str(error.value)


def one_message(path: Path, topic: str, kind: str, encoding: str) -> Bag:
    """Return a bag with one message of a type that our tools do not know."""
    with path.open('wb') as file:
        writer = Writer(file)
        writer.start('ros2', 'test')
        channel = writer.register_channel(topic, encoding, writer.register_schema(kind, '', b''))
        writer.add_message(channel, 5, b'{}', 5)
        writer.finish()  # type: ignore[no-untyped-call]
    return open_bag(path)


@pytest.mark.parametrize(
    ('topic', 'kind', 'encoding', 'words'),
    [
        (
            '/dynamic_joint_states', 'control_msgs/msg/DynamicJointState', 'cdr',
            'got control_msgs/msg/DynamicJointState on /dynamic_joint_states, which is not read',
        ),
        ('/joint_states', JOINT_STATE, 'json', 'encoded as json, which is not read: record it'),
    ],
)  # fmt: skip
def test_what_was_recorded_but_cannot_be_read_is_named(
    tmp_path: Path, topic: str, kind: str, encoding: str, words: str
) -> None:
    """A type or encoding that is not read is named, with what to record instead."""
    bag = one_message(tmp_path / 'run.mcap', topic, kind, encoding)
    with pytest.raises(BadBag, match='expected topic') as error:
        choose_topics(bag)
    assert words in str(error.value)


def test_an_imu_that_cannot_be_read_is_not_absent(tmp_path: Path) -> None:
    """Where an IMU was recorded in an encoding that is not read, the bag has no absent IMU."""
    bag = one_message(tmp_path / 'run.mcap', '/imu/data', IMU, 'json')
    with pytest.raises(BadBag, match='encoded as json'):
        choose_topics(bag, None, 'imu/data', imu_required=False)


def test_two_robots_in_a_bag_are_told_apart_by_all_their_topics(tmp_path: Path) -> None:
    """With two of each input the error says that both topics are those of one robot."""
    held = {f'/{r}/{t}': k for r in ('r1', 'r2') for t, k in (('js', JOINT_STATE), ('imu', IMU))}
    with pytest.raises(BadBag, match=r'set topics\.joint_states\.name .*of the same robot'):
        choose_topics(topics_of(tmp_path, held))


def test_an_input_without_a_name_is_not_read(tmp_path: Path) -> None:
    """None in place of a topic's name leaves that input out, whatever the bag holds."""
    bag = topics_of(tmp_path, {'/joint_states': JOINT_STATE, '/imu/data': IMU})
    assert choose_topics(bag, 'joint_states', None) == Topics('/joint_states', None, None)
    assert choose_topics(bag, None, 'imu/data') == Topics(None, '/imu/data', None)
