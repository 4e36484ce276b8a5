"""What a configuration says that no robot can be is warned of by field; what is right is not."""

import re
from pathlib import Path

import pytest
from config.robot_files import URDF, YAML, write_robot

from ugv_acceptance.config import Config, load

UNSAFE = 'unsafe_limits: "bench test, robot tied down"\n'
BOX = '<collision><geometry><box size="2 2 0.2"/></geometry></collision>'
ROD = (
    '<collision><origin xyz="{x} 0 0" rpy="1.5707963 0 0"/>'
    '<geometry><cylinder radius="0" length="2"/></geometry></collision>'
)
SHARED = Path(__file__).parents[2].parent / 'shared' / 'robots'


def config_of(folder: Path, yaml: str = YAML, urdf: str = URDF) -> Config:
    """Load the two texts."""
    return load(write_robot(folder, yaml, urdf))


def of(config: Config, field: str) -> list[str]:
    """Return the warnings about a field of the YAML file, whatever its unit."""
    return [text for text in config.warnings if re.search(rf': {field}(_[a-z]+)?: ', text)]


@pytest.mark.parametrize(
    ('limits', 'field', 'words'),
    [
        ('tip_error_deg: -89', 'limits.tip_error', '89 deg past tipping'),
        ('tip_error_deg: -0.5', 'limits.tip_error', '0.5 deg past tipping'),
        ('torque_error: 10', 'limits.torque_error', 'up to 1000 % of it'),
        ('torque_error: 1.1', 'limits.torque_error', 'up to 110 % of it'),
    ],
)
def test_a_limit_that_nothing_can_pass_is_warned_of(
    tmp_path: Path, limits: str, field: str, words: str
) -> None:
    """A limit beyond the robot's own says what counts as within it."""
    found = of(config_of(tmp_path, f'{YAML}limits: {{{limits}}}\n{UNSAFE}'), field)
    assert [words in text for text in found].count(True) == 1


def test_no_tilt_in_reserve_is_warned_of(tmp_path: Path) -> None:
    """With an error limit of 0 degrees an alert comes when the robot is tipping: warned of."""
    (found,) = of(config_of(tmp_path, f'{YAML}limits: {{tip_error_deg: 0}}\n'), 'limits.tip_error')
    assert 'past tipping' in found


@pytest.mark.parametrize('joint', ['lift', 'slide'])
def test_a_joint_that_carries_much_without_a_limit_is_warned_of(tmp_path: Path, joint: str) -> None:
    """`limit: null` on a joint that carries the arm says so, with the torque it carries."""
    yaml = re.sub(rf'  {joint}:\n    limit_n(m?): \d+', rf'  {joint}:\n    limit_n\1: null', YAML)
    (found,) = of(config_of(tmp_path, yaml), f'joints.{joint}.limit')
    assert 'its torque is not judged: it carries up to' in found


