"""Playing a recording: where the playhead is."""

from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.console.recording import Playhead


def test_it_moves_with_time_and_speed() -> None:
    """Two seconds at half speed are one second of the recording."""
    head = Playhead(10.0, speed=0.5)
    head.advance(2.0)
    assert head.position == 1.0


def test_it_stays_where_it_is_paused() -> None:
    """A paused recording does not move."""
    head = Playhead(10.0, 3.0)
    head.pause()
    head.advance(2.0)
    assert head.position == 3.0


def test_it_stops_at_the_end_and_begins_anew() -> None:
    """At the end it stops; play goes on from the beginning."""
    head = Playhead(10.0, 9.0)
    head.advance(5.0)
    assert (head.position, head.playing) == (10.0, False)
    head.play()
    assert (head.position, head.playing) == (0.0, True)


@given(st.floats(allow_nan=False))
def test_it_never_leaves_the_recording(position: float) -> None:
    """A search beyond an end is that end."""
    head = Playhead(10.0)
    head.seek(position)
    assert 0.0 <= head.position <= 10.0
