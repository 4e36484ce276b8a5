"""Contact points derived of small robots: what carries is found, what is doubtful is asked."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from configure.small_robots import (
    block,
    box,
    derived,
    drum,
    files_in,
    four,
    joint,
    link,
    mesh,
    rover,
    shape,
    sphere,
    tyre,
    wheel,
    write_dae,
    write_obj,
    write_stl,
)

from ugv_acceptance.config import load
from ugv_acceptance.config.urdf import read_urdf
from ugv_acceptance.configure.collision import geometry_of
from ugv_acceptance.configure.draft import ASK, CERTAIN, CHECK, Contacts
from ugv_acceptance.configure.posture import posture_of

BODY = shape(box(0.5, 0.3, 0.1), '0 0 0.15')
WHEEL = tyre(0.1, 0.04)
PAIR = wheel('left', '0.1 0.2 0.1', WHEEL) + wheel('right', '0.1 -0.2 0.1', WHEEL)
ROOT = Path(__file__).parents[2]


def rounded(contacts: Contacts) -> set[tuple[float, ...]]:
    """Return the points of contacts on the base link, to 0.01 mm."""
    assert {one.contact.link for one in contacts.points} <= {'base_link'}
    return {tuple(round(x, 5) + 0.0 for x in one.contact.position) for one in contacts.points}


def test_a_wheel_stands_on_two_points_under_its_axle_on_what_carries_it() -> None:
    """Across its tread, on the link that does not spin; all four wheels are certain."""
    found = derived(rover(BODY, four(WHEEL)))
    points = {(x, y, 0.0) for x in (0.2, -0.2) for y in (0.22, 0.18, -0.18, -0.22)}
    assert rounded(found) == points
    assert {one.grade for one in found.points} == {CERTAIN}
    assert {one.on for one in found.points} == {
        f'wheel {a}_{b}' for a in ('front', 'rear') for b in ('left', 'right')
    }
    assert (found.ground.value, found.question) == (0.0, '')
    assert found.tilt == pytest.approx(0.0)
    assert len({one.contact.name for one in found.points}) == 8


@pytest.mark.parametrize('suffix', ['stl', 'obj', 'dae'])
def test_a_wheel_that_is_a_mesh_stands_across_its_tread(tmp_path: Path, suffix: str) -> None:
    """The tread is where its radius is largest: a boss on the axle does not widen it."""
    write = {'stl': write_stl, 'obj': write_obj, 'dae': write_dae}[suffix]
    write(tmp_path / f'wheel.{suffix}', drum(0.1, 0.04))
    geometry = shape(mesh(f'package://rover/wheel.{suffix}'))
    find = files_in(tmp_path)
    found = derived(rover(BODY, four(geometry)), meshes=find)
    points = {(x, y, 0.0) for x in (0.2, -0.2) for y in (0.22, 0.18, -0.18, -0.22)}
    assert rounded(found) == points
    assert found.question == ''


def test_a_wheel_that_is_a_ball_stands_on_one_point() -> None:
    """A sphere tells no width: the point in its middle is to be checked."""
    found = derived(rover(BODY, four(shape(sphere(0.1)))))
    assert rounded(found) == {(x, y, 0.0) for x in (0.2, -0.2) for y in (0.2, -0.2)}
    assert {one.grade for one in found.points} == {CHECK}


@pytest.mark.parametrize(
    ('geometry', 'says'),
    [
        (tyre(0.1, 0.04, 'visual'), 'as it is drawn'),
        (WHEEL + shape(mesh('package://x/y.stl')), 'is not read: file not found'),
    ],
)
def test_what_only_partly_tells_a_wheel_is_to_be_checked(geometry: str, says: str) -> None:
    """One that is only drawn, and one with a mesh beside its cylinder."""
    found = derived(rover(BODY, four(geometry)))
    assert len(found.points) == 8
    assert {one.grade for one in found.points} == {CHECK}
    assert all(says in one.source for one in found.points)


@pytest.mark.parametrize('low', [0.004, 0.02])
def test_the_body_is_not_taken_where_wheels_carry(low: float) -> None:
    """A body box a few mm lower is told; one far lower is asked about."""
    body = shape(box(0.5, 0.3, 0.1), f'0 0 {0.05 - low}')
    found = derived(rover(body, four(WHEEL)))
    assert {one.on.split()[0] for one in found.points} == {'wheel'}
    said = found.question if low > 0.01 else ' '.join(found.remarks)
    assert f'{1e3 * low:.1f} mm below the ground on which the wheels stand' in said
    assert bool(found.question) == (low > 0.01)


@pytest.mark.parametrize(
    ('geometry', 'at', 'place'),
    [
        (shape(sphere(0.03)), '-0.2 0 0.03', {(-0.2, 0.0, 0.0)}),
        (tyre(0.03, 0.02), '-0.2 0 0.03', {(-0.2, 0.01, 0.0), (-0.2, -0.01, 0.0)}),
        (shape(box(0.03, 0.03, 0.06)), '-0.2 0 0.03', {(-0.2, 0.0, 0.0)}),
    ],
)
@pytest.mark.parametrize('own', ['caster', 'base_link'])
def test_fixed_casters_carry(
    geometry: str, at: str, place: set[tuple[float, ...]], own: str
) -> None:
    """Balls and small cylinders, on a link of their own or the body's, and small boxes on one."""
    if own == 'caster':
        urdf = rover(BODY, PAIR, link('caster', geometry) + joint('caster', at))
    else:
        urdf = rover(BODY + geometry.replace('xyz="0 0 0"', f'xyz="{at}"'), PAIR)
    found = derived(urdf)
    if 'box' in geometry and own == 'base_link':
        assert found.question.startswith('Only left, right were found')
        return
    model = read_urdf(urdf.encode(), '')
    frames = posture_of(model, {}, geometry_of(model, lambda _: None)).frames
    points = {
        tuple(np.round(frames[o.contact.link][1] + o.contact.position, 5) + 0.0)
        for o in found.points
        if o.on.startswith('caster')
    }
    assert points == place
    assert found.question == ''
    assert len(found.points) == 4 + len(place)


