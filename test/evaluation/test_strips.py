"""Strips for charts: nothing that matters is lost when a run is thinned."""

import hypothesis
import numpy as np
from evaluation.streams import MS, T0, Message, recorded, settings, split, streams
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.strips import WIDTH, StripRecorder

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
