"""Which joints are told, by which names, with which limits; the others and where they are held."""

import math
from dataclasses import replace

import pytest
from configure.seen_robots import joint, urdf_of

from ugv_acceptance.config.urdf import Urdf, read_urdf
from ugv_acceptance.configure.draft import ASK, CERTAIN, CHECK, Joints
from ugv_acceptance.configure.evidence import Evidence, SeenJoint
from ugv_acceptance.configure.joints import derive_joints, rest_posture
from ugv_acceptance.configure.names import match_names

LIFT = joint('lift_joint', effort=30.0)
BEND = joint('bend_joint', effort=20.0, parent='lift_joint_link')
ARM = urdf_of(LIFT, BEND)
WHEEL = joint('wheel', 'continuous', None, cog=0.0)


def of(text: str) -> Urdf:
    """The URDF of a text."""
    return read_urdf(text.encode(), 'made.urdf')


def told(*names: str, at: float = 0.5, topic: str | None = '/joint_states') -> Evidence:
    """What a robot tells whose joints of these names all stand at one position."""
    seen = tuple(SeenJoint(name, at, at, at, effort=True) for name in names)
    return Evidence('/runs/run.mcap', joint_states=topic, joints=seen)


def names_of(joints: Joints) -> dict[str, str]:
    """The measured joints with the names that messages use."""
    return {measured.name: measured.topic_name for measured in joints.measured}


@pytest.mark.parametrize(
    ('first', 'last'),
    [('', ''), ('r1_', ''), ('robot/', ''), ('', '_state'), ('/ns/arm_', '')],
)
def test_names_with_a_common_prefix_or_suffix_are_found(first: str, last: str) -> None:
    """And the prefix is told once."""
    names = [f'{first}{name}{last}' for name in ('lift_joint', 'bend_joint')]
    found = derive_joints(of(ARM), told(*names, 'wheel_left'))
    assert names_of(found) == dict(zip(('lift_joint', 'bend_joint'), names, strict=True))
    assert found.prefix == first
    assert found.question == ''
    assert (found.topic.value, found.topic.grade) == ('joint_states', CERTAIN)


def test_a_prefix_of_the_urdf_is_found() -> None:
    """Which messages leave out."""
    text = ARM.replace('lift_joint', 'r1_lift').replace('bend_joint', 'r1_bend')
    found = derive_joints(of(text), told('lift', 'bend'))
    assert names_of(found) == {'r1_lift': 'lift', 'r1_bend': 'bend'}


def test_names_that_differ_in_separators_are_found() -> None:
    """And each is told: a URDF's exporter may write dots."""
    text = ARM.replace('lift_joint"', 'arm.1_Joint"')
    found = derive_joints(of(text), told('arm_1_joint', 'bend_joint'))
    assert names_of(found) == {'arm.1_Joint': 'arm_1_joint', 'bend_joint': 'bend_joint'}
    assert 'arm.1_Joint is called arm_1_joint in the messages' in found.remarks


def test_equal_names_are_taken_before_prefixed_ones() -> None:
    """Another robot's joints on the same topic are named as foreign."""
    names = ('lift_joint', 'bend_joint', 'r2_lift_joint', 'r2_bend_joint')
    found = derive_joints(of(ARM), told(*names))
    assert names_of(found) == {'lift_joint': 'lift_joint', 'bend_joint': 'bend_joint'}
    (foreign,) = (remark for remark in found.remarks if 'URDF does not have' in remark)
    assert 'r2_lift_joint, r2_bend_joint' in foreign


def test_two_prefixes_that_fit_are_asked_for() -> None:
    """None of them is taken."""
    names = ('r1_lift_joint', 'r1_bend_joint', 'r2_lift_joint', 'r2_bend_joint')
    found = derive_joints(of(ARM), told(*names))
    assert found.measured == ()
    assert 'r1_' in found.question
    assert 'r2_' in found.question


def test_one_name_that_ends_alike_is_no_prefix() -> None:
    """Left_wheel is not front_left_wheel: one of several joints proves no prefix."""
    matched = match_names(['left_wheel', 'lift'], ['front_left_wheel', 'lift'])
    assert dict(matched.told) == {'lift': 'lift'}


def test_a_recording_of_another_robot_is_asked_about() -> None:
    """What it names is in the question."""
    found = derive_joints(of(ARM), told('hip', 'knee'))
    assert found.question.startswith('Is it this robot?')
    assert 'hip, knee' in found.question
    assert found.topic.grade == ASK


def test_topics_that_fit_equally_are_asked_for() -> None:
    """As with two robots in one recording."""
    evidence = replace(told('lift_joint', 'bend_joint'), rivals=('/r2/joint_states',))
    found = derive_joints(of(ARM), evidence)
    assert found.topic.grade == ASK
    assert '/r2/joint_states' in found.question