def test_a_caster_lower_than_the_wheels_is_a_tilt_that_is_asked_about() -> None:
    """2 mm over 0.3 m are 0.38 deg, lower at the rear."""
    more = link('caster', shape(sphere(0.03))) + joint('caster', '-0.2 0 0.028')
    found = derived(rover(BODY, PAIR, more))
    assert math.degrees(found.tilt) == pytest.approx(0.382, abs=0.001)
    assert abs(math.degrees(found.heading)) == pytest.approx(180.0)
    assert '0.38 deg off the xy-plane of base_link, lower at the rear: is this' in found.question
    assert {one.grade for one in found.points} == {CHECK}
    assert found.ground.value == pytest.approx(-0.002)


def test_casters_inside_a_mesh_of_the_body_are_asked_about(tmp_path: Path) -> None:
    """Two wheels carry nothing alone: where the mesh would touch is only a guess."""
    parts = [*block(0.5, 0.3, 0.1, (0.0, 0.0, 0.15)), *block(0.02, 0.02, 0.1, (-0.2, 0.0, 0.05))]
    write_stl(tmp_path / 'base.stl', parts)
    urdf = rover(shape(mesh('base.stl')), PAIR)
    seen = derived(urdf, meshes=files_in(tmp_path))
    assert seen.question.startswith('Only left, right were found to carry')
    grades = {one.on: one.grade for one in seen.points}
    assert grades == {'wheel left': CERTAIN, 'wheel right': CERTAIN, 'body base_link': ASK}
    guessed = [one.contact.position for one in seen.points if one.grade == ASK]
    assert {round(x, 3) for x, _, _ in guessed} == {-0.21, -0.19}
    unseen = derived(urdf)
    assert 'was not read' in unseen.question
    assert {one.on for one in unseen.points} == {'wheel left', 'wheel right'}


