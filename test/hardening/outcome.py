"""What a trial came to: the figure that is printed, and whether what must hold held."""

import os
from typing import NamedTuple


class Outcome(NamedTuple):
    """`held` is None where the trial could not be made; `measured` says the figure or why not."""

    measured: str
    held: bool | None


def memory(process: int | str = 'self') -> float:
    """Return the memory of a process now (MB, resident)."""
    with open(f'/proc/{process}/statm', encoding='ascii') as file:  # noqa: PTH123 (a file of the kernel)
        return int(file.read().split()[1]) * os.sysconf('SC_PAGE_SIZE') / 1e6
