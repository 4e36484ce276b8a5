"""What a motion is called: by what it does to the robot, not by how its description is written."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as effort
from hypothesis import strategies as st
from robots import DOWN, random_robot, tracked
from scipy.spatial.transform import Rotation

from ugv_acceptance.evaluation.advice.paths import Path
from ugv_acceptance.evaluation.advice.search import advise
from ugv_acceptance.evaluation.advice.words import joint_words
from ugv_acceptance.evaluation.settings import Delays, ImuInput, JointInput, Limits, Settings
from ugv_acceptance.model.robot import Contact, Joint, Link, Matrix, Mimic, Payload, Robot
from ugv_acceptance.type_aliases import Floats

UP, LEFT, LIFT = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)


def said(robot: Robot, joint: str, amount: float, q: list[float], mass: float = 1.0) -> str:
    """Return the words for a joint moved by an amount (deg, m) from a posture (deg, m)."""
    slides = [robot.joint(name).slides for name in robot.joint_names]
    scale = np.where(slides, 1.0, math.pi / 180.0)
    j = robot.joint_names.index(joint)
    move = amount * scale[j]
    end = (np.array(q) * scale + np.eye(len(q))[j] * move)[np.newaxis]
    one = np.array([abs(move)])
    path = Path(joint, end, np.array([DOWN]), np.array([move]), one, np.array([False]))
    return joint_words(robot, path, 0, Payload(mass, robot.payload.cog))


def crane() -> Robot:
    """Return a turret with an arm of two links of half a metre, straight forward at zero."""
    links = [Link('base', 30.0), Link('a'), *(Link(n, 2.0, (0.25, 0.0, 0.0)) for n in 'bc')]
    joints = (
        Joint('turret', 'continuous', 'base', 'a', (0.0, 0.0, 0.3), axis=UP),
        Joint('shoulder', 'revolute', 'a', 'b', axis=LIFT),
        Joint('elbow_joint', 'revolute', 'b', 'c', (0.5, 0.0, 0.0), axis=LIFT),
        Joint('wrist', 'continuous', 'c', 'hand', (0.5, 0.0, 0.0)),
    )
    names = tuple(j.name for j in joints)
    links.append(Link('hand', 0.5, (0.1, 0.0, 0.0)))
    return Robot('crane', tuple(links), joints, names, payload_link='hand')


@pytest.mark.parametrize(
    ('q', 'joint', 'amount', 'words'),
    [
        # The arm level and straight: forward, left, back.
        ((0, 0, 0), 'elbow_joint', 20, 'raise the elbow by 20 deg'),
        ((0, 0, 0), 'elbow_joint', -20, 'lower the elbow by 20 deg'),
        ((90, 0, 0), 'elbow_joint', 20, 'raise the elbow by 20 deg'),
        ((180, 0, 0), 'shoulder', -20, 'lower the shoulder by 20 deg'),
        ((0, 0, 0), 'turret', 30, 'turn the turret by 30 deg to the left'),
        ((0, 0, 0), 'turret', -30, 'turn the turret by 30 deg to the right'),
        ((180, 0, 0), 'turret', 30, 'turn the turret by 30 deg to the left'),
        ((40, 80, -90), 'turret', -170, 'turn the turret by 170 deg to the right'),
        # Upright, it goes to where it leans.
        ((0, 90, 0), 'elbow_joint', -20, 'swing the elbow by 20 deg forward'),
        ((0, 90, 0), 'elbow_joint', 20, 'swing the elbow by 20 deg back'),
        ((90, 90, 0), 'elbow_joint', -20, 'swing the elbow by 20 deg to the left'),
        ((90, 90, 0), 'elbow_joint', 20, 'swing the elbow by 20 deg to the right'),
        ((180, 90, 0), 'elbow_joint', 20, 'swing the elbow by 20 deg forward'),
        ((-90, 80, 0), 'shoulder', 20, 'swing the shoulder by 20 deg to the left'),
        # Over the top by the same angle on both sides.
        ((0, 45, 0), 'shoulder', 90, 'swing the shoulder by 90 deg back'),
        # The upper arm 60 degrees up, the forearm hanging straight down: out, and in.
        ((0, 60, -160), 'elbow_joint', 20, 'extend the elbow by 20 deg'),
        ((0, 60, -140), 'elbow_joint', -20, 'fold the elbow by 20 deg'),
        ((90, 60, -160), 'elbow_joint', 20, 'extend the elbow by 20 deg'),
        ((123, 60, -140), 'elbow_joint', -20, 'fold the elbow by 20 deg'),
        # Folded back over the robot, the forearm comes down on to it.
        ((0, 90, 90), 'elbow_joint', 30, 'lower the elbow by 30 deg'),
        # Nothing is off the axis of the wrist.
        ((0, 0, 0), 'wrist', 30, 'turn the wrist by 30 deg'),
    ],
)
def test_a_planar_arm_does_what_geometry_says(
    q: tuple[float, ...], joint: str, amount: float, words: str
) -> None:
    """By hand: an arm of two equal links on a turret, wherever the turret points."""
    assert said(crane(), joint, amount, [*q, 0.0]) == words


def scara() -> Robot:
    """Return an arm of two level links of half a metre about upright axes."""
    links = (Link('base', 30.0), *(Link(n, 2.0, (0.25, 0.0, 0.0)) for n in 'bc'))
    joints = (
        Joint('shoulder', 'revolute', 'base', 'b', (0.0, 0.0, 0.3), axis=UP),
        Joint('elbow', 'revolute', 'b', 'c', (0.5, 0.0, 0.0), axis=UP),
    )
    return Robot('scara', links, joints, ('shoulder', 'elbow'))


@pytest.mark.parametrize(
    ('q', 'amount', 'words'),
    [
        ((0, -10), 20, 'swing the elbow by 20 deg to the left'),
        ((0, 10), -20, 'swing the elbow by 20 deg to the right'),
        # Its hand, not its axis: the forearm points back, so that it goes to the right.
        ((0, 170), 20, 'swing the elbow by 20 deg to the right'),
        ((0, 100), 20, 'fold the elbow by 20 deg'),
        ((0, 120), -20, 'extend the elbow by 20 deg'),
    ],
)
def test_an_upright_elbow_swings_extends_and_folds(
    q: tuple[float, ...], amount: float, words: str
) -> None:
    """Beyond the joint on the base it counts where the forearm goes."""
    assert said(scara(), 'elbow', amount, list(q)) == words
    turned = 'turn the shoulder by 20 deg to the left'
    assert said(scara(), 'shoulder', 20, list(q)) == turned


def sliding(axis: tuple[float, float, float], *, arm: bool) -> Robot:
    """Return a robot with a slide of this axis: on its base, or at the end of an arm."""
    links = (Link('base', 30.0), Link('b', 2.0, (0.25, 0.0, 0.0)), Link('c', 2.0))
    parent, at = ('b', (0.5, 0.0, 0.0)) if arm else ('base', (0.0, 0.0, 0.5))
    lift = Joint('lift', 'revolute', 'base', 'b', (0.0, 0.0, 0.3), axis=LIFT)
    slide = Joint('boom_joint', 'prismatic', parent, 'c', at, axis=axis)
    return Robot('sliding', links, (lift, slide), ('lift', 'boom_joint'))


@pytest.mark.parametrize(
    ('axis', 'arm', 'lift', 'words'),
    [
        (UP, False, 0, 'raise the boom by 12 cm'),
        ((0.0, 0.0, -1.0), False, 0, 'lower the boom by 12 cm'),
        ((1.0, 0.0, 0.0), False, 0, 'slide the boom by 12 cm forward'),
        (LIFT, False, 0, 'slide the boom by 12 cm to the right'),
        ((1.0, 0.0, 0.0), True, 0, 'extend the boom by 12 cm'),
        ((1.0, 0.0, 0.0), True, 80, 'extend the boom by 12 cm'),
        ((-1.0, 0.0, 0.0), True, 80, 'retract the boom by 12 cm'),
        (LEFT, True, 80, 'slide the boom by 12 cm to the left'),
        (UP, True, 0, 'raise the boom by 12 cm'),
    ],
)
def test_what_slides_is_raised_extended_or_slid(
    axis: tuple[float, float, float], *, arm: bool, lift: float, words: str
) -> None:
    """A mast goes up, a boom out, a cross slide to a side; the other way the opposite is said."""
    robot = sliding(axis, arm=arm)
    assert said(robot, 'boom_joint', 0.12, [lift, 0.3]) == words
    back = said(robot, 'boom_joint', -0.12, [lift, 0.3])
    assert back != words
    assert back.split(' by ')[1].startswith('12 cm')


@pytest.mark.parametrize(
    ('at', 'amount', 'words'),
    [(0, 20, 'raise'), (0, -20, 'lower'), (80, 20, 'swing'), (180, 20, 'lower')],
)
@pytest.mark.parametrize('weighs', [True, False])
def test_flippers_are_raised_and_lowered(
    at: float, amount: float, words: str, *, weighs: bool
) -> None:
    """In front of their joint or behind it; without a mass their contact points count."""
    robot = tracked()
    if not weighs:
        links = tuple(replace(k, mass=0.0) if k.name == 'flippers' else k for k in robot.links)
        robot = replace(robot, links=links)
    q = [0.0, 0.0, 0.0, at + 5.0]
    assert said(robot, 'flippers', amount, q).startswith(f'{words} the flippers by 20 deg')


def panda() -> Robot:
    """Return an arm with the axes of a Panda's first four joints: each about z of its frame."""
    half = math.pi / 2.0
    rows = (
        ('joint1', (0.0, 0.0, 0.333), 0.0),
        ('joint2', (0.0, 0.0, 0.0), -half),
        ('joint3', (0.0, -0.316, 0.0), half),
        ('joint4', (0.0825, 0.0, 0.0), half),
    )
    links = [Link('base', 30.0), *(Link(f'link{k}', 0.1) for k in (1, 2, 3))]
    # The forearm and the hand, 0.4 m along -y of the turned frame.
    links.append(Link('link4', 3.0, (-0.0825, 0.4, 0.0)))
    joints, parent = [], 'base'
    for k, (name, xyz, roll) in enumerate(rows, 1):
        turn = matrix_of(Rotation.from_euler('x', roll))
        joints.append(Joint(name, 'revolute', parent, f'link{k}', xyz, turn, UP))
        parent = f'link{k}'
    return Robot('panda', tuple(links), tuple(joints), tuple(j.name for j in joints))