def test_a_joint_that_carries_little_is_not_warned_of(tmp_path: Path) -> None:
    """A joint without limit that carries a small share of what the arm's carry is no warning."""
    flap = """<joint name="flap" type="revolute"><origin xyz="0 0 0.2"/><parent link="base"/>
      <child link="lid"/><axis xyz="0 1 0"/><limit lower="0" upper="1" effort="0" velocity="1"/>
      </joint><link name="lid"><inertial><origin xyz="0.2 0 0"/><mass value="0.5"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
    yaml = YAML.replace('joints:\n', 'joints:\n  flap: {limit_nm: null}\n')
    config = config_of(tmp_path, yaml, URDF.replace('</robot>', flap))
    assert of(config, 'joints.flap.limit') == []


def with_shape(shape: str) -> str:
    """Return the URDF with collision geometry at its base."""
    return URDF.replace('<link name="base">', f'<link name="base">{shape}', 1)


def test_contacts_within_the_robot_are_no_warning(tmp_path: Path) -> None:
    """Contact points on the edge of the collision geometry, and a little beyond, are right."""
    wide = YAML.replace('[1, 1, 0]', '[1.04, 1.02, 0]')
    for yaml in (YAML, wide):
        config = config_of(tmp_path, yaml, with_shape(BOX))
        assert (config.warnings, config.not_compared) == ((), ())


@pytest.mark.parametrize(
    ('place', 'off'), [('[2, 1, 0]', '1.00'), ('[1, 1.1, 0]', '0.10'), ('[-2, -2, 0]', '1.41')]
)
@pytest.mark.parametrize(
    'shape',
    [
        BOX,
        BOX.replace('<geometry>', '<origin rpy="0 0 1.5707963"/><geometry>'),
        '<collision><geometry><cylinder radius="1" length="3"/></geometry></collision>',
        '<collision><origin xyz="0 0 0.5"/><geometry><sphere radius="1"/></geometry></collision>',
        ROD.format(x=1) + ROD.format(x=-1),
    ],
)
def test_contacts_wider_than_the_robot_are_warned_of(
    tmp_path: Path, place: str, off: str, shape: str
) -> None:
    """A contact point more than 5 cm outside of box, cylinder or sphere is told, with how far."""
    yaml = YAML.replace('[1, 1, 0]', place)
    (found,) = of(config_of(tmp_path, yaml, with_shape(shape)), 'contacts.a.position')
    assert f'{off} m outside of the collision geometry' in found


WHEELS = """<joint name="axle_{n}" type="{kind}"><origin xyz="{x} {y} 0.1" rpy="-1.5707963 0 0"/>
  <parent link="base"/><child link="wheel_{n}"/><axis xyz="0 0 1"/></joint>
  <link name="wheel_{n}"><collision><geometry>{shape}</geometry></collision></link>"""


def on_wheels(kind: str, shape: str) -> str:
    """Return the URDF with a small box for a body and a wheel at each contact point."""
    at = {'a': (1, 1), 'b': (-1, 1), 'c': (0, -1)}
    wheels = ''.join(
        WHEELS.format(n=n, kind=kind, x=x, y=y, shape=shape) for n, (x, y) in at.items()
    )
    body = (
        '<collision><origin xyz="0 0 0.4"/><geometry><box size="1 1 0.2"/></geometry></collision>'
    )
    return with_shape(body).replace('</robot>', f'{wheels}</robot>')


@pytest.mark.parametrize('kind', ['fixed', 'continuous'])
@pytest.mark.parametrize('held', [True, False])
def test_wheels_are_part_of_what_a_robot_stands_on(
    tmp_path: Path,
    kind: str,
    held: bool,  # noqa: FBT001
) -> None:
    """Contacts under wheels beside the body are right; a metre beside the wheels they are not."""
    urdf = on_wheels(kind, '<cylinder radius="0.1" length="0.05"/>')
    yaml = YAML
    if kind != 'fixed' and held:
        yaml += 'held: {axle_a: 0, axle_b: 0, axle_c: 0}\n'
    elif kind != 'fixed':
        wheels = ''.join(f'  axle_{n}: {{limit_nm: null}}\n' for n in 'abc')
        yaml = yaml.replace('joints:\n', f'joints:\n{wheels}')
    yaml += 'links: {wheel_a: {mass_kg: 1}, wheel_b: {mass_kg: 1}, wheel_c: {mass_kg: 1}}\n'
    assert config_of(tmp_path, yaml, urdf).warnings == ()
    wrong = config_of(tmp_path, yaml.replace('[0, -1, 0]', '[0, -2, 0]'), urdf)
    assert len(of(wrong, 'contacts.c.position')) == 1


def test_an_arm_stretched_out_makes_no_robot_wider(tmp_path: Path) -> None:
    """The arm's geometry above the ground does not excuse a contact point under its hand."""
    arm = (
        '<collision><origin xyz="1 0 0.5"/><geometry><box size="4 0.1 0.1"/></geometry></collision>'
    )
    urdf = with_shape(BOX).replace('<link name="arm">', f'<link name="arm">{arm}', 1)
    yaml = YAML.replace('[1, 1, 0]', '[2, 0, 0]')
    assert len(of(config_of(tmp_path, yaml, urdf), 'contacts.a.position')) == 1


