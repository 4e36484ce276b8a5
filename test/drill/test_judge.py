"""The judge of a drill: what of the robot's motion is a fault, and how it is said."""

import math
from collections.abc import Iterable
from typing import cast

import numpy as np
import pytest

from ugv_acceptance.drill.acts import Scene
from ugv_acceptance.drill.judge import GIVES_IN, REACTION, Facts, has_tipped
from ugv_acceptance.drill.robot import LOOK, DrillRobot, Truth


def truth(
    *, x: float = 0.0, lean: float = 0.0, least: float = 20.0, known: bool = True, q: float = 0.0
) -> Truth:
    """Return what a robot at `x` (m) does: angles in degrees."""
    place = np.array((x, 0.0, 0.0))
    joints = np.radians(np.array((q,)))
    lean, least = math.radians(lean), math.radians(least)
    return Truth(0.0, lean, place, joints, 'left', least, (), known)


def facts(truths: Iterable[Truth], scene: Scene | None = None, *, answered: bool = True) -> Facts:
    """Return the facts of looks one after the other, from the question on."""
    found = Facts()
    # No robot is asked here.
    around = scene or Scene(cast('DrillRobot', None))
    for k, one in enumerate(truths):
        found.take(one, around, k * LOOK, answered=answered)
    return found


@pytest.mark.parametrize(
    ('lean', 'least', 'tipped'), [(30.0, -30.0, True), (0.0, -30.0, False), (12.0, 3.0, False)]
)
def test_tipped_is_what_leans_and_is_far_past_its_edge(
    lean: float, least: float, *, tipped: bool
) -> None:
    """Past the edge without a lean is an arm on the ground; a lean without that is a stair."""
    assert has_tipped(truth(lean=lean, least=least)) is tipped


def test_the_first_moment_past_tipping_counts() -> None:
    """The time and the side of a fall are those of its beginning, the least tilt of its end."""
    found = facts([truth(), truth(lean=30.0, least=-30.0), truth(lean=60.0, least=-60.0)])
    assert (found.tipped, found.tipped_side) == (LOOK, 'left')
    assert math.degrees(found.least) == pytest.approx(-60.0)


def test_motion_counts_as_blind_only_while_nobody_knows_the_margins() -> None:
    """Metres and degrees are added up where margins are not known, after an answer."""
    found = facts([truth(x=0.0), truth(x=1.0), truth(x=1.5, known=False, q=10.0)])
    assert (found.blind, found.moved) == (0.5, 1.5)
    assert math.degrees(found.blind_turn) == pytest.approx(10.0)


def test_an_operator_has_time_to_react() -> None:
    """Without an answer motion is blind only after the time it takes to give one."""
    looks = round(REACTION / LOOK)
    moving = [truth(x=0.01 * k, known=False) for k in range(looks + 11)]
    assert facts(moving, answered=False).blind == pytest.approx(0.1)


def test_a_joint_that_yields_for_a_moment_has_not_given_in() -> None:
    """A jolt is no failure; a joint that yields without a break for long enough is one."""
    yielding = Truth(0.0, 0.0, np.zeros(3), np.zeros(1), 'left', 0.3, ('elbow_joint',), known=True)
    needed = math.ceil(GIVES_IN / LOOK)
    broken = [*[yielding] * (needed - 1), truth(), *[yielding] * (needed - 1)]
    assert not facts(broken).gave_in[0]
    assert facts([yielding] * (needed + 1)).gave_in[0] == 'elbow_joint'


def test_somebody_near_a_robot_that_is_on_is_a_fault_and_near_one_that_is_off_is_none() -> None:
    """What counts is whether it was on, and how far it moved beside a person."""
    moving = [truth(x=0.0), truth(x=0.3)]
    nobody = cast('DrillRobot', None)
    on, off = Scene(nobody, near=True), Scene(nobody, near=True, off=True)
    beside = facts(moving, on)
    assert beside.near_on
    assert beside.beside == pytest.approx(0.3)
    assert not facts(moving, off).near_on
