"""What a configuration says of how its robot stands is checked when it is loaded."""

import math
from collections.abc import Mapping
from pathlib import Path

import pytest
from config.robot_files import write_robot

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.config.setup_checks import DOUBT, FAILS, SetupDoubt, setup_doubts
from ugv_acceptance.model.robot import Contact, Joint, Link, Robot, Vector

CORNERS: dict[str, Vector] = {
    'fl': (0.3, 0.2, 0.0),
    'fr': (0.3, -0.2, 0.0),
    'rl': (-0.3, 0.2, 0.0),
    'rr': (-0.3, -0.2, 0.0),
}


def robot(
    corners: Mapping[str, Vector] = CORNERS, cog: Vector = (0.0, 0.0, 0.2), arm: float = 0.0
) -> Robot:
    """Return a box of 20 kg on its corners, with an arm of so many kg that turns about y."""
    base, hand = Link('base', 20.0, cog), Link('arm', arm, (0.5, 0.0, 0.0))
    lift = Joint('lift', 'continuous', 'base', 'arm', (0.0, 0.0, 0.3), axis=(0.0, -1.0, 0.0))
    contacts = tuple(Contact(name, 'base', at) for name, at in corners.items())
    if not arm:
        return Robot('box', (base,), (), (), contacts)
    return Robot('box', (base, hand), (lift,), ('lift',), contacts)


def only(found: tuple[SetupDoubt, ...]) -> SetupDoubt:
    """Return the one finding."""
    (one,) = found
    return one


def test_nothing_is_said_of_a_robot_that_stands_well() -> None:
    """Level points, the centre of gravity in the middle."""
    assert setup_doubts(robot()) == ()
    assert setup_doubts(robot(arm=1.0)) == ()


def raised(deg: float) -> dict[str, Vector]:
    """Return the corners with the front ones higher by so much."""
    rise = 0.6 * math.tan(math.radians(deg))
    return {n: (x, y, rise if x > 0.0 else 0.0) for n, (x, y, _) in CORNERS.items()}


@pytest.mark.parametrize('deg', [0.25, 3.0])
def test_a_tilt_of_the_carrying_points_fails_above_a_fifth_of_a_degree(deg: float) -> None:
    """By how much is said; one that is declared as real does not fail."""
    found = only(setup_doubts(robot(raised(deg))))
    assert found.severity == FAILS
    assert f'got one {deg:.2f} deg off' in found.words
    assert setup_doubts(robot(raised(deg)), known=('contacts.tilt',)) == ()
    assert setup_doubts(robot(raised(0.15))) == ()


@pytest.mark.parametrize('count', [0, 1, 2, 4])
def test_fewer_than_three_points_that_carry_fail(count: int) -> None:
    """None, one, two, and four in one line."""
    line: dict[str, Vector] = {f'p{k}': (0.1 * k - 0.1, 0.0, 0.0) for k in range(count)}
    found = only(setup_doubts(robot(line)))
    assert (found.field, found.severity) == (('contacts',), FAILS)
    assert found.words.startswith('expected at least three points that carry')


@pytest.mark.parametrize(
    ('x', 'severity', 'words'),
    [
        (0.285, DOUBT, '15 mm inside'),
        (0.32, FAILS, '20 mm outside'),
        (-0.5, FAILS, '200 mm outside'),
    ],
)
def test_a_centre_of_gravity_near_or_beyond_an_edge_is_told(
    x: float, severity: str, words: str
) -> None:
    """20 mm inside of the outermost points, or 10 % of half their width, are enough."""
    found = only(setup_doubts(robot(cog=(x, 0.0, 0.2))))
    assert (found.field, found.severity) == (('contacts',), severity)
    assert words in found.words
    assert setup_doubts(robot(cog=(0.27, 0.0, 0.2))) == ()


def test_small_robots_need_less_room() -> None:
    """10 % of half the width: 5 mm of a robot 100 mm wide."""
    small = {n: (x / 3.0, y / 4.0, z) for n, (x, y, z) in CORNERS.items()}
    assert setup_doubts(robot(small, (0.0, 0.044, 0.1))) == ()
    assert '5 mm inside' in only(setup_doubts(robot(small, (0.0, 0.046, 0.1)))).words


def test_an_arm_that_reaches_out_is_only_a_doubt() -> None:
    """Where other postures are inside; in a posture that is given it fails."""
    reaching = robot(cog=(0.1, 0.0, 0.2), arm=20.0)
    found = only(setup_doubts(reaching))
    assert (found.severity, 'other postures are inside' in found.words) == (DOUBT, True)
    low = robot(cog=(0.29, 0.0, 0.2), arm=10.0)
    assert only(setup_doubts(low, posture={'lift': 0.0})).severity == FAILS
    assert setup_doubts(reaching, posture={'lift': math.pi}) == ()


def test_nothing_is_said_of_legs_without_a_posture() -> None:
    """With joints at 0 nobody knows whether a robot on legs stands."""
    legs = robot(CORNERS, (0.6, 0.0, 0.2), arm=1.0)
    feet = tuple(Contact(c.name, 'arm', c.position) for c in legs.contacts)
    moved = Robot(legs.name, legs.links, legs.joints, legs.joint_names, feet)
    assert setup_doubts(moved) == ()
    assert only(setup_doubts(moved, posture={'lift': 0.0})).severity == FAILS


