"""Splits the runs into batches for the workers, in processes here or on a cluster."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from ugv_acceptance.campaign.sources import Source
from ugv_acceptance.campaign.work import Done

DIED = 'the process that judged it died (out of memory, or a crash in a library)'
# Batches sent ahead to each worker: few, so that a dying worker costs few runs a second try.
AHEAD = 2
# A batch is so many runs or bytes at most: short runs cost less than the way to a worker and back.
_BATCH, _BATCH_BYTES = 16, 4 << 20

Work = Callable[[Source], Done]
Runs = list[Source]


def batches(sources: Sequence[Source], workers: int) -> Iterator[Runs]:
    """Yield the sources in batches, small enough to keep all workers busy until the end."""
    most = max(1, min(_BATCH, len(sources) // (8 * workers)))
    batch: Runs = []
    size = 0
    for source in sources:
        batch.append(source)
        size += _BATCH_BYTES if source.remote else _bytes(source)
        if len(batch) >= most or size >= _BATCH_BYTES:
            yield batch
            batch, size = [], 0
    if batch:
        yield batch


def _bytes(source: Source) -> int:
    return sum(Path(file).stat().st_size for file in source.files if Path(file).is_file())


def each(work: Work, batch: Runs) -> list[Done]:
    """Return the outcome of every run of a batch; a worker calls this."""
    return [work(source) for source in batch]
