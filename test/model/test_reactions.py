"""Joints that carry the robot: balance, the even spread and the interval, against other methods."""

import math
from dataclasses import replace

import numpy as np
import pytest
from robots import DOWN, tracked
from scipy.optimize import linprog, nnls

from ugv_acceptance.model.mechanics import Mechanics, Posture, mechanics_of, posture_of
from ugv_acceptance.model.reactions import (
    carrying_joints,
    loads_of,
    reactions_of,
    standing_torque,
)
from ugv_acceptance.model.robot import Contact, Joint, Law, Link, Mimic, Payload, Robot
from ugv_acceptance.model.statics import inverse_dynamics, static_torque, torque_of
from ugv_acceptance.type_aliases import Floats

Gravity = tuple[float, float, float]


def legged(legs: int, seed: int) -> tuple[Robot, Floats]:
    """Return a robot with so many legs of two joints in random directions, and a posture."""
    rng = np.random.default_rng(seed)
    links = [Link('base', 20.0, (0.0, 0.0, 0.1))]
    joints, names, contacts = [], [], []
    for k in range(legs):
        angle = 2.0 * math.pi * (k + rng.uniform(-0.3, 0.3)) / legs
        x, y = 0.4 * math.cos(angle), 0.3 * math.sin(angle)
        for part, parent, at in (
            ('hip', 'base', (x, y, 0.0)),
            ('knee', f'hip{k}', (0.1, 0.0, -0.3)),
        ):
            axis = rng.normal(size=3)
            axis /= np.linalg.norm(axis)
            name = f'{part}{k}'
            links.append(Link(name, rng.uniform(0.2, 2.0), (0.05, 0.0, -0.1)))
            joints.append(Joint(name, 'revolute', parent, name, at, axis=tuple(axis.tolist())))
            names.append(name)
        contacts.append(Contact(f'foot{k}', f'knee{k}', (0.0, 0.0, -0.35)))
    robot = Robot('legged', tuple(links), tuple(joints), tuple(names), tuple(contacts))
    return robot, rng.uniform(-0.15, 0.15, len(names))


def put(robot: Robot, q: Floats) -> tuple[Mechanics, Posture]:
    """Return a robot's mechanics and its posture."""
    load = robot.payload
    return mechanics_of(robot), posture_of(mechanics_of(robot), q.tolist(), load.mass, load.cog)


def leaning(roll: float, pitch: float) -> Gravity:
    """Return gravity (m/s2) of a robot that leans by two small angles (rad)."""
    x, y, z = math.sin(pitch), -math.sin(roll), -1.0
    size = 9.81 / math.hypot(x, y, z)
    return (size * x, size * y, size * z)


def points_of(robot: Robot, q: Floats) -> Floats:
    """Return the contact points (c, 3) of a posture (m)."""
    return np.array(put(robot, q)[1].contacts, dtype=np.float64)


def balance(robot: Robot, q: Floats, gravity: Gravity) -> tuple[Floats, Floats, Floats]:
    """Return A and b of A w = b (kg carried by each contact), and the torque per kg (j, c).

    From the positions of the points and how they move with the joints: no Jacobian of the model.
    """
    _, posture = put(robot, q)
    down = np.array(gravity) / math.hypot(*gravity)
    points = points_of(robot, q) - np.array(posture.cog, dtype=np.float64)
    across = np.linalg.svd(down[None])[2][1:]
    system = np.vstack((np.ones(len(points)), across @ points.T))
    step, effect = 1e-6, []
    for j in range(len(q)):
        moved = step * np.eye(len(q))[j]
        way = (points_of(robot, q + moved) - points_of(robot, q - moved)) / (2.0 * step)
        effect.append(way @ np.array(gravity))
    return system, np.array([posture.mass, 0.0, 0.0]), np.array(effect)


# Legs and seed of robots that stand; on three legs not all do.
CASES = [(legs, seed) for legs in (3, 4, 5, 6, 8) for seed in range(3)]


@pytest.mark.parametrize(('legs', 'seed'), CASES)
def test_the_interval_is_what_all_loads_that_balance_can_do(legs: int, seed: int) -> None:
    """Its ends are the least and the largest torque of a linear program over all such loads."""
    robot, q = legged(legs, seed)
    gravity = leaning(0.02 * seed, -0.015 * seed)
    mechanics, posture = put(robot, q)
    found = reactions_of(mechanics, posture, tuple(range(legs)), gravity)
    system, weight, effect = balance(robot, q, gravity)
    assert found.carrying == tuple(range(len(q)))
    for joint in found.carrying:
        ends = []
        for sign in (1.0, -1.0):
            best = linprog(sign * effect[joint], A_eq=system, b_eq=weight, bounds=(0, None))
            assert (best.status, best.fun is None) == (0, False)
            ends.append(found.hanging[joint] + sign * float(best.fun or 0.0))
        # The torque a kg takes off is minus the work of gravity on the point it presses on.
        low, high = sorted(ends)
        assert found.least[joint] == pytest.approx(low, abs=2e-5)
        assert found.most[joint] == pytest.approx(high, abs=2e-5)
        assert found.least[joint] <= found.even[joint] <= found.most[joint]


