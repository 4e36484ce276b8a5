"""The arm's clearance above the ground, against closed forms, surfaces of points and MuJoCo."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from robots import places, random_robot, tracked
from scipy.spatial.transform import Rotation

from ugv_acceptance.config import load
from ugv_acceptance.model.clearance import (
    arm_links,
    clearance,
    clearance_at,
    is_fixed,
    lowest_part,
    nearness_of,
    unread_links,
)
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import IDENTITY, Contact, Joint, Link, Matrix, Robot, Shape
from ugv_acceptance.model.row_selection import ALL
from ugv_acceptance.type_aliases import Floats

PACKBOT = load('packbot').settings.robot
HAND = (0.0, 0.0, 0.0)


def turned(*rpy: float) -> Matrix:
    """Return a rotation matrix of roll, pitch and yaw (rad)."""
    a, b, c = Rotation.from_euler('xyz', rpy).as_matrix().tolist()
    return (tuple(a), tuple(b), tuple(c))


# Each kind of geometry, somewhere on the arm of `tracked`.
SHAPES = (
    Shape('link1', 'box', (0.2, 0.03, -0.02), turned(0.3, -0.2, 0.9), (0.2, 0.05, 0.08)),
    Shape('link2', 'cylinder', (0.3, 0.0, 0.05), turned(0.4, 1.2, 0.1), (0.06, 0.06, 0.25)),
    Shape('gripper', 'sphere', (0.05, 0.02, 0.0), IDENTITY, (0.09, 0.09, 0.09)),
)


def surface(shape: Shape) -> Floats:
    """Return points (n, 3) on a geometry, in the axes of its link."""
    half, round_ = np.array(shape.size), np.linspace(-math.pi, math.pi, 721)
    if shape.kind == 'box':
        points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    elif shape.kind == 'cylinder':
        circle = np.column_stack((half[0] * np.cos(round_), half[0] * np.sin(round_)))
        points = np.vstack([np.column_stack((circle, np.full(721, z * half[2]))) for z in (-1, 1)])
    else:
        up, round_ = (x.ravel() for x in np.meshgrid(np.linspace(-1.57, 1.57, 181), round_[::3]))
        points = half[0] * np.column_stack(
            (np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up))
        )
    placed: Floats = np.array(shape.xyz) + points @ np.array(shape.rotation).T
    return placed


def lowest(robot: Robot, q: Sequence[float], normal: Floats, offset: float) -> float:
    """Return the least height (m) of points on the arm's surface, and of its load."""
    at = places(robot, q)
    points = [(shape.link, surface(shape)) for shape in robot.shapes]
    points.append((str(robot.payload_link), np.array([robot.payload.cog])))
    heights = [
        (at[link][:3, :3] @ p.T).T @ normal + at[link][:3, 3] @ normal - offset
        for link, p in points
    ]
    return float(min(h.min() for h in heights))


def test_a_bare_arm_is_as_high_as_its_lowest_joint_or_load() -> None:
    """Without collision geometry: elbow, hand and load, by the closed form of a two-link arm."""
    robot = replace(tracked(), payload=replace(tracked().payload, cog=HAND))
    mechanics, rng = mechanics_of(robot), np.random.default_rng(1)
    for first, second in rng.uniform(-1.5, 1.5, (40, 2)).tolist():
        elbow = 0.25 + 0.55 * math.sin(first)
        hand = elbow + 0.64 * math.sin(first + second)
        found = clearance(mechanics, None, (0.3, first, second, 0.0), HAND)
        assert found == pytest.approx(min(elbow, hand), abs=1e-12)
        name = lowest_part(mechanics, None, (0.3, first, second, 0.0), HAND)
        assert name == 'link2' if elbow < hand else name in ('gripper', 'load')


