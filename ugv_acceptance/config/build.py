"""Combines a validated YAML file and a URDF into the settings of an evaluation."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from difflib import get_close_matches
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from ugv_acceptance import BadConfig
from ugv_acceptance.config.combining import Build
from ugv_acceptance.config.combining import known as _known
from ugv_acceptance.config.combining import listed as _list
from ugv_acceptance.config.combining import of_joint as _of_joint
from ugv_acceptance.config.document import Document
from ugv_acceptance.config.held import held_joints
from ugv_acceptance.config.imu_place import base_frame_from, imu_from
from ugv_acceptance.config.masses import check_masses
from ugv_acceptance.config.mimics import followed
from ugv_acceptance.config.poses import poses_from
from ugv_acceptance.config.schema import JointSection
from ugv_acceptance.config.units import shown
from ugv_acceptance.config.unknown import known_of
from ugv_acceptance.config.untold import untold_of
from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.config.wheels import on_axles
from ugv_acceptance.evaluation.ground import Ground
from ugv_acceptance.evaluation.inputs.frames import same_frame, without_prefix
from ugv_acceptance.evaluation.margin_words import percent_words
from ugv_acceptance.evaluation.permitted_limits import refused, relaxed
from ugv_acceptance.evaluation.settings import Delays, JointInput, Limits, Settings
from ugv_acceptance.model.clearance import arm_links
from ugv_acceptance.model.robot import Contact, Joint, Law, Link, Payload, Robot, Shape

__all__ = ['Build', 'assumed_numbers', 'checked', 'sentence_of', 'settings_from']
T = TypeVar('T')
M = TypeVar('M', bound=BaseModel)
# Keys of joints.NAME.law in order of Law, with their quantities: of a rotary joint, of a slide.
_LAW_KINDS = {
    'constant': ('torque', 'force'),
    'spring': ('stiffness', 'linear stiffness'),
    'rest': ('angle', 'length'),
}


# What is expected where the library's own words are no sentence for people.
_WORDS = {
    'string_too_short': 'expected a text that is not empty',
    'string_type': 'expected a text',
}


def checked(document: Document, model: type[M]) -> M:
    """Return the validated file; BadConfig with file, line and field of its first error."""
    try:
        return model.model_validate(document.data)
    except ValidationError as error:
        raise BadConfig(sentence_of(document, error)) from None


def sentence_of(document: Document, error: ValidationError) -> str:
    """Return the first validation error as one sentence: file, line, field, expected and given."""
    first, more = error.errors()[0], error.error_count() - 1
    return _sentence(document, dict(first)) + (f' (and {more} more)' if more else '')


def _sentence(document: Document, error: dict[str, Any]) -> str:
    context = error.get('ctx', {})
    path = tuple(part for part in error['loc'] if part != '[key]')
    if error['type'] == 'key':
        return f'{document.where((*path, context["key"]))}: {context["text"]}'
    where = document.where(path)
    if error['type'] == 'missing':
        return f'{where}: expected this key, got none'
    if 'error' in context:
        return f'{where}: {context["error"]}'
    if error['type'] in ('dict_type', 'model_type'):
        return f'{where}: expected keys with values, got {_given(error["input"])}'
    if error['type'] == 'string_pattern_mismatch':
        topic = '/' in context['pattern']
        kind = 'a topic such as /arm/joint_states: letters, digits, _ and /, no digit first'
        text = f'expected {kind if topic else "letters, digits, _ and - alone"}'
        return f'{where}: {text}, got {shown(error["input"])}'
    text = _WORDS.get(error['type']) or error['msg'].replace('Input should be', 'expected', 1)
    return f'{where}: {text}, got {shown(error["input"])}'


def _given(value: object) -> str:
    return 'nothing' if value is None else shown(value)


def settings_from(build: Build) -> Settings:
    """Return the settings of an evaluation; BadConfig if file and URDF do not fit each other."""
    file, unknown = known_of(build.file, build.refuse)
    build = replace(build, file=file)
    measured = _measured(build)
    stands = on_axles(robot := _robot(build, measured), build.refuse)
    robot = replace(robot, contacts=stands.contacts)
    joints = {name: robot.joint(name) for name in measured}
    settings = Settings(
        robot,
        tuple(_input(build, joints[name], section) for name, section in measured.items()),
        imu_from(build.file, robot, build.refuse),
        _limits(build, [(joints[name], section) for name, section in measured.items()]),
        Delays(**build.file.delays.model_dump()),
        build.file.unsafe_limits or '',
        build.file.payload is not None and build.file.payload.known,
        Ground(build.file.ground.kind, build.file.ground.pitch),
        tuple(name for name, section in measured.items() if section.passive),
        stands.moved,
        unknown=unknown,
        base_frame=base_frame_from(build.file, robot, build.refuse, build.warn),
        frame_prefix=build.file.robot.frame_prefix,
    )
    _check_inputs(build, settings)
    _check_ranges(build, settings)
    if build.file.joints is None:  # implied by the URDF: not all of them need to be told
        settings = replace(settings, untold=untold_of(robot, settings.limits.torque, settings.imu))
    return settings


def _check_ranges(build: Build, settings: Settings) -> None:
    """Refuse values outside their permitted range, or warn of them if the file gives a reason."""
    wrong = refused(settings)
    if wrong is not None:
        raise build.refuse(wrong.path, wrong.refusal)
    for found in relaxed(settings):
        build.warn(found.path, f'relaxed: {found.words}; reason: {settings.unsafe}')
    error, tip = settings.limits.torque_error, math.degrees(settings.limits.tip_error)
    if error > 1.0:
        build.warn(
            ('limits', 'torque_error'),
            f'a joint counts as within its limit up to {percent_words(error)} of it',
        )
    if tip <= 0.0:
        build.warn(
            ('limits', 'tip_error'),
            'a robot counts as standing until it is '
            + (f'{-tip:g} deg past tipping' if tip else 'past tipping'),
        )


def _check_inputs(build: Build, settings: Settings) -> None:
    """Refuse an input that is absent without what stands in its place, and what has no effect."""
    topics, imu = build.file.topics, build.file.imu
    if topics.imu is None and settings.hears_imu:
        raise build.refuse(
            ('topics', 'imu'),
            'expected a topic, or null with imu.attitude: level, which declares that the base '
            f'stands level; got null with imu.attitude: {imu.attitude}',
        )
    if topics.imu is not None and not settings.hears_imu:
        raise build.refuse(
            ('imu', 'attitude'), 'level is for robots without an IMU: expected topics.imu: null too'
        )
    if imu.specific_force and not settings.hears_imu:
        raise build.refuse(
            ('imu', 'specific_force'), 'expected false with imu.attitude: level, got true'
        )
    if topics.joint_states is None and settings.hears_joints:
        raise build.refuse(
            ('topics', 'joint_states'),
            'expected a topic, or null with the positions of all joints under held; '
            f'got null with {_list(settings.robot.joint_names)} under joints',
        )
    if not (settings.hears_joints or settings.hears_imu):
        raise build.refuse(
            ('topics',), 'expected joint states or an IMU: nothing is left that could be measured'
        )
    frame, link = topics.payload.frame_id, settings.robot.payload_link
    bare = without_prefix(frame or '', settings.frame_prefix)
    if frame and link and not same_frame(bare, link):
        build.warn(
            ('topics', 'payload', 'frame_id'),
            f'{frame} is not the payload link, {link}: loads declared in it cannot be used',
        )


def _measured(build: Build) -> dict[str, JointSection]:
    """Return the joints whose positions come in messages, in the file's order."""
    movable = [joint.name for joint in build.urdf.joints if joint.kind != 'fixed']
    named = build.file.joints
    if named is None and build.file.topics.joint_states is None:
        return {}
    if named is None:
        mimics = {mimic.joint for mimic in build.urdf.mimics}
        rest = (n for n in movable if n not in build.file.held and n not in mimics)
        return {name: JointSection() for name in rest}
    for name in named:
        _known(build, ('joints', name), name, movable, 'movable joint')
    topic_names = [section.topic_name or name for name, section in named.items()]
    for name, topic_name in zip(named, topic_names, strict=True):
        if topic_names.count(topic_name) > 1:
            raise build.refuse(
                ('joints', name, 'topic_name'),
                f'expected a name of its own, got {topic_name}, which another joint has too',
            )
    return dict(named)


