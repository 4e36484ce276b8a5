"""Amounts on a command line that no robot's file has: sizes of files, lengths of time."""

import re

from ugv_acceptance import BadConfig

_NUMBER = re.compile(r'\s*(\d+(?:\.\d*)?|\.\d+)\s*([A-Za-z]*)\s*')
_BYTES = {'kb': 1e3, 'mb': 1e6, 'gb': 1e9, 'tb': 1e12}
_BYTES |= {'kib': 2.0**10, 'mib': 2.0**20, 'gib': 2.0**30, 'tib': 2.0**40}
_SECONDS = {'s': 1.0, 'min': 60.0, 'h': 3600.0}
SIZE, TIME = 'a size such as 500MB or 1GB', 'a time such as 90s, 10min or 2h'


def bytes_of(text: str, option: str) -> int:
    """Return a size in bytes. Raises BadConfig where the text is none."""
    found = _amount(text, _BYTES)
    if found is None:
        raise BadConfig(f'{option}: expected {SIZE}, got {text!r}')
    return int(found)


def seconds_of(text: str, option: str) -> float:
    """Return a time in s. Raises BadConfig where the text is none."""
    found = _amount(text, _SECONDS)
    if found is None:
        raise BadConfig(f'{option}: expected {TIME}, got {text!r}')
    return found


def size_or_time(text: str, option: str) -> tuple[int | None, float | None]:
    """Return a size in bytes or a time in s, the other None. Raises BadConfig for anything else."""
    size, time = _amount(text, _BYTES), _amount(text, _SECONDS)
    if size is None and time is None:
        raise BadConfig(f'{option}: expected {SIZE}, or {TIME}, got {text!r}')
    return (None if size is None else int(size)), time


def size_words(size: float) -> str:
    """Return a size as people read it: 1.2 GB."""
    for unit, number in (('GB', 1e9), ('MB', 1e6)):
        if size >= number:
            return f'{size / number:.1f} {unit}'
    return f'{size / 1e3:.0f} kB'


def time_words(seconds: float) -> str:
    """Return a length of time as people read it: 45 s, 12 min, 3.5 h, 12 days."""
    for unit, length, most in (('s', 1.0, 120.0), ('min', 60.0, 7200.0), ('h', 3600.0, 172_800.0)):
        if seconds < most:
            return f'{seconds / length:.{unit == "h":d}f} {unit}'
    return f'{seconds / 86_400.0:.0f} days'


def _amount(text: str, units: dict[str, float]) -> float | None:
    found = _NUMBER.fullmatch(text)
    unit = units.get(found[2].lower()) if found else None
    return float(found[1]) * unit if found and unit and float(found[1]) > 0.0 else None
