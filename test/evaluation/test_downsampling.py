"""Samples of a run at even times: which rows are kept, what of them, and how many at most."""

from typing import Any

import numpy as np
from evaluation.hand_made import made

from ugv_acceptance.evaluation.downsampling import Sampler
from ugv_acceptance.evaluation.margin_table import MarginRows


def times(parts: list[MarginRows], spacing: int = 10, *, standing: bool = False) -> list[int]:
    """Return the times of the samples kept from rows that come in parts."""
    sampler = Sampler(spacing)
    for part in parts:
        sampler.add(part, standing=standing)
    found, _ = sampler.samples(2)
    return [int(t) for t in found]


def test_the_first_row_of_a_slot_is_taken() -> None:
    """Of each time slot the first row is kept; a slot whose first row is unknown gives none."""
    assert times([made([0, 4, 9, 10]), made([]), made([13, 25]), made([29, 31])]) == [0, 10, 25, 31]
    assert times([made([12, 15])]) == [12]
    assert times([made([0, 4, 10], known=[False, True, True])]) == [10]
    assert times([made([0], known=[False])]) == []


def test_a_robot_that_has_tipped_is_left_out_if_only_standing_counts() -> None:
    """From a tilt left of nothing on, to any side; an unknown tilt is no reason."""
    angle = [(0.1,) * 4, (0.1, 0.0, 0.1, 0.1), (0.1, 0.1, 0.1, -0.1), (np.nan,) * 4]
    rows = made([0, 10, 20, 30], angle=angle)
    assert times([rows], standing=True) == [0, 30]
    assert times([rows]) == [0, 10, 20, 30]


def test_a_sample_holds_what_was_measured_and_computed() -> None:
    """Effort, torque, rate, position of each joint, and gravity; of a robot that tipped too."""
    sampler = Sampler(10)
    columns: dict[str, Any] = {
        name: np.arange(4.0).reshape(2, 2) + 10.0 * k
        for k, name in enumerate(('effort', 'torque', 'qd', 'q'))
    }
    gravity = [(1.0, 2.0, -9.0), (3.0, 4.0, -8.0)]
    sampler.add(made([5, 15], gravity=gravity, angle=np.full((2, 4), -1.0), **columns))
    time, found = sampler.samples(2)
    assert time.tolist() == [5, 15]
    for name, table in zip(columns, found[:4], strict=True):
        assert table.tolist() == columns[name].tolist()
    assert found[4].tolist() == [list(g) for g in gravity]
    _, none = Sampler(10).samples(2)
    assert [table.shape for table in none] == [(0, 2)] * 4 + [(0, 3)]


def test_of_more_than_forty_thousand_every_second_remains() -> None:
    """Beyond 40,000 samples every second one is kept and the spacing doubles."""
    time = 10 * np.arange(40_001)
    assert times([made(time[:-1])]) == time[:-1].tolist()
    assert times([made(time)]) == time[::2].tolist()
    after = [made(time), made([400_005, 400_010, 400_019, 400_020, 400_030, 400_040])]
    assert times(after)[-3:] == [400_000, 400_020, 400_040]
    sampler = Sampler(10)
    sampler.add(made(time, torque=np.column_stack((time, time))))
    left, (_, torque, *_) = sampler.samples(2)
    assert torque[:, 0].tolist() == left.tolist()