@pytest.mark.parametrize(('legs', 'seed'), CASES)
def test_the_even_spread_has_the_least_sum_of_squares(legs: int, seed: int) -> None:
    """Of all loads that balance, none pulling, it is what a least-squares solver finds."""
    robot, q = legged(legs, seed)
    gravity = leaning(0.02 * seed, -0.015 * seed)
    mechanics, posture = put(robot, q)
    loads = np.array(loads_of(posture, tuple(range(legs)), gravity))
    system, weight, effect = balance(robot, q, gravity)
    np.testing.assert_allclose(system @ loads, weight, atol=1e-9)
    assert (loads >= 0.0).all()
    stiff = np.vstack((1e4 * system, np.eye(legs)))
    expected, _ = nnls(stiff, np.concatenate((1e4 * weight, np.zeros(legs))))
    np.testing.assert_allclose(loads, expected, atol=1e-4)
    even = np.array(reactions_of(mechanics, posture, tuple(range(legs)), gravity).even)
    hanging = np.array(torque_of(posture, gravity))
    np.testing.assert_allclose(even, hanging + effect @ loads, atol=1e-5)


def test_many_samples_at_once_have_the_torques_of_each() -> None:
    """Arrays give what floats give, also past the tipping point and upside down."""
    robot, _ = legged(4, 9)
    mechanics, points = mechanics_of(robot), (0, 1, 2, 3)
    rng = np.random.default_rng(3)
    q = rng.uniform(-0.6, 0.6, (120, len(robot.joint_names)))
    gravity = np.array([leaning(*rng.uniform(-1.2, 1.2, 2)) for _ in q])
    gravity[::20, 2] *= -1.0
    posture = posture_of(mechanics, list(q.T), 0.0, (0.0, 0.0, 0.0))
    x, y, z = gravity.T
    many = reactions_of(mechanics, posture, points, (x, y, z))
    for k in range(len(q)):
        one = posture_of(mechanics, q[k].tolist(), 0.0, (0.0, 0.0, 0.0))
        a, b, c = gravity[k].tolist()
        alone = reactions_of(mechanics, one, points, (a, b, c))
        for part in ('hanging', 'even', 'least', 'most'):
            of_many = [np.broadcast_to(v, len(q))[k] for v in getattr(many, part)]
            np.testing.assert_allclose(of_many, getattr(alone, part), rtol=1e-6, atol=1e-6)


def test_a_joint_whose_points_are_in_the_air_carries_nothing() -> None:
    """Raised flippers cost one look into a table: the hanging torques come back as they are."""
    robot = tracked()
    mechanics, posture = put(robot, np.zeros(4))
    hanging = torque_of(posture, DOWN)
    assert standing_torque(mechanics, posture, (0, 1, 2, 3), DOWN, hanging) is hanging
    assert carrying_joints(mechanics, (0, 1, 2, 3)) == ()
    assert carrying_joints(mechanics, (2, 3, 4, 5)) == (3,)


def test_a_flipper_pressed_down_carries_what_the_lever_says() -> None:
    """On two tips and two tracks the flippers carry their share of the weight, at their lever."""
    robot = tracked()
    q = np.array([0.0, 0.0, 0.0, -0.7])
    mechanics, posture = put(robot, q)
    found = reactions_of(mechanics, posture, (2, 3, 4, 5), DOWN)
    (cx, _, _), mass = posture.cog, posture.mass
    rear, tip = posture.contacts[2][0], posture.contacts[4][0]
    share = (cx - rear) / (tip - rear)
    carried = -mass * 9.81 * share * (tip - 0.239)
    assert found.even[3] == pytest.approx(found.hanging[3] + carried, abs=1e-9)
    # The robot is symmetric but for its load, so left and right together are settled.
    assert found.least[3] == pytest.approx(found.most[3], abs=1e-9)
    assert found.even[:3] == found.hanging[:3]


