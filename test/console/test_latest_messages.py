"""Which messages a console evaluates for a picture: the newest ones, each once."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.config import load
from ugv_acceptance.console.latest_messages import (
    Heartbeat,
    Newest,
    Pick,
    hints_of,
    newest_attitude,
    newest_of_joints,
    problem_of,
)
from ugv_acceptance.evaluation.criteria.not_judged import unknown_words
from ugv_acceptance.evaluation.settings import CONTACTS, ImuInput

NOTHING = (0.0, 0.0, 0.0)
LEVEL, LEANING = (0.0, 0.0, 0.0, 1.0), (0.6, 0.0, 0.0, 0.8)
OPEN = replace(load().settings, unknown=(CONTACTS,))
NOT_GIVEN = (-1.0,) + (0.0,) * 8


def joint_state(stamp: int, *names: str) -> bytes:
    """Return a JointState of these joints."""
    zeros = (0.0,) * len(names)
    return joint_state_cdr(stamp, '', names, zeros, zeros, zeros)


def imu(stamp: int, orientation: tuple[float, ...], first: tuple[float, ...]) -> bytes:
    """Return an Imu message with this orientation and its covariance."""
    covariances = (first, (0.0,) * 9, (0.0,) * 9)
    return imu_cdr(stamp, 'imu', orientation, NOTHING, (0.0, 0.0, 9.81), covariances)


def heard(newest: Newest, taken: list[bytes], messages: list[bytes]) -> tuple[list[bytes], int]:
    """Return what is handed on of messages, and how many were not."""
    for message in messages:
        newest(message)
    replaced = newest.hand_on()
    found = list(taken)
    taken.clear()
    return found, replaced


@given(st.lists(st.sampled_from(['arm', 'flipper', 'both']), max_size=30))
def test_the_newest_joint_state_of_each_set_of_joints_is_kept(drivers: list[str]) -> None:
    """A driver of the arm and one of the flippers do not hide each other; order is kept."""
    names = {'arm': ('elbow',), 'flipper': ('flipp',), 'both': ('elbow', 'flipper')}
    messages = [joint_state(k, *names[who]) for k, who in enumerate(drivers)]
    taken: list[bytes] = []
    newest = Newest(taken.append, newest_of_joints())
    last = sorted({who: k for k, who in enumerate(drivers)}.values())
    found, replaced = heard(newest, taken, messages)
    assert found == [messages[k] for k in last]
    assert replaced == len(drivers) - len(last)
    assert heard(newest, taken, []) == ([], 0)


def test_an_orientation_replaces_an_older_one() -> None:
    """Where IMU messages give the attitude, the newest says all."""
    taken: list[bytes] = []
    messages = [imu(k, LEANING, (0.0,) * 9) for k in range(5)]
    newest = Newest(taken.append, newest_attitude(ImuInput()))
    assert heard(newest, taken, messages) == (messages[-1:], 4)


@pytest.mark.parametrize(
    ('settings', 'orientation', 'covariance'),
    [
        (ImuInput(), LEANING, NOT_GIVEN),
        (ImuInput(), LEVEL, (0.0,) * 9),
        (ImuInput(attitude='accelerometer'), LEANING, (0.0,) * 9),
        (ImuInput(specific_force=True), LEANING, (0.0,) * 9),
    ],
)
def test_what_is_smoothed_is_taken_whole(
    settings: ImuInput, orientation: tuple[float, ...], covariance: tuple[float, ...]
) -> None:
    """If attitude comes from smoothed acceleration, every IMU message is passed on."""
    taken: list[bytes] = []
    messages = [imu(k, orientation, covariance) for k in range(5)]
    newest = Newest(taken.append, newest_attitude(settings))
    assert heard(newest, taken, messages) == (messages, 0)


@pytest.mark.parametrize(
    ('pick', 'fine'),
    [
        (newest_of_joints(), joint_state(1, 'elbow')),
        (newest_attitude(ImuInput()), imu(1, LEANING, (0.0,) * 9)),
    ],
)
def test_what_cannot_be_read_goes_on(pick: Pick, fine: bytes) -> None:
    """A malformed message is handed on beside others, to be counted where messages are judged."""
    taken: list[bytes] = []
    newest = Newest(taken.append, pick)
    assert heard(newest, taken, [b'\0']) == ([b'\0'], 0)
    assert heard(newest, taken, [fine, b'\0', fine]) == ([b'\0', fine], 1)


def test_silence_is_judged_by_the_period_heard() -> None:
    """What comes every 0.4 s is not silent after 1 s, and is after 3 s; what never came is not."""
    pulse = Heartbeat()
    assert not pulse.silent(9.0, 0.5)
    for k in range(100):
        pulse.beat(0.4 * k)
    assert not pulse.silent(39.6 + 1.0, 0.5)
    assert pulse.silent(39.6 + 3.0, 0.5)


@pytest.mark.parametrize(
    ('values', 'hints'),
    [
        ({}, ()),
        ({'tip_of': 'front'}, ()),
        ({'tip_in_s': '1.2', 'tip_of': 'front'}, ()),
        (
            {'payload_estimate_kg': '3.5', 'saturation_in_s': '0.7', 'saturation_of': 'elbow'},
            ('measured efforts suggest a payload of 3.5 kg',),
        ),
    ],
)
def test_hints_are_what_the_verdict_tells(values: dict[str, str], hints: tuple[str, ...]) -> None:
    """The load that is felt; the time to a limit is a number of its own, not said twice."""
    assert hints_of(values) == hints


@pytest.mark.parametrize(
    ('message', 'problem'),
    [
        ('waiting for imu: no margins yet', 'waiting for imu: no margins yet'),
        ('stairs: it is not known yet; 6 deg to tipping; and more', 'stairs: it is not known yet'),
        (f'{unknown_words(OPEN)}; 6 deg to tipping', ''),
        ('', ''),
    ],
)
def test_a_verdict_of_no_data_tells_no_margin(message: str, problem: str) -> None:
    """The reason alone; none where only the configuration leaves something open."""
    assert problem_of(message, {'left': '6 deg to tipping'}, OPEN) == problem
    assert problem_of(message, {}, load().settings) == message