ROVER = """<robot name="rover">
  <link name="base"><inertial><mass value="20"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
{wheels}</robot>"""
WHEEL = """<joint name="{name}_axle" type="continuous"><origin xyz="{x} {y} 0.1"/>
    <parent link="base"/><child link="{name}"/><axis xyz="0 1 0"/></joint>
  <link name="{name}"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin rpy="1.5707963 0 0"/>
    <geometry><cylinder radius="0.08" length="0.06"/></geometry></collision>
    <collision><origin rpy="1.5707963 0 0"/>
    <geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
"""


def rover(folder: Path, fl: str, *, held: bool = True) -> Path:
    """Write a rover of four wheels, held or measured, whose first contact is `fl`."""
    wheels = ''.join(WHEEL.format(name=n, x=x, y=y) for n, (x, y, _) in CORNERS.items())
    joints = ', '.join(f'{name}_axle: {"0" if held else "{limit_nm: 5}"}' for name in CORNERS)
    yaml = [
        'robot: {name: rover}',
        'urdf: two.urdf',
        'topics: {joint_states: null}' if held else '',
        f'{"held" if held else "joints"}: {{{joints}}}',
        'joints: {}' if held else '',
        'contacts:',
        f'  fl: {fl}',
        *(
            f'  {n}: {{link: base, position_m: {list(at)}}}'
            for n, at in CORNERS.items()
            if n != 'fl'
        ),
    ]
    return write_robot(folder, '\n'.join(yaml) + '\n', ROVER.format(wheels=wheels))


@pytest.mark.parametrize('held', ['held', 'measured'])
def test_a_contact_below_the_axle_of_a_wheel_is_fixed_to_what_carries_it(
    tmp_path: Path, held: str
) -> None:
    """Measured or held: a held wheel turns all the same, nobody only tells its angle."""
    config = load(rover(tmp_path, '{link: fl, position_m: [0, 0, -0.1]}', held=held == 'held'))
    contact = config.settings.robot.contacts[0]
    assert contact.link == 'base'
    assert contact.position == pytest.approx((0.3, 0.2, 0.0))
    (words,) = config.settings.moved_contacts
    assert words.startswith('fl is taken as the lowest point of the wheel fl, fixed to base')
    assert config.warnings == ()


@pytest.mark.parametrize('held', ['held', 'measured'])
@pytest.mark.parametrize('point', ['[0.1, 0, 0]', '[0, 0, 0.1]', '[0.03, 0, -0.095]'])
def test_a_contact_elsewhere_on_a_wheel_is_refused(tmp_path: Path, point: str, held: str) -> None:
    """It would go round with the wheel, whether a message tells its angle or not."""
    with pytest.raises(BadConfig, match=r'contacts\.fl\.position.*below the axle of fl, a wheel'):
        load(rover(tmp_path, f'{{link: fl, position_m: {point}}}', held=held == 'held'))


@pytest.mark.parametrize('held', ['held', 'measured'])
def test_a_contact_that_is_a_little_askew_on_its_wheel_is_warned_of(
    tmp_path: Path, held: str
) -> None:
    """5 deg off straight below the axle."""
    point = f'[{0.1 * math.sin(0.087):.6f}, 0, {-0.1 * math.cos(0.087):.6f}]'
    found = load(
        rover(tmp_path, f'{{link: fl, position_m: {point}}}', held=held == 'held')
    ).warnings
    assert any('contacts.fl.position' in w and '5.0 deg off' in w for w in found)


@pytest.mark.parametrize(
    ('at', 'words'),
    [
        ('[0.34, 0.2, 0]', 'got one 40 mm off along the ground and 0 mm above it'),
        ('[0.3, 0.2, 0.02]', 'got one 0 mm off along the ground and 20 mm above it'),
        ('[0.3, 0.215, -0.01]', 'got one 0 mm off along the ground and 10 mm below it'),
        ('[0.3, 0.26, 0]', 'mm beyond its side'),
    ],
)
def test_a_contact_of_the_body_that_misses_the_wheel_above_it_is_warned_of(
    tmp_path: Path, at: str, words: str
) -> None:
    """By file and field: the lowest point of the wheel was expected."""
    found = load(rover(tmp_path, f'{{link: base, position_m: {at}}}')).warnings
    assert any('contacts.fl.position' in w and words in w for w in found)


def test_a_tilt_is_warned_of_until_it_is_declared(tmp_path: Path) -> None:
    """`contacts.tilt` under assumed says that it is real."""
    fl = '{link: base, position_m: [0.3, 0.2, 0.0]}'
    text = rover(tmp_path, fl).read_text('utf-8')
    path = tmp_path / 'two.yaml'
    for name in ('fl', 'fr'):
        x, y, _ = CORNERS[name]
        text = text.replace(f'position_m: [{x}, {y}, 0.0]', f'position_m: [{x}, {y}, 0.004]')
    path.write_text(text, encoding='utf-8')
    assert any('0.38 deg off' in w for w in load(path).warnings)
    path.write_text(f'{text}assumed: {{contacts.tilt: smaller front wheels}}\n', encoding='utf-8')
    assert load(path).warnings == ()