def test_boxes_cylinders_and_spheres_are_taken_exactly() -> None:
    """The least height is that of the lowest of many points on the surface of each geometry."""
    rng = np.random.default_rng(2)
    for shapes in (*((shape,) for shape in SHAPES), SHAPES):
        # Links without a geometry count by their joints, so all others get a small one.
        rest = tuple(
            Shape(n, 'sphere', HAND, IDENTITY, (1e-9, 1e-9, 1e-9))
            for n in ('turret', 'link1', 'link2', 'gripper')
            if n not in {shape.link for shape in shapes}
        )
        robot = replace(tracked(), shapes=shapes + rest)
        # The ends of turret and link1 lie on the axes of joints that never move them.
        still = [s for s in rest if s.link in ('turret', 'link1')]
        moving = replace(robot, shapes=tuple(s for s in robot.shapes if s not in still))
        for q in rng.uniform(-1.2, 1.2, (8, 4)).tolist():
            found = clearance(mechanics_of(robot), None, q, robot.payload.cog)
            expected = lowest(moving, q, np.array((0.0, 0.0, 1.0)), 0.0)
            assert found == pytest.approx(expected, abs=1e-5)


def test_the_ground_is_the_plane_of_the_contacts_that_carry_the_robot() -> None:
    """Clearance above a face is the height over the plane through its three points."""
    robot, rng = replace(tracked(), shapes=SHAPES), np.random.default_rng(3)
    mechanics, face = mechanics_of(robot), (2, 3, 4)
    for q in rng.uniform(-1.0, 1.0, (12, 4)).tolist():
        at = places(robot, q)
        a, b, c = (
            at[x.link][:3, :3] @ np.array(x.position) + at[x.link][:3, 3]
            for x in (robot.contacts[k] for k in face)
        )
        normal = np.cross(b - a, c - a)
        normal *= np.sign(normal[2]) / np.linalg.norm(normal)
        expected = lowest(robot, q, normal, float(a @ normal))
        found = clearance(mechanics, face, q, robot.payload.cog)
        assert found == pytest.approx(expected, abs=1e-5)
    assert not is_fixed(mechanics, face)
    assert is_fixed(mechanics, (0, 1, 2))
    q = [0.2, -0.3, 0.1, 2.0]
    level = clearance(mechanics, None, q, robot.payload.cog)
    assert clearance(mechanics, (0, 1, 2), q, robot.payload.cog) == pytest.approx(level)


def test_the_distance_is_that_of_mujoco() -> None:
    """PackBot's arm in random postures is as far from a floor as MuJoCo's collision says."""
    text = (Path(__file__).parents[2] / 'urdf' / 'packbot.urdf').read_text('utf-8')
    keep = '<mujoco><compiler fusestatic="false"/></mujoco></robot>'
    spec = mujoco.MjSpec.from_string(text.replace('</robot>', keep))
    floor = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
    floor.name = 'floor'
    model = spec.compile()
    data, plane = mujoco.MjData(model), model.geom('floor').id
    arm = {model.body(name).id for name in ('arm_link_1', 'arm_link_2')}
    geoms = [g for g in range(model.ngeom) if model.geom_bodyid[g] in arm]
    assert len(geoms) == 2
    mechanics, rng = mechanics_of(PACKBOT), np.random.default_rng(4)
    for q in rng.uniform(-1.0, 1.5, (10, 4)).tolist():
        for name, x in zip(PACKBOT.joint_names, q, strict=True):
            data.qpos[model.joint(name).qposadr[0]] = x
        mujoco.mj_kinematics(model, data)
        expected = min(mujoco.mj_geomDistance(model, data, plane, g, 5.0, None) for g in geoms)
        found = clearance(mechanics, None, q, HAND)
        assert found == pytest.approx(expected, abs=1e-6)


def test_many_postures_at_once_are_those_one_by_one() -> None:
    """Arrays give what floats give, for every face."""
    robot, rng = replace(tracked(), shapes=SHAPES), np.random.default_rng(5)
    mechanics, q = mechanics_of(robot), rng.uniform(-2.0, 2.0, (20, 4))
    for face in (None, (0, 1, 2), (2, 3, 5)):
        many = clearance_at(mechanics, face, list(q.T), HAND, ALL)
        one = [clearance(mechanics, face, row, HAND) for row in q.tolist()]
        np.testing.assert_allclose(many, one, rtol=0.0, atol=1e-12)


