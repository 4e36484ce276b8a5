"""The text of /robot_description, written and read without ROS."""

from contextlib import suppress

import pytest
from bag.bag_cases import STORE
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance import BadSample
from ugv_acceptance.bag.description import TYPE, string_of
from ugv_acceptance.bag.encode import string_message

# No NUL: it ends a string on the wire.
words = st.text(st.characters(exclude_categories=['Cs'], exclude_characters='\0'), max_size=9)


@given(words)
def test_a_text_is_a_string(text: str) -> None:
    """It is what rosbags reads, and what we read of rosbags, in either byte order and of ROS 1."""
    message = STORE.deserialize_cdr(string_message(text), TYPE)
    assert message.data == text  # type: ignore[attr-defined]
    for little in (True, False):
        assert string_of(bytes(STORE.serialize_cdr(message, TYPE, little_endian=little))) == text
    assert string_of(bytes(STORE.cdr_to_ros1(string_message(text), TYPE)), 'ros1') == text


@given(st.binary(max_size=60), st.booleans())
def test_any_bytes_are_a_text_or_refused(data: bytes, headed: bool) -> None:  # noqa: FBT001
    """With BadSample, and nothing else."""
    with suppress(BadSample):
        string_of(b'\x00\x01\x00\x00' + data if headed else data)


def test_a_text_that_breaks_off_is_refused() -> None:
    """Wherever it does."""
    whole = string_message('a text')
    for stop in range(len(whole)):
        with pytest.raises(BadSample, match=r'data|encapsulation'):
            string_of(whole[:stop])
