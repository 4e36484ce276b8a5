"""Batches of a recording put together, so that many messages are evaluated at a time."""

from collections.abc import Iterable, Iterator, Sequence

from ugv_acceptance.evaluation.samples import Batch

# Messages evaluated at a time, so that the arrays of a kernel stay in the processor's cache.
STRETCH = 16384


def stretches(batches: Iterable[Batch]) -> Iterator[Batch]:
    """Yield batches merged to at least STRETCH messages each, to save calls."""
    held: list[Batch] = []
    count = 0
    for batch in batches:
        held.append(batch)
        count += sum(len(s.log_time) for s in batch.joints)
        count += sum(len(s.log_time) for s in batch.imu)
        if count >= STRETCH:
            yield _together(held)
            held, count = [], 0
    if held:
        yield _together(held)


def _together(batches: Sequence[Batch]) -> Batch:
    return Batch(
        [s for b in batches for s in b.joints],
        [s for b in batches for s in b.imu],
        [s for b in batches for s in b.payload],
    )
