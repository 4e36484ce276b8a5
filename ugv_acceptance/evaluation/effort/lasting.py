"""Finds spells in which something was so for long enough, in columns that come in parts."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.type_aliases import Floats, Times


@dataclass(frozen=True, slots=True)
class Spell:
    """A spell from `start` to `end` (ns); `peak` is the largest value in it."""

    start: int
    end: int
    peak: float


@dataclass(slots=True)
class Lasting:
    """Gathers the spells of one column that last at least `least` ns."""

    least: int
    _found: list[Spell] = field(default_factory=list)
    _open: Spell | None = None

    @property
    def open(self) -> bool:
        """Whether a spell lasts until the last row: only then rows that are not bad matter."""
        return self._open is not None

    def add(self, time: Times, until: Times, bad: NDArray[np.bool_], value: Floats) -> None:
        """Take rows (n,) that hold from `time` to `until` (ns): whether bad, and how large."""
        if not len(time) or (self._open is None and not bad.any()):
            return
        edges = np.flatnonzero(np.diff(bad.astype(np.int8), prepend=0, append=0))
        for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            spell = Spell(int(time[first]), int(until[after - 1]), float(value[first:after].max()))
            before, self._open = self._open, None
            if before is not None and first == 0 and before.end >= spell.start:
                spell = Spell(before.start, spell.end, max(before.peak, spell.peak))
            else:
                self._close(before)
            if after == len(time):
                self._open = spell
            else:
                self._close(spell)
        if not bad[0] and self._open is not None and self._open.start < int(time[0]):
            self._close(self._open)
            self._open = None

    def _close(self, spell: Spell | None) -> None:
        if spell is not None and spell.end - spell.start >= self.least:
            self._found.append(spell)

    def spells(self) -> list[Spell]:
        """Return the spells found so far."""
        last = self._open
        more = [] if last is None or last.end - last.start < self.least else [last]
        return [*self._found, *more]