def assumed_numbers(build: Build) -> tuple[tuple[str, str], ...] | None:
    """Return the numbers that are only assumed, with the reasons; None if the file says nothing.

    BadConfig for a name that begins with no link, joint or section of the file.
    """
    said, urdf = build.file.assumed, build.urdf
    if said is None:
        return None
    of = [link.name for link in urdf.links] + [joint.name for joint in urdf.joints]
    sections = [name for name in type(build.file).model_fields if name != 'assumed']
    for name in said:
        subject, _, what = name.partition('.')
        if not what or subject not in (*of, *sections):
            near = get_close_matches(subject, [*of, *sections], 1, 0.5)
            hint = f'; did you mean {near[0]}?' if near else ''
            raise build.refuse(
                ('assumed', name),
                'expected a link, joint or section of this file, a point, and which number of it, '
                f'such as shoulder_joint.limit, got {shown(name)}{hint}',
            )
    return tuple(said.items())


def _robot(build: Build, sections: dict[str, JointSection]) -> Robot:
    measured = tuple(sections)
    stays = {*measured, *build.file.held}
    file, links = build.file, [link.name for link in build.urdf.links]
    contacts = file.contacts or {}
    for name, contact in contacts.items():
        _known(build, ('contacts', name, 'link'), contact.link, links, 'link')
    if len(contacts) < 3:
        build.warn(('contacts',), f'{len(contacts)} contact points: no tip-over margin below 3')
    if file.payload is not None:
        _known(build, ('payload', 'link'), file.payload.link, links, 'link')
    bodies = tuple(_links(build, links))
    load = Payload() if file.payload is None else Payload(file.payload.mass, file.payload.cog)
    check_masses(bodies, build.urdf.joints, build.urdf.shapes, build.refuse, build.warn)
    robot = Robot(
        file.robot.name,
        bodies,
        build.urdf.joints,
        measured,
        tuple(Contact(name, c.link, c.position) for name, c in contacts.items()),
        tuple(held_joints(build, measured)),
        None if file.payload is None else file.payload.link,
        load,
        file.gravity,
        file.ground.height,
        file.ground.tolerance,
        tuple(m for m in followed(build.urdf.mimics, stays) if m.follows in measured),
        tuple(_laws(build, sections)),
    )
    joints = [robot.joint(name) for name in measured]
    robot = replace(robot, poses=tuple(poses_from(file.poses, joints, build.refuse)))
    arm = arm_links(robot)
    shapes = tuple(s for s in build.urdf.shapes if s.link in arm)
    return replace(robot, shapes=shapes, drawn=tuple(_drawn(build.urdf, shapes)))


