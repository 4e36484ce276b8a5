"""If the power goes: whether limp joints tip the robot, what brakes hold, how far things fall."""

import json
import math
from dataclasses import replace

import pytest
from cli.here import ugv
from robots import LIFT, box

from ugv_acceptance.config import load
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Joint, Link, Payload, Robot
from ugv_acceptance.model.statics import torque_of
from ugv_acceptance.simulation.power_loss import (
    DAMPINGS,
    MAY_TIP,
    NOT_SEEN_TO_TIP,
    TIPS,
    Fall,
    Released,
    answer_of,
    brakes_of,
    mixed,
    power_loss,
)

LEVEL = (0.0, 0.0, -9.81)


def mast(base: float, load: float, lower: float = 0.3) -> Released:
    """Return a light or heavy base with a mast almost upright that carries a load (kg).

    It leans forward until `lower` (rad above the horizon), beyond the front feet.
    """
    links = (
        Link('base_link', base, (0.0, 0.0, 0.05), box(base, 0.4, 0.3, 0.1)),
        Link('mast', 1.0, (0.3, 0.0, 0.0), box(1.0, 0.6, 0.04, 0.04)),
    )
    joint = Joint('lean', 'revolute', 'base_link', 'mast', (0, 0, 0.1), axis=LIFT,
                  lower=lower, upper=2.8)  # fmt: skip
    feet = tuple(
        Contact(f'{x}{y}', 'base_link', (0.2 * x, 0.15 * y, 0.0)) for x in (1, -1) for y in (1, -1)
    )
    robot = Robot('mast', links, (joint,), ('lean',), feet, payload_link='mast')
    return Released(robot, (math.radians(80.0),), Payload(load, (0.6, 0.0, 0.0)), LEVEL)


def test_a_heavy_mast_on_a_light_base_tips() -> None:
    """What stands while its motor holds the mast tips at every damping once the mast falls."""
    found = power_loss(mast(4.0, 6.0))
    assert found.stood
    assert found.answer == TIPS
    assert all(fall.tips for fall in found.falls)


def test_a_brake_that_closes_keeps_it_standing() -> None:
    """The same robot with its brake is not seen to tip, and hardly turns."""
    found = power_loss(replace(mast(4.0, 6.0), braked=('lean',)))
    assert found.answer == NOT_SEEN_TO_TIP
    assert max(fall.turn for fall in found.falls) < math.radians(0.5)


def test_a_light_mast_on_a_heavy_base_is_not_seen_to_tip() -> None:
    """A mast of 1 kg that falls on a base of 40 kg tips nothing."""
    assert power_loss(mast(40.0, 0.0)).answer == NOT_SEEN_TO_TIP


@pytest.mark.parametrize(
    ('turns_deg', 'answer'),
    [
        ((31.0, 31.0, 31.0), TIPS),
        ((31.0, 0.1, 0.1), MAY_TIP),
        ((0.1, 29.0, 31.0), MAY_TIP),
        ((0.1, 6.0, 0.1), MAY_TIP),
        ((4.0, 4.0, 4.0), NOT_SEEN_TO_TIP),
    ],
)
def test_the_answer_is_that_of_all_falls(turns_deg: tuple[float, ...], answer: str) -> None:
    """TIPS if every fall tips, MAY TIP if one turns the base by more than 5 deg."""
    falls = [Fall((0.5,), math.radians(turn), turn > 30.0) for turn in turns_deg]
    assert answer_of(falls) == answer


def test_joints_may_have_dampings_of_their_own() -> None:
    """Besides equal ones, every second joint is slow, and each half of them; one joint has none."""
    f, s = DAMPINGS[0], DAMPINGS[-1]
    assert set(mixed(4)) == {(f, s, f, s), (s, f, s, f), (f, f, s, s), (s, s, f, f)}
    assert mixed(1) == ()


def test_who_does_not_stand_with_power_is_said_to() -> None:
    """On a slope where it tips with all joints held, the answer says that it did not stand."""
    released = replace(mast(4.0, 6.0), gravity=(7.0, 0.0, -6.9))
    found = power_loss(released)
    assert not found.stood
    assert found.answer == TIPS


@pytest.mark.parametrize('lower', [0.3, -1.0])
def test_brakes_hold_the_static_torque_and_spare_the_fall(lower: float) -> None:
    """A brake's torque is the model's, a mast falls from its height to its limit or the ground."""
    released = mast(20.0, 2.0, lower)
    (brake,) = brakes_of(released)
    found = posture_of(mechanics_of(released.robot), released.q, 2.0, (0.6, 0.0, 0.0))
    assert brake.torque == pytest.approx(abs(torque_of(found, LEVEL)[0]), rel=1e-3)
    # The centre of gravity of 3 kg is 0.5 m out; the joint is 0.1 m above the ground.
    least = max(0.5 * math.sin(lower), -0.1)
    assert brake.fall == pytest.approx(0.5 * math.sin(math.radians(80.0)) - least, abs=1e-3)
    assert brake.energy == pytest.approx(3.0 * 9.81 * brake.fall, rel=1e-6)
    assert not brake.carries


def test_packbots_flippers_carry_it() -> None:
    """A joint with contacts on it is marked: the ground's load is not in its torque."""
    robot = load().settings.robot
    brakes = brakes_of(Released(robot, (0.0, 1.0, 0.0, -0.6), robot.payload, LEVEL))
    assert {b.joint for b in brakes if b.carries} == {'flipper_joint'}


def test_the_verb_prints_the_answer_and_writes_it_as_json() -> None:
    """`model --power-loss` says one of three answers, what it means and what was assumed."""
    words = ('model', '--posture', 'shoulder_joint=120deg,elbow_joint=-140deg', '--power-loss')
    printed = ugv(*words)
    assert printed.returncode == 0, printed.stderr
    assert 'If the power goes: NOT SEEN TO TIP: no simulated fall' in printed.stdout
    assert 'Assumed: flat ground' in printed.stdout
    found = json.loads(ugv(*words, '--braked', 'shoulder_joint', '--json').stdout)['power_loss']
    assert found['braked'] == ['shoulder_joint']
    assert [fall['damping_ratios'] for fall in found['falls']] == [[d] * 4 for d in DAMPINGS]


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (('--power-loss', '--braked', 'knee'), '--braked: expected a measured joint (turret_joint'),
        (('--braked', 'turret_joint'), '--braked: expected --power-loss beside it'),
    ],
)
def test_what_cannot_be_braked_is_refused(words: tuple[str, ...], said: str) -> None:
    """One line and exit code 2, before anything is simulated."""
    done = ugv('model', *words)
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count('\n') == 1
