"""LZ4 frames into a buffer that is already there, block by block.

`lz4.frame` takes new memory for every chunk, which costs five times as much as LZ4 itself; its
`lz4.block` does not. A frame is a header, blocks of at most 4 MiB and an end mark. A frame's own
checksums are not looked at: the chunk around it has one of its own.
"""

import lz4.block  # type: ignore[import-untyped]
import lz4.frame  # type: ignore[import-untyped]

from ugv_acceptance import BadBag

_MAGIC = b'\x04\x22\x4d\x18'
_HISTORY = 1 << 16  # bytes that a linked block may refer back to


def unlz4(source: memoryview, target: memoryview) -> int:
    """Unpack a frame into `target`; the bytes it unpacks to, or BadBag where it is broken."""
    try:
        return _blocks(source, target)
    except (lz4.block.LZ4BlockError, RuntimeError, ValueError, IndexError) as error:
        raise BadBag(f'its lz4 data is broken ({error})') from error


def _blocks(source: memoryview, target: memoryview) -> int:
    flags = source[4]
    if source[:4] != _MAGIC or flags >> 6 != 1 or flags & 1:
        return _whole(source, target)  # of another version or with a dictionary
    linked, sums = not flags & 0x20, bool(flags & 0x10)
    most = 1 << 2 * (source[5] >> 4 & 7) + 8
    pos = 7 + (8 if flags & 8 else 0)
    got = 0
    while True:
        if pos + 4 > len(source):
            raise ValueError('no end mark')
        size = int.from_bytes(source[pos : pos + 4], 'little')
        pos += 4
        if not size:
            return got
        plain, size = bool(size >> 31), size & 0x7FFFFFFF
        if pos + size > len(source):
            raise ValueError('cut off')
        block = source[pos : pos + size]
        if not plain:
            block = _block(block, most, target[max(got - _HISTORY, 0) : got] if linked else None)
        if got + len(block) > len(target):
            return got + len(block)
        target[got : got + len(block)] = block
        got += len(block)
        pos += size + (4 if sums else 0)


def _block(block: memoryview, most: int, history: memoryview | None) -> memoryview:
    if history:
        return memoryview(lz4.block.decompress(block, uncompressed_size=most, dict=history))
    return memoryview(lz4.block.decompress(block, uncompressed_size=most))


def _whole(source: memoryview, target: memoryview) -> int:
    data = lz4.frame.LZ4FrameDecompressor().decompress(source, max_length=len(target) + 1)
    target[: len(data)] = data[: len(target)]
    return len(data)
