"""A robot with shortened tracks: what may carry it where the ground is not flat."""

from dataclasses import replace

import numpy as np
import pytest

from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Contact, Joint, Link, Robot
from ugv_acceptance.model.shortened_tracks import STUMP, has_tracks, shortened
from ugv_acceptance.model.stability import SIDES, margins
from ugv_acceptance.model.tree import point_of, pose_of, tree_of

PACKBOT = load().settings.robot
LEVEL = (0.0, 0.0, -9.81)


def places(robot: Robot, q: tuple[float, ...]) -> np.ndarray:
    """Return the contact points (n, 3) of a robot in a posture, m."""
    tree = tree_of(robot)
    pose = pose_of(tree, q)
    found = [point_of(tree, pose, c.link, c.position)[1] for c in robot.contacts]
    return np.array(found, np.float64)


@pytest.mark.parametrize('cut', [0.0, 0.1, 0.155])
def test_the_base_loses_so_much_at_each_end(cut: float) -> None:
    """Contacts of the base move along x towards their middle, and nowhere else."""
    before, after = places(PACKBOT, (0.0,) * 4)[:4], places(shortened(PACKBOT, cut), (0.0,) * 4)[:4]
    np.testing.assert_allclose(
        after - before, np.sign(-before[:, :1]) * [[cut, 0.0, 0.0]], atol=1e-12
    )


@pytest.mark.parametrize('angle', [-1.2, 0.0, 0.6, 3.0])
def test_a_flipper_gets_shorter_at_any_angle(angle: float) -> None:
    """Its tip is so much nearer to its axis, on the line from the axis to where it was."""
    q = (0.0, 0.0, 0.0, angle)
    axis = next(joint.xyz for joint in PACKBOT.joints if joint.name == 'flipper_joint')
    before, after = (places(robot, q)[4:] - axis for robot in (PACKBOT, shortened(PACKBOT, 0.1)))
    for a, b in zip(before[:, [0, 2]], after[:, [0, 2]], strict=True):
        assert np.hypot(*b) == pytest.approx(np.hypot(*a) - 0.1)
        assert np.cross(np.append(a, 0.0), np.append(b, 0.0)) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(before[:, 1], after[:, 1])


def test_some_of_a_track_stays() -> None:
    """A robot no longer than the cut keeps a polygon, so that a margin is known."""
    after = places(shortened(PACKBOT, 5.0), (0.0, 0.0, 0.0, 3.14))
    np.testing.assert_allclose(np.abs(after[:4, 0]), STUMP)
    found = margins(shortened(PACKBOT, 5.0), (0.0, 2.0, -2.0, 3.14), LEVEL).angle
    assert np.isfinite(found[[0, 2]]).all()


def test_feet_of_legs_stay() -> None:
    """A foot is a point that touches or does not: nothing can be cut from it."""
    joints = (
        Joint('hip', 'revolute', 'base', 'thigh', axis=(0.0, 1.0, 0.0)),
        Joint('knee', 'revolute', 'thigh', 'shank', (0.0, 0.0, -0.3), axis=(0.0, 1.0, 0.0)),
    )
    links = tuple(Link(name, 1.0) for name in ('base', 'thigh', 'shank'))
    contacts = (Contact('foot', 'shank', (0.0, 0.0, -0.3)),)
    legged = Robot('leg', links, joints, ('hip', 'knee'), contacts)
    assert shortened(legged, 0.1).contacts == contacts
    assert not has_tracks(legged)
    assert has_tracks(PACKBOT)


def test_a_shorter_robot_tips_sooner_over_its_ends() -> None:
    """The cautious margin to front and rear is smaller; to the sides nothing is cut."""
    q = (0.0, 2.0, -2.0, 3.14)
    whole, cut = (dict(zip(SIDES, margins(r, q, LEVEL).angle, strict=True))
                  for r in (PACKBOT, shortened(PACKBOT, 0.155)))  # fmt: skip
    assert cut['front'] < whole['front'] - 0.1
    assert cut['rear'] < whole['rear'] - 0.1
    assert cut['left'] == pytest.approx(whole['left'])


def test_it_follows_a_link_that_is_turned() -> None:
    """Where a link's axes are turned against the base, its contact moves in the base's axes."""
    turned = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    joints = (*PACKBOT.joints, Joint('skid_joint', 'fixed', 'base_link', 'skid', rotation=turned))
    contact = Contact('skid', 'skid', (0.1, -0.4, 0.0))  # at x = 0.4, y = 0.1
    robot = replace(
        PACKBOT, links=(*PACKBOT.links, Link('skid')), joints=joints,
        contacts=(*PACKBOT.contacts, contact),
    )  # fmt: skip
    before, after = places(robot, (0.0,) * 4)[-1], places(shortened(robot, 0.1), (0.0,) * 4)[-1]
    np.testing.assert_allclose(after - before, (-0.1, 0.0, 0.0), atol=1e-12)
