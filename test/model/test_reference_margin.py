"""The least margin against its definition by brute force, and how far it moves with a contact."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made.subjects import PACKBOT, subjects
from reference_margin import reference_margin
from robots import DOWN, centre, feet, random_robot, tracked
from scipy.spatial.transform import Rotation

from ugv_acceptance.config import load
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Robot
from ugv_acceptance.model.stability import stability, stances_of, standing, tip_angles_of
from ugv_acceptance.type_aliases import Floats

# How far (deg) the least margin may move with each millimetre of a contact's coordinate.
STEEPEST = 4.0
STOWED = np.pi
POSTURES = {
    'stowed': (0.0, 2.0, -2.5, STOWED),
    'raised': (0.0, 2.0, -2.5, np.radians(-40.0)),
    'stretched': (0.0, 0.0, 0.0, STOWED),
    'half stretched': (0.0, 1.05, 0.0, STOWED),
    'on its flippers': (0.0, 1.0, -0.5, np.radians(-14.92)),
    'flippers forward': (0.0, 0.0, 0.0, 0.0),
}
TILTS = ((0.0, 0.0), (15.0, 0.0), (0.0, 15.0), (0.0, -15.0))


@cache
def packbot() -> Robot:
    """Return the PackBot that ships."""
    return load().settings.robot


def down(roll: float, pitch: float) -> Floats:
    """Return gravity in base axes (3,) at a roll and pitch (deg)."""
    turn = Rotation.from_euler('yx', (pitch, roll), degrees=True)
    gravity: Floats = turn.inv().apply(DOWN)
    return gravity


def least(robot: Robot, q: Floats, gravity: Floats) -> Floats:
    """Return the least margin (rad) of many samples, shape (...)."""
    angles: Floats = np.min(np.array(stability(robot, q, gravity).angle), axis=0)
    return angles


def least_alone(robot: Robot, q: Floats, gravity: Floats) -> float:
    """Return the least margin (rad) of one sample, as it is computed live."""
    mechanics, load_ = mechanics_of(robot), robot.payload
    posture = posture_of(mechanics, q.tolist(), load_.mass, load_.cog)
    x, y, z = gravity.tolist()
    stance = standing(stances_of(mechanics, posture), (x, y, z))
    angles, _ = tip_angles_of(stance, (x, y, z))
    return float(min(angles))


def expected(robot: Robot, q: Floats, gravity: Floats) -> float:
    """Return the reference's least margin (rad) of one sample."""
    fixed = [k for k, contact in enumerate(robot.contacts) if contact.link == robot.root]
    _, cog = centre(robot, q.tolist(), robot.payload)
    return reference_margin(feet(robot, q.tolist()), cog, gravity, fixed).margin


def check(robot: Robot, q: Floats, gravity: Floats) -> None:
    """Compare the margins of samples, one and many, with the reference's, where they are positive.

    How far a robot is past tipping is not compared. Those whose centre of gravity hangs below a
    contact are left out: no edge counts as further than a quarter turn.
    """
    for k, margin in enumerate(least(robot, q, gravity)):
        _, cog = centre(robot, q[k].tolist(), robot.payload)
        if ((feet(robot, q[k].tolist()) - cog) @ gravity[k] > 0.0).all():
            want = expected(robot, q[k], gravity[k])
            for found in (float(margin), least_alone(robot, q[k], gravity[k])):
                assert max(found, 0.0) == pytest.approx(max(want, 0.0), abs=1e-9)


def samples(robot: Robot, rng: np.random.Generator, count: int) -> tuple[Floats, Floats]:
    """Return random joint positions (count, j) and gravities (count, 3), up to 40 deg of tilt."""
    q = rng.uniform(-np.pi, np.pi, (count, len(robot.joint_names)))
    tilts = rng.uniform(-40.0, 40.0, (count, 2))
    return q, np.array([down(roll, pitch) for roll, pitch in tilts])


