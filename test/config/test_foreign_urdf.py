"""URDFs as others write them: the harmless is ignored, the rest gives one line with a way out."""

import math
import re
from pathlib import Path

import pytest
from config.robot_files import URDF, YAML, write_robot

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config, load
from ugv_acceptance.config.urdf import Urdf, read_urdf

MASS = '<inertial><mass value="1"/></inertial>'
BOX = '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>'
RUN = 'run xacro on it first, or `ugv-acceptance init FILE.xacro`'


def read(text: str) -> Urdf:
    """Read a URDF text."""
    return read_urdf(text.encode(), 'x.urdf')


def refusal(text: str) -> str:
    """Return why a URDF is refused: one line that begins with the file."""
    with pytest.raises(BadConfig) as caught:
        read(text)
    said = str(caught.value)
    assert said.startswith('x.urdf: ')
    assert '\n' not in said
    return said


def added(text: str, urdf: str = URDF) -> str:
    """Return the small robot with more elements."""
    return urdf.replace('</robot>', f'{text}</robot>')


def joint(parent: str, child: str, kind: str = 'fixed', inside: str = '') -> str:
    """Return a joint element."""
    return (
        f'<joint name="to_{child}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'{inside}</joint>'
    )


def bare(*names: str) -> str:
    """Return links that are only frames."""
    return ''.join(f'<link name="{name}"/>' for name in names)


def config_of(folder: Path, urdf: str, yaml: str = YAML) -> Config:
    """Load the small robot with another URDF."""
    return load(write_robot(folder, yaml, urdf))


# Masses


@pytest.mark.parametrize(
    'urdf',
    [
        re.sub('<inertial>.*?</inertial>', '', URDF, flags=re.DOTALL),
        URDF.replace('"20"', '"0"').replace('"4"', '"0"'),
    ],
)
def test_a_urdf_without_masses_says_what_to_do(tmp_path: Path, urdf: str) -> None:
    """Refused: which links, and that they are weighed and entered, or another URDF taken."""
    with pytest.raises(BadConfig) as caught:
        config_of(tmp_path, urdf)
    said = str(caught.value)
    assert re.search(r'two\.yaml:2: urdf: expected links with mass, got none in base, arm', said)
    assert 'enter them, as links: {base: {mass_kg: ...' in said


def test_masses_of_the_file_take_the_place_of_missing_ones(tmp_path: Path) -> None:
    """A URDF without inertials, with masses under links, is a robot."""
    urdf = re.sub('<inertial>.*?</inertial>', '', URDF, flags=re.DOTALL)
    config = config_of(tmp_path, urdf, f'{YAML}links: {{base: {{mass_kg: 20}}}}\n')
    assert config.settings.robot.mass == 20


@pytest.mark.parametrize(
    ('shape', 'said'),
    [
        (BOX, True),
        ('<collision><geometry><mesh filename="a.stl"/></geometry></collision>', True),
        ('<collision><geometry><box size="0.001 0.001 0.001"/></geometry></collision>', False),
        ('<visual><geometry><box size="1 1 1"/></geometry></visual>', False),
        ('', False),
    ],
)
def test_a_link_with_geometry_and_no_mass_is_warned_of_once(
    tmp_path: Path, shape: str, *, said: bool
) -> None:
    """All such links in one line; frames, and boxes of a millimetre that mark one, are none."""
    more = ''.join(f'<link name="{n}">{shape}</link>{joint("base", n)}' for n in ('mast', 'box'))
    found = [w for w in config_of(tmp_path, added(more)).warnings if 'without mass' in w]
    assert [': links: mast, box: collision geometry' in w for w in found] == [True] * said


def test_a_mass_on_a_link_of_its_own_is_that_of_the_link_it_is_fixed_to(tmp_path: Path) -> None:
    """A base whose inertial stands on a child without geometry, as in many robots, has a mass."""
    plate = f'<link name="plate">{BOX}</link>{joint("base", "plate")}'
    weight = f'<link name="weight">{MASS}</link>{joint("plate", "weight")}'
    assert not any('without mass' in w for w in config_of(tmp_path, added(plate + weight)).warnings)


# One tree


def test_frames_that_hang_on_nothing_are_ignored_with_a_warning() -> None:
    """A lone world, or a small tree of frames, is not part of the robot."""
    loose = bare('world', 'map', 'odom') + joint('map', 'odom')
    found = read(added(loose))
    assert (found.links, found.joints) == (read(URDF).links, read(URDF).joints)
    (said,) = [w for w in found.warnings if 'ignored' in w]
    assert 'world, map, odom: on no joint that leads to base, without mass' in said


