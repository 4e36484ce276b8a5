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
