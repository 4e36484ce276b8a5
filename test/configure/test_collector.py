"""Whatever messages hold, what is collected of them is plain, and what follows is an answer."""

import math
from typing import Any

import pytest
from configure.seen_robots import joint, urdf_of
from hypothesis import given, settings
from hypothesis import strategies as st

from ugv_acceptance.bag.cdr import IMU, JOINT_STATE
from ugv_acceptance.bag.description import TYPE as STRING
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr, string_message
from ugv_acceptance.bag.transforms import TYPE as TF
from ugv_acceptance.bag.transforms import transforms_cdr
from ugv_acceptance.config.urdf import read_urdf
from ugv_acceptance.configure.collector import Collector, is_wanted
from ugv_acceptance.configure.joints import derive_joints, rest_posture
from ugv_acceptance.configure.mounting import derive_mounting

NAMES = ('lift', 'bend')
URDF = read_urdf(urdf_of(joint('lift'), joint('bend', parent='lift_link')).encode(), 'made.urdf')
TOPICS = {
    '/robot_description': STRING,
    '/tf_static': TF,
    '/joint_states': JOINT_STATE.type,
    '/imu/data': IMU.type,
}
wild = st.floats() | st.sampled_from([0.0, 1.0, 9.81, -9.81, math.inf, math.nan])


def floats(count: int) -> st.SearchStrategy[list[float]]:
    """So many numbers of any kind."""
    return st.lists(wild, min_size=count, max_size=count)


frames = st.sampled_from(['imu_link', '/imu_link', '', 'a/b/c', 'base_link', 'tip'])
contents = st.one_of(
    st.tuples(st.sampled_from(list(TOPICS)), st.binary(max_size=90)),
    st.tuples(
        st.just('/joint_states'),
        st.builds(joint_state_cdr, st.just(0), frames, st.just(NAMES), floats(2)),
    ),
    st.tuples(
        st.just('/imu/data'),
        st.builds(imu_cdr, st.just(0), frames, floats(4), floats(3), floats(3)),
    ),
    st.tuples(
        st.just('/tf_static'),
        st.lists(st.tuples(frames, frames, floats(3), floats(4)), max_size=3).map(transforms_cdr),
    ),
    st.tuples(st.just('/robot_description'), st.text('<robot/> ').map(string_message)),
)
times = st.integers(0, 3_000_000_000)


@settings(max_examples=60)
@given(st.lists(st.tuples(times, contents), max_size=12))
def test_no_content_of_messages_is_an_error(messages: list[tuple[int, Any]]) -> None:
    """Joints, posture and mounting are derived all the same; positions are finite."""
    collector = Collector('live')
    for name, kind in TOPICS.items():
        collector.topic(name, kind)
    for now, (topic, data) in messages:
        collector.take(now, topic, data)
    evidence = collector.evidence(URDF)
    derive_joints(URDF, evidence)
    posture = rest_posture(URDF, evidence)
    assert all(value.value is not None and math.isfinite(value.value) for value in posture.values())
    mounting = derive_mounting(URDF, evidence, {k: v.value or 0.0 for k, v in posture.items()})
    assert mounting.rotation.value is not None
    assert all(math.isfinite(x) for row in mounting.rotation.value for x in row)


@pytest.mark.parametrize(
    ('topic', 'kind', 'wanted'),
    [
        ('/r1/robot_description', STRING, True),
        ('/robot_description_semantic', STRING, False),
        ('/chatter', STRING, False),
        ('/tf_static', TF, True),
        ('/tf', TF, False),
        ('/arm/states', JOINT_STATE.type, True),
        ('/acceptance_monitor/torque_margin', JOINT_STATE.type, False),
        ('/camera/imu', IMU.type, True),
        ('/odom', 'nav_msgs/msg/Odometry', False),
    ],
)
def test_topics_are_chosen_by_type_and_name(topic: str, kind: str, *, wanted: bool) -> None:
    """In any namespace."""
    assert is_wanted(topic, kind) is wanted
