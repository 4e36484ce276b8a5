"""Two URDFs are compared by what they mean, not by their bytes."""

import re
from pathlib import Path

import pytest
from config.robot_files import URDF

from ugv_acceptance.config.same_robot import difference_words, differences
from ugv_acceptance.config.urdf import read_urdf

SHAPED = URDF.replace(
    '<link name="hand"/>',
    """<link name="hand">
    <collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
    <collision><geometry><mesh filename="package://two/hand.stl"/></geometry></collision></link>
  <joint name="finger" type="prismatic"><parent link="hand"/><child link="tip"/>
    <limit lower="0" upper="0.1" effort="5" velocity="1"/><mimic joint="slide" multiplier="2"/>
  </joint><link name="tip"/>""",
)


def found(old: str, new: str) -> tuple[str, ...]:
    """Return the differences of a robot and of itself with one text of its URDF replaced."""
    assert old in SHAPED
    one, other = read_urdf(SHAPED.encode(), 'a'), read_urdf(SHAPED.replace(old, new).encode(), 'b')
    return differences(one, other)


@pytest.mark.parametrize(
    ('old', 'new', 'words'),
    [
        ('mass value="20"', 'mass value="24"', r'link base: mass 20 kg in the file, 24 kg on the'),
        ('origin xyz="0.5 0 0"', 'origin xyz="0.6 0 0"', r'link arm: centre of gravity 0\.5 0 0 m'),
        ('ixx="1"', 'ixx="2"', r'link base: inertia 1 0 0 0 1 0 0 0 1 kg m2 in the file, 2 0 0'),
        ('xyz="0 0 0.2"', 'xyz="0 0 0.2" rpy="0 0 1"', r'joint lift: rotation'),
        ('axis xyz="0 -2 0"', 'axis xyz="0 2 0"', r'joint lift: axis -?0 -1 -?0 in the file'),
        (
            'effort="40"',
            'effort="0"',
            r'joint lift: effort limit 40 in the file, none on the robot',
        ),
        ('upper="1.5"', 'upper="1.5001"', r'joint lift: upper limit 1\.5 in the file, 1\.5001 on'),
        ('multiplier="2"', 'multiplier="3"', r'mimic joint finger: multiplier 2 in the file, 3 on'),
        ('size="0.1 0.2 0.3"', 'size="0.1 0.2 0.4"', r'collision of hand: half size 0\.05 0\.1'),
        ('<mesh filename="package://two/hand.stl"/>', '<sphere radius="1"/>', r'hand no\. 2: geom'),
        ('"tip"', '"nail"', r'link tip: only in the file'),
        ('name="lift"', 'name="raise"', r'joint lift: only in the file'),
    ],
)
def test_a_number_that_differs_is_named_with_both_values(old: str, new: str, words: str) -> None:
    """Masses, places, axes, limits, laws and shapes that differ are told with part and values."""
    assert re.search(words, '; '.join(found(old, new)))


@pytest.mark.parametrize(
    ('old', 'new'),
    [
        ('mass value="20"', 'mass value="20.000000001"'),
        ('<link name="tip"/>', '<!-- the tip --><link name="tip"><visual/></link>'),
        ('package://two/hand.stl', 'file:///opt/meshes/hand.stl'),
        ('<robot name="two">', '<robot name="three">'),
        ('axis xyz="0 -2 0"', 'axis xyz="0 -1 0"'),
        ('xyz="0 0 0.2"', 'xyz="0.0 -0.0 2e-1"'),
    ],
)
def test_what_means_the_same_is_no_difference(old: str, new: str) -> None:
    """Comments, visuals, mesh paths, the robot's name and how a number is printed do not count."""
    assert found(old, new) == ()


def test_the_order_of_links_and_joints_does_not_count(repository: Path) -> None:
    """A URDF with its elements in reverse order is the same robot."""
    text = (repository / 'urdf' / 'packbot.urdf').read_text('utf-8')
    head, *parts = re.split(r'(?=\n  <(?:link|joint|material) )', text.replace('</robot>', ''))
    turned = head + ''.join(reversed(parts)) + '</robot>'
    assert turned != text
    assert differences(read_urdf(text.encode(), 'a'), read_urdf(turned.encode(), 'b')) == ()


def test_of_many_differences_the_first_are_told() -> None:
    """One sentence names two differences and how many more there are."""
    said = found('mass value', 'mass value="1" was')
    assert len(said) == 2
    assert difference_words([*said, 'c', 'd']) == f'{said[0]}; {said[1]}; and 2 more differences'
