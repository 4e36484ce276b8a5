"""What viewers are shown, encoded by hand, held to rclpy's and to rosbags' decoders."""

import struct

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message
from rosbags.typesys import Stores, get_typestore
from visualization_msgs.msg import Marker, MarkerArray

from ugv_acceptance.bag.encode_views import (
    Diagnosis,
    Shape,
    diagnoses_cdr,
    diagnosis_cdr,
    markers_cdr,
)

STORE = get_typestore(Stores.ROS2_JAZZY)
# No NUL: it ends a string on the wire.
words = st.text(st.characters(exclude_categories=['Cs'], exclude_characters='\0'), max_size=9)
single = st.floats(0.0, 1.0, width=32)
numbers = st.floats(-1e6, 1e6)
points = st.tuples(numbers, numbers, numbers)
colours = st.tuples(single, single, single, single)
stamps = st.integers(0, (1 << 31) * 10**9 - 1)
diagnoses = st.builds(
    Diagnosis, st.integers(0, 3), words, words, words, st.dictionaries(words, words, max_size=4)
)
shapes = st.builds(
    Shape,
    words,
    st.sampled_from([4, 5, 7, 9]),
    colours,
    numbers,
    st.lists(points, max_size=5).map(tuple),
    st.lists(colours, max_size=3).map(tuple),
    words,
    points,
)


def same_status(found: DiagnosticStatus, wanted: Diagnosis) -> None:
    """Hold a decoded status to what was encoded."""
    assert found.level == bytes([wanted.level])
    assert (found.name, found.message) == (wanted.name, wanted.message)
    assert found.hardware_id == wanted.hardware_id
    assert [(pair.key, pair.value) for pair in found.values] == list(wanted.values.items())


@given(diagnoses)
def test_a_diagnosis_is_a_diagnostic_status(wanted: Diagnosis) -> None:
    """ROS's own decoder gives back every field."""
    same_status(deserialize_message(diagnosis_cdr(wanted), DiagnosticStatus), wanted)


@given(stamps, st.lists(diagnoses, max_size=4))
def test_diagnoses_are_a_diagnostic_array(stamp: int, wanted: list[Diagnosis]) -> None:
    """With the stamp, in their order."""
    found = deserialize_message(diagnoses_cdr(stamp, wanted), DiagnosticArray)
    assert found.header.stamp.sec * 10**9 + found.header.stamp.nanosec == stamp
    assert len(found.status) == len(wanted)
    for status, diagnosis in zip(found.status, wanted, strict=True):
        same_status(status, diagnosis)


@settings(max_examples=60)
@given(stamps, words, st.floats(0.0, 100.0), st.lists(shapes, max_size=4))
def test_shapes_are_a_marker_array(
    stamp: int, frame: str, lifetime: float, wanted: list[Shape]
) -> None:
    """ROS's own decoder gives back all that a viewer draws, and what we do not use is empty."""
    found = deserialize_message(markers_cdr(stamp, frame, lifetime, wanted), MarkerArray).markers
    assert len(found) == len(wanted)
    for marker, shape in zip(found, wanted, strict=True):
        assert (marker.ns, marker.type, marker.text) == (shape.name, shape.kind, shape.text)
        assert marker.header.frame_id == frame
        assert marker.action == (Marker.ADD if shape.points or shape.text else Marker.DELETE)
        assert tuple((p.x, p.y, p.z) for p in marker.points) == shape.points
        assert tuple((c.r, c.g, c.b, c.a) for c in marker.colors) == shape.colours
        assert marker.lifetime.sec + marker.lifetime.nanosec / 1e9 == pytest.approx(
            lifetime, abs=1e-9
        )
        at, turn = marker.pose.position, marker.pose.orientation
        assert (at.x, at.y, at.z) == shape.position
        assert (turn.x, turn.y, turn.z, turn.w) == (0.0, 0.0, 0.0, 1.0)
        assert marker.scale.x == marker.scale.y == marker.scale.z == shape.size
        assert not marker.mesh_file.filename
        assert not marker.texture.data


@given(stamps, st.lists(shapes, min_size=1, max_size=3))
def test_rosbags_reads_the_last_byte_too(stamp: int, wanted: list[Shape]) -> None:
    """A decoder that is not ROS's re-encodes what it read to the very same bytes."""
    data = markers_cdr(stamp, 'base_link', 0.5, wanted)
    kind = 'visualization_msgs/msg/MarkerArray'
    again = bytes(STORE.serialize_cdr(STORE.deserialize_cdr(data, kind), kind))
    assert again == data


def test_a_colour_is_four_single_floats() -> None:
    """As in std_msgs/ColorRGBA: what is not a single is rounded, not refused."""
    shape = Shape('x', 9, (0.1, 0.2, 0.3, 1.0), 1.0, text='t')
    (marker,) = deserialize_message(markers_cdr(0, '', 0.0, [shape]), MarkerArray).markers
    assert marker.color.r == struct.unpack('<f', struct.pack('<f', 0.1))[0]
