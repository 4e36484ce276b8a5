"""Strips for charts: nothing that matters is lost when a run is thinned."""

from dataclasses import replace

import hypothesis
import numpy as np
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

from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.strips import MOST, WIDTH, StripRecorder

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
    """Columns are merged: fewer than MOST, as wide as each other, no peak of the run lost."""
    evaluator, recorder = RecordedEvaluator(TOLD), StripRecorder(TOLD, T0)
    evaluator.start(T0)
    worst = np.zeros(2)
    for start in range(0, 12_000, 1000):
        run = run_of(1000.0, joints_hz=20.0, imu_hz=1.0)
        bent = [
            replace(m, position=(1e-4 * start + 1e-3 * (k % 977), 0.1))
            if isinstance(m, Joints)
            else m
            for k, m in enumerate(run)
        ]
        rows = evaluator.batch(batch_of([replace(m, time=m.time + start * S) for m in bent]))
        recorder.add(rows)
        worst = np.fmax(worst, np.nanmax(np.abs(rows.torque), axis=0))
    strips = recorder.strips()
    assert MOST / 2 < len(strips.time) <= MOST
    assert np.diff(strips.time).max() < 2.1 * 2 * WIDTH / 1e9
    np.testing.assert_array_equal(np.nanmax(strips.torque, axis=0), worst.astype(np.float32))