def test_past_the_tipping_point_the_edge_carries_all() -> None:
    """The torque goes on from what it was on the edge; it is neither unknown nor of hanging."""
    robot, q = legged(4, 9)
    mechanics, posture = put(robot, q)
    points = (0, 1, 2, 3)
    for lean in np.linspace(0.6, 1.2, 7).tolist():
        loads = np.array(loads_of(posture, points, leaning(lean, 0.0)))
        assert loads.sum() == pytest.approx(posture.mass)
        assert (loads > 1e-6).sum() <= 3
    lean = np.linspace(0.0, 1.2, 2000)
    gravity = (0.0 * lean, -9.81 * np.sin(lean), -9.81 * np.cos(lean))
    steps = np.array(reactions_of(mechanics, posture, points, gravity).even)
    assert np.abs(np.diff(steps, axis=1)).max() < 1.0


def test_many_points_are_no_harder_than_few() -> None:
    """Twenty points on one plate balance as the plate does, and the even spread is found."""
    angles = np.linspace(0.0, 2.0 * math.pi, 20, endpoint=False)
    contacts = [
        Contact(f'c{k}', 'plate', (0.3 * math.cos(a), 0.2 * math.sin(a), 0.0))
        for k, a in enumerate(angles.tolist())
    ]
    links = (Link('base', 10.0, (0.25, 0.0, 0.5)), Link('plate', 1.0))
    joint = Joint('j', 'revolute', 'base', 'plate', axis=(0.0, 1.0, 0.0))
    robot = Robot('r', links, (joint,), ('j',), tuple(contacts))
    mechanics, posture = put(robot, np.zeros(1))
    found = reactions_of(mechanics, posture, tuple(range(20)), DOWN)
    # The plate is all that stands: the joint holds the body's weight on it, whoever carries it.
    assert found.even[0] == pytest.approx(10.0 * 9.81 * 0.25)
    assert found.least[0] == pytest.approx(found.most[0])


def mimicking() -> Robot:
    """Return an arm whose second joint turns 1.5 times as far as the first, and 0.2 rad more."""
    links = (
        Link('base', 10.0),
        Link('one', 2.0, (0.2, 0.03, 0.0), ((0.02, 0, 0), (0, 0.03, 0), (0, 0, 0.01))),
        Link('two', 1.0, (0.1, 0.0, 0.05), ((0.01, 0, 0), (0, 0.02, 0), (0, 0, 0.02))),
    )
    joints = (
        Joint('first', 'revolute', 'base', 'one', (0.0, 0.0, 0.3), axis=(0.0, -1.0, 0.0)),
        Joint('second', 'revolute', 'one', 'two', (0.4, 0.0, 0.0), axis=(0.0, 0.6, 0.8)),
    )
    follows = (Mimic('second', 'first', 1.5, 0.2),)
    return Robot(
        'm', links, joints, ('first',), payload_link='two', payload=Payload(3.0), mimics=follows
    )


def test_a_mimic_joint_loads_the_joint_that_it_follows() -> None:
    """The torque is what the potential energy of both links and the load says."""
    robot = mimicking()
    gravity = np.array((1.0, 2.0, -9.0))

    def energy(angle: float) -> float:
        _, posture = put(robot, np.array([angle]))
        return float(-posture.mass * gravity @ np.array(posture.cog))

    for angle in (-0.7, 0.0, 1.1):
        slope = (energy(angle + 1e-5) - energy(angle - 1e-5)) / 2e-5
        assert static_torque(robot, [angle], gravity)[0] == pytest.approx(slope, abs=1e-6)


def test_a_mimic_joint_moves_by_its_law_in_every_formula() -> None:
    """Both joints measured and told by the law give the same: at rest and in motion."""
    robot = mimicking()
    free = replace(robot, joint_names=('first', 'second'), mimics=())
    gravity = (1.0, 2.0, -9.0)
    q, qd, qdd = 0.4, 0.9, -2.0
    both = np.array([[q, 1.5 * q + 0.2], [qd, 1.5 * qd], [qdd, 1.5 * qdd]])
    apart = inverse_dynamics(free, both[0], both[1], both[2], gravity)
    one = inverse_dynamics(robot, [q], [qd], [qdd], gravity)
    assert one[0] == pytest.approx(apart[0] + 1.5 * apart[1], abs=1e-12)
    assert put(robot, np.array([q]))[1].cog == pytest.approx(put(free, both[0])[1].cog)


def test_a_spring_takes_its_part_off_the_motor() -> None:
    """A constant torque and a spring are what the motor need not hold, at rest and in motion."""
    robot = mimicking()
    sprung = replace(robot, laws=(Law('first', 5.0, 12.0, 0.3),))
    for q in (-0.5, 0.0, 0.8):
        spring = 5.0 - 12.0 * (q - 0.3)
        plain, less = static_torque(robot, [q], DOWN), static_torque(sprung, [q], DOWN)
        assert less[0] == pytest.approx(plain[0] - spring)
        still = inverse_dynamics(sprung, [q], [0.0], [0.0], DOWN)
        assert still[0] == pytest.approx(less[0])
