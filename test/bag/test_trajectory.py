"""Serialised trajectories: the same numbers as rosbags, and BadSample of anything that is none."""

import hashlib
import struct
from contextlib import suppress

import numpy as np
import pytest
from bag.trajectories import encoded, trajectory
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance import BadSample
from ugv_acceptance.bag.trajectory import FIELDS, MOST_POINTS, trajectory_from

FLOATS = st.floats(allow_nan=False, width=64)


@given(
    rows=st.integers(1, 5).flatmap(
        lambda m: st.lists(st.lists(FLOATS, min_size=m, max_size=m), min_size=1, max_size=4)
    ),
    more=st.sets(st.sampled_from(FIELDS[1:])),
    little=st.booleans(),
    behind=st.binary(max_size=20),
)
def test_a_trajectory_equals_rosbags(
    *, rows: list[list[float]], more: set[str], little: bool, behind: bytes
) -> None:
    """Of either byte order, whatever fields it has, and whatever stands behind its end."""
    message = trajectory(rows, ('positions', *more))
    found = trajectory_from(encoded(message, little=little) + behind)
    assert (found.stamp, found.names) == (5 * 10**9 + 1, tuple(message.joint_names))
    assert found.times.tolist() == [k * (10**9 + 7) for k in range(len(rows))]
    for field in FIELDS:
        expected = [list(getattr(point, field)) for point in message.points]
        numbers = getattr(found, field)
        assert (numbers is None) is (field not in {'positions', *more})
        assert numbers is None or numbers.tolist() == expected


def test_a_trajectory_is_named_by_its_contents_alone() -> None:
    """Not by header, byte order or gaps; any other number gives another name."""
    rows = [[1.0, 2.0], [3.0, 4.0]]
    name = trajectory_from(encoded(trajectory(rows))).sha256
    later = encoded(trajectory(rows, stamp=6), little=False) + b'accidental'
    assert trajectory_from(later).sha256 == name
    plain = b'joint_\0joint_x\0'
    for time, row in ((0, rows[0]), (10**9 + 7, rows[1])):
        plain += struct.pack('<I2d3Iq', 2, *row, 0, 0, 0, time)
    assert hashlib.sha256(plain).hexdigest() == name
    others = [trajectory([[1.0, 2.0], [3.0, 4.5]])]
    others += [trajectory(rows, ('positions', field)) for field in FIELDS[1:]]
    names = {trajectory_from(encoded(other)).sha256 for other in others}
    assert len(names - {name}) == len(others)


@given(st.integers(0, 400), st.binary(max_size=12), st.integers(0, 400))
def test_any_bytes_give_a_trajectory_or_a_reason(at: int, noise: bytes, length: int) -> None:
    """A message that is cut or overwritten anywhere is decoded or refused, nothing else."""
    data = encoded(trajectory([[1.0, 2.0, 3.0]] * 4, FIELDS))
    for hostile in (data[:length], data[:at] + noise + data[at + len(noise) :], noise):
        with suppress(BadSample):
            trajectory_from(hostile)


@pytest.mark.parametrize(
    ('rows', 'fields', 'reason'),
    [
        ([], (), r'points: expected 1 to 10,000 points, got 0'),
        ([[1.0]], (), r'points\[0\].positions: expected 1 positions \(one a joint\), got 0'),
        ([[1.0]] * (MOST_POINTS + 1), ('positions',), r'expected 1 to 10,000 points, got 10,001'),
    ],
)
def test_what_is_no_whole_trajectory_is_refused(
    rows: list[list[float]], fields: tuple[str, ...], reason: str
) -> None:
    """Without points or positions, or with too many: the field and the numbers."""
    with pytest.raises(BadSample, match=reason):
        trajectory_from(encoded(trajectory(rows, fields)))


def test_a_point_may_lack_what_others_have() -> None:
    """Its rates are not a number then; which point lacks them is part of the trajectory's name."""
    names = set()
    for lacking in (0, 1):
        message = trajectory([[1.0], [1.0]], ('positions', 'velocities'))
        message.points[lacking].velocities = np.empty(0)
        found = trajectory_from(encoded(message))
        assert found.velocities is not None
        assert np.isnan(found.velocities[:, 0]).tolist() == [lacking == 0, lacking == 1]
        names.add(found.sha256)
    assert len(names) == 2
