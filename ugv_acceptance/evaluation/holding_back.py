"""Holds the margins of a recording back until it is known whether they can be believed.

A contradiction between sensors takes a while to confirm, and the margins of that while rest on the
wrong sensor. They are unknown in a verdict: not a failure of the robot, and not a success.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.model.stability import UNKNOWN
from ugv_acceptance.type_aliases import Floats

# The longest time (ns) that a contradiction reaches back.
LONGEST_REACH = 12_000_000_000
Span = tuple[int, int]


def doubtful_spans(log: Sequence[Alert]) -> Iterator[Span]:
    """Yield the spans (ns) before alerts in which what they contradict was still believed."""
    for alert in log:
        if alert.rule.reach:
            # What is known in the nanosecond of the alert came just before it.
            yield alert.start - alert.rule.reach, alert.start + 1


def drawn_in_doubt(alert: Alert, spans: Sequence[Span]) -> bool:
    """Return whether an alert rests only on margins of spans (ns) that are contradicted."""
    delay = alert.rule.on_delay
    return any(start <= alert.start - delay and alert.start - delay < end for start, end in spans)


def without(rows: MarginRows, spans: Sequence[Span]) -> MarginRows:
    """Return margins in which those of the spans (ns) are unknown; the same if there are none."""
    doubtful = np.zeros(len(rows.time), np.bool_)
    for start, end in spans:
        doubtful |= (rows.time >= start) & (rows.time < end)
    doubtful &= rows.known
    if not doubtful.any():
        return rows
    return replace(
        rows,
        known=rows.known & ~doubtful,
        state=np.where(doubtful, np.int8(UNKNOWN), rows.state),
        torque=_blank(rows.torque, doubtful),
        angle=_blank(rows.angle, doubtful),
        moment=_blank(rows.moment, doubtful),
        energy=_blank(rows.energy, doubtful),
        zmp=_blank(rows.zmp, doubtful),
        ground=replace(rows.ground, cautious=_blank(rows.ground.cautious, doubtful)),
        clearance=_blank(rows.clearance, doubtful),
        touches=rows.touches & ~doubtful if len(rows.touches) else rows.touches,
    )


def _blank(table: Floats, some: NDArray[np.bool_]) -> Floats:
    """Return a table (n, ...) in which some of the rows are NaN; an empty one as it is."""
    if not len(table):
        return table
    blank = np.where(some.reshape(-1, *[1] * (table.ndim - 1)), np.nan, table)
    return blank.astype(np.float64, copy=False)


@dataclass(slots=True)
class HeldMargins:
    """Delays parts of a recording's margins by LONGEST_REACH, and blanks what `log` contradicts.

    `log` may grow while a part is held.
    """

    log: list[Alert]
    _held: list[MarginRows] = field(default_factory=list)
    _distrusted: list[Span] = field(default_factory=list)

    @property
    def doubtful(self) -> list[Span]:
        """All spans (ns) whose margins are not believed."""
        return [*doubtful_spans(self.log), *self._distrusted]

    def distrust(self, span: Span | None) -> None:
        """Take a span (ns) whose margins are not to be believed, if there is one."""
        if span is not None and span not in self._distrusted:
            self._distrusted.append(span)

    def add(self, rows: MarginRows) -> Iterator[MarginRows]:
        """Take the next part; yield the parts that nothing can contradict any more."""
        if not len(rows.time):
            return
        self._held.append(rows)
        settled = int(rows.time[-1]) - LONGEST_REACH
        while self._held and self._held[0].time[-1] < settled:
            yield self._believed(self._held.pop(0))

    def finish(self) -> Iterator[MarginRows]:
        """Yield the parts that are still held, at the end of the recording."""
        while self._held:
            yield self._believed(self._held.pop(0))

    def _believed(self, rows: MarginRows) -> MarginRows:
        return without(rows, self.doubtful)