@pytest.mark.parametrize('seed', range(8))
def test_it_is_the_one_of_the_definition(seed: int) -> None:
    """For random trees on even and uneven feet, some on links that move: one sample and many."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, int(rng.integers(3, 6)), moving=seed % 3)
    if seed % 2:
        spread = float(rng.choice((0.001, 0.005, 0.02)))
        robot = replace(robot, contacts=tuple(uneven(c, rng, spread) for c in robot.contacts))
    check(robot, *samples(robot, rng, 30))


def uneven(contact: Contact, rng: np.random.Generator, spread: float) -> Contact:
    """Return a contact that is up to `spread` (m) from where it was, along each axis."""
    x, y, z = (np.array(contact.position) + rng.uniform(-spread, spread, 3)).tolist()
    return replace(contact, position=(x, y, z))


@pytest.mark.parametrize('robot', [tracked(), packbot()], ids=['tracked', PACKBOT])
def test_flippers_at_any_angle_keep_to_the_definition(robot: Robot) -> None:
    """Up, near the ground, on it, pressed down: one sample and many."""
    q, gravity = samples(robot, np.random.default_rng(5), 40)
    q[:, -1] = np.linspace(-np.pi, np.pi, len(q))
    check(robot, q, gravity)


def moved(robot: Robot, contact: int, axis: int, by: float) -> Robot:
    """Return the robot with one coordinate of a contact changed by so much (m)."""
    contacts = list(robot.contacts)
    at = list(contacts[contact].position)
    at[axis] += by
    contacts[contact] = replace(contacts[contact], position=(at[0], at[1], at[2]))
    return replace(robot, contacts=tuple(contacts))


def check_steepness(robot: Robot, q: Floats, gravity: Floats, draw: st.DataObject) -> None:
    """Compare two places of one contact, up to 5 mm from where it is: the margins are as near."""
    contact = draw.draw(st.integers(0, len(robot.contacts) - 1), 'contact')
    axis = draw.draw(st.integers(0, 2), 'axis')
    a, b = (draw.draw(st.integers(-50, 50), 'tenths of a millimetre') for _ in range(2))
    one, other = (least_alone(moved(robot, contact, axis, x * 1e-4), q, gravity) for x in (a, b))
    assert abs(np.degrees(one - other)) <= STEEPEST * abs(a - b) / 10.0 + 1e-6


@settings(max_examples=25)
@given(posture=st.sampled_from(sorted(POSTURES)), tilt=st.sampled_from(TILTS), draw=st.data())
def test_millimetres_of_a_contact_move_it_little(
    posture: str, tilt: tuple[float, float], draw: st.DataObject
) -> None:
    """PackBot: no more than 0.4 deg for 0.1 mm, in any posture and attitude, so it never jumps."""
    check_steepness(packbot(), np.array(POSTURES[posture]), down(*tilt), draw)


@cache
def configured(name: str) -> tuple[Robot, tuple[float, ...]]:
    """Return a robot of ../shared/robots and a folded posture."""
    with TemporaryDirectory() as folder:
        subject = subjects()[name]
        return load(subject.config(Path(folder))).settings.robot, subject.calm


@settings(max_examples=20)
@given(
    name=st.sampled_from(sorted(set(subjects()) - {PACKBOT})),
    tilt=st.sampled_from(TILTS[:2]),
    draw=st.data(),
)
def test_robots_of_others_do_not_jump_either(
    name: str, tilt: tuple[float, float], draw: st.DataObject
) -> None:
    """Those of ../shared/robots on their wheels; without that folder a stand-in with flippers."""
    robot, q = configured(name)
    check_steepness(robot, np.array(q), down(*tilt), draw)


def test_a_millimetre_does_not_turn_a_tip_into_a_hold() -> None:
    """Stretched forward PackBot is 18 deg past tipping, with `rear_left` 1.5 mm lower too."""
    names = [contact.name for contact in packbot().contacts]
    lower = moved(packbot(), names.index('rear_left'), 2, -0.0015)
    q = np.array(POSTURES['flippers forward'])
    found = np.degrees([least_alone(robot, q, np.array(DOWN)) for robot in (packbot(), lower)])
    np.testing.assert_allclose(found, -18.0, atol=0.2)


@pytest.mark.parametrize('flippers', [-9.0, -8.0, -6.0, -4.0, -2.0])
def test_a_robot_that_would_drop_onto_its_flippers_has_tipped(flippers: float) -> None:
    """Its front drops by 6 to 12 deg before they hold it: that is no margin."""
    q = np.array((0.0, 0.0, 0.0, np.radians(flippers)))
    assert least_alone(packbot(), q, np.array(DOWN)) < 0.0


@pytest.mark.parametrize('ground', [-0.1, 0.03, 0.07])
def test_a_wrong_height_of_the_ground_makes_no_flipper_a_foot(ground: float) -> None:
    """At full reach forward PackBot is 18 deg past tipping, wherever the ground is said to be."""
    robot = replace(load().settings.robot, ground=ground)
    found = least(robot, np.zeros((1, 4)), np.array([[0.0, 0.0, -9.81]]))
    assert float(np.degrees(found[0])) == pytest.approx(-18.0, abs=0.1)