@pytest.mark.parametrize('inside', [MASS, BOX, BOX.replace('collision', 'visual')])
def test_a_second_robot_is_refused_with_the_joint_to_add(inside: str) -> None:
    """What has mass, geometry or a picture is not dropped: both roots are told, the robot first."""
    said = refusal(added(f'<link name="mast">{inside}</link>{bare("eye")}{joint("mast", "eye")}'))
    assert 'expected one root link, got base (3 links, 24 kg), mast (2 links, ' in said
    assert 'add a joint from a link of base to mast, or leave out' in said


@pytest.mark.parametrize('kind', ['floating', 'planar'])
def test_a_base_that_floats_in_the_world_is_the_base(tmp_path: Path, kind: str) -> None:
    """A free joint from a world without mass: its child is the root, and that is warned of."""
    urdf = added(bare('world') + joint('world', 'base', kind))
    config = config_of(tmp_path, urdf)
    assert config.settings.robot.root == 'base'
    assert config.settings.robot.joint_names == ('lift', 'slide')
    assert any(f'joint to_base: {kind}, from world: base is taken' in w for w in config.warnings)


@pytest.mark.parametrize(
    'urdf',
    [
        added(f'{bare("ball")}{joint("hand", "ball", "floating")}'),
        added(bare('world', 'wall') + joint('world', 'base', 'floating') + joint('world', 'wall')),
        added(f'<link name="world">{MASS}</link>{joint("world", "base", "planar")}'),
    ],
)  # fmt: skip
def test_a_free_joint_elsewhere_is_refused(urdf: str) -> None:
    """In the arm, from a world with other things, from a world with mass."""
    assert re.search(
        'joint to_ba[a-z]+: expected the type revolute, .*got "(float|plan)', refusal(urdf)
    )


# Xacro that was left


XMLNS = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


@pytest.mark.parametrize(
    'leftover',
    [
        '<xacro:property name="width" value="0.3"/>',
        '<xacro:arg name="prefix" default=""/>',
        '<xacro:macro name="wheel" params="x"><link name="${x}"/><xacro:inner/></xacro:macro>',
        '<property name="width" value="0.3"/>',
        '<gazebo reference="arm"><material>Gazebo/Grey</material></gazebo>',
        '<gazebo><plugin name="p" filename="libx.so"><xacro:if value="1"/></plugin></gazebo>',
        '<transmission name="t"><joint name="lift"/></transmission>',
        '<ros2_control name="c"><joint name="lift"/></ros2_control>',
        '<sensor:camera name="c"/>',
    ],
)
@pytest.mark.parametrize('declared', [True, False])
def test_what_is_harmless_is_ignored(leftover: str, *, declared: bool) -> None:
    """Definitions, plugins and elements of others, with and without their prefix declared."""
    spaces = f'{XMLNS} xmlns:sensor="http://x.org/s"' if declared else ''
    found = read(added(leftover).replace('<robot ', f'<robot {spaces} '))
    assert (found.links, found.joints) == (read(URDF).links, read(URDF).joints)


def test_a_default_namespace_is_ignored() -> None:
    """<robot xmlns="..."> is a robot."""
    assert read(URDF.replace('<robot ', '<robot xmlns="http://www.ros.org" ')).links


@pytest.mark.parametrize(
    ('urdf', 'got'),
    [
        (added('<xacro:include filename="arm.xacro"/>'), '<xacro:include>'),
        (added('<xacro:wheel side="left"/>'), '<xacro:wheel>'),
        (added('<xacro:if value="1"><link name="x"/></xacro:if>'), '<xacro:if>'),
        (added('<include filename="arm.xacro"/>'), '<include>'),
        (
            URDF.replace('<link name="hand"/>', '<link name="hand"><xacro:box/></link>'),
            '<xacro:box>',
        ),
        (URDF.replace('"20"', '"${mass}"'), '"${mass}"'),
        (URDF.replace('"hand"', '"${prefix}hand"'), '"${prefix}hand"'),
        (URDF.replace('"0 0 0.2"', '"0 0 $(arg h)"'), '"0 0 $(arg h)"'),
    ],
)
@pytest.mark.parametrize('declared', [True, False])
def test_what_only_xacro_can_do_says_run_xacro(urdf: str, got: str, *, declared: bool) -> None:
    """Calls, includes and expressions, their prefix declared or not: what it is, the way out."""
    said = refusal(urdf.replace('<robot ', f'<robot {XMLNS} ') if declared else urdf)
    assert f'expected a URDF, got xacro ({got}): {RUN}' in said


def test_a_mesh_found_by_xacro_is_no_fault() -> None:
    """Meshes are not read here, so an expression in their path is not either."""
    mesh = '<collision><geometry><mesh filename="$(find x)/a.stl"/></geometry></collision>'
    assert read(URDF.replace('<link name="hand"/>', f'<link name="hand">{mesh}</link>')).links