def test_what_nobody_tells_is_held_and_told_in_one_line() -> None:
    """Casters by their number, others by name; at 0 if their range has it, else amid it."""
    casters = [joint(f'caster_{k}_joint', 'continuous', None, cog=0.0) for k in range(4)]
    text = urdf_of(LIFT, BEND, *casters, WHEEL, joint('knee', span=(-2.0, -1.0)))
    found = derive_joints(of(text), told('lift_joint', 'bend_joint'))
    held = {name: (value.value, value.grade) for name, value in found.held}
    assert held['knee'] == (-1.5, CHECK)
    assert held['caster_0_joint'] == held['wheel'] == (0.0, CERTAIN)
    assert '4 caster joints and 1 wheel joint and knee are in no message: held at 0, or the ' in (
        ' '.join(found.remarks)
    )


def test_a_joint_that_follows_another_is_neither_measured_nor_held() -> None:
    """Though messages tell it: the URDF's law is used."""
    mimic = joint('right', more='<mimic joint="lift_joint" multiplier="-1"/>')
    found = derive_joints(of(urdf_of(LIFT, mimic)), told('lift_joint', 'right'))
    assert names_of(found) == {'lift_joint': 'lift_joint'}
    assert found.held == ()
    assert not any('URDF does not have' in remark for remark in found.remarks)


@pytest.mark.parametrize(
    ('efforts', 'value', 'grade'),
    [
        ((30.0, 20.0, 10.0), 30.0, CHECK),
        ((0.0, 20.0, 10.0), None, ASK),
        ((None, 20.0, 10.0), None, ASK),
        ((1000.0, 20.0, 10.0), 1000.0, ASK),
        ((80.0, 80.0, 80.0), 80.0, ASK),
    ],
)
def test_a_limit_is_as_sure_as_it_looks(
    efforts: tuple[float | None, ...], value: float | None, grade: str
) -> None:
    """0, none, 1000 and more, and one value everywhere are placeholders; nothing is certain."""
    joints = [joint(f'j{k}', effort=effort) for k, effort in enumerate(efforts)]
    limit = derive_joints(of(urdf_of(*joints, WHEEL)), None).measured[0].limit
    assert (limit.value, limit.grade) == (value, grade)


def test_wheels_and_casters_are_not_judged() -> None:
    """A balanced wheel has no limit to ask for, and a caster that is told is passive."""
    caster = joint('front_caster_swivel', 'continuous', 5.0)
    found = derive_joints(of(urdf_of(WHEEL, caster)), told('wheel', 'front_caster_swivel'))
    wheel, swivel = found.measured
    assert (wheel.limit.value, wheel.limit.grade, wheel.passive) == (None, CERTAIN, False)
    assert (swivel.limit.value, swivel.limit.grade, swivel.passive) == (None, CERTAIN, True)


def test_a_joint_that_turns_what_is_off_its_axis_is_no_wheel() -> None:
    """Nor one that carries another joint."""
    flipper = joint('flipper', 'continuous', None, cog=0.1)
    turret = joint('turret', 'continuous', None, cog=0.0)
    text = urdf_of(flipper, turret, joint('lift', parent='turret_link'))
    for measured in derive_joints(of(text), None).measured[:2]:
        assert measured.limit.grade == ASK


def test_without_messages_all_joints_are_taken_as_told() -> None:
    """Which is to be checked, and what is often told by nobody is named."""
    found = derive_joints(of(urdf_of(LIFT, joint('caster', 'continuous', None))), None)
    assert names_of(found) == {'lift_joint': 'lift_joint', 'caster': 'caster'}
    assert (found.topic.value, found.topic.grade) == ('joint_states', CHECK)
    assert any('caster' in remark for remark in found.remarks)


def test_a_rover_whose_recording_has_no_joint_states_needs_none() -> None:
    """The angles of its wheels change nothing; an arm would have to be told."""
    nothing = told(topic=None)
    rover = derive_joints(of(urdf_of(WHEEL)), nothing)
    assert (rover.topic.value, rover.measured) == (None, ())
    assert [name for name, _ in rover.held] == ['wheel']
    arm = derive_joints(of(ARM), nothing)
    assert (arm.topic.value, arm.topic.grade) == ('joint_states', ASK)
    assert len(arm.measured) == 2


def test_the_rest_posture_is_what_messages_tell() -> None:
    """What turns without end within half a turn of 0; what is not told as it is held."""
    turret = joint('turret', 'continuous', None)
    text = urdf_of(turret, joint('knee', span=(-2.0, -1.0)))
    found = rest_posture(of(text), told('turret', at=4.0))
    assert found['turret'].value == pytest.approx(4.0 - math.tau)
    assert (found['knee'].value, found['knee'].grade) == (-1.5, CHECK)


def test_a_position_in_degrees_is_no_posture() -> None:
    """It is named, and where the joint stands has to be asked."""
    evidence = told('lift_joint', 'bend_joint', at=60.0)
    assert any('degrees' in remark for remark in derive_joints(of(ARM), evidence).remarks)
    stands = rest_posture(of(ARM), evidence)['lift_joint']
    assert (stands.value, stands.grade) == (0.0, ASK)
