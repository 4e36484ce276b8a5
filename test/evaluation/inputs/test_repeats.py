"""A joint state that comes again and again is no new message."""

import math

import numpy as np
import pytest
from evaluation.streams import MS, T0, Imu, Joints, Message, S, live, recorded, settings, split
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.alerts.messages import describe
from ugv_acceptance.evaluation.inputs.repeats import Repeats


@given(
    st.lists(
        st.tuples(st.integers(1, 700), st.sampled_from([0, 5, 7, S, 2 * S]), st.integers(0, 1)),
        min_size=1,
    ),
    st.integers(0, 30),
)
def test_columns_are_the_steps(messages: list[tuple[int, int, int]], cut: int) -> None:
    """Any stamps and positions, in any two batches."""
    one, many = Repeats(), Repeats()
    time = T0 + np.cumsum([wait for wait, _, _ in messages]) * MS
    stamp = np.array([s for _, s, _ in messages], np.int64)
    position = np.array([[0.5, float(q)] for _, _, q in messages])
    rows = zip(time.tolist(), stamp.tolist(), position.tolist(), strict=True)
    steps = [one.step(t, s, tuple(q)) for t, s, q in rows]
    parts = [slice(0, cut), slice(cut, None)]
    columns = [many.columns(time[p], stamp[p], position[p]) for p in parts if len(time[p])]
    np.testing.assert_array_equal(np.concatenate(columns), steps)
    assert one == many


def stream(stamp_of: str, seconds: float = 6.0, *, moves: float = 0.0) -> list[Message]:
    """Return a run in which from 2 s on stamps are as `stamp_of` says and the lift moves."""
    found: list[Message] = []
    for k in range(int(seconds * 50)):
        now = T0 + 7 + k * 20 * MS
        stamp = {
            'repeated': min(now, T0 + 7 + 2 * S), 'running': now, 'zero': 0, 'whole': now // S * S,
            'never moved': T0 - 5,
        }[stamp_of]  # fmt: skip
        wave = 1e-9 * k if stamp < now else 0.0
        found.append(
            Joints(now, position=(0.1 + moves * wave, 0.0), velocity=(0.5, 0.0), stamp=stamp)
        )
        found.append(Imu(now + MS))
    return found


def told(messages: list[Message]) -> tuple[list[float], list[str]]:
    """Return when (s) there were no margins, and the alerts about repeats, on both roads."""
    end = messages[-1].time
    seen, alerts = live(settings(), messages, end)
    rows, evaluator = recorded(settings(), split(messages, [50, 333]), end)
    unknown = [(m.time - T0) / S for m, margins in seen[2:] if margins is None]
    known = np.concatenate([part.known for part in rows])[2:]
    time = np.concatenate([part.time for part in rows])[2:]
    assert ((time[~known] - T0) / S).tolist() == unknown
    logs = [
        [describe(a, settings()) for a in log if a.rule.code == 'JOINTS_REPEATED']
        for log in (alerts, evaluator.watch.log)
    ]
    assert logs[0] == logs[1]
    return unknown, logs[0]


@pytest.mark.parametrize('stamp', ['repeated', 'never moved'])
def test_one_message_repeated_gives_no_margins(stamp: str) -> None:
    """From half a second on, while its velocities go on: margins are unknown, and why is said."""
    unknown, said = told(stream(stamp))
    began = 2.5 if stamp == 'repeated' else 0.5
    assert unknown[0] == pytest.approx(began, abs=0.05)
    assert len(unknown) == pytest.approx((6.0 - began) * 100, abs=6)
    assert len(said) == 1
    assert said[0].startswith('joint_states repeats one message: its stamp and all positions')


@pytest.mark.parametrize('stamp', ['running', 'zero', 'whole'])
def test_joints_at_rest_are_new_messages(stamp: str) -> None:
    """With running stamps; a stamp of 0 is no stamp, and one of whole seconds stands still."""
    assert told(stream(stamp)) == ([], [])


@pytest.mark.parametrize('stamp', ['repeated', 'never moved'])
def test_positions_that_change_are_new_whatever_the_stamp_says(stamp: str) -> None:
    """A clock that stands still is another fault: CLOCK."""
    assert told(stream(stamp, moves=1.0)) == ([], [])


def test_parts_of_one_moment_may_share_their_stamp() -> None:
    """Arm and slide come in messages of their own with one common stamp."""
    messages: list[Message] = []
    for k in range(300):
        now = T0 + 7 + k * 20 * MS
        for n, names in enumerate((('lift',), ('hand_slide',))):
            messages.append(Joints(now + n * MS, names, (0.1,), stamp=now))
        messages.append(Imu(now + 2 * MS))
    assert told(messages) == ([], [])


def test_a_part_that_is_repeated_makes_the_whole_posture_unknown() -> None:
    """The slide's messages are new, the lift's are not: no margins, at the slide's neither."""
    messages: list[Message] = []
    for k in range(300):
        now = T0 + 7 + k * 20 * MS
        messages += [
            Joints(now, ('lift',), (0.1,), stamp=min(now, T0 + 2 * S + 9)),
            Joints(now + MS, ('hand_slide',), (0.1,), stamp=now),
            Imu(now + 2 * MS),
        ]
    unknown, said = told(messages)
    assert unknown[0] == pytest.approx(2.5, abs=0.05)
    assert len(unknown) == pytest.approx(3 * 3.5 * 50, abs=9)
    assert len(said) == 1


def test_a_position_that_is_not_a_number_is_never_a_repeat() -> None:
    """It is invalid, which is another alert."""
    one = Repeats()
    assert [one.step(T0 + k * S, 5, (float('nan'), 1.0)) for k in range(3)] == [0.0] * 3
    many = Repeats().columns(np.arange(3) * S, np.full(3, 5), np.array([[math.nan, 1.0]] * 3))
    assert not many.any()