def test_wheels_that_toe_in_do_not_carry_alone() -> None:
    """Their points span a sliver under the centre of gravity; no robot stands on that."""
    turned = PAIR.replace('xyz="0.1 0.2 0.1"', 'xyz="0 0.2 0.1" rpy="0 0 0.1"')
    turned = turned.replace('xyz="0.1 -0.2 0.1"', 'xyz="0 -0.2 0.1" rpy="0 0 -0.1"')
    assert derived(rover(BODY, turned)).question.startswith('Only left, right were found')


def test_a_centre_of_gravity_outside_of_the_wheels_is_asked_about() -> None:
    """By how much it is outside is said."""
    found = derived(rover(BODY, four(WHEEL), cog='0.42 0 0.2'))
    assert 'centre of gravity is' in found.question
    assert 'outside of what front_left' in found.question
    assert len(found.points) == 8


def test_an_arm_that_would_tip_a_rover_leaves_it_on_its_wheels() -> None:
    """Stretched out it has the centre of gravity outside of them, which is said."""
    arm = link('arm', shape(box(2.0, 0.1, 0.1), '1 0 0'), 20.0, '1 0 0')
    found = derived(rover(BODY, four(WHEEL), arm + joint('arm', '0 0 0.4', 'revolute')))
    assert (len(found.points), found.question) == (8, '')
    assert any('the arm has the centre of gravity' in one for one in found.remarks)


def test_a_wheel_above_the_plane_of_the_others_is_asked_about() -> None:
    """One of 5 mm is to be checked; one of 10 mm is asked about; one of 30 mm is not taken."""
    middle = wheel('middle', '0 0.2 {z}', tyre(0.09, 0.04))
    rover_of = [rover(BODY, four(WHEEL), middle.format(z=0.09 + z)) for z in (0.005, 0.01, 0.03)]
    near, far, high = map(derived, rover_of)
    assert (near.question, len(near.points)) == ('', 10)
    assert {one.grade for one in near.points if one.on == 'wheel middle'} == {CHECK}
    assert 'wheel middle is 10.0 mm above the plane of the others: does it' in far.question
    assert len(far.points) == 10
    assert 'wheel middle is 30.0 mm above' in high.question
    assert len(high.points) == 8


@pytest.mark.parametrize('suffix', ['cylinder', 'stl'])
def test_wheels_that_overlap_are_asked_about(tmp_path: Path, suffix: str) -> None:
    """As where a radius, or a mesh without a scale, is in millimetres."""
    write_stl(tmp_path / 'wheel.stl', drum(100.0, 40.0))
    geometry = tyre(100.0, 40.0) if suffix == 'cylinder' else shape(mesh('wheel.stl'))
    found = derived(rover(BODY, four(geometry)), meshes=files_in(tmp_path))
    assert 'front_left (radius 100000.0 mm) and front_right' in found.question
    assert 'overlap: which number is wrong?' in found.question


def test_a_wheel_that_swivels_stands_on_the_link_that_swivels() -> None:
    """It does not spin; by how much the point moves is said."""
    fork = link('fork') + joint('fork', '-0.2 0 0.1', 'continuous', '0 0 1')
    more = fork + wheel('caster', '-0.03 0 -0.05', tyre(0.05, 0.02), parent='fork')
    found = derived(rover(BODY, PAIR, more))
    points = [one.contact for one in found.points if one.on == 'wheel caster']
    assert {one.link for one in points} == {'fork'}
    assert {one.position for one in points} == {(-0.03, 0.01, -0.1), (-0.03, -0.01, -0.1)}
    assert any('caster swivels: its point moves by up to 60.0 mm' in one for one in found.remarks)
    assert found.question == ''


def test_a_wheel_on_a_leg_is_asked_about_without_a_posture() -> None:
    """Its point goes round with the shank; with a posture that is said."""
    urdf = legged(tyre(0.05, 0.02)).replace(
        'foot_joint" type="fixed"', 'foot_joint" type="continuous"'
    )
    assert 'fl_foot hangs on a leg that was taken with fl_thigh_joint' in derived(urdf).question
    found = derived(urdf, bent())
    assert found.question == ''
    assert {one.contact.link for one in found.points} == {f'{leg}_calf' for leg in LEGS}
    assert sum('its point is below the axle in this posture' in one for one in found.remarks) == 4


