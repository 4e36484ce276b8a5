"""Stretches of time in which something holds: total, longest, the first few."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Times = NDArray[np.int64]
Span = tuple[int, int]

# Spans kept as evidence.
MOST = 20


@dataclass(slots=True)
class Spans:
    """Takes spans (ns) in order and joins those that touch; memory does not grow."""

    total: int = 0
    count: int = 0
    longest: Span = (0, 0)
    first: list[Span] = field(default_factory=list)
    _open: Span | None = None

    def add(self, start: Times, end: Times) -> None:
        """Take spans (n,) in order of time; none overlaps."""
        if not len(start):
            return
        self.total += int((end - start).sum())
        breaks = np.flatnonzero(start[1:] > end[:-1]) + 1
        begins = start[np.concatenate(([0], breaks))].tolist()
        ends = end[np.concatenate((breaks - 1, [len(end) - 1]))].tolist()
        if self._open is not None and begins[0] <= self._open[1]:
            begins[0] = self._open[0]
        else:
            self.close()
        for span in zip(begins[:-1], ends[:-1], strict=True):
            self._note(span)
        self._open = (begins[-1], ends[-1])

    def close(self) -> None:
        """Say that no span follows."""
        if self._open is not None:
            self._note(self._open)
        self._open = None

    def _note(self, span: Span) -> None:
        self.count += 1
        if len(self.first) < MOST:
            self.first.append(span)
        if span[1] - span[0] > self.longest[1] - self.longest[0]:
            self.longest = span
