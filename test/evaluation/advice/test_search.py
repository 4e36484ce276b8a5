"""Advice about a margin, compared with the model, with geometry, and with the simulated robot."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.advice_trial import trials
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.advice.paths import joint_speed
from ugv_acceptance.evaluation.advice.search import advise, margin_names, scores_of
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import NO_CONTACT, margins
from ugv_acceptance.model.statics import centre_of_gravity, gripper_point
from ugv_acceptance.simulation.vehicle import gravity_on_slope

PACKBOT = load().settings
LEVEL = (0.0, 0.0, -9.81)
STRETCHED = (0.0, 0.0, 0.0, 1.5)
# A robot that is not said to tip: only its motors count.
STEADY = replace(PACKBOT, limits=replace(PACKBOT.limits, tip_warn=-1.0, tip_error=-1.5))
angles = st.floats(-3.1, 3.1)
postures = st.tuples(angles, angles, angles, angles)
slopes = st.tuples(st.floats(0.0, 0.7), angles)


def test_a_robot_that_stands_well_needs_no_advice() -> None:
    """Nothing is said where every margin is beyond its warning limit."""
    assert advise(PACKBOT, (0.0, 1.5, 2.9, 1.5), LEVEL, Payload()) == ()


def test_an_arm_stretched_forward_is_raised() -> None:
    """With 4 kg at full reach the robot is about to tip to the front: raise the elbow."""
    first = advise(PACKBOT, STRETCHED, LEVEL, Payload(4.0))[0]
    assert first.subject == 'elbow_joint'
    assert first.margin == 'front'
    assert first.sentence.startswith('raise the elbow by ')
    assert 'deg further from tipping to the front, in ' in first.sentence


def test_a_load_too_heavy_for_a_joint_is_told_in_kg() -> None:
    """The excess is the load less what the warning limit of the joint allows."""
    words = [a.sentence for a in advise(STEADY, (3.0, 0.9, 0.0, 1.5), LEVEL, Payload(4.0))]
    assert any('kg too heavy in this posture' in sentence for sentence in words)


def test_a_saturated_joint_is_not_told_to_lift() -> None:
    """A motor at its limit cannot raise what it does not hold."""
    told = advise(STEADY, STRETCHED, LEVEL, Payload(4.0))
    assert told
    assert not [a for a in told if a.subject == 'shoulder_joint' and a.amount > 0.0]


@pytest.mark.parametrize('unknown', [math.nan, math.inf])
def test_nothing_is_advised_of_what_is_not_known(unknown: float) -> None:
    """No advice without positions or gravity."""
    assert advise(PACKBOT, (unknown, 0.0, 0.0, 0.0), LEVEL, Payload(4.0)) == ()
    assert advise(PACKBOT, STRETCHED, (0.0, unknown, -9.81), Payload(4.0)) == ()


@settings(max_examples=60)
@given(postures, slopes, st.floats(0.0, 8.0))
def test_advice_gains_what_it_says_and_costs_no_other_margin_its_limit(
    q: tuple[float, ...], slope: tuple[float, float], mass: float
) -> None:
    """The model says of the end of a joint's path: the gain is there, no other limit was passed."""
    down, load_ = gravity_on_slope(9.81, *slope), Payload(mass)
    before = margins(PACKBOT.robot, q, down, load_)
    for a in advise(PACKBOT, q, down.tolist(), load_):
        if a.kind != 'joint':
            continue
        j = PACKBOT.robot.joint_names.index(a.subject)
        end = np.array(q) + np.eye(4)[j] * a.amount
        after = margins(PACKBOT.robot, end, down, load_)
        then, now = (scores_of(PACKBOT, m.torque, m.angle) for m in (after, before))
        assert a.gain > 0.0
        assert (then >= np.minimum(now, 1.0) - 1e-5).all()
        k = margin_names(PACKBOT).index(a.margin)
        assert then[k] > now[k]
        assert abs(a.amount) / a.seconds == pytest.approx(joint_speed(PACKBOT, j))


