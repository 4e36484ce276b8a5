"""Sums up spans of time: their number, total and longest, and the first of them as evidence."""

from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.type_aliases import Times

Span = tuple[int, int]

# Number of time spans kept as evidence.
MOST = 20


@dataclass(slots=True)
class Spans:
    """Sums up time spans (ns) given in order, and joins those that touch; memory is bounded.

    `first` are the first MOST spans, `longest` the longest one.
    """

    total: int = 0
    count: int = 0
    longest: Span = (0, 0)
    first: list[Span] = field(default_factory=list)
    _open: Span | None = None

    def add(self, start: Times, end: Times) -> None:
        """Take spans (n,) in order of time that do not overlap."""
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
        """Finish: no span follows, so that the last one is complete."""
        if self._open is not None:
            self._note(self._open)
        self._open = None

    def _note(self, span: Span) -> None:
        self.count += 1
        if len(self.first) < MOST:
            self.first.append(span)
        if span[1] - span[0] > self.longest[1] - self.longest[0]:
            self.longest = span


@dataclass(slots=True)
class UnseenStretches:
    """Collects the stretches without margins that last longer than `least` (ns), from `start` on.

    `spans` holds those, `longest` (ns) is the longest of all.
    """

    start: int
    least: int
    spans: Spans = field(default_factory=Spans)
    longest: int = 0
    _seen_until: int = field(init=False)
    _last: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        self._seen_until = self.start

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        if not len(rows.time):
            return
        self._settle(int(rows.time[0]))
        some = rows.known[:-1]
        self._see(rows.time[:-1][some], rows.until[:-1][some])
        if rows.known[-1]:
            self._last = int(rows.time[-1]), int(rows.until[-1])

    def finish(self, now: int) -> None:
        """Finish at the end of the recording, `now` (ns)."""
        self._settle(now)
        self._note(np.array([self._seen_until]), np.array([now]))
        self.spans.close()

    def _settle(self, now: int) -> None:
        """Count the last row, now that the next message or the end (`now`, ns) is known."""
        if self._last is not None:
            start, until = self._last
            self._see(np.array([start]), np.array([min(until, now)]))
        self._last = None

    def _see(self, start: Times, end: Times) -> None:
        """Take spans (n,) with margins, in order; one without length shows nothing."""
        some = end > start
        if not some.any():
            return
        start, end = start[some], np.maximum.accumulate(end[some])
        before = np.append(self._seen_until, np.maximum(end[:-1], self._seen_until))
        self._note(before, start)
        self._seen_until = max(self._seen_until, int(end[-1]))

    def _note(self, start: Times, end: Times) -> None:
        length = end - start
        self.longest = max(self.longest, int(length.max()))
        long = length > self.least
        self.spans.add(start[long], end[long])
