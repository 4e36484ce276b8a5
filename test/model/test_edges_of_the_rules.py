"""Where the model's rules begin and end, to the last digit, and links that are rigidly joined."""

import math
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robots import DOWN, at, places, random_robot, tracked

from ugv_acceptance import BadConfig
from ugv_acceptance.model.attitude import is_rotation
from ugv_acceptance.model.blocks import BLOCK, in_blocks
from ugv_acceptance.model.expressions import Scalar
from ugv_acceptance.model.kernels import compile_kernel
from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Contact, Joint, Link, Matrix, Payload, Robot, Vector
from ugv_acceptance.model.row_selection import ALL, groups, inner, pick
from ugv_acceptance.model.stability import (
    FREE_FALL,
    INVERTED,
    RAISED,
    STANDING,
    margins,
    stability,
    stability_of,
    stances_of,
)
from ugv_acceptance.model.statics import (
    gripper_point,
    inverse_dynamics,
    payload_capacity,
    static_torque,
    utilisation,
)
from ugv_acceptance.type_aliases import Floats

FEET: list[Vector] = [(x, y, 0.0) for x in (-0.3, 0.3) for y in (-0.2, 0.2)]


def stool(points: list[Vector], tolerance: float = 0.125) -> Robot:
    """Return a robot of one link."""
    contacts = tuple(Contact(f'p{k}', 'base', p) for k, p in enumerate(points))
    return Robot(
        's', (Link('base', 10.0, (0.0, 0.0, 0.3)),), (), (), contacts, contact_tolerance=tolerance
    )


@pytest.mark.parametrize(
    ('gravity', 'state'),
    [((0.0, 0.0, -1.0), STANDING), ((0.0, 0.0, -0.999), FREE_FALL), ((0.0, 0.8, -0.6), STANDING),
     ((0.0, 0.8, -0.59), FREE_FALL), ((0.0, 0.0, 1.5), INVERTED), ((1.5, 0.0, 0.0), INVERTED)],
)  # fmt: skip
def test_nothing_presses_on_the_ground_below_one_metre_per_second_squared(
    gravity: Vector, state: int
) -> None:
    """1 m/s2 is enough; a floor that stands upright carries nothing. Floats and arrays alike."""
    robot = stool(FEET)
    load = robot.payload
    (stance,) = stances_of(
        mechanics_of(robot), posture_of(mechanics_of(robot), [], load.mass, load.cog)
    )
    assert stability_of(stance, gravity).state == state
    assert stability(robot, np.empty((3, 0)), [gravity] * 3).state.tolist() == [state] * 3  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ('height', 'raised'), [(0.125, False), (0.126, False), (-0.125, False), (-0.126, True)]
)
def test_a_point_may_be_as_low_as_the_tolerance(
    height: float,
    raised: bool,  # noqa: FBT001
) -> None:
    """An eighth of a metre either way is level; lower, the robot is raised on that point."""
    robot = stool([*FEET, (0.0, 0.5, height)])
    whole = stability(robot, np.empty((2, 0)), DOWN)
    assert np.all(np.asarray(whole.state) == (RAISED if raised else STANDING))


@pytest.mark.parametrize('factor', [-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 3.0])
@pytest.mark.parametrize('other', [-2.0, -1.0, 0.0, 1.0, 2.0])
def test_constants_fold_to_what_they_are(factor: float, other: float) -> None:
    """Products, sums and quotients with a constant, of a number and of what has a sign already."""

    def formula(x: Scalar, y: Scalar) -> list[Scalar]:
        return [
            x * factor, factor * x, (-x) * factor, (x * other) * factor, -(x * factor),
            x + factor, factor + x, x - factor, factor - x, factor / x, x / 4.0,
            x + (-y), (-x) + y, (-x) + (-y), x - (-y), (-x) - y, -(x - y), (-x) * (-y), (-x) - (-y),
        ]  # fmt: skip

    kernel = compile_kernel(formula, ['x', 'y'])
    assert kernel.one(1.5, -0.25) == pytest.approx(formula(1.5, -0.25), abs=1e-15)


def inertia(rng: np.random.Generator) -> Matrix:
    """Return a symmetric inertia."""
    a = rng.uniform(-0.3, 0.3, (3, 3))
    m = a @ a.T + 0.2 * np.eye(3)
    x, y, z = ((float(r[0]), float(r[1]), float(r[2])) for r in (m + m.T) / 2)
    return x, y, z


