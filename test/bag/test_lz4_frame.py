"""LZ4 frames of every form unpack to what was packed, and broken ones to BadBag."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import lz4.frame  # type: ignore[import-untyped]
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance import BadBag
from ugv_acceptance.bag.lz4_frame import Lz4, unpack_whole

Unpack = Callable[[memoryview, memoryview], int]
WAYS: tuple[Unpack, ...] = (Lz4().unpack, unpack_whole)
CONTENT = b''.join(i.to_bytes(4, 'little') * (i % 7) for i in range(60_000))
forms = st.fixed_dictionaries(
    {
        'block_size': st.sampled_from([4, 5, 6, 7]),
        'block_linked': st.booleans(),
        'store_size': st.booleans(),
        'content_checksum': st.booleans(),
        'block_checksum': st.booleans(),
        'compression_level': st.sampled_from([0, 9]),
    }
)


@given(forms, st.one_of(st.binary(max_size=300), st.just(CONTENT), st.randoms()))
def test_every_form_of_frame(form: dict[str, Any], content: Any) -> None:
    """Linked and independent blocks, of every size, with and without checksums."""
    data = content if isinstance(content, bytes) else content.randbytes(200_000)
    packed = memoryview(lz4.frame.compress(data, **form))
    for unpack in WAYS:
        target = bytearray(len(data))
        assert unpack(packed, memoryview(target)) == len(data)
        assert target == data


@given(st.integers(0, 10**6), st.integers(0, 255))
def test_damage_is_badbag_or_other_bytes(place: int, value: int) -> None:
    """A byte changed anywhere never raises anything but BadBag, nor writes beyond the target."""
    packed = bytearray(lz4.frame.compress(CONTENT[:100_000]))
    packed[place % len(packed)] = value
    for unpack in WAYS:
        # What lies behind the target must stay as it is.
        target = bytearray(b'\xa5' * 110_000)
        with suppress(BadBag):
            assert unpack(memoryview(packed), memoryview(target)[:100_000]) >= 0
        assert target[100_000:] == b'\xa5' * 10_000


def test_a_broken_frame_spoils_no_later_one() -> None:
    """One reading thread unpacks on after a chunk that is broken."""
    whole = lz4.frame.compress(CONTENT)
    unpack, target = Lz4().unpack, bytearray(len(CONTENT))
    with pytest.raises(BadBag, match='lz4'):
        unpack(memoryview(whole[:1000]), memoryview(target))
    assert unpack(memoryview(whole), memoryview(target)) == len(CONTENT)
    assert target == CONTENT


@pytest.mark.parametrize('unpack', WAYS)
@pytest.mark.parametrize('cut', [0, 3, 6, 7, 10, 1000])
def test_cut_off_frame(cut: int, unpack: Unpack) -> None:
    """A frame without its end is BadBag."""
    packed = lz4.frame.compress(CONTENT)[:cut]
    with pytest.raises(BadBag, match='lz4'):
        unpack(memoryview(packed), memoryview(bytearray(len(CONTENT))))


@pytest.mark.parametrize('unpack', WAYS)
def test_more_than_promised_is_told(unpack: Unpack) -> None:
    """A frame that unpacks to more than there is room for says so by its size."""
    packed = memoryview(lz4.frame.compress(CONTENT))
    assert unpack(packed, memoryview(bytearray(1000))) > 1000
