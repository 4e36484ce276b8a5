"""What robots say of themselves: their URDF as a String, fixed frames as a TFMessage."""

from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from bag.bag_cases import STORE
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance import BadSample
from ugv_acceptance.bag.description import STRING, TF, Transform, string_of, transforms_of
from ugv_acceptance.bag.encode import string_message, tf_message

# No NUL: it ends a string on the wire.
words = st.text(st.characters(exclude_categories=['Cs'], exclude_characters='\0'), max_size=9)
numbers = st.floats(-1e6, 1e6)
places = st.tuples(numbers, numbers, numbers)
rotations = st.tuples(numbers, numbers, numbers, numbers)
transforms = st.lists(st.tuples(words, words, places, rotations), max_size=4)


def seen(message: Any) -> list[tuple[Any, ...]]:
    """The transforms of a message of rosbags, as they are given to `tf_message`."""
    return [
        (
            part.header.frame_id,
            part.child_frame_id,
            tuple(getattr(part.transform.translation, axis) for axis in 'xyz'),
            tuple(getattr(part.transform.rotation, axis) for axis in 'xyzw'),
        )
        for part in message.transforms
    ]


@given(words)
def test_a_text_is_a_string(text: str) -> None:
    """Rosbags gives the text back, and so do we."""
    assert STORE.deserialize_cdr(string_message(text), STRING).data == text  # type: ignore[attr-defined]
    assert string_of(string_message(text)) == text


@given(st.integers(0, (1 << 31) * 10**9 - 1), transforms)
def test_transforms_are_a_tf_message(stamp: int, wanted: list[Any]) -> None:
    """Rosbags gives every transform back, in their order."""
    data = tf_message(wanted, stamp)
    found: Any = STORE.deserialize_cdr(data, TF)
    assert seen(found) == wanted
    assert all(
        part.header.stamp.sec * 10**9 + part.header.stamp.nanosec == stamp
        for part in found.transforms
    )


@given(st.booleans(), st.integers(0, (1 << 31) * 10**9 - 1), transforms)
def test_transforms_are_read_as_rosbags_reads_them(
    little: bool,  # noqa: FBT001 (hypothesis)
    stamp: int,
    wanted: list[Any],
) -> None:
    """In either byte order."""
    message: Any = STORE.deserialize_cdr(tf_message(wanted, stamp), TF)
    data = bytes(STORE.serialize_cdr(message, TF, little_endian=little))
    assert transforms_of(data) == tuple(Transform(stamp, *one) for one in wanted)


@given(st.binary(max_size=200), st.booleans())
def test_any_bytes_are_read_or_refused(data: bytes, headed: bool) -> None:  # noqa: FBT001
    """With BadSample, and nothing else."""
    data = b'\x00\x01\x00\x00' + data if headed else data
    for decode in (string_of, transforms_of):
        with suppress(BadSample):
            decode(data)


@pytest.mark.parametrize('decode', [string_of, transforms_of])
def test_a_message_that_breaks_off_is_refused(decode: Any) -> None:
    """Its error says where."""
    whole = {
        string_of: string_message('a text'),
        transforms_of: tf_message([('a', 'b', np.zeros(3), (0.0, 0.0, 0.0, 1.0))]),
    }[decode]
    for stop in range(4, len(whole)):
        with pytest.raises(BadSample, match=r'data|transforms'):
            decode(whole[:stop])
