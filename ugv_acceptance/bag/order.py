"""Sorts columns of overlapping chunks into batches that follow each other in log time."""

from collections.abc import Iterable

import numpy as np

from ugv_acceptance.bag.columns import Columns, batch, select
from ugv_acceptance.evaluation.samples import Batch


class Sequencer:
    """Holds messages back until no earlier one can come.

    Chunks overlap a little in time, since several topics are written as they arrive. Only the
    overlap is held, so memory does not grow with the recording.
    """

    def __init__(self) -> None:
        self._held: list[Columns] = []
        self._from: int | None = None
        self.late = 0

    def push(self, columns: Iterable[Columns], until: int | None) -> Batch | None:
        """Add columns; return a batch of all messages logged before `until` (ns), None if none.

        `until` promises that no earlier message follows; None, that none follows at all. Messages
        that break an earlier promise are dropped and counted in `late`.
        """
        ready, held = [], []
        for part in [*self._held, *self._on_time(columns)]:
            before, after = _split(part, until)
            ready += before
            held += after
        self._held = held
        self._from = until
        return batch(ready) if ready else None

    def _on_time(self, columns: Iterable[Columns]) -> list[Columns]:
        if self._from is None:
            return list(columns)
        kept = []
        for part in columns:
            late, rest = _split(part, self._from)
            self.late += sum(len(c.log_time) for c in late)
            kept += rest
        return kept


def _split(columns: Columns, until: int | None) -> tuple[list[Columns], list[Columns]]:
    """Split columns into messages logged before `until` (ns) and the others, order kept."""
    if until is None or not columns.log_time.size or columns.log_time.max() < until:
        return [columns], []
    before = columns.log_time < until
    number = int(np.count_nonzero(before))
    if not number:
        return [], [columns]
    if before[:number].all():
        return [select(columns, slice(number))], [select(columns, slice(number, None))]
    return [select(columns, before)], [select(columns, ~before)]
