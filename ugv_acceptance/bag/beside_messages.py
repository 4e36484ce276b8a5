"""Finds what an MCAP file holds beside messages: attachments and metadata records."""

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

from mcap import records
from mcap.opcode import Opcode

from ugv_acceptance.bag.mcap_index import MAGIC, pread

_HEAD = struct.Struct('<BQ')
_TIMES, _LENGTH = struct.Struct('<QQ'), struct.Struct('<I')
# Bytes of a record in which its names have to end.
_NAMES = 1 << 16
# The metadata record in which rosbag2 describes the file itself: counts, paths, duration.
OF_THE_FILE = 'rosbag2'

Index = records.AttachmentIndex | records.MetadataIndex


@dataclass(frozen=True, slots=True)
class Extra:
    """An attachment or a metadata record: its bytes from `start` on, head included.

    `index` is what an index of the file says of it, with the place in this file.
    """

    start: int
    index: Index


def extras(file: BinaryIO) -> Iterator[Extra]:
    """Yield attachments and metadata records as they stand in a file, up to where it breaks off.

    Without that in which rosbag2 describes the file: of another file it is not true. Those whose
    lengths contradict each other are left out.
    """
    at, size = len(MAGIC), os.fstat(file.fileno()).st_size
    while at + _HEAD.size <= size:
        opcode, length = _HEAD.unpack(pread(file, at, _HEAD.size))
        end = at + _HEAD.size + length
        if end > size or opcode in {Opcode.DATA_END, Opcode.FOOTER}:
            return
        if opcode in {Opcode.ATTACHMENT, Opcode.METADATA}:
            content = pread(file, at + _HEAD.size, min(length, _NAMES))
            index = _index(opcode, content, at, length)
            if index is not None and index.name != OF_THE_FILE:
                yield Extra(at, index)
        at = end


def _index(opcode: int, content: bytes, at: int, length: int) -> Index | None:
    """Return the index of a record that begins with `content`, None if its lengths are wrong."""
    whole = _HEAD.size + length
    try:
        if opcode == Opcode.METADATA:
            return records.MetadataIndex(at, whole, _text(content, 0)[0])
        log_time, create_time = _TIMES.unpack_from(content)
        name, place = _text(content, _TIMES.size)
        media_type, place = _text(content, place)
        (size,) = struct.unpack_from('<Q', content, place)
    except (struct.error, UnicodeDecodeError):
        return None
    if place + 8 + size + 4 != length:  # the size of the data before them, a checksum behind
        return None
    return records.AttachmentIndex(at, whole, log_time, create_time, size, name, media_type)


def _text(content: bytes, at: int) -> tuple[str, int]:
    (length,) = _LENGTH.unpack_from(content, at)
    start = at + _LENGTH.size
    return struct.unpack_from(f'{length}s', content, start)[0].decode(), start + length
