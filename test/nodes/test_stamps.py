"""Header stamps in the time of a replay: near now, at its rate, alike for all of one clock."""

from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from hypothesis import given
from hypothesis import strategies as st
from nodes.live_case import joints
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    Marker,
    MarkerArray,
)

from ugv_acceptance.nodes.replay_stamps import NS, Stamps, restamped, stamp_of, stamped

MS = 1_000_000
LOG, NOW, SIM = 1_700_000_000 * NS, 1_800_000_000 * NS, 12_300 * MS
ALL = frozenset({'/a', '/b', '/c'})


def stamps(rate: float = 1.0, leaders: frozenset[str] = ALL) -> Stamps:
    """Return the stamps of a round that begins now."""
    return Stamps(LOG, NOW, rate, leaders)


def told(anew: Stamps, topic: str, logged: int, stamp: int) -> int:
    """Return a stamp as it is published, in ns after the round's begin."""
    return anew.of(topic, LOG + logged, stamp)(stamp) - NOW


@given(st.integers(0, 2**31 - 1), st.integers(0, NS - 1), st.integers(-(2**40), 2**40))
def test_a_stamp_moves_by_the_shift(sec: int, nanosec: int, shift: int) -> None:
    """The stamp moves by the shift, but not before 1970 or beyond what it can tell."""
    stamp = sec * NS + nanosec
    moved = stamp_of(restamped(joints(stamp=stamp), lambda stamp: stamp + shift))
    assert moved == min(max(stamp + shift, 0), 2**31 * NS - 1)


@pytest.mark.parametrize('rate', [0.25, 1.0, 2.0, 50.0])
@pytest.mark.parametrize('start', [LOG, SIM, LOG - 9 * 86400 * NS, LOG + 10**8 * NS])
def test_stamps_advance_with_the_replay(rate: float, start: int) -> None:
    """Recorded, simulated or days off: a stamp is the time at which its message is due."""
    anew = stamps(rate)
    for second in range(100):
        due = int(second * NS / rate)
        assert abs(told(anew, '/a', second * NS, start + second * NS) - due) < MS


@pytest.mark.parametrize('rate', [1.0, 4.0])
@pytest.mark.parametrize('start', [LOG, SIM])
@pytest.mark.parametrize('lag', [0, 20 * MS, 3 * NS])
def test_what_topics_of_one_clock_tell_of_each_other_stays(
    rate: float, start: int, lag: int
) -> None:
    """Equal stamps stay equal, and one that is behind stays so, though it is logged later."""
    anew = stamps(rate)
    for k in range(50):
        at = k * 100 * MS
        a = told(anew, '/a', at, start + at)
        b = told(anew, '/b', at + 5 * MS, start + at)
        c = told(anew, '/c', at + 7 * MS, start + at - lag)
        assert a == b
        assert a - c == pytest.approx(lag / rate, abs=2)


def test_each_clock_has_its_own_shift() -> None:
    """Wall time, a simulation and time since boot in one recording: all come out near now."""
    anew = stamps()
    for k in range(50):
        at = k * 100 * MS
        for topic, start in (('/a', LOG), ('/b', SIM), ('/c', 5000 * NS)):
            assert abs(told(anew, topic, at, start + at) - at) < MS


@pytest.mark.parametrize('off', [-5 * NS, 5 * NS, 600 * NS])
def test_a_clock_that_is_wrong_stays_wrong(off: int) -> None:
    """A topic some seconds off the recorder's clock is for the monitor to see, as it was."""
    anew = stamps()
    assert told(anew, '/a', 0, LOG) == 0
    assert told(anew, '/b', 0, LOG + off) == off


@pytest.mark.parametrize('speed', [0.3, 0.97, 1.5])
def test_a_simulation_may_run_at_another_speed(speed: float) -> None:
    """However slow or fast it ran, its stamps never come out a second from when they are due."""
    anew = stamps()
    for k in range(2000):
        at = k * 50 * MS
        assert abs(told(anew, '/a', at, SIM + int(at * speed)) - at) < NS
        assert abs(told(anew, '/b', at, SIM + int(at * speed)) - at) < NS


