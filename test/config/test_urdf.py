"""The URDF reader."""

import math
from itertools import pairwise

import numpy as np
import pinocchio
import pytest
from config.robot_files import URDF

from ugv_acceptance import BadConfig
from ugv_acceptance.config.urdf import Urdf, read_urdf, rotation_from_rpy
from ugv_acceptance.model.robot import Mimic

INERTIA = '<inertia ixx="1" iyy="2" izz="2.5" ixy="0.1" ixz="0.2" iyz="0.3"/>'


def read(text: str) -> Urdf:
    """Read a URDF text."""
    return read_urdf(text.encode(), 'x.urdf')


def robot(joints: str, links: str = 'a b') -> str:
    """Return a URDF of empty links and the joints given."""
    return (
        f'<robot name="r">{"".join(f"<link name={n!r}/>" for n in links.split())}{joints}</robot>'
    )


def joint(kind: str = 'revolute', inside: str = '', ends: str = 'a b', name: str = 'j') -> str:
    """Return a joint element."""
    parent, child = ends.split()
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'{inside}</joint>'
    )


def test_links_and_joints_are_read() -> None:
    """Mass, centre of gravity, frame, axis of length 1 and limits are those of the file."""
    urdf = read(URDF)
    assert [(link.mass, link.cog) for link in urdf.links] == [
        (20.0, (0.0, 0.0, 0.0)),
        (4.0, (0.5, 0.0, 0.0)),
        (0.0, (0.0, 0.0, 0.0)),
    ]
    lift = urdf.joints[0]
    assert (lift.axis, lift.xyz) == ((0.0, -1.0, 0.0), (0.0, 0.0, 0.2))
    assert (lift.lower, lift.upper, lift.effort, lift.velocity) == (-1.5, 1.5, 40.0, 1.0)


def test_the_inertia_is_turned_with_its_origin() -> None:
    """An inertial frame at an angle gives R I R^T in link axes, as Pinocchio reads it."""
    text = (
        '<robot name="r"><link name="w"/><joint name="j" type="revolute"><parent link="w"/>'
        '<child link="a"/><limit effort="1" velocity="1" lower="-1" upper="1"/></joint>'
        '<link name="a"><inertial><origin xyz="1 2 3" rpy="0.3 -0.7 1.9"/>'
        f'<mass value="2"/>{INERTIA}</inertial></link></robot>'
    )
    link, other = read(text).links[1], pinocchio.buildModelFromXML(text).inertias[1]
    np.testing.assert_allclose(link.inertia, other.inertia, rtol=0, atol=1e-12)
    np.testing.assert_allclose(link.cog, other.lever, rtol=0, atol=1e-12)


def test_roll_pitch_yaw_turn_about_fixed_axes() -> None:
    """A yaw of 90 degrees turns x to y; roll is applied first."""
    turned = np.array(rotation_from_rpy((math.pi / 2, 0.0, math.pi / 2))) @ [0.0, 1.0, 0.0]
    np.testing.assert_allclose(turned, [0.0, 0.0, 1.0], rtol=0, atol=1e-15)


def test_an_effort_of_zero_or_none_is_no_limit() -> None:
    """An effort of 0 in a URDF means no known limit, as exporters write it."""
    limits = [
        read(robot(joint(inside=inside))).joints[0].effort
        for inside in ('', '<limit effort="0" velocity="0" lower="-1" upper="1"/>')
    ]
    assert limits == [math.inf, math.inf]


def test_a_continuous_joint_has_no_range() -> None:
    """Lower and upper of a continuous joint are ignored."""
    found = read(robot(joint('continuous', '<limit lower="0" upper="0" effort="5"/>'))).joints[0]
    assert (found.lower, found.upper, found.effort) == (-math.inf, math.inf, 5.0)


def test_a_mimic_joint_is_read_with_its_law() -> None:
    """Position = multiplier * that of the other joint + offset; by default 1 and 0."""
    other = joint(ends='b c', name='k')
    law = '<mimic joint="k" multiplier="2" offset="0.3"/>'
    text = robot(joint(inside=law) + other, 'a b c')
    assert read(text).mimics == (Mimic('j', 'k', 2.0, 0.3),)
    plain = text.replace(' multiplier="2" offset="0.3"', '')
    assert read(plain).mimics == (Mimic('j', 'k', 1.0, 0.0),)


