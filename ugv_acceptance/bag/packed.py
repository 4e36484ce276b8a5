"""Unpacks messages that rosbag2 compressed one by one (compression mode: message)."""

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np
import zstandard
from numpy.typing import NDArray

from ugv_acceptance import BadSample
from ugv_acceptance.bag.gather import HEAD, LEAD, SLACK, Bytes, Offsets

_MAX_MESSAGE = 1 << 24
# What is unpacked together: messages of a usual size, whatever they claim in all.
_MAX_EACH, _MAX_TOGETHER = 1 << 16, 64 << 20
_FRAME = np.frombuffer(zstandard.FRAME_HEADER, '<u4')[0]
_LEAST = 10  # bytes of a message, so that the head of a frame can be read beyond its end
_local = threading.local()


def _decompressor() -> zstandard.ZstdDecompressor:
    """Return this thread's own: making a new one takes ten times as long as unpacking a message."""
    if not hasattr(_local, 'zstd'):
        _local.zstd = zstandard.ZstdDecompressor()
    found: zstandard.ZstdDecompressor = _local.zstd
    return found


def plain(data: bytes) -> bytes:
    """Decompress a message if rosbag2 compressed it; BadSample if broken."""
    if data[:4] != zstandard.FRAME_HEADER:
        return data
    try:
        if zstandard.frame_content_size(data) > _MAX_MESSAGE:
            raise BadSample(f'message claims more than {_MAX_MESSAGE} bytes')
        return _decompressor().decompress(data, max_output_size=_MAX_MESSAGE)
    except zstandard.ZstdError as error:
        raise BadSample(f'message: its zstd data is broken ({error})') from error


@dataclass(frozen=True, slots=True)
class Unpacked:
    """Messages after one another in `buffer` from LEAD on, each after HEAD free bytes.

    `sizes` (k,) are in bytes; the mask `which` (n,) says which of the packed messages these are.
    """

    buffer: Bytes
    sizes: Offsets
    which: NDArray[np.bool_]


def unpack(buffer: Bytes, starts: Offsets, lengths: Offsets) -> Unpacked | None:
    """Decompress together those of n messages in a buffer that `plain` decompresses to the same.

    None if it is none of them, or if one of them is broken: `plain` tells which.
    """
    if 'multi_decompress_to_buffer' not in zstandard.backend_features:
        return None
    sizes = _sizes(buffer, starts, lengths)
    mask = (sizes > 0) & (sizes <= _MAX_EACH)
    mask &= np.cumsum(np.where(mask, sizes, 0)) <= _MAX_TOGETHER
    if not mask.any():
        return None
    segments = np.stack((starts[mask], lengths[mask]), axis=1).astype(np.uint64)
    source = zstandard.BufferWithSegments(buffer.data, segments.tobytes())
    try:
        parts: Any = _decompressor().multi_decompress_to_buffer(source)
    except zstandard.ZstdError:
        return None
    joined = bytearray(HEAD).join([bytes(LEAD), *parts, bytes(SLACK)])
    return Unpacked(np.frombuffer(joined, np.uint8), sizes[mask], mask)


def _sizes(buffer: Bytes, starts: Offsets, lengths: Offsets) -> Offsets:
    """Return the sizes (n,) that compressed messages claim to unpack to; -1: none, or not claimed.

    The head of a zstd frame: magic, a byte that says which fields follow, window, dictionary, size.
    """
    sizes = np.full(len(starts), -1)
    places = np.flatnonzero(lengths >= _LEAST)
    starts = starts[places]
    words = np.ndarray((buffer.size - 7,), '<u8', buffer, strides=(1,))
    heads = words[starts]
    fields = heads >> np.uint64(32)
    single = (fields >> np.uint64(5)) & np.uint64(1)
    dictionary = np.array([0, 1, 2, 4])[fields & np.uint64(3)]
    code = (fields >> np.uint64(6)) & np.uint64(3)
    kept = np.array([0, 0xFFFF, 0xFFFFFFFF, 2**64 - 1], np.uint64)[code]
    kept |= np.where(code == 0, single * np.uint64(0xFF), 0).astype(np.uint64)
    at = starts + 6 - single.astype(np.int64) + dictionary
    claimed = (words[at] & kept) + np.where(code == 1, 256, 0).astype(np.uint64)
    known = ((heads & np.uint64(0xFFFFFFFF)) == _FRAME) & (kept > 0)
    sizes[places[known]] = claimed[known].astype(np.int64)
    return sizes