# Limits and numbers


@pytest.mark.parametrize('effort', ['0', '0.0', 'inf', '1e30'])
def test_an_effort_that_is_no_limit_is_said(tmp_path: Path, effort: str) -> None:
    """0, infinity and 1e30 are no limits: not judged, and the warning says so."""
    urdf = URDF.replace('effort="40"', f'effort="{effort}"')
    config = config_of(tmp_path, urdf, YAML.replace('    limit_nm: 30\n', '    sign: 1\n'))
    assert math.isinf(config.settings.limits.torque[0])
    assert any('joints.lift: no limit here and an effort of 0' in w for w in config.warnings)


def test_a_boundless_range_is_unlimited() -> None:
    """lower="-inf" upper="inf", or 1e30 as some exporters write, is no range."""
    for lower, upper in [('-inf', 'inf'), ('-1e30', '1e30'), ('-1.5', 'inf')]:
        found = read(URDF.replace('"-1.5" upper="1.5"', f'"{lower}" upper="{upper}"')).joints[0]
        assert found.upper == math.inf
        assert found.lower == (-1.5 if lower == '-1.5' else -math.inf)


@pytest.mark.parametrize(
    ('old', 'new', 'said'),
    [
        ('0 0 0.2', '0,0,0.2', 'lift/origin/xyz: expected three .*"0,0,0.2": numbers have'),
        ('0 0 0.2', '0 0 0,2', 'origin/xyz: expected a finite .*"0,2": numbers have a decimal'),
        ('"20"', '"20,5"', 'link base: inertial/mass/value: .*"20,5": numbers have a decimal'),
        ('"20"', '"inf"', 'link base: inertial/mass/value: expected a finite number .*got "inf"'),
        ('lower="-1.5"', 'lower="nan"', 'joint lift/limit/lower: expected a finite .*got "nan"'),
        ('lower="-1.5"', 'lower=""', 'joint lift/limit/lower: expected a finite number .*got ""'),
        ('<mass value="20"/>', '<mass/>', 'link base: inertial/mass/value: .* number, got none'),
        ('<parent link="base"/>', '<parent/>', 'lift/parent: expected the name of .*, got none'),
        ('<child link="arm"/>', '', 'joint lift/child: expected the name of a link, got none'),
        ('type="revolute"', '', 'joint lift: expected the type revolute, .*got ""'),
        ('type="revolute"', 'type="Revolute"', 'joint lift: expected the type .*got "Revolute"'),
    ],
)  # fmt: skip
def test_a_wrong_number_names_its_element(old: str, new: str, said: str) -> None:
    """File, link or joint, attribute, what was expected and what came."""
    assert re.search(said, refusal(URDF.replace(old, new, 1)))


def test_a_model_of_gazebo_is_called_that() -> None:
    """An SDF is named as one."""
    assert 'got <"sdf">, an SDF: a URDF is needed' in refusal('<sdf version="1.6"><model/></sdf>')


@pytest.mark.parametrize('name', ['b' * 5000, 'bras_élévateur', '臂', 'a b', 'a&#10;b', '&lt;'])
def test_names_of_any_kind_are_names(tmp_path: Path, name: str) -> None:
    """Long, foreign and odd names are taken; in an error they stay short and on one line."""
    urdf = URDF.replace('"arm"', f'"{name}"')
    assert config_of(tmp_path, urdf).settings.robot.mass == 24
    wrong = urdf.replace('value="4"', 'value="-4"')
    assert len(refusal(wrong)) < 200


# Joints that nobody tells


HINGE = added(f'<link name="lid">{MASS}</link>') .replace(
    '</robot>', joint('base', 'lid', 'revolute', '<limit lower="-2" upper="-0.5"/>') + '</robot>'
)  # fmt: skip


def test_a_joint_whose_range_is_without_0_is_held_at_its_nearest_end(tmp_path: Path) -> None:
    """Nobody tells it: held where it can be, and that is warned of."""
    config = config_of(tmp_path, HINGE)
    assert config.settings.robot.held == (('to_lid', -0.5),)
    assert any('to_lid: its range is without 0, so held at -0.5' in w for w in config.warnings)


def test_a_joint_that_is_held_outside_its_range_is_warned_of(tmp_path: Path) -> None:
    """What the file says is done, and doubted."""
    config = config_of(tmp_path, HINGE, f'{YAML}held: {{to_lid_deg: 0, }}\n'.replace('_deg', ''))
    assert config.settings.robot.held == (('to_lid', 0.0),)
    assert any('held.to_lid: 0 is outside its range, -2 .. -0.5 rad' in w for w in config.warnings)
