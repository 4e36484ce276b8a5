"""Stretches of time added up in pieces, against sets of milliseconds."""

from itertools import pairwise

import hypothesis
import numpy as np
from hypothesis import strategies as st

from ugv_acceptance.evaluation.spans import MOST, Spans

# Lengths of gaps and spans in turn; a gap of 0 lets two spans touch.
steps = st.lists(st.tuples(st.integers(0, 3), st.integers(1, 4)), max_size=60)


def spans_of(pairs: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return (start, end) of spans after gaps."""
    now, found = 0, []
    for gap, length in pairs:
        found.append((now + gap, now + gap + length))
        now += gap + length
    return found


def joined(spans: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return spans with those that touch made one: runs of neighbouring units of time."""
    held = sorted(unit for a, b in spans for unit in range(a, b))
    starts = [x for x in held if x - 1 not in held]
    ends = [x + 1 for x in held if x + 1 not in held]
    return list(zip(starts, ends, strict=True))


@hypothesis.given(steps, st.lists(st.integers(0, 60), max_size=5))
def test_spans_given_in_pieces_are_those_of_a_set(
    pairs: list[tuple[int, int]], cuts: list[int]
) -> None:
    """Total, count, longest and the first few do not depend on how the spans are handed over."""
    spans = spans_of(pairs)
    found = Spans()
    places = [0, *sorted(min(c, len(spans)) for c in cuts), len(spans)]
    for first, last in pairwise(places):
        part = np.array(spans[first:last], np.int64).reshape(-1, 2)
        found.add(part[:, 0], part[:, 1])
    found.close()
    whole = joined(spans)
    assert found.total == sum(b - a for a, b in whole)
    assert found.count == len(whole)
    assert found.first == whole[:MOST]
    longest = max((b - a for a, b in whole), default=0)
    assert found.longest[1] - found.longest[0] == longest


def given(*parts: list[tuple[int, int]]) -> Spans:
    """Return what spans handed over in parts come to."""
    found = Spans()
    for part in parts:
        table = np.array(part, np.int64).reshape(-1, 2)
        found.add(table[:, 0], table[:, 1])
    found.close()
    return found


def test_spans_that_touch_are_one_within_a_part_and_across_parts() -> None:
    """Spans of time that touch count as one, within a part and across parts."""
    found = given([(0, 1), (2, 5), (5, 6)], [(6, 7), (9, 10)], [], [(11, 13)])
    assert found.first == [(0, 1), (2, 7), (9, 10), (11, 13)]
    assert (found.total, found.count, found.longest) == (9, 4, (2, 7))


def test_the_longest_is_the_first_of_equals() -> None:
    """Of equally long spans the first is kept as the longest."""
    assert given([(0, 2), (3, 5)], [(7, 9)]).longest == (0, 2)


def test_twenty_spans_are_kept_as_evidence_and_all_are_counted() -> None:
    """The first ones; memory does not grow."""
    spans = [(3 * k, 3 * k + 1) for k in range(25)]
    found = given(spans[:7], spans[7:])
    assert found.first == spans[:20]
    assert (found.count, found.total) == (25, 25)