def test_links_joined_rigidly_turn_as_one() -> None:
    """Steiner: about any axis the torque of a unit acceleration is sum(I + m (d2 1 - d d')) a."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        parts, links, joints, total = 'arm', [Link('base', 5.0)], [], np.zeros((3, 3))
        place = np.zeros(3)
        for k in range(3):
            name, step = f'{parts}{k}', rng.uniform(-0.5, 0.5, 3) * (k > 0)
            place = place + step
            cog, m, own = rng.uniform(-0.3, 0.3, 3), float(rng.uniform(0.5, 2.0)), inertia(rng)
            links.append(Link(name, m, (cog[0], cog[1], cog[2]), own))
            kind, parent = ('revolute', 'base') if k == 0 else ('fixed', f'{parts}{k - 1}')
            xyz, about = (step[0], step[1], step[2]), (axis[0], axis[1], axis[2])
            joints.append(Joint(f'j{k}', kind, parent, name, xyz, axis=about))
            d = place + cog
            total += np.array(own) + m * (d @ d * np.eye(3) - np.outer(d, d))
        robot = Robot('r', tuple(links), tuple(joints), ('j0',))
        found = inverse_dynamics(robot, [0.3], [0.0], [1.0], [0.0, 0.0, 0.0])
        assert found[0] == pytest.approx(axis @ total @ axis)


def test_the_gripper_s_point_is_the_payload_s() -> None:
    """By plain 4 x 4 matrices, whatever the load."""
    rng = np.random.default_rng(5)
    for _ in range(10):
        robot = random_robot(rng, 4)
        q = rng.uniform(-3.0, 3.0, len(robot.joint_names))
        assert robot.payload_link is not None
        expected = at(places(robot, q.tolist())[robot.payload_link], robot.payload.cog)
        assert gripper_point(robot, q) == pytest.approx(expected, abs=1e-9)


def test_a_joint_that_is_held_stands_where_it_is_held() -> None:
    """Revolute and prismatic, not at zero."""
    robot = tracked()
    q = [0.4, 0.5, -0.5, 2.5]
    held = Robot(
        'held', robot.links, robot.joints, ('shoulder', 'elbow', 'flippers'), robot.contacts,
        (('turret', 0.4),), 'gripper', robot.payload,
    )  # fmt: skip
    assert gripper_point(held, q[1:]) == pytest.approx(gripper_point(robot, q))
    links = (Link('base', 5.0), Link('slide', 1.0), Link('tip', 1.0))
    joints = (
        Joint('s', 'prismatic', 'base', 'slide', axis=(0.0, 0.0, 1.0)),
        Joint('t', 'revolute', 'slide', 'tip', (1.0, 0.0, 0.0), axis=(0.0, -1.0, 0.0)),
    )
    robot = Robot('s', links, joints, ('t',), (), (('s', 0.25),), 'tip', Payload())
    assert gripper_point(robot, [0.0]) == pytest.approx((1.0, 0.0, 0.25))


def test_blocks_give_each_sample_its_own_value() -> None:
    """More samples than a block, by one thread and by three, with axes that broadcast."""
    x = np.arange(BLOCK + 7, dtype=np.float64).reshape(-1, 1)
    y = np.array((2.0, 3.0))
    for workers in (1, 3):
        found = in_blocks(lambda a, b, c: [a * b, a + c], 2, x, y, workers=workers)
        assert found.shape == (BLOCK + 7, 2)
        np.testing.assert_array_equal(found, np.hstack((x * 2.0, x + 3.0)))


@pytest.mark.parametrize(
    ('count', 'workers', 'others'),
    [(BLOCK, 1, False), (BLOCK + 1, 1, False), (BLOCK, 2, False), (BLOCK + 1, 2, True)],
)
def test_other_threads_work_where_asked_for_and_worth_it(
    count: int,
    workers: int,
    others: bool,  # noqa: FBT001
) -> None:
    """Several threads work only on more than one block of samples."""
    seen = set[int]()

    def same(x: Floats) -> list[Floats]:
        seen.add(threading.get_ident())
        return [x]

    in_blocks(same, 1, np.zeros((count, 1)), workers=workers)
    assert (threading.get_ident() not in seen) == others


@pytest.mark.parametrize('width', [1, 3])
def test_a_function_gives_as_many_values_as_are_asked_for(width: int) -> None:
    """A function of blocks that returns another number of values than stated is an error."""
    with pytest.raises(ValueError, match='zip'):
        in_blocks(lambda x: [x, x], width, np.zeros((4, 1)))


def test_one_thread_works_unless_more_are_asked_for() -> None:
    """One thread works unless more are requested: torques, motions, payloads and margins."""
    started, arm, limit = list[str](), tracked(), [9.0] * 4
    q, still = np.zeros((BLOCK + 1, 4)), np.zeros(4)
    asks = (
        lambda **more: static_torque(arm, q, DOWN, **more),
        lambda **more: inverse_dynamics(arm, q, still, still, DOWN, **more),
        lambda **more: payload_capacity(arm, q, DOWN, limit, **more),
        lambda **more: stability(arm, q, DOWN, **more),
        lambda **more: margins(arm, q, DOWN, **more),
        lambda **more: in_blocks(lambda x: [x], 1, q[:, :1], **more),
    )
    threading.setprofile(lambda *_: started.append(threading.current_thread().name))
    try:
        for ask in asks:
            ask()
            assert not started
            ask(workers=2)
            assert started
            started.clear()
    finally:
        threading.setprofile(None)


@given(st.lists(st.integers(-3, 9000), min_size=1, max_size=30))
def test_groups_are_the_rows_of_each_value(codes: list[int]) -> None:
    """Rows are grouped by equal values, in order of the values, each row once."""
    found = [
        (code, np.arange(len(codes))[rows].tolist(), size)
        for code, rows, size in groups(np.array(codes))
    ]
    expected = [
        (code, [k for k, c in enumerate(codes) if c == code], codes.count(code))
        for code in sorted(set(codes))
    ]
    assert found == expected


def test_rows_of_rows_are_rows() -> None:
    """A part of a part, where either may be all; what comes twice stays one object."""
    part, rows = np.array((2, 0)), np.array((5, 6, 9))
    assert inner(ALL, part) is part
    assert inner(rows, ALL) is rows
    assert inner(rows, part).tolist() == [9, 5]  # type: ignore[union-attr]
    x = np.arange(10.0)
    a, (b, c) = pick((x, (x, 3.0)), rows)
    assert a is b
    assert a.tolist() == [5.0, 6.0, 9.0]
    assert c == 3.0
    assert pick((x,), ALL)[0] is x


def test_utilisation_is_a_share_of_the_limit() -> None:
    """Utilisation is |torque| / limit, and 0 for an infinite limit."""
    assert utilisation((-20.0, 30.0), (40.0, 20.0)).tolist() == [0.5, 1.5]
    assert utilisation((20.0,), (math.inf,)).tolist() == [0.0]


@pytest.mark.parametrize('part', range(4))
@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_turn_about_one_axis_is_a_rotation(part: int, sign: float) -> None:
    """Each component counts alike, whatever its sign; with half of it there is none."""
    q = sign * np.eye(4)[part]
    assert is_rotation(*q)
    assert not is_rotation(*(0.5 * q))
    mixed = np.full(4, 0.5)
    mixed[part] *= -1.0
    assert is_rotation(*mixed)


def test_joints_that_are_no_tree_are_refused() -> None:
    """A link with two parents, and links that hang on nothing."""
    links = (Link('a', 1.0), Link('b', 1.0), Link('c', 1.0), Link('d', 1.0))
    twice = (Joint('x', 'fixed', 'a', 'b'), Joint('y', 'fixed', 'a', 'c'),
             Joint('z', 'fixed', 'c', 'b'), Joint('w', 'fixed', 'a', 'd'))  # fmt: skip
    with pytest.raises(BadConfig, match='joint z: link b has a parent already'):
        mechanics_of(Robot('r', links, twice, ()))
    lost = (Joint('x', 'fixed', 'a', 'b'), Joint('y', 'fixed', 'c', 'd'),
            Joint('z', 'fixed', 'd', 'c'))  # fmt: skip
    with pytest.raises(BadConfig, match='links c, d do not hang on root link a'):
        mechanics_of(Robot('r', links, lost, ()))
