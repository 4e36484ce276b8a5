"""Proposes acceptance criteria as YAML from a good run: its worst values plus an allowance."""

import json
import math
from typing import Any

from ugv_acceptance.type_aliases import Json

# Allowance beyond the worst value of a good run, as a share of it.
ROOM = 0.1


def proposed_criteria(result: Json, name: str) -> str:
    """Return the YAML of criteria that the run of `result` (a PASS) meets, for a person to edit.

    No limit is looser than that of the configuration.
    """
    lines = [
        '# Proposed from a run: its worst values, the bound of their uncertainty, and a tenth of',
        '# room, within the limits of the configuration. Edit before the next run, then leave it.',
        'version: 1',
        f'name: {json.dumps(name)}',
        'uncertainty: rss',
        'coverage: 0.95',
        'criteria:',
    ]
    for outcome in result['criteria']['results']:
        measured = outcome['measured']
        if 'signal' in measured and measured['worst'] is not None:
            lines += _value(outcome, measured)
    lines += ['  no error:', '    alert: any', '    level: ERROR', '    expect: absent']
    lines += ['  coverage:', '    data: coverage', '    at_least: 0.95']
    lines += ['  whole file:', '    data: salvaged', '    at_most: 0']
    lines += ['  all messages:', '    data: lost_messages', '    at_most: 0']
    lines += ['  protected:', '    data: protected', '    at_least: 1'] * _protected(result)
    for key in ('joint_states', 'imu'):
        lines += _input(key, result['inputs'][key])
    return '\n'.join(lines) + '\n'


def _protected(result: Json) -> bool:
    return bool(result['bag']['protected'] == 'all')


def _value(outcome: Json, measured: Json) -> list[str]:
    bound = measured['uncertainty']['bound'] if measured['uncertainty'] else 0.0
    worst, limit = measured['worst'], measured['limit']
    unit = {'deg': '_deg', 'N m': '_nm', 'm': '_m', 'deg/s': '_degps', 'N': '_n', 'm/s': '_mps'}
    key = measured['must_be'] + unit.get(measured['unit'], '')
    if measured['must_be'] == 'below':
        value = min(limit, _rounded(worst + bound + ROOM * abs(worst), math.ceil))
    else:
        value = max(limit, _rounded(worst - bound - ROOM * abs(worst), math.floor))
    return [
        f'  {json.dumps(outcome["name"])}:',
        f'    requirement: {json.dumps(outcome["requirement"])}',
        f'    value: {measured["signal"]}',
        f'    of: {json.dumps(measured["of"])}',
        f'    {key}: {value:g}  # this run: {worst:.4g}, uncertainty {bound:.2g}',
    ]


def _rounded(value: float, towards: Any) -> float:  # noqa: ANN401 - math.ceil or math.floor
    """Return a value rounded to two significant digits, up or down by `towards`."""
    if value == 0.0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 1)
    return float(towards(value / step) * step)


def _input(key: str, found: Json) -> list[str]:
    lines = []
    if found['rate_hz']:
        rate = _rounded((1.0 - ROOM) * found['rate_hz'], math.floor)
        lines += [
            f'  rate of {key}:',
            '    data: rate',
            f'    of: {key}',
            f'    at_least: {rate:g}',
        ]
    gap = max(0.2, _rounded(2.0 * found['longest_gap_s'], math.ceil))
    lines += [f'  gaps of {key}:', '    data: longest_gap', f'    of: {key}']
    return [*lines, f'    at_most_s: {gap:g}']