@pytest.mark.parametrize(
    ('q', 'joint', 'amount', 'words'),
    [
        ((0, 0, 0, -90), 'joint1', 20, 'turn the joint1 by 20 deg to the left'),
        ((0, 60, 0, -90), 'joint2', 20, 'lower the joint2 by 20 deg'),
        ((0, 0, 0, 0), 'joint2', 20, 'swing the joint2 by 20 deg forward'),
        ((90, 0, 0, 0), 'joint2', -20, 'swing the joint2 by 20 deg to the right'),
        ((0, 0, 0, -90), 'joint4', 20, 'raise the joint4 by 20 deg'),
        ((0, 0, 0, -90), 'joint3', 20, 'swing the joint3 by 20 deg to the left'),
    ],
)
def test_an_arm_whose_axes_are_all_z_is_told_as_any_other(
    q: tuple[float, ...], joint: str, amount: float, words: str
) -> None:
    """A lift written about z of a turned frame is raised and lowered, never turned to a side."""
    assert said(panda(), joint, amount, list(q)) == words


def matrix_of(rotation: Rotation) -> Matrix:
    """Return a rotation as the model takes it."""
    a, b, c = rotation.as_matrix().tolist()
    return tuple(a), tuple(b), tuple(c)


def rewritten(
    robot: Robot, rng: np.random.Generator, names: dict[str, str], slip: float = 0.0
) -> tuple[Robot, Floats]:
    """Return the same robot written otherwise, and the sign of each joint's position.

    The frame of every child link is turned at random and shifted along its joint's axis by up to
    `slip` (m), axes are flipped with their ranges, and joints are renamed.
    """
    turns = {joint.child: Rotation.random(random_state=rng) for joint in robot.joints}
    shift = {joint.child: np.array(joint.axis) * rng.uniform(-slip, slip) for joint in robot.joints}
    signs = {joint.name: float(rng.choice([-1.0, 1.0])) for joint in robot.joints}

    def place(link: str, xyz: tuple[float, ...]) -> tuple[float, float, float]:
        x, y, z = np.array(xyz, dtype=np.float64)
        if link in turns:
            x, y, z = turns[link].inv().apply(np.array((x, y, z)) - shift[link])
        return float(x), float(y), float(z)

    def around(link: str, rotation: Matrix) -> Rotation:
        found = Rotation.from_matrix(rotation)
        return turns[link].inv() * found if link in turns else found

    joints = []
    for joint in robot.joints:
        own = Rotation.from_matrix(joint.rotation)
        at = np.array(joint.xyz) + own.apply(shift[joint.child])
        sign = signs[joint.name]
        x, y, z = (sign * turns[joint.child].inv().apply(np.array(joint.axis))).tolist()
        low, high = (joint.lower, joint.upper) if sign > 0.0 else (-joint.upper, -joint.lower)
        turn = matrix_of(around(joint.parent, matrix_of(own * turns[joint.child])))
        joints.append(
            replace(
                joint,
                name=names[joint.name],
                xyz=place(joint.parent, tuple(at)),
                rotation=turn,
                axis=(x, y, z),
                lower=low,
                upper=high,
            )
        )
    links = tuple(
        replace(
            link,
            cog=place(link.name, link.cog),
            inertia=_turned(turns.get(link.name), link.inertia),
        )
        for link in robot.links
    )
    contacts = tuple(replace(c, position=place(c.link, c.position)) for c in robot.contacts)
    load = robot.payload
    if robot.payload_link is not None:
        load = replace(load, cog=place(robot.payload_link, load.cog))
    order = tuple(names[name] for name in robot.joint_names)
    held = tuple((names[n], signs[n] * x) for n, x in robot.held)
    other = replace(
        robot, links=links, joints=tuple(joints), joint_names=order, contacts=contacts,
        payload=load, held=held,
    )  # fmt: skip
    return other, np.array([signs[name] for name in robot.joint_names])


