"""Decompresses LZ4 frames into an existing buffer, by calling liblz4 directly.

`lz4.frame` itself allocates new memory for every chunk, which takes five times as long as LZ4 does.
A frame's own checksums are verified if it has any.
"""

import ctypes
import weakref
from ctypes import byref, c_size_t, c_void_p

import lz4.frame  # type: ignore[import-untyped]
import numpy as np

from ugv_acceptance import BadBag

_VERSION = 100  # of liblz4's interface for frames


def _liblz4() -> ctypes.CDLL | None:
    """Load the liblz4 of the lz4 package, in wheels and in Debian; None if it is not found."""
    try:
        library = ctypes.CDLL(lz4.frame._frame.__file__)  # noqa: SLF001 - its file is all we need
        library.LZ4F_decompress.argtypes = [c_void_p] * 6
        library.LZ4F_decompress.restype = c_size_t
        library.LZ4F_getErrorName.argtypes = [c_size_t]
        library.LZ4F_getErrorName.restype = ctypes.c_char_p
        library.LZ4F_createDecompressionContext.argtypes = [c_void_p, ctypes.c_uint]
        library.LZ4F_freeDecompressionContext.argtypes = [c_void_p]
        library.LZ4F_resetDecompressionContext.argtypes = [c_void_p]
    except (OSError, AttributeError):
        return None
    return library


class Lz4:
    """Decompresses LZ4 frames one after another; each thread needs its own."""

    def __init__(self) -> None:
        self._lib = _liblz4()
        self._context = c_void_p()
        if self._lib is not None:
            self._lib.LZ4F_createDecompressionContext(byref(self._context), _VERSION)
            weakref.finalize(self, self._lib.LZ4F_freeDecompressionContext, self._context)

    def unpack(self, source: memoryview, target: memoryview) -> int:
        """Decompress a frame into `target`; return its size, more than the target's if too large.

        Raises BadBag if the frame is broken.
        """
        if self._lib is None or not source or not target:
            return unpack_whole(source, target)
        packed, out = (np.frombuffer(view, np.uint8) for view in (source, target))
        used = got = 0
        self._lib.LZ4F_resetDecompressionContext(self._context)
        while True:
            here, there = c_size_t(len(packed) - used), c_size_t(len(out) - got)
            more = self._lib.LZ4F_decompress(
                self._context,
                out.ctypes.data + got,
                byref(there),
                packed.ctypes.data + used,
                byref(here),
                None,
            )
            if self._lib.LZ4F_isError(c_size_t(more)):
                raise _broken(self._lib.LZ4F_getErrorName(more).decode())
            used, got = used + here.value, got + there.value
            if not more:
                return got
            if got == len(out):
                return got + 1
            if not here.value and not there.value:
                raise _broken('truncated')


def unpack_whole(source: memoryview, target: memoryview) -> int:
    """Decompress a frame as `Lz4.unpack` does, but with the lz4 package and new memory."""
    unpacker = lz4.frame.LZ4FrameDecompressor()
    try:
        data = unpacker.decompress(source, max_length=len(target) + 1)
    except (RuntimeError, ValueError, EOFError) as error:
        raise _broken(str(error)) from error
    if len(data) <= len(target) and not unpacker.eof:
        raise _broken('truncated')
    target[: len(data)] = data[: len(target)]
    return len(data)


def _broken(why: str) -> BadBag:
    return BadBag(f'its lz4 data is broken ({why})')
