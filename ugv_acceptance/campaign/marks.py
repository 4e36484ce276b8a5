"""Tells by a look at a file, without reading it, whether it is as it was.

The look of a file on a disk is its size, the times of its last change and its inode; that of an
object in a store its size, time and tag (ETag). What changed so recently that a second change might
leave no trace has no mark at all, as in git's rule for "racy" files: it is read.
"""

import os
from collections.abc import Mapping
from datetime import datetime, timezone
from typing import Any

# A change less than this (ns) before the look is too recent: file systems and stores keep times in
# steps of up to two seconds.
RECENT_NS = 2_000_000_000
_SECOND_NS = 1_000_000_000
# What the file systems of fsspec call it. Of a store with tags the time is kept in whole seconds
# and the tag without quotes: some list the one finer, or the other barer, than for one object.
_TAGS = ('ETag', 'etag', 'md5Hash')
_CHANGED = ('LastModified', 'last_modified', 'mtime')
_IDENTITY = ('ino', 'created')


def local_mark(file: str, now_ns: int) -> str:
    """Return the mark of a file as seen at `now_ns` (since 1970), '' where there is none."""
    try:
        # Opened, because a network disk asks its server only then; a pipe must not make it wait.
        number = os.open(file, os.O_RDONLY | getattr(os, 'O_NONBLOCK', 0))
        try:
            found = os.fstat(number)
        finally:
            os.close(number)
    except OSError:
        return ''
    times = (found.st_mtime_ns, found.st_ctime_ns)
    return _mark(found.st_size, times, str(found.st_ino), now_ns)


def listed_mark(info: Mapping[str, Any], now_ns: int) -> str:
    """Return the mark of a file as a store lists it (fsspec), '' where it has none.

    A store that tells no size or no time of change gives no mark.
    """
    size = info.get('size')
    changed = next((_ns(info[name]) for name in _CHANGED if name in info), None)
    if not isinstance(size, int) or changed is None:
        return ''
    tag = next((info[name] for name in _TAGS if info.get(name)), None)
    if tag is not None:
        return _mark(size, (changed // _SECOND_NS * _SECOND_NS,), str(tag).strip('"'), now_ns)
    identity = ' '.join(str(info[name]) for name in _IDENTITY if name in info)
    return _mark(size, (changed,), identity, now_ns)


def _mark(size: int, times: tuple[int, ...], identity: str, now_ns: int) -> str:
    if max(times) > now_ns - RECENT_NS:
        return ''
    return ' '.join([str(size), *map(str, times), identity])


def _ns(moment: object) -> int | None:
    """Return a moment (datetime, or seconds since 1970) in ns since 1970, None if it is neither."""
    if isinstance(moment, datetime):
        aware = moment if moment.tzinfo else moment.replace(tzinfo=timezone.utc)
        moment = aware.timestamp()
    if isinstance(moment, (int, float)):
        return round(moment * 1e9)
    return None