def _turned(turn: Rotation | None, inertia: Matrix) -> Matrix:
    if turn is None:
        return inertia
    back = turn.inv().as_matrix()
    a, b, c = (back @ np.array(inertia) @ back.T).tolist()
    return tuple(a), tuple(b), tuple(c)


def told(robot: Robot, q: Floats, down: Floats, payload: Payload) -> list[str]:
    """Return the sentences of advice for every margin that is below its warning limit."""
    names = robot.joint_names
    limits = Limits((8.0,) * len(names), tip_warn=0.9, tip_error=0.2)
    inputs = tuple(JointInput(name) for name in names)
    settings = Settings(robot, inputs, ImuInput(), limits, Delays())
    return [
        a.sentence
        for of in (None, *names)
        for a in advise(settings, q.tolist(), down.tolist(), payload, of)
    ]


@effort(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), random=st.booleans())
def test_the_same_robot_written_otherwise_is_told_the_same(seed: int, *, random: bool) -> None:
    """Turned frames, flipped axes and other names change no sentence of the search."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 4) if random else tracked()
    q = rng.uniform(-1.5, 1.5, len(robot.joint_names))
    lean = rng.uniform(-0.2, 0.2, 2)
    down = np.array((*(9.81 * lean), -9.6))
    names = {joint.name: f'n{k}' for k, joint in enumerate(robot.joints)}
    other, signs = rewritten(robot, rng, names)
    here = told(robot, q, down, robot.payload)
    there = told(other, signs * q, down, other.payload)
    assert sorted(renamed(there, names)) == sorted(here)


def renamed(sentences: list[str], names: dict[str, str]) -> list[str]:
    """Return sentences with the joints' old names."""
    back = {new: old.removesuffix('_joint') for old, new in names.items()}
    return [re.sub(r'\bn\d+\b', lambda m: back[m[0]], sentence) for sentence in sentences]