@pytest.mark.parametrize(
    'shape',
    [
        '',
        '<collision><geometry><mesh filename="package://x/base.stl"/></geometry></collision>',
        '<collision><geometry><box size="wide"/></geometry></collision>',
        '<collision><geometry><capsule radius="1" length="1"/></geometry></collision>',
        '<collision/>',
    ],
)
def test_what_is_not_drawn_is_not_compared(tmp_path: Path, shape: str) -> None:
    """Without geometry that can be read, contacts are not warned of but named as not compared."""
    config = config_of(tmp_path, YAML.replace('[1, 1, 0]', '[9, 1, 0]'), with_shape(shape))
    assert config.warnings == ()
    assert config.not_compared == ('a', 'b', 'c')


@pytest.mark.parametrize('name', ['packbot'])
def test_robots_that_ship_are_not_warned_of(name: str) -> None:
    """The configurations that ship have no warning, and contacts that their geometry confirms."""
    config = load(name)
    assert (config.warnings, config.not_compared) == ((), ())


# Where the wheels of public robots stand by their makers' drawings, in the axes of base_link.
STANDS = {
    'husky/husky.urdf': ('base_link', 0.2560, 0.2854),
    'jackal/jackal.urdf': ('base_link', 0.131, 0.1878),
    'husky_ur5/husky_ur5.urdf': ('base_link', 0.2560, 0.2854),
}


@pytest.mark.skipif(not SHARED.is_dir(), reason='no ../shared/robots beside the checkout')
@pytest.mark.parametrize('name', STANDS)
def test_public_robots_are_compared_rightly(tmp_path: Path, name: str) -> None:
    """Wheel contacts of robots of other makers are right as they are, and wrong a metre wider."""
    link, x, y = STANDS[name]
    found = []
    for wider in (0.0, 1.0):
        points = [(x, y + wider), (x, -y - wider), (-x, y + wider), (-x, -y - wider)]
        lines = [
            f'  c{k}: {{link: {link}, position_m: [{a}, {b}, 0]}}'
            for k, (a, b) in enumerate(points)
        ]
        path = tmp_path / f'r{wider:g}.yaml'
        text = '\n'.join([f'robot: {{name: r}}\nurdf: {SHARED / name}\ncontacts:', *lines])
        path.write_text(f'{text}\n', encoding='utf-8')
        config = load(path)
        found.append(sum('outside of the collision' in text for text in config.warnings))
    assert found == [0, 4]


@pytest.mark.parametrize(
    ('place', 'warned', 'unknown'),
    [('[1, 1, 0]', 0, ()), ('[1.5, 1, 0]', 0, ('a',)), ('[6, 1, 0]', 1, ())],
)
def test_beside_a_mesh_a_contact_is_not_compared_and_far_from_it_is_warned_of(
    tmp_path: Path, place: str, warned: int, unknown: tuple[str, ...]
) -> None:
    """A mesh on a robot whose wheels are known reaches no further than about the robot's size."""
    mesh = '<collision><geometry><mesh filename="package://x/top.stl"/></geometry></collision>'
    config = config_of(tmp_path, YAML.replace('[1, 1, 0]', place), with_shape(BOX + mesh))
    assert len(of(config, 'contacts.a.position')) == warned
    assert config.not_compared == unknown


def test_tracks_that_are_not_in_one_plane_are_named(tmp_path: Path) -> None:
    """By how much, and what of every margin that takes; half a tenth of a millimetre is not."""
    text = (Path('msg_configs') / 'packbot.yaml').read_text()
    urdf = (Path('urdf') / 'packbot.urdf').resolve()
    for height, told in ((0.0015, True), (-0.0015, True), (0.00005, False)):
        moved = text.replace('[-0.250, 0.202, 0]', f'[-0.250, 0.202, {height}]')
        path = tmp_path / 'packbot.yaml'
        path.write_text(moved.replace('../urdf/packbot.urdf', str(urdf)))
        found = [w for w in load(path).warnings if 'not in one plane' in w]
        assert len(found) == told
        for sentence in found:
            assert 'rear_left' in sentence
            assert '1.5 mm off that of three others, so 2.7 deg' in sentence
