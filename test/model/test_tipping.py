"""The margins of a robot that moves: held to a pendulum that is integrated, and to closed forms."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.chassis.motion import MATTERS, run_tipping, stance_kernel, turn_bound
from ugv_acceptance.model.edges import corners_of
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Joint, Link, Robot
from ugv_acceptance.model.stability import SIDES, stances_of, tip_angles_of
from ugv_acceptance.model.tipping import inertia_of, tipping_of

MASS, HEIGHT, HALF, WIDE, INERTIA = 20.0, 0.3, 0.25, 0.2, (1.0, 1.5, 2.0)
G, IMU = 9.81, (0.05, 0.02, 0.4)
FRONT, LEFT, REAR = (SIDES.index(side) for side in ('front', 'left', 'rear'))


def box(inertia: tuple[float, float, float] = INERTIA) -> Robot:
    """Return a box on four points, with an arm that weighs nothing."""
    xx, yy, zz = inertia
    links = (
        Link('base', MASS, (0.0, 0.0, HEIGHT), ((xx, 0.0, 0.0), (0.0, yy, 0.0), (0.0, 0.0, zz))),
        Link('arm'),
    )
    feet = ((HALF, WIDE), (HALF, -WIDE), (-HALF, WIDE), (-HALF, -WIDE))
    contacts = tuple(Contact(f'c{k}', 'base', (x, y, 0.0)) for k, (x, y) in enumerate(feet))
    return Robot('box', links, (Joint('j', 'revolute', 'base', 'arm'),), ('j',), contacts)


def margins(
    pitch: float = 0.0,
    push: Sequence[float] = (0.0, 0.0, 0.0),
    omega: Sequence[float] = (0.0, 0.0, 0.0),
    alpha: Sequence[float] = (0.0, 0.0, 0.0),
) -> tuple[tuple[float, ...], ...]:
    """Return the four results for the box, nose down by `pitch` (rad); `push` is what it feels."""
    mechanics = mechanics_of(box())
    (stance,) = stances_of(mechanics, posture_of(mechanics, (0.0,), 0.0, (0.0, 0.0, 0.0)))
    assert stance.footing is not None
    corners = corners_of(mechanics, stance.footing.polygon)
    kernel = tipping_of(mechanics, corners, stance.sides, IMU, rocks=False)
    inertia = inertia_of(mechanics).one(0.0, 0.0, 0.0, 0.0, 0.0)
    gravity = np.array([G * math.sin(pitch), 0.0, -G * math.cos(pitch)])
    felt = (*gravity, *(np.array(push) - gravity), *omega, *alpha)
    return kernel.one(*stance.terms, stance.mass, *inertia, *map(float, felt))


def furthest(angle: float, rate: float) -> float:
    """Return where a rigid body that turns about its front edge comes to rest: the margin left.

    Integrated step by step; minus infinity if it goes over.
    """
    reach2 = HALF**2 + HEIGHT**2
    inertia, pull = INERTIA[1] + MASS * reach2, MASS * G * math.sqrt(reach2)
    left, dt = angle, 1e-5
    while rate > 0.0:
        rate -= pull / inertia * math.sin(left) * dt
        left -= rate * dt
        if left < 0.0:
            return -math.inf
    return left


@pytest.mark.parametrize('pitch', [0.0, 0.3])
@pytest.mark.parametrize('rate', [0.0, 0.5, 1.5, 2.2])
def test_the_energy_of_a_turn_takes_what_the_pendulum_turns(pitch: float, rate: float) -> None:
    """A box that turns about its edge comes to rest at the margin told, or goes over."""
    found = margins(pitch, omega=(0.0, rate, 0.0))[0][FRONT]
    wanted = furthest(math.atan2(HALF, HEIGHT) - pitch, rate)
    assert found == pytest.approx(wanted, abs=2e-4) if wanted > 0.0 else found < 0.0


def test_a_turn_away_from_an_edge_takes_nothing() -> None:
    """Only the rate towards an edge counts for it; a yaw counts for none."""
    still = margins()[0]
    assert margins(omega=(0.0, 1.0, 0.0))[0][REAR] == pytest.approx(still[REAR], abs=1e-12)
    assert margins(omega=(0.0, 0.0, 3.0))[0] == pytest.approx(still, abs=1e-12)
    assert margins(omega=(-1.0, 0.0, 0.0))[0][LEFT] < still[LEFT] - 0.01
    assert margins(omega=(-1.0, 0.0, 0.0))[2][LEFT] == -1.0


@pytest.mark.parametrize('brake', [-6.0, -1.0, 0.0, 2.0, 8.0, 12.0])
def test_a_brake_tilts_effective_gravity(brake: float) -> None:
    """On the ground the margin is the static one less the arctangent of brake over gravity."""
    found = margins(push=(-brake, 0.0, 0.0))[1]
    lean = math.atan2(brake, G)
    assert found[FRONT] == pytest.approx(math.atan2(HALF, HEIGHT) - lean, abs=1e-12)
    assert found[REAR] == pytest.approx(math.atan2(HALF, HEIGHT) + lean, abs=1e-12)


def test_a_body_that_turns_about_its_edge_feels_only_gravity_there() -> None:
    """What the IMU feels of the turn itself is taken off: the edge does not move."""
    rate, turn = 1.3, 4.0
    arm = np.array(IMU) - (HALF, 0.0, 0.0)
    omega, alpha = np.array([0.0, rate, 0.0]), np.array([0.0, turn, 0.0])
    push = np.cross(omega, np.cross(omega, arm)) + np.cross(alpha, arm)
    found = margins(push=push.tolist(), omega=omega.tolist(), alpha=alpha.tolist())[1]
    assert found[FRONT] == pytest.approx(margins()[1][FRONT], abs=1e-12)
    assert abs(margins(push=push.tolist())[1][FRONT] - found[FRONT]) > 0.05


def test_the_frequency_is_that_of_the_pendulum() -> None:
    """The squared natural frequency is M g r over the inertia about the edge."""
    reach2 = HALF**2 + HEIGHT**2
    wanted = MASS * G * math.sqrt(reach2) / (INERTIA[1] + MASS * reach2)
    assert margins()[3][FRONT] == pytest.approx(wanted, rel=1e-12)


# The slowest pendulum that is allowed for: wn^2 just above 2 / s2.
SLOW = (32.0, 32.0, 32.0)


@pytest.mark.parametrize(('inertia', 'most'), [(INERTIA, 0.6), (SLOW, 0.1)])
@given(
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, 2.0 * math.pi),
)
def test_a_rate_up_to_the_bound_takes_no_degree(
    inertia: tuple[float, float, float],
    most: float,
    pitch: float,
    roll: float,
    share: float,
    heading: float,
) -> None:
    """Where the closer look is left out, no margin is a degree less than the tip angle."""
    pitch, roll = most * pitch, most * roll
    mechanics = mechanics_of(box(inertia))
    gravity = (
        G * math.sin(pitch),
        -G * math.sin(roll) * math.cos(pitch),
        -G * math.cos(roll) * math.cos(pitch),
    )
    (stance,) = stances_of(mechanics, posture_of(mechanics, (0.0,), 0.0, (0.0, 0.0, 0.0)))
    angles: Any = tip_angles_of(stance, gravity)[0]
    assume(min(angles) > 0.0)
    rate = share * math.sqrt(turn_bound(min(angles)))
    omega = (rate * math.cos(heading), rate * math.sin(heading), 0.0)
    margin, *_, frequency = run_tipping(
        stance_kernel(mechanics, stance, IMU),
        stance,
        inertia_of(mechanics).one(0.0, 0.0, 0.0, 0.0, 0.0),
        (*gravity, *(-g for g in gravity), *omega, 0.0, 0.0, 0.0),
    )
    assert min(frequency) > 2.0
    assert max(a - m for a, m in zip(angles, margin, strict=True)) <= MATTERS


def test_a_rate_a_little_above_the_bound_may_take_a_degree() -> None:
    """The bound is no smaller than it must be: with half as much again a slow robot loses one."""
    mechanics = mechanics_of(box(SLOW))
    (stance,) = stances_of(mechanics, posture_of(mechanics, (0.0,), 0.0, (0.0, 0.0, 0.0)))
    gravity = (0.0, 0.0, -G)
    angles: Any = tip_angles_of(stance, gravity)[0]
    rate = math.sqrt(1.5 * turn_bound(min(angles)))
    margin, *_ = run_tipping(
        stance_kernel(mechanics, stance, IMU),
        stance,
        inertia_of(mechanics).one(0.0, 0.0, 0.0, 0.0, 0.0),
        (*gravity, *(-g for g in gravity), rate, 0.0, 0.0, 0.0, 0.0, 0.0),
    )
    assert max(a - m for a, m in zip(angles, margin, strict=True)) > MATTERS


def test_a_rate_well_above_the_bound_takes_a_degree() -> None:
    """The bound is not so careful that it is useless: ten times the rate is looked at."""
    rate = 10.0 * math.sqrt(turn_bound(0.3))
    margin, *_ = margins(pitch=math.atan2(HALF, HEIGHT) - 0.3, omega=(0.0, rate, 0.0))
    assert margin[FRONT] < 0.3 - MATTERS
