"""Stretches of a recording without margins: found exactly, however the recording is cut."""

from itertools import pairwise

import numpy as np
from evaluation.hand_made import BEGIN, S, made, seconds
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.spans import UnseenStretches

MS = 1_000_000
# A row: time since the one before, how long it holds at most (ms), and whether it has margins.
_rows = st.lists(
    st.tuples(st.integers(0, 400), st.integers(0, 400), st.booleans()), min_size=1, max_size=30
)


def by_brute_force(rows: list[tuple[int, int, bool]], end: int, least: int) -> list[list[int]]:
    """Return the unseen stretches (ms) by looking at every millisecond."""
    seen = np.zeros(end, np.bool_)
    for time, until, known in rows:
        if known:
            seen[time:until] = True
    edges = np.flatnonzero(np.diff(np.concatenate(([1], seen, [1]))))
    pairs = edges.reshape(-1, 2).tolist()
    return [pair for pair in pairs if pair[1] - pair[0] > least]


@given(_rows, st.lists(st.integers(0, 30), max_size=4), st.integers(0, 500))
def test_every_stretch_is_found(
    steps: list[tuple[int, int, bool]], cuts: list[int], least: int
) -> None:
    """The same as looking at every millisecond; touching rows leave no gap."""
    times = np.cumsum([step for step, _, _ in steps]).tolist()
    end = times[-1] + 700
    held = [min(t + h, following) for (t, (_, h, _)), following in
            zip(zip(times, steps, strict=True), [*times[1:], end], strict=True)]  # fmt: skip
    rows = [(t, u, known) for t, u, (_, _, known) in zip(times, held, steps, strict=True)]
    found = UnseenStretches(BEGIN, least * MS)
    places = sorted({0, len(rows), *(min(c, len(rows)) for c in cuts)})
    for a, b in pairwise(places):
        part = rows[a:b]
        found.add(
            made(
                [BEGIN + t * MS for t, _, _ in part],
                until=[BEGIN + u * MS for _, u, _ in part],
                known=[known for _, _, known in part],
            )
        )
    found.finish(BEGIN + end * MS)
    expected = by_brute_force(rows, end, least)
    assert found.spans.count == len(expected)
    told = [[(x - BEGIN) // MS for x in span] for span in found.spans.first]
    assert told == expected[: len(told)]
    every = by_brute_force(rows, end, -1)
    assert found.longest == max((b - a for a, b in every), default=0) * MS


def test_a_recording_without_margins_is_one_stretch() -> None:
    """From its start to its end."""
    found = UnseenStretches(BEGIN, S // 2)
    found.add(made(seconds(1, 2, 3), known=[False] * 3))
    found.finish(BEGIN + 4 * S)
    assert found.spans.first == [(BEGIN, BEGIN + 4 * S)]
