"""What can be demanded of the data of a run: the numbers of a result that tell their quality."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

INPUTS = ('joint_states', 'imu')

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number of the whole run (`of` None), or one of each input; a `share` is from 0 to 1."""

    of: Callable[[Json], float | None]
    words: str
    unit: str = ''
    each_input: bool = False
    share: bool = False


def _shares(protected: str) -> float:
    return {'all': 1.0, 'part': 0.5}.get(protected, 0.0)


DATA = {
    'coverage': Quantity(
        lambda r: r['coverage']['fraction'], 'share of the recording evaluated', share=True
    ),
    'duration': Quantity(lambda r: r['coverage']['duration_s'], 'length of the recording', 's'),
    'protected': Quantity(
        lambda r: _shares(r['bag']['protected']), 'share of chunks with a checksum', share=True
    ),
    'salvaged': Quantity(lambda r: float(r['bag']['salvaged'] is not None), 'files that break off'),
    'lost_messages': Quantity(
        lambda r: float(r['bag']['lost_messages']), 'messages that metadata.yaml tells of missing'
    ),
    'findings': Quantity(lambda r: float(len(r['bag']['findings'])), 'oddities of the file'),
    'late_messages': Quantity(
        lambda r: float(r['inputs']['late_messages']), 'messages out of order'
    ),
    'messages': Quantity(lambda i: float(i['messages']), 'messages', each_input=True),
    'rate': Quantity(lambda i: i['rate_hz'], 'rate', 'Hz', each_input=True),
    'gaps': Quantity(lambda i: float(i['gaps']), 'gaps', each_input=True),
    'longest_gap': Quantity(lambda i: i['longest_gap_s'], 'longest gap', 's', each_input=True),
    'malformed': Quantity(lambda i: float(i['malformed']), 'malformed messages', each_input=True),
    'faults': Quantity(lambda i: float(len(i['faults'])), 'kinds of fault', each_input=True),
}


def measured_of(quantity: str, of: str | None, result: Json) -> dict[str, float | None]:
    """Return the numbers of a quantity: of the run, of one input, or (None) of both inputs."""
    found = DATA[quantity]
    if not found.each_input:
        return {'run': found.of(result)}
    return {name: found.of(result['inputs'][name]) for name in INPUTS if of in (None, name)}


def unit_of(quantity: str) -> str:
    """Return the unit of a quantity."""
    return DATA[quantity].unit