def test_a_simulation_may_pause_or_begin_again() -> None:
    """After a pause, and after its time was set back, stamps are near now at once."""
    anew = stamps()
    for at, stamp in ((0, 0), (1, 1), (21, 2), (22, 3), (30, -10), (31, -9)):
        assert told(anew, '/a', at * NS, SIM + stamp * NS) == at * NS


def test_a_stamp_that_stands_still_stands() -> None:
    """A driver whose stamps freeze is not healed, and moves no other topic."""
    anew = stamps()
    frozen = [told(anew, '/a', k * NS, SIM) for k in range(10)]
    assert set(frozen) == {0}
    assert told(anew, '/b', 9 * NS, SIM + 9 * NS) == 9 * NS


def test_a_stamp_that_is_not_given_is_not_made_up() -> None:
    """Zero stays zero, whatever the clock of the others is."""
    for start in (LOG, SIM):
        anew = stamps()
        assert told(anew, '/a', 0, start) == 0
        assert anew.of('/b', LOG, 0)(0) == 0
        assert anew.of('/a', LOG, 0)(0) == 0
        assert told(anew, '/b', 0, start) == 0


def test_a_map_of_long_ago_is_no_clock() -> None:
    """What is told once, stamped before the recording began, moves no other topic."""
    anew = stamps(leaders=frozenset({'/a'}))
    told(anew, '/map', 0, SIM - 8 * NS)
    assert told(anew, '/a', 0, SIM) == 0


def deep(*seconds: int) -> MarkerArray:
    """Return markers with these stamps (s)."""
    message = MarkerArray(markers=[Marker(ns=f'of_{second}') for second in seconds])
    for marker, second in zip(message.markers, seconds, strict=True):
        marker.header.stamp.sec = second
    return message


def moved(message: Any, stamp: int) -> Any:
    """Return a message as it is published whose clock tells `stamp` when it is logged."""
    data = serialize_message(message)
    kind = type(message)
    return deserialize_message(stamped(kind).moved(data, '/a', LOG + stamp, stamps()), kind)


def test_headers_inside_a_message_move_too() -> None:
    """Markers, as tf's transforms, have a header each, none for all: each moves, all else stays."""
    message = moved(deep(12, 13, 0), 12 * NS)
    assert [t.header.stamp.sec for t in message.markers] == [
        (NOW // NS) + 12,
        (NOW // NS) + 13,
        0,
    ]
    assert [t.ns for t in message.markers] == ['of_12', 'of_13', 'of_0']


def test_the_header_of_a_whole_and_of_its_parts_move_alike() -> None:
    """One header for all, and one for each part two levels down: their differences stay."""
    handle = InteractiveMarker(controls=[InteractiveMarkerControl(markers=deep(15, 16).markers)])
    handle.header.stamp.sec = 15
    found = moved(handle, 15 * NS)
    parts = [marker.header.stamp for marker in found.controls[0].markers]
    assert found.header.stamp == parts[0]
    assert found.header.stamp.sec == NOW // NS + 15
    assert parts[1].sec - parts[0].sec == 1


@pytest.mark.parametrize(
    ('kind', 'first', 'inside'),
    [
        (JointState, True, False),
        (DiagnosticArray, True, False),
        (JointTrajectory, True, False),
        (InteractiveMarker, True, True),
        (MarkerArray, False, True),
        (String, False, False),
    ],
)
def test_where_headers_are_is_known_of_a_type(kind: Any, *, first: bool, inside: bool) -> None:
    """The headers of a message type are found at its start, in its parts, in both, or nowhere."""
    found = stamped(kind)
    assert (found.first, found.inside) == (first, inside)


@pytest.mark.parametrize('data', [b'', b'\0\1\0\0', b'\0\1\0\0\xff\xff\xff\xff'])
@pytest.mark.parametrize('kind', [JointState, MarkerArray, InteractiveMarker])
def test_a_message_that_is_broken_stays_as_it_is(kind: Any, data: bytes) -> None:
    """Too short, or not what its type says: a listener gets it as it was recorded."""
    assert stamped(kind).moved(data, '/a', LOG, stamps()) == data