def test_no_joint_brings_the_arm_down_faster_than_its_lever() -> None:
    """Between two postures clearance changes by less than the levers times the joints' motion."""
    rng = np.random.default_rng(6)
    robots = [replace(tracked(), shapes=SHAPES), *(random_robot(rng, 4) for _ in range(8))]
    checked = 0
    for robot in robots:
        mechanics, n = mechanics_of(robot), len(robot.joint_names)
        levers = np.array(nearness_of(mechanics, robot.payload.cog).levers)
        if not np.isfinite(levers).all():
            continue
        for p, q in rng.uniform(-2.0, 2.0, (30, 2, n)).tolist():
            a, b = (clearance(mechanics, None, x, robot.payload.cog) for x in (p, q))
            if math.isfinite(a):
                checked += 1
                assert abs(a - b) <= levers @ np.abs(np.subtract(p, q)) + 1e-12
    assert checked > 60


def test_wheels_flippers_and_the_base_are_no_arm() -> None:
    """What stands on the ground is not the arm: with a contact, or a wheel."""
    robot = tracked()
    assert arm_links(robot) == ('turret', 'link1', 'link2', 'gripper')
    wheel = Shape('wheel', 'cylinder', (0.0, 0.0, 0.0), turned(math.pi / 2, 0, 0), (0.1, 0.1, 0.02))
    axle = Joint('axle', 'continuous', 'base_link', 'wheel', (0.3, 0.3, 0.1), axis=(0.0, 1.0, 0.0))
    rolling = replace(
        robot,
        links=(*robot.links, Link('wheel', 1.0)),
        joints=(*robot.joints, axle),
        joint_names=(*robot.joint_names, 'axle'),
        shapes=(wheel,),
    )
    q = (0.0, 0.5, 0.5, 0.0)
    expected = clearance(mechanics_of(robot), None, q, HAND)
    assert clearance(mechanics_of(rolling), None, (*q, 1.0), HAND) == pytest.approx(expected)


def test_a_boom_that_only_turns_counts_on_a_sloping_ground() -> None:
    """A part of one height over the tracks' plane comes down where the robot is raised behind."""
    links = (*tracked().links, Link('boom'))
    out = Joint('out', 'fixed', 'turret', 'boom', (1.4, 0.0, 0.0))
    robot = replace(tracked(), links=links, joints=(*tracked().joints, out), payload_link=None)
    robot = replace(robot, joints=tuple(
        replace(j, xyz=(0.0, 0.0, 2.0)) if j.name == 'shoulder' else j for j in robot.joints
    ))  # fmt: skip
    contacts = (*robot.contacts, Contact('tail', 'base_link', (-0.26, 0.0, -0.2)))
    mechanics, q = mechanics_of(replace(robot, contacts=contacts)), (0.0, 1.0, 0.0, 2.0)
    assert clearance(mechanics, None, q, HAND) == pytest.approx(0.19)
    slope = math.atan2(0.2, 0.5)
    expected = (0.19 - (1.4 - 0.24) * math.tan(slope)) * math.cos(slope)
    assert clearance(mechanics, (0, 1, 6), q, HAND) == pytest.approx(expected)


@pytest.mark.parametrize('feet', [0, 2])
def test_a_robot_without_ground_has_no_clearance(feet: int) -> None:
    """With fewer than three contact points nobody knows the ground: the clearance is infinite."""
    contacts = tuple(Contact(f'foot{k}', 'base_link', (float(k), 0.0, 0.0)) for k in range(feet))
    robot = replace(tracked(), contacts=contacts)
    assert clearance(mechanics_of(robot), None, (0.0, -1.0, 0.0, 0.0), HAND) == math.inf


def test_meshes_are_not_read_and_named() -> None:
    """A link with a mesh counts by its joints, and is named; one that never moves is not."""
    meshes = tuple(Shape(n, 'mesh', HAND, IDENTITY, None) for n in ('link1', 'base_link'))
    robot = replace(tracked(), shapes=meshes)
    q = (0.0, -0.5, 0.2, 0.0)
    bare = clearance(mechanics_of(tracked()), None, q, HAND)
    assert clearance(mechanics_of(robot), None, q, HAND) == pytest.approx(bare)
    assert unread_links(mechanics_of(robot)) == ()  # link1's own end, the shoulder, never moves
    further = replace(robot, shapes=(Shape('link2', 'mesh', HAND, IDENTITY, None),))
    assert unread_links(mechanics_of(further)) == ('link2',)
