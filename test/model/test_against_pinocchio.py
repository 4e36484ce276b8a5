"""Random trees, postures, motions and tilts: the same numbers as Pinocchio's."""

import numpy as np
import pinocchio as pin
import pytest
from robots import random_robot

from ugv_acceptance.model.mechanics import mechanics_of, posture_of
from ugv_acceptance.model.robot import Link, Robot
from ugv_acceptance.model.statics import centre_of_gravity, inverse_dynamics, static_torque
from ugv_acceptance.model.tipping import inertia_of

SEEDS = range(40)


class Twin:
    """A robot in Pinocchio, joint by joint: no URDF and no code of ours in between."""

    def __init__(self, robot: Robot) -> None:
        self.model = pin.Model()
        self.robot = robot
        self.place = {robot.root: (0, pin.SE3.Identity())}
        waiting = list(robot.joints)
        while waiting:
            joint = waiting.pop(0)
            if joint.parent not in self.place:
                waiting.append(joint)
                continue
            parent, frame = self.place[joint.parent]
            at = frame * pin.SE3(np.array(joint.rotation), np.array(joint.xyz))
            if joint.kind == 'fixed':
                self.place[joint.child] = (parent, at)
                continue
            slides = joint.kind == 'prismatic'
            kind = pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned
            number = self.model.addJoint(parent, kind(np.array(joint.axis)), at, joint.name)
            self.place[joint.child] = (number, pin.SE3.Identity())
        for link in robot.links:
            self.attach(link)
        assert robot.payload_link is not None
        self.attach(Link(robot.payload_link, robot.payload.mass, robot.payload.cog))
        self.data = self.model.createData()
        self.order = [
            self.model.joints[self.model.getJointId(name)].idx_v for name in robot.joint_names
        ]

    def attach(self, link: Link) -> None:
        """Fix a link's mass to its joint."""
        joint, frame = self.place[link.name]
        body = pin.Inertia(link.mass, np.array(link.cog), np.array(link.inertia))
        self.model.appendBodyToJoint(joint, body, frame)

    def ordered(self, values: np.ndarray) -> np.ndarray:
        """Return values in Pinocchio's order of joints."""
        theirs = np.zeros(self.model.nv)
        theirs[self.order] = values
        return theirs

    def rnea(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, g: np.ndarray) -> np.ndarray:
        """Return inverse dynamics in our order."""
        self.model.gravity.linear = g
        values = [self.ordered(x) for x in (q, qd, qdd)]
        torque: np.ndarray = pin.rnea(self.model, self.data, *values)[self.order]
        return torque

    def centre(self, q: np.ndarray) -> np.ndarray:
        """Return the centre of gravity of everything, the fixed base included."""
        moving = pin.centerOfMass(self.model, self.data, self.ordered(q))
        base = self.model.inertias[0]
        mass = sum(inertia.mass for inertia in self.model.inertias[1:])
        whole: np.ndarray = (mass * moving + base.mass * base.lever) / (mass + base.mass)
        return whole


def case(seed: int) -> tuple[Robot, Twin, np.ndarray, np.ndarray]:
    """Return a robot, its twin, ten rows of (position, rate, acceleration), ten gravities."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 4)
    motion = rng.uniform(-3.0, 3.0, (3, 10, len(robot.joint_names)))
    return robot, Twin(robot), motion, 9.81 * rng.normal(size=(10, 3))


@pytest.mark.parametrize('seed', SEEDS)
def test_inverse_dynamics_are_those_of_rnea(seed: int) -> None:
    """Any tree, motion and gravity: torques agree to 1e-9 of the largest."""
    robot, twin, (q, qd, qdd), gravity = case(seed)
    ours = inverse_dynamics(robot, q, qd, qdd, gravity)
    theirs = np.array([twin.rnea(*row) for row in zip(q, qd, qdd, gravity, strict=True)])
    assert np.abs(ours - theirs).max() <= 1e-9 * np.abs(theirs).max()


@pytest.mark.parametrize('seed', SEEDS)
def test_static_torque_is_rnea_at_rest(seed: int) -> None:
    """Any tree, posture and tilt: torques agree to 1e-9 of the largest."""
    robot, twin, (q, _, _), gravity = case(seed)
    still = np.zeros(q.shape[1])
    theirs = np.array([twin.rnea(a, still, still, g) for a, g in zip(q, gravity, strict=True)])
    ours = static_torque(robot, q, gravity)
    assert np.abs(ours - theirs).max() <= 1e-9 * np.abs(theirs).max()


@pytest.mark.parametrize('joints', [5, 9, 20])
def test_a_long_arm_is_held_as_pinocchio_says(joints: int) -> None:
    """Many joints in a chain, turning and sliding about any axes: torques agree to 1e-12."""
    rng = np.random.default_rng(joints)
    robot = random_robot(rng, 4, arm=joints)
    twin, still = Twin(robot), np.zeros(joints)
    q, gravity = rng.uniform(-3.0, 3.0, (10, joints)), 9.81 * rng.normal(size=(10, 3))
    theirs = np.array([twin.rnea(a, still, still, g) for a, g in zip(q, gravity, strict=True)])
    assert np.abs(static_torque(robot, q, gravity) - theirs).max() <= 1e-12 * np.abs(theirs).max()


@pytest.mark.parametrize('joints', [5, 9, 20])
def test_what_a_contact_point_far_out_puts_on_the_joints_is_pinocchio_s(joints: int) -> None:
    """A kg at a contact point changes the torques by its levers, on every joint before it."""
    rng = np.random.default_rng(joints)
    robot = random_robot(rng, 4, moving=3, arm=joints)
    q, gravity, still = rng.uniform(-3.0, 3.0, joints), 9.81 * rng.normal(size=3), np.zeros(joints)
    empty = Twin(robot).rnea(q, still, still, gravity)
    mechanics = mechanics_of(robot)
    posture = posture_of(mechanics, q.tolist(), robot.payload.mass, robot.payload.cog)
    for number, contact in enumerate(robot.contacts):
        twin = Twin(robot)
        twin.attach(Link(contact.link, 1.0, contact.position))
        expected = twin.rnea(q, still, still, gravity) - empty
        found = np.zeros(joints)
        for (joint, point), load in zip(mechanics.carried, posture.loads, strict=True):
            if point == number:
                found[joint] = np.asarray(load) @ gravity
        np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(empty).max())


@pytest.mark.parametrize('seed', SEEDS)
def test_the_centre_of_gravity_is_theirs(seed: int) -> None:
    """Any tree and posture: centres of gravity agree to 1e-12 of their distance (m)."""
    robot, twin, (q, _, _), _ = case(seed)
    theirs = np.array([twin.centre(a) for a in q])
    assert np.abs(centre_of_gravity(robot, q) - theirs).max() <= 1e-12 * (1 + np.abs(theirs).max())


@pytest.mark.parametrize('seed', SEEDS)
def test_inertia_is_pinocchios(seed: int) -> None:
    """The inertia about the centre of gravity is that of Pinocchio's composite rigid body."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 4)
    q = rng.uniform(-2.0, 2.0, len(robot.joint_names))
    twin = Twin(robot)
    pin.ccrba(twin.model, twin.data, twin.ordered(q), np.zeros(twin.model.nv))
    moving = twin.data.Ig
    whole = pin.Inertia(moving.mass, twin.data.com[0], moving.inertia) + twin.model.inertias[0]
    load = robot.payload
    found = inertia_of(mechanics_of(robot)).one(*q.tolist(), load.mass, *load.cog)
    entries = whole.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    np.testing.assert_allclose(found, entries, rtol=1e-9, atol=1e-9)
