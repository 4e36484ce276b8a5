"""Why joint states cannot be used, in words: now, or at a row of the batch that was merged last."""

import math
from collections.abc import Iterable

from ugv_acceptance.evaluation.inputs.joint_rows import NEVER
from ugv_acceptance.evaluation.inputs.joint_words import (
    foreign_words,
    missing_words,
    unusable_words,
)
from ugv_acceptance.evaluation.inputs.joints import JointMerger
from ugv_acceptance.evaluation.inputs.timeouts import FOREVER


def why_unusable(merger: JointMerger, row: int | None = None) -> str:
    """Return why positions cannot be used: now, or at a row of the last batch."""
    joints = range(len(merger.q))
    if row is None:
        told, q, seen = merger.turns.told, merger.q, merger.seen
    else:
        batch = merger.told
        told = [batch.told_at(j, row) for j in joints]
        q, seen = batch.q[row].tolist(), [int(times[row]) for times in batch.seen]
    unknown = [j for j in joints if math.isnan(q[j]) and seen[j] != NEVER]
    return unusable_words(merger.settings, told, unknown)


def what_is_missing(merger: JointMerger, now: int, limit: int, row: int | None = None) -> str:
    """Return which joints were told longer before `now` than `limit` (ns), as `why_unusable`.

    Those that were never told are all named, also where they are taken as held.
    """
    seen = merger.seen if row is None else [int(times[row]) for times in merger.told.seen]
    ages = [
        math.inf if at in {NEVER, FOREVER} else None if now - at <= limit else (now - at) / 1e9
        for at in seen
    ]
    return missing_words(merger.settings, ages, _names(merger, now))


def why_foreign(merger: JointMerger, until: int) -> str:
    """Return why no message until then (ns) was of this robot; '' if none came, or one was."""
    came = [layout for layout in merger.layouts.values() if NEVER != layout.first <= until]
    if not came or any(layout.pairs for layout in came):
        return ''
    return foreign_words(merger.settings, _names(merger, until))


def _names(merger: JointMerger, until: int) -> Iterable[str]:
    """Return all names that messages told until then (ns)."""
    layouts = merger.layouts.items()
    return {x for names, layout in layouts if NEVER != layout.first <= until for x in names}