@effort(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_motion_has_one_name_however_its_joint_is_written(seed: int) -> None:
    """The origin of a joint may be anywhere on its axis as well."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 4)
    names = {joint.name: f'n{k}' for k, joint in enumerate(robot.joints)}
    other, signs = rewritten(robot, rng, names, slip=0.5)
    q = rng.uniform(-90.0, 90.0, len(signs))
    q[[robot.joint(n).slides for n in robot.joint_names]] /= 90.0
    for j, name in enumerate(robot.joint_names):
        amount = float(rng.uniform(0.2, 1.0)) * (1.0 if robot.joint(name).slides else 60.0)
        here = said(robot, name, amount, q.tolist())
        there = said(other, names[name], float(signs[j]) * amount, (signs * q).tolist())
        assert renamed([there], names) == [here]


def test_a_joint_that_moves_with_another_counts_with_it() -> None:
    """A shoulder that straightens the elbow as it rises sends the hand straight forward."""
    robot, q = crane(), [0.0, -70.0, 0.0]
    names = ('turret', 'shoulder', 'wrist')
    both = replace(robot, joint_names=names, mimics=(Mimic('elbow_joint', 'shoulder', -2.0),))
    assert said(both, 'shoulder', 20, q) == 'swing the shoulder by 20 deg forward'
    held = replace(robot, joint_names=names, held=(('elbow_joint', math.radians(140.0)),))
    assert said(held, 'shoulder', 20, [0.0, -10.0, 0.0]) == 'raise the shoulder by 20 deg'


def test_contacts_stand_for_flippers_without_mass() -> None:
    """The contact points of a joint without any mass say where it goes."""
    links = (Link('base', 30.0), Link('leg'))
    joint = Joint('leg', 'revolute', 'base', 'leg', axis=LEFT)
    feet = (Contact('toe', 'leg', (0.3, 0.0, 0.0)),)
    robot = Robot('leg', links, (joint,), ('leg',), feet)
    assert said(robot, 'leg', 20, [0]) == 'lower the leg by 20 deg'