@pytest.mark.parametrize(
    'geometry', [shape(box(0.2, 0.04, 0.2)), shape('<cylinder radius="0.1" length="0.04"/>')]
)
def test_a_wheel_that_is_not_round_is_asked_about(geometry: str) -> None:
    """A box, and a cylinder that lies flat, beside round wheels and alone."""
    urdf = rover(BODY, four(WHEEL), wheel('fifth', '0 0.2 0.1', geometry))
    assert 'fifth turns without end as low as the wheels' in derived(urdf).question
    assert derived(rover('', four(geometry))).question != ''


def test_a_wheel_with_limits_of_many_turns_is_one() -> None:
    """Some URDFs write a wheel as revolute with huge limits."""
    text = four(WHEEL).replace('type="continuous"', 'type="revolute"')
    found = derived(rover(BODY, text.replace('lower="-3" upper="3"', 'lower="-1e6" upper="1e6"')))
    assert ({one.on.split()[0] for one in found.points}, found.question) == ({'wheel'}, '')


def test_a_wheel_of_rollers_is_one_wheel() -> None:
    """What turns on a wheel within its radius is part of it."""
    rollers = ''.join(
        wheel(
            f'roller{k}',
            f'{0.08 * math.cos(k)} 0 {0.08 * math.sin(k)}',
            tyre(0.02, 0.03),
            'front_left',
        )
        for k in range(6)
    )
    found = derived(rover(BODY, four(WHEEL), rollers))
    assert (len(found.points), found.question) == (8, '')


def test_rollers_on_a_hub_that_is_not_read_are_asked_about() -> None:
    """They are carried by a link that spins: no point of them stays where it is."""
    hub = shape(mesh('hub.stl'))
    rollers = ''.join(
        wheel(f'r{n}', '0 0 -0.08', tyre(0.02, 0.03), n)
        for n in ('front_left', 'front_right', 'rear_left', 'rear_right')
    )
    assert (
        'turns without end: where does that touch'
        in derived(rover(BODY, four(hub), rollers)).question
    )


def test_wheels_whose_geometry_is_not_read_are_asked_about() -> None:
    """Their inertia tells a radius, as a guess; nothing else of the body is taken instead."""
    found = derived(rover(BODY, four(shape(mesh('wheel.dae')))))
    radius = math.sqrt(2.0 * 0.01 / 1.0)
    assert rounded(found) == {
        (x, y, round(0.1 - radius, 5)) for x in (0.2, -0.2) for y in (0.2, -0.2)
    }
    assert {one.grade for one in found.points} == {ASK}
    assert f'gives a radius of {1e3 * radius:.1f} mm: is it that?' in found.question


def test_wheels_that_nothing_tells_of_are_asked_about() -> None:
    """Without geometry and inertia there is no point, and the body is asked about."""
    bare = four(shape(mesh('wheel.dae'))).replace('<mass value="1.0"/>', '<mass value="0"/>')
    found = derived(rover('', bare))
    assert (found.points, found.ground.value) == ((), None)
    assert found.question.startswith('The radius of front_left, front_right')


def test_a_wheel_at_the_end_of_an_arm_carries_nothing() -> None:
    """The body stands on its tracks; the arm's roller is told of."""
    tracks = ''.join(shape(box(0.6, 0.1, 0.2), f'0 {y} 0.1') for y in (0.2, -0.2))
    arm = link('arm', shape(box(0.3, 0.05, 0.05), '0.15 0 0')) + joint('arm', '0 0 0.3', 'revolute')
    found = derived(rover(tracks, arm, wheel('roller', '0.3 0 0', WHEEL, 'arm')))
    assert {one.contact.name for one in found.points} == {
        'front_left', 'front_right', 'rear_left', 'rear_right'
    }  # fmt: skip
    assert found.question == ''
    assert any('roller is' in one for one in found.remarks)


def test_tracks_stand_on_the_ends_of_their_flat_run() -> None:
    """PackBot's four points come out as its configuration has them; its flippers are told of."""
    urdf = (ROOT / 'urdf' / 'packbot.urdf').read_text('utf-8')
    found = derived(urdf)
    tracks = [c for c in load('packbot').settings.robot.contacts if c.link == 'base_link']
    assert {one.contact.name: one.contact.position for one in found.points} == {
        one.name: one.position for one in tracks
    }
    assert {one.on for one in found.points} == {'track chassis_link'}
    assert (found.question, found.ground.value) == ('', 0.0)


