"""Strips for charts: nothing that matters is lost when a run is thinned."""

from dataclasses import replace

import hypothesis
import numpy as np
from evaluation.hand_made import made
from evaluation.streams import (
    MS,
    T0,
    Joints,
    Message,
    S,
    batch_of,
    recorded,
    run_of,
    settings,
    split,
    streams,
)
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.downsampling import MOST_STRIPS, WIDTH, StripRecorder, Strips
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.recorded import RecordedEvaluator

TOLD = settings()


@hypothesis.settings(max_examples=60)
@given(streams(), st.lists(st.integers(0, 120), max_size=4))
def test_the_worst_of_a_run_is_in_its_strips(messages: list[Message], cuts: list[int]) -> None:
    """Largest torques and smallest tilt left are those of all rows, in columns 50 ms apart."""
    rows, _ = recorded(TOLD, split(messages, cuts), messages[-1].time + MS)
    recorder = StripRecorder(TOLD, T0)
    for part in rows:
        recorder.add(part)
    strips = recorder.strips()
    torque = np.abs(np.concatenate([part.torque for part in rows]))
    angle = np.concatenate([part.angle.min(axis=1) for part in rows])
    known = np.concatenate([part.known for part in rows])
    assert np.isfinite(strips.torque[:, 0]).any() == known.any()
    if known.any():
        worst = np.nanmax(strips.torque, axis=0)
        np.testing.assert_array_equal(worst, torque[known].max(axis=0).astype(np.float32))
    if np.isfinite(angle).any():
        least = np.nanmin(angle[np.isfinite(angle)]).astype(np.float32)
        assert np.nanmin(strips.angle) == least
    slots = {int(t) // WIDTH for part in rows for t in part.time}
    assert len(strips.time) <= len(slots) + len(rows)
    assert (np.diff(strips.time) >= 0.0).all()


def test_a_long_run_has_wider_columns_and_the_same_worst() -> None:
    """Columns are merged: at most MOST_STRIPS, as wide as each other, no peak of the run lost."""
    evaluator, recorder = RecordedEvaluator(TOLD), StripRecorder(TOLD, T0)
    evaluator.start(T0)
    worst = np.zeros(2)
    for start in range(0, 12_000, 1000):
        run = run_of(1000.0, joints_hz=20.0, imu_hz=1.0)
        bent = [
            replace(m, position=(-1e-4 * start - 1e-3 * (k % 977), 0.1))
            if isinstance(m, Joints)
            else m
            for k, m in enumerate(run)
        ]
        rows = evaluator.batch(batch_of([replace(m, time=m.time + start * S) for m in bent]))
        recorder.add(rows)
        worst = np.fmax(worst, np.nanmax(np.abs(rows.torque), axis=0))
    strips = recorder.strips()
    assert MOST_STRIPS / 2 < len(strips.time) <= MOST_STRIPS
    assert np.diff(strips.time).max() < 2.1 * 2 * WIDTH / 1e9
    np.testing.assert_array_equal(np.nanmax(strips.torque, axis=0), worst.astype(np.float32))


def recorded_strips(parts: list[MarginRows], start: int = 0) -> Strips:
    """Return the strips of rows that come in parts."""
    recorder = StripRecorder(TOLD, start)
    for part in parts:
        recorder.add(part)
    return recorder.strips()


def test_a_column_is_the_worst_of_fifty_milliseconds() -> None:
    """Largest torque of each joint, least tilt of all sides, last posture, time of its first row.

    A tilt counts only where a row of the column is known.
    """
    rows = made(
        [60 * MS, 80 * MS, 99 * MS, 100 * MS, 260 * MS],
        torque=[(1.0, 2.0), (-5.0, 0.5), (2.0, np.nan), (3.0, -4.0), (7.0, 8.0)],
        angle=[(0.5, 0.6, 0.7, 0.8), (0.9, 0.9, 0.3, 0.9), (0.4,) * 4, (0.2,) * 4, (0.1,) * 4],
        q=[(0.1, 0.2), (0.3, 0.4), (0.5, 0.6), (0.7, 0.8), (0.9, 1.0)],
        known=[False, True, False, True, False],
    )
    found = recorded_strips([rows, made([])], start=-S)
    np.testing.assert_allclose(found.time, [1.06, 1.1, 1.26], rtol=1e-12)
    np.testing.assert_allclose(found.torque, [(5.0, 2.0), (3.0, 4.0), (7.0, 8.0)])
    np.testing.assert_allclose(found.angle, [0.3, 0.2, np.nan], rtol=1e-6)
    np.testing.assert_allclose(found.q, [(0.5, 0.6), (0.7, 0.8), (0.9, 1.0)], rtol=1e-6)


def test_a_recording_from_zero_on_has_its_first_column() -> None:
    """A recording that begins at time 0 keeps its first column; an empty one has none."""
    assert recorded_strips([made([0, 10 * MS])]).time.tolist() == [0.0]
    assert recorded_strips([]).torque.shape == (0, 2)


def test_columns_double_in_width_from_150001_on() -> None:
    """From 150,001 columns on, two become one: larger torque, smaller tilt, later posture."""
    time = 50 * MS * np.arange(150_001)
    torque = np.column_stack((np.arange(150_001) % 7, -np.ones(150_001)))
    angle = np.repeat(np.arange(150_001.0)[:, None] % 5, 4, axis=1)
    q = np.column_stack((np.arange(150_001), np.zeros(150_001)))
    full = recorded_strips([made(time[:-1])])
    assert len(full.time) == 150_000
    np.testing.assert_allclose(np.diff(full.time), 0.05)
    wide = recorded_strips([made(time, torque=torque, angle=angle, q=q)])
    assert len(wide.time) == 75_001
    np.testing.assert_allclose(np.diff(wide.time), 0.1)
    assert wide.torque[:4].tolist() == [[1.0, 1.0], [3.0, 1.0], [5.0, 1.0], [6.0, 1.0]]
    assert wide.angle[:4].tolist() == [0.0, 2.0, 0.0, 1.0]
    assert wide.q[:3, 0].tolist() == [1.0, 3.0, 5.0]
    later = time[-1] + 100 * MS * np.arange(1, 75_001)
    wider = recorded_strips([made(time), made(later)])
    assert len(wider.time) == 75_001
    np.testing.assert_allclose(np.diff(wider.time), 0.2)
