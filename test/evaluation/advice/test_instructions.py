"""What to do in words: each form of sentence, by a posture whose geometry is plain."""

import math
from dataclasses import replace

import numpy as np
import pytest
from evaluation.streams import settings
from robots import DOWN, tracked

from ugv_acceptance.evaluation.advice.paths import Path
from ugv_acceptance.evaluation.advice.words import joint_words, load_words, turn_words
from ugv_acceptance.model.robot import Payload, Robot


def words(
    robot: Robot, joint: str, amount: float, q: tuple[float, ...], down: tuple[float, ...] = DOWN
) -> str:
    """Return the words for a joint moved by an amount from a posture."""
    end = np.array([q]) + np.eye(len(q))[robot.joint_names.index(joint)] * amount
    one = np.array([abs(amount)])
    path = Path(joint, end, np.array([down]), np.array([amount]), one, np.array([False]))
    return joint_words(robot, path, 0, Payload(1.0))


TWO, TRACKED = settings().robot, tracked()


@pytest.mark.parametrize(
    ('amount', 'said'),
    [(0.123, 'extend the slide by 12 cm'), (-0.2, 'retract the slide by 20 cm')],
)
def test_a_slide_is_extended_and_retracted(amount: float, said: str) -> None:
    """A prismatic joint is advised to extend or retract by centimetres."""
    assert words(TWO, 'slide', amount, (0.0, 0.0)) == said


@pytest.mark.parametrize(
    ('q', 'amount', 'said'),
    [
        (0.0, 0.5, 'raise the lift by 29 deg'),
        (0.0, -0.5, 'lower the lift by 29 deg'),
        (math.pi / 2 - 0.25, 0.5, 'swing the lift by 29 deg back'),
        (math.pi / 2 + 0.25, -0.5, 'swing the lift by 29 deg forward'),
    ],
)
def test_a_lift_is_raised_lowered_or_swung(q: float, amount: float, said: str) -> None:
    """A motion is called raise, lower or swing by where it moves the centre of gravity."""
    assert words(TWO, 'lift', amount, (q, 0.0)) == said


@pytest.mark.parametrize(('q', 'verb'), [(1.1, 'raise'), (1.3, 'swing')])
def test_a_motion_is_up_from_a_share_of_its_way_on(q: float, verb: str) -> None:
    """A small motion from the angle q goes up by cos q of its way: 0.45 is up, 0.27 is not."""
    assert words(TWO, 'lift', 0.01, (q, 0.0)).startswith(verb)


@pytest.mark.parametrize('down', [(9.81, 0.0, 0.0), (3.0, -4.0, -8.4), (0.0, 0.0, 9.81)])
def test_up_is_that_of_the_robot_wherever_it_stands(down: tuple[float, ...]) -> None:
    """On a slope a motion has the name that it has on level ground."""
    assert words(TWO, 'lift', 0.1, (0.0, 0.0), down).startswith('raise')
    assert words(TWO, 'lift', 0.1, (math.pi / 2, 0.0), down).startswith('swing')


@pytest.mark.parametrize(('amount', 'side'), [(0.5, 'left'), (-0.5, 'right')])
def test_a_turret_is_turned(amount: float, side: str) -> None:
    """To the left about z; a turret whose axis points down counts the other way."""
    found = words(TRACKED, 'turret', amount, (0.0,) * 4)
    assert found == f'turn the turret by 29 deg to the {side}'
    joints = tuple(
        replace(j, axis=(0.0, 0.0, -1.0)) if j.name == 'turret' else j for j in TRACKED.joints
    )
    hung = words(replace(TRACKED, joints=joints), 'turret', -amount, (0.0,) * 4)
    assert hung == found


@pytest.mark.parametrize(
    ('downhill', 'faces'),
    [
        (0.0, ', to face downhill'), (29.0, ', to face downhill'), (-29.0, ', to face downhill'),
        (31.0, ''), (-31.0, ''), (149.0, ''), (151.0, ', to face uphill'),
        (-151.0, ', to face uphill'), (180.0, ', to face uphill'),
    ],
)  # fmt: skip
def test_a_turn_says_what_the_robot_faces(downhill: float, faces: str) -> None:
    """A turn names downhill or uphill where the robot ends within 30 degrees of it."""
    x, y = math.cos(math.radians(downhill)), math.sin(math.radians(downhill))
    found = turn_words(-1.0, np.array((x, y, -9.0)))
    assert found == f'turn the robot slowly by 57 deg to the right{faces}'
    assert ' to the left' in turn_words(1.0, np.array((x, y, -9.0)))


def test_a_load_is_set_down_and_how_much_of_it_is_too_much() -> None:
    """Setting down names the excess in kg, unless the posture holds all of the load."""
    assert load_words(4.0, None) == load_words(4.0, 4.0) == 'set the load of 4.0 kg down'
    heavy = 'set the load down: 4.0 kg is 1.5 kg too heavy in this posture'
    assert load_words(4.0, 2.5) == heavy


def test_the_axis_counts_as_it_stands_not_as_its_link_has_it() -> None:
    """A lift about z of a frame that is rolled over lifts, as makers of arms write it."""
    rolled = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    joints = tuple(
        replace(j, rotation=rolled, axis=(0.0, 0.0, -1.0)) if j.name == 'shoulder' else j
        for j in TRACKED.joints
    )
    found = words(replace(TRACKED, joints=joints), 'shoulder', 0.5, (0.0,) * 4)
    assert found.startswith(('raise the shoulder', 'lower the shoulder'))