TRACKS = ''.join(shape(box(0.6, 0.1, 0.2), f'0 {y} 0.1') for y in (0.2, -0.2))


@pytest.mark.parametrize('angle', [0.0, 0.2])
def test_an_arm_that_would_tip_the_robot_leaves_it_on_its_tracks(angle: float) -> None:
    """Stretched out it carries nothing; where it is below the ground that is asked about."""
    arm = link('arm', shape(box(2.0, 0.1, 0.1), '1 0 0'), 20.0, '1 0 0')
    found = derived(rover(TRACKS, arm + joint('arm', '0 0 0.25', 'revolute')), {'arm_joint': angle})
    assert rounded(found) == {(x, y, 0.0) for x in (0.3, -0.3) for y in (0.25, -0.25)}
    assert any('the centre of gravity is' in one for one in found.remarks)
    below = 'In this posture arm is' in found.question and 'below the ground' in found.question
    assert below == (angle > 0.0)


def test_where_flippers_come_to_the_ground_is_told() -> None:
    """The points that PackBot's configuration has, at the angle that its comment names."""
    found = derived((ROOT / 'urdf' / 'packbot.urdf').read_text('utf-8'))
    (told,) = [one for one in found.remarks if 'flipper_link reaches the ground' in one]
    assert 'as flipper_joint turns by -14.9 deg' in told
    points = [[float(x) for x in one.split(',')] for one in re.findall(r'\[(.*?)\]', told)]
    flippers = [c for c in load('packbot').settings.robot.contacts if c.link == 'flipper_link']
    assert points == [pytest.approx(one.position, abs=2e-5) for one in flippers]


@pytest.mark.parametrize('geometry', [shape(box(0.6, 0.4, 0.2)), shape(mesh('body.stl'))])
def test_a_body_without_wheels_is_asked_about(tmp_path: Path, geometry: str) -> None:
    """One shape, a box or a mesh, may have its tracks inside: its corners are a guess."""
    write_stl(tmp_path / 'body.stl', block(0.6, 0.4, 0.2))
    found = derived(rover(geometry, ''), meshes=files_in(tmp_path))
    assert rounded(found) == {(x, y, -0.1) for x in (0.3, -0.3) for y in (0.2, -0.2)}
    assert {one.grade for one in found.points} == {ASK}
    assert 'does the robot stand on its corners?' in found.question


def test_geometry_of_the_body_that_is_not_read_is_asked_about() -> None:
    """Sensors whose geometry is read must not be taken for what carries."""
    sensors = ''.join(
        shape(box(0.1, 0.1, 0.1), f'{x} {y} 0.4') for x in (0.2, -0.2) for y in (0.2, -0.2)
    )
    found = derived(rover(shape(mesh('tracks.stl')) + sensors, ''))
    assert 'Geometry of base_link was not read' in found.question
    nothing = derived(rover(shape(mesh('tracks.stl')), ''))
    assert (nothing.points, 'was not read' in nothing.question) == ((), True)
    assert (
        derived(rover('', '')).question == 'The URDF has no geometry: what does the robot stand on?'
    )


LEGS = ('fl', 'fr', 'rl', 'rr')


def legged(feet: str = shape(sphere(0.02)), more: str = '') -> str:
    """Return a robot of four legs of two joints, 0.2 m each."""
    text = ''
    for name, x, y in zip(LEGS, (0.2, 0.2, -0.2, -0.2), (0.1, -0.1, 0.1, -0.1), strict=True):
        rod = shape(box(0.02, 0.02, 0.2), '0 0 -0.1')
        text += link(f'{name}_thigh', rod) + joint(f'{name}_thigh', f'{x} {y} 0', 'revolute')
        text += link(f'{name}_calf', rod)
        text += joint(f'{name}_calf', '0 0 -0.2', 'revolute', parent=f'{name}_thigh')
        text += link(f'{name}_foot', feet) + joint(
            f'{name}_foot', '0 0 -0.2', parent=f'{name}_calf'
        )
    return rover(shape(box(0.5, 0.2, 0.1)), text, more)