@pytest.mark.parametrize(
    ('of', 'says'), [('j', 'follow each other'), ('x', 'expected a movable joint, got "x"')]
)
def test_a_mimic_joint_must_follow_another_one(of: str, says: str) -> None:
    """One that follows itself, or a joint that is not there, is refused by name."""
    with pytest.raises(BadConfig, match=f'joint j/mimic.*{says}'):
        read(robot(joint(inside=f'<mimic joint="{of}"/>')))


def test_meshes_are_ignored() -> None:
    """A mesh by package:// or file:// need not exist."""
    text = URDF.replace(
        '<link name="hand"/>',
        '<link name="hand"><visual><geometry><mesh filename="package://no/such.dae"/></geometry>'
        '</visual></link>',
    )
    assert read(text).links == read(URDF).links


@pytest.mark.parametrize(
    ('text', 'sentence'),
    [
        (robot(joint('ball')), 'joint j: expected the type'),
        (robot(joint(ends='a c')), 'link "c" does not exist'),
        (robot(joint() + joint(name='k')), 'link b has two parents'),
        (robot('', 'a b'), 'expected one root link, got a (1 link, 0 kg), b (1 link, 0 kg)'),
        (robot(joint() + joint(ends='b a', name='k')), 'the joints are a cycle'),
        (
            robot(joint() + joint(ends='b a', name='k'), 'a b c'),
            'joints are a cycle through link',
        ),
        (robot(''.join(joint(ends=e, name=e) for e in ('a b', 'a a')), 'a b'), 'cycle'),
        ('<robot/>', 'expected one root link, got no link'),
        (robot(joint() + joint(ends='a c'), 'a b c'), 'got twice: j'),
        (robot(joint(), 'a b b'), 'got twice: b'),
        (robot(joint(inside='<axis xyz="0 0 0"/>')), 'joint j/axis: expected a direction'),
        (robot(joint(inside='<axis xyz="0 0"/>')), 'joint j/axis/xyz: expected three numbers'),
        (robot(joint(inside='<origin xyz="0 nan 0"/>')), 'origin/xyz: expected a finite number'),
        (robot(joint(inside='<limit lower="1" upper="-1"/>')), 'expected lower <= upper'),
        (robot(joint(inside='<limit effort="-1"/>')), 'limit/effort: expected a limit >= 0'),
        (URDF.replace('"20"', '"-20"'), 'link base: inertial/mass: expected a mass >= 0 kg'),
        (
            URDF.replace('<mass value="20"/>', ''),
            'inertial/mass/value: expected a number, got none',
        ),
        (URDF.replace('name="arm"', ''), 'expected a name on every link'),
        ('<sdf/>', 'expected the root element <robot>, got <"sdf">'),
        ('<robot', 'expected a URDF'),
        (
            '<robot xmlns:xacro="http://x.org/xacro"><xacro:include/></robot>',
            'run xacro on it first',
        ),
    ],
)
def test_what_is_no_usable_tree_is_refused(text: str, sentence: str) -> None:
    """The error names the file, the element and what is wrong with it."""
    with pytest.raises(BadConfig) as caught:
        read(text)
    assert sentence in str(caught.value)
    assert str(caught.value).startswith('x.urdf: ')


def test_entities_are_refused() -> None:
    """XML entities in a URDF are refused: neither bombs nor local files are expanded."""
    bomb = '<!DOCTYPE r [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><robot name="&b;"/>'
    with pytest.raises(BadConfig, match='DTD or entities'):
        read(bomb)


@pytest.mark.parametrize(
    ('text', 'sentence'),
    [
        (URDF.replace('ixx="1"', 'ixx="0"'), 'link base: inertial/inertia: not that of a rigid'),
        (URDF.replace('izz="1"', 'izz="9"'), 'not positive definite'),
        (URDF.replace('"20"', '"0"'), 'link base: inertial/mass: is 0 kg'),
        (robot(joint()), 'none given for a revolute joint: taken as unlimited'),
        (robot(joint(inside='<limit effort="1"/>')), 'both 0: taken as unlimited'),
    ],
)
def test_what_is_doubtful_is_warned_of(text: str, sentence: str) -> None:
    """A doubtful element of a URDF gives a warning, and the robot is loaded."""
    assert sentence in '\n'.join(read(text).warnings)


def test_five_hundred_links_are_read() -> None:
    """A chain of 500 links is read without deep recursion."""
    names = [f'l{k}' for k in range(500)]
    chain = ''.join(joint('continuous', ends=f'{a} {b}', name=b) for a, b in pairwise(names))
    assert len(read(robot(chain, ' '.join(names))).joints) == 499
