"""The lines of a CSV file, byte by byte those that are written one value after another."""

import csv
from collections.abc import Mapping
from itertools import pairwise
from math import inf, isfinite, nan, nextafter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.bag.recording import open_recording
from ugv_acceptance.config import load
from ugv_acceptance.model.stability import STATES
from ugv_acceptance.offline.csv_text import csv_lines, header_line
from ugv_acceptance.offline.judge import Options, judge
from ugv_acceptance.offline.margins import NOT_IN_CSV, margin_rows, named_columns
from ugv_acceptance.offline.output import CsvSink

# Where Python and JSON begin to write an exponent, and what is next to it.
EDGES = [
    x
    for edge in (1e-5, 1e-4, 1e15, 1e16, 1e17, 5e-324, 2.2250738585072014e-308, 1.8e308)
    for x in (edge, nextafter(edge, 0.0), nextafter(edge, inf))
]
ODD = [0.0, -0.0, nan, -nan, inf, -inf, 0.1, 1 / 3, 1e22, 123456789012345678.0, *EDGES]


def one_by_one(columns: Mapping[str, Any]) -> bytes:
    """Return the lines written value by value: `repr` of a float, nothing where none is known."""
    lines = []
    for row in zip(*(column.tolist() for column in columns.values()), strict=True):
        cells = [
            f'{value:.9f}'
            if name == 'time_s'
            else (repr(value) if isfinite(value) else '')
            if isinstance(value, float)
            else str(value)
            for name, value in zip(columns, row, strict=True)
        ]
        lines.append(','.join(cells) + '\n')
    return ''.join(lines).encode()


def columns_of(values: Any) -> dict[str, Any]:
    """Return a table with a float column, signs swapped in a second, between other columns."""
    numbers = np.array(values, np.float64)
    count = np.arange(len(numbers))
    return {
        'time_s': count * 0.0025 - 1.0,
        'stamp_ns': 1_760_000_000_000_000_000 + count,
        'state': np.array(STATES)[count % len(STATES)],
        'left_angle_deg': numbers,
        'right_angle_deg': -numbers,
    }


@given(st.lists(st.floats() | st.sampled_from(ODD), min_size=1, max_size=60))
def test_any_number_is_written_as_repr_writes_it(values: list[float]) -> None:
    """Also without a digit, with an exponent, and beside numbers that need none."""
    columns = columns_of(values)
    assert csv_lines(columns) == one_by_one(columns)


def test_two_hundred_thousand_floats_of_all_sizes_are_those_of_repr() -> None:
    """Of random bits, of the sizes that margins have, and rounded as sensors round."""
    rng = np.random.default_rng(5)
    bits = rng.integers(0, 2**64, 80_000, dtype=np.uint64).view(np.float64)
    sizes = 10.0 ** rng.uniform(-6.0, 18.0, 80_000)
    sensed = np.round(rng.normal(0.0, 30.0, 40_000) / 0.01) * 0.01
    columns = columns_of(np.concatenate((bits, sizes, sensed, ODD)))
    assert csv_lines(columns) == one_by_one(columns)


@pytest.mark.parametrize('count', [0, 1, 2047, 2048, 2049, 4097])
def test_no_line_is_lost_where_many_are_written_together(count: int) -> None:
    """A table of any length has a line a row, in order."""
    columns = columns_of(np.linspace(-1.0, 1.0, count))
    lines = csv_lines(columns)
    assert lines == one_by_one(columns)
    assert lines.count(b'\n') == count


def test_a_name_with_a_comma_or_a_quote_is_one_column() -> None:
    """Any CSV reader finds the names of joints as they are."""
    names = ['time_s', 'arm, upper_position_rad', 'the "wrist"_position_rad', 'a\nb_position_rad']
    (found,) = csv.reader(header_line(names).decode().splitlines(keepends=True))
    assert found == names
    assert header_line(['time_s', 'zmp_m']) == b'time_s,zmp_m\n'


@pytest.mark.parametrize('name', ['packbot_fail', 'packbot_gap'])
def test_the_file_of_a_recording_is_that_of_its_margins(
    repository: Path, tmp_path: Path, name: str
) -> None:
    """Line by line, with unknown margins as empty fields."""
    recording, settings = open_recording(repository / 'bags' / name), load().settings
    with CsvSink(tmp_path / 'm.csv', settings, recording.start_ns) as sink:
        judge(recording, settings, options=Options(tuple(sink.sinks), detail=True))
    topics = recording.chosen(imu_required=False)
    parts = [
        {
            name: column
            for name, column in named_columns(rows, settings, recording.start_ns).items()
            if name not in NOT_IN_CSV
        }
        for rows in margin_rows(recording.bag, topics, settings, detail=True)
    ]
    wanted = header_line(list(parts[0])) + b''.join(map(one_by_one, parts))
    assert (tmp_path / 'm.csv').read_bytes() == wanted
    with (tmp_path / 'm.csv').open() as file:
        rows = list(csv.DictReader(file))
    assert {row['zmp_m'] == '' for row in rows} == {True, False}
    assert all(float(a['time_s']) <= float(b['time_s']) for a, b in pairwise(rows))
