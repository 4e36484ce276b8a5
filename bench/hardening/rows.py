"""The table of trials: what is tried, what must hold, and what runs it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from hardening.outcome import Outcome

from bench.hardening import messages, recordings


@dataclass(frozen=True, slots=True)
class Row:
    """A trial: `run(share)` makes that share of its long form and yields what was measured."""

    number: int
    trial: str
    must_hold: str
    run: Callable[[float], Iterable[Outcome]]


ROWS = (
    Row(
        1,
        'mutated CDR messages of each input type, decoded and evaluated',
        'no uncaught exception, growth under 10 MB',
        messages.mutants,
    ),
    Row(
        2,
        'MCAP cut, flipped, bombs, wrong lengths, loops, conformance files',
        'no crash, 5 s a file, no silent change under a checksum, over 64 MiB refused',
        recordings.damaged,
    ),
    Row(
        3,
        'the same bag again, in parts, turned round, 1, 2 and 4 threads, message by message',
        'the same bytes',
        recordings.same,
    ),
    Row(
        5,
        '24 h at 50 Hz simulated, faults sprinkled',
        'no critical alert missed or false, drift under 5 MB',
        messages.day,
    ),
)