def _drawn(urdf: Urdf, taken: Sequence[Shape]) -> Iterator[Shape]:
    """Yield what only pictures need: what was not taken, or else how a link is to look."""
    read = [shape for shape in urdf.shapes if shape.size is not None]
    solid = {shape.link for shape in read}
    yield from (shape for shape in read if shape not in taken)
    yield from (s for s in urdf.visuals if s.size is not None and s.link not in solid)


def _laws(build: Build, sections: dict[str, JointSection]) -> Iterable[Law]:
    """Yield what springs and constant torques put on measured joints."""
    joints = {joint.name: joint for joint in build.urdf.joints}
    for name, section in sections.items():
        law, path = section.law, ('joints', name, 'law')
        if section.passive and section.limit is not None:
            raise build.refuse(
                ('joints', name, 'passive'), 'expected no limit on a passive joint: none is judged'
            )
        if law is None:
            continue
        if not {'constant', 'spring'} & law.model_fields_set:
            raise build.refuse(path, 'expected constant or spring, got neither')
        numbers = [
            _of_joint(build, (*path, key), joints[name], getattr(law, key), *kinds)
            for key, kinds in _LAW_KINDS.items()
        ]
        yield Law(name, *numbers)


def _links(build: Build, names: list[str]) -> Iterable[Link]:
    """Yield the URDF's links, with masses and centres of gravity replaced where the file says."""
    for name in build.file.links:
        _known(build, ('links', name), name, names, 'link')
    for link in build.urdf.links:
        new = build.file.links.get(link.name)
        mass = link.mass if new is None or new.mass is None else new.mass
        cog = link.cog if new is None or new.cog is None else new.cog
        yield replace(link, mass=mass, cog=cog)


def _input(build: Build, joint: Joint, section: JointSection) -> JointInput:
    path = ('joints', joint.name, 'offset')
    return JointInput(
        section.topic_name or joint.name,
        section.sign,
        _of_joint(build, path, joint, section.offset, 'angle', 'length'),
        section.effort_sign,
        section.effort_scale,
    )


def _limits(build: Build, joints: list[tuple[Joint, JointSection]]) -> Limits:
    limits = build.file.limits
    if limits.torque_warn > limits.torque_error:
        raise build.refuse(
            ('limits', 'torque_warn'), f'expected at most torque_error, got {limits.torque_warn:g}'
        )
    if limits.tip_warn < limits.tip_error:
        raise build.refuse(
            ('limits', 'tip_warn'),
            f'expected at least tip_error, got {math.degrees(limits.tip_warn):g} deg',
        )
    torque = tuple(_limit(build, joint, section) for joint, section in joints)
    return Limits(
        torque=torque,
        rated=torque,
        speed=tuple(_speed(build, joint, section) for joint, section in joints),
        **limits.model_dump(exclude_none=True),
    )


def _limit(build: Build, joint: Joint, section: JointSection) -> float:
    """Return a joint's limit (N m or N): the file's, else the URDF's; infinite: not judged."""
    path = ('joints', joint.name, 'limit')
    if section.limit is not None:
        value = _of_joint(build, path, joint, section.limit, 'torque', 'force')
        if value <= 0.0:
            raise build.refuse(path, f'expected a limit above 0, got {value:g}')
        return value
    if section.passive:
        return math.inf
    if 'limit' not in section.model_fields_set and math.isinf(joint.effort):
        given = 'an effort of 0' if joint.name in build.urdf.unlimited else 'no effort'
        build.warn(path[:2], f'no limit here and {given} in the URDF: its torque is not judged')
    return math.inf if 'limit' in section.model_fields_set else joint.effort


def _speed(build: Build, joint: Joint, section: JointSection) -> float:
    """Return the rate up to which the static model is valid (rad/s or m/s); infinite: unjudged."""
    if section.static_speed is None:
        return math.inf
    path = ('joints', joint.name, 'static_speed')
    value = _of_joint(build, path, joint, section.static_speed, 'angular rate', 'rate')
    if value <= 0.0:
        raise build.refuse(path, f'expected a speed above 0, got {value:g}')
    return value