@settings(max_examples=40)
@given(postures, slopes, st.floats(0.0, 8.0))
def test_what_is_enough_comes_first(
    q: tuple[float, ...], slope: tuple[float, float], mass: float
) -> None:
    """Advice that ends the warning comes first, of that turns last, and then the fastest."""
    told = advise(PACKBOT, q, gravity_on_slope(9.81, *slope).tolist(), Payload(mass))
    enough = [a.enough for a in told]
    assert enough == sorted(enough, reverse=True)
    order = [(a.kind == 'turn', a.seconds) for a in told if a.enough]
    assert order == sorted(order)


@settings(max_examples=40)
@given(postures, slopes)
def test_advice_is_only_for_what_is_known_and_wrong(
    q: tuple[float, ...], slope: tuple[float, float]
) -> None:
    """Advice is given only if the margins are known and one of them is below its warning limit."""
    down, load_ = gravity_on_slope(9.81, *slope), Payload(4.0)
    found = margins(PACKBOT.robot, q, down, load_)
    worst = scores_of(PACKBOT, found.torque, found.angle).min()
    if advise(PACKBOT, q, down.tolist(), load_):
        assert worst < 1.0
        assert found.state < NO_CONTACT


@pytest.mark.parametrize('kind', ['joint', 'turn', 'payload'])
def test_following_the_advice_in_the_simulator_raises_the_margin(kind: str) -> None:
    """All of ten seeded cases a kind come out better, and none tips; the bench counts more."""
    found = list(trials(PACKBOT, 10, 11, (kind,)))
    assert len(found) == 10
    assert all(trial.helped for trial in found)
    assert not any(trial.tipped for trial in found)


def test_both_tracks_carry_the_robot_all_the_way_of_a_turn() -> None:
    """Statics of a rigid body on two tracks: the lighter one carries at least a quarter.

    Skid steering cannot turn a robot that stands on one track: it drives off (bench_advice).
    """
    feet = [p.position for p in PACKBOT.robot.contacts if p.link == PACKBOT.robot.root]
    half, ground = max(y for _, y, _ in feet), min(z for _, _, z in feet)
    random, turns = np.random.default_rng(3), 0
    for _ in range(500):
        # An arm that leans forward, on a slope down to the front or to a side.
        q = (*random.uniform((-1.0, 0.0, -1.0), (1.0, 1.5, 1.0)).tolist(), 1.5)
        load_ = Payload(random.uniform(0.0, 6.0))
        down = gravity_on_slope(9.81, *random.uniform((0.1, -1.6), (0.5, 1.6)).tolist())
        cog = centre_of_gravity(PACKBOT.robot, q, load_)
        for a in advise(PACKBOT, q, down.tolist(), load_):
            if a.kind != 'turn':
                continue
            turns += 1
            for part in np.linspace(0.0, a.amount, 7):
                across = math.cos(part) * down[1] - math.sin(part) * down[0]
                # Where gravity through the centre of gravity meets the ground, across.
                y = cog[1] - across / down[2] * (cog[2] - ground)
                assert abs(y) <= 0.51 * half
    assert turns >= 10


def test_an_arm_is_not_laid_on_the_ground() -> None:
    """No advice ends with a joint or the load within five centimetres of the ground."""
    for trial in range(40):
        q = np.random.default_rng(trial).uniform(-1.5, 1.5, 4)
        for a in advise(PACKBOT, q.tolist(), LEVEL, Payload(6.0)):
            if a.kind != 'joint' or a.subject == 'flipper_joint':
                continue
            end = q + np.eye(4)[PACKBOT.robot.joint_names.index(a.subject)] * a.amount
            lowest = gripper_point(PACKBOT.robot, [q, end])[:, 2]
            assert lowest[1] > min(lowest[0] - 1e-6, PACKBOT.robot.ground + 0.05)


def test_a_warning_of_a_motor_is_not_hidden_by_a_tilt_that_is_fine() -> None:
    """Only margins below their warning limit get advice; among those a tip-over comes first."""
    told = advise(STEADY, STRETCHED, LEVEL, Payload(2.0))
    assert {a.margin for a in told} == {'shoulder_joint'}
    assert {a.margin for a in advise(PACKBOT, STRETCHED, LEVEL, Payload(4.0))} == {'front'}