def bent(*, lifted: float = 0.0) -> dict[str, float]:
    """Return a posture with bent knees; `lifted` (rad) bends one more."""
    found: dict[str, float] = {}
    for name in LEGS:
        more = lifted if name == 'fl' else 0.0
        found |= {f'{name}_thigh_joint': 0.6 + more, f'{name}_calf_joint': -1.2 - 2.0 * more}
    return found


def test_legs_stand_on_the_lowest_points_of_their_feet() -> None:
    """In the posture given: below the balls, which the calves lean by 0.6 rad."""
    found = derived(legged(), bent())
    low = (0.02 * math.sin(-0.6), 0.0, -0.02 * math.cos(0.6))
    assert {one.contact.link for one in found.points} == {f'{leg}_foot' for leg in LEGS}
    for one in found.points:
        assert one.contact.position == pytest.approx(low, abs=1e-8)
        assert (one.grade, one.on) == (CERTAIN, f'foot {one.contact.link}')
    assert found.question == ''
    assert found.ground.value == pytest.approx(-0.4 * math.cos(0.6) - 0.02, abs=1e-6)


def test_a_foot_in_the_air_is_a_foot_too() -> None:
    """A leg of the same build is taken, to be checked: how high it is stands in its source."""
    found = derived(legged(), bent(lifted=0.2))
    grades = {one.contact.link: one.grade for one in found.points}
    assert grades == dict.fromkeys((f'{leg}_foot' for leg in LEGS[1:]), CERTAIN) | {
        'fl_foot': CHECK
    }


def test_flat_feet_stand_on_their_corners() -> None:
    """Four points each."""
    found = derived(legged(shape(box(0.04, 0.02, 0.01))), dict.fromkeys(bent(), 0.0))
    assert len(found.points) == 16


def test_legs_without_a_posture_are_asked_about() -> None:
    """With every joint at 0 they are stretched; a limit that this breaks is named."""
    found = derived(legged().replace('lower="-3" upper="3"', 'lower="-2" upper="-0.3"', 2))
    assert 'every joint at 0, which is outside of the limits of fl_thigh_joint' in found.question
    assert {one.grade for one in found.points} == {CHECK}


def test_a_robot_lying_on_its_body_is_asked_about() -> None:
    """With its legs folded the body touches as well."""
    folded = {f'{leg}_{n}_joint': x for leg in LEGS for n, x in (('thigh', 1.57), ('calf', 0.0))}
    assert (
        'of the body touches the ground'
        in derived(
            legged().replace('<box size="0.5 0.2 0.1"/>', '<box size="0.5 0.2 0.04"/>'), folded
        ).question
    )


def test_an_arm_alone_stands_on_nothing() -> None:
    """Its foot is small and most of it moves: no point is made up."""
    text, parent = '', 'base_link'
    for k in range(4):
        text += link(f'arm{k}', shape(box(0.05, 0.05, 0.3), '0 0 0.15'), 8.0)
        text += joint(f'arm{k}', '0 0 0.3', 'revolute', parent=parent)
        parent = f'arm{k}'
    found = derived(rover(shape(box(0.1, 0.1, 0.05)), text))
    assert (found.points, found.ground.grade) == ((), ASK)
    assert 'only an arm: what is it mounted on?' in found.question


@pytest.mark.parametrize('masses', ['', 'base'])
def test_without_masses_the_middle_of_the_geometry_counts(masses: str) -> None:
    """It is said, and nothing is certain then."""
    urdf = rover(BODY, four(WHEEL)).replace('<mass value="10.0"/>', '<mass value="0"/>')
    if not masses:
        urdf = urdf.replace('<mass value="1.0"/>', '<mass value="0"/>')
    found = derived(urdf)
    assert len(found.points) == 8
    assert {one.grade for one in found.points} == ({CERTAIN} if masses else {CHECK})
    assert any('no masses' in one for one in found.remarks) == (not masses)
