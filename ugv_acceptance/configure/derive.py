"""Derives the draft of a robot from its URDF and from what was seen of it, part by part."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ugv_acceptance.config.contact_check import Kneeling, kneeling
from ugv_acceptance.config.urdf import Urdf, read_urdf
from ugv_acceptance.configure.contact_points import derive_contacts
from ugv_acceptance.configure.draft import (
    ASK,
    CHECK,
    Contacts,
    Derived,
    DerivedJoint,
    Draft,
    Joints,
)
from ugv_acceptance.configure.evidence import Evidence
from ugv_acceptance.configure.home import payload_link, positions
from ugv_acceptance.configure.joints import derive_joints, rest_posture
from ugv_acceptance.configure.mounting import derive_mounting
from ugv_acceptance.configure.sources import MeshFinder
from ugv_acceptance.evaluation.criteria.not_judged import MOST_JOINTS, carried
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.roles import roles_of

_LEGS = (
    'Its legs were taken as they are with every joint at 0, or mid of its range: is that how it '
    'stands? A recording of it standing contains its posture.'
)


@dataclass(frozen=True, slots=True)
class Given:
    """What a draft is derived from: the text of a URDF, what it is called, what was seen.

    `shown` is the path of the URDF as the YAML file names it.
    """

    text: bytes
    name: str
    shown: str
    evidence: Evidence | None
    meshes: MeshFinder


def draft_of(given: Given) -> Draft:
    """Return the draft of a robot, before any question is answered; BadConfig for a bad URDF."""
    urdf = read_urdf(given.text, given.name)
    evidence = given.evidence
    home = rest_posture(urdf, evidence)
    contacts = derive_contacts(urdf, positions(home), given.meshes)
    joints = derive_joints(urdf, evidence)
    robot = robot_of(urdf, joints, contacts)
    contacts = _asked_of_legs(robot, contacts, evidence)
    mass = math.fsum(link.mass for link in urdf.links)
    return Draft(
        urdf.name,
        urdf,
        given.shown,
        evidence,
        home,
        contacts,
        replace(joints, measured=_judged(robot, joints)),
        derive_mounting(urdf, evidence, positions(home)),
        payload_link(robot),
        Derived(mass, ASK, 'the sum of all links of the URDF'),
    )


def contacts_of(given: Given, draft: Draft, links: Sequence[str]) -> Contacts:
    """Return the contact points of a draft, derived anew from the geometry of some links alone."""
    shapes = tuple(shape for shape in draft.urdf.shapes if shape.link in links)
    urdf = replace(draft.urdf, shapes=shapes)
    return derive_contacts(urdf, positions(draft.home), given.meshes)


def _asked_of_legs(robot: Robot, contacts: Contacts, evidence: Evidence | None) -> Contacts:
    """Return contact points with the question of the posture, where legs stand in a guessed one."""
    knees = kneeling(robot, robot.shapes)
    if knees:
        return _no_knees(contacts, knees, guessed=evidence is None)
    if evidence is not None or contacts.question or not roles_of(robot).legs:
        return contacts
    return replace(contacts, question=_LEGS)


def _no_knees(contacts: Contacts, knees: Sequence[Kneeling], *, guessed: bool) -> Contacts:
    """Return contact points without any, where the posture has the robot on its knees."""
    ends = list(dict.fromkeys(one.end for one in knees))
    seen = 'with every joint at 0, or mid of its range,' if guessed else 'as recorded'
    question = (
        f'Its legs {seen} kneel: {knees[0].contact.link} would touch {1e3 * knees[0].near:.0f} mm '
        f'from its joint, {ends[0]} is further out. Name the ends of its legs '
        f'(--contacts {",".join(ends)}), or give a recording of it standing.'
    )
    ground: Derived[float] = Derived(None, ASK, 'no contact point is known')
    return replace(contacts, points=(), ground=ground, tilt=0.0, question=question)


def robot_of(urdf: Urdf, joints: Joints, contacts: Contacts) -> Robot:
    """Return the robot that parts of a draft describe, without a payload link."""
    names = tuple(joint.name for joint in joints.measured)
    return Robot(
        urdf.name,
        urdf.links,
        urdf.joints,
        names,
        tuple(point.contact for point in contacts.points),
        tuple((name, one.value or 0.0) for name, one in joints.held),
        ground=contacts.ground.value or 0.0,
        mimics=tuple(m for m in urdf.mimics if m.follows in names and m.joint not in names),
        shapes=urdf.shapes,
    )


def _judged(robot: Robot, joints: Joints) -> tuple[DerivedJoint, ...]:
    """Return the measured joints; no limit is asked of those on which no weight was found."""
    if not any(joint.limit.grade == ASK for joint in joints.measured):
        return joints.measured
    most = carried(robot) if len(joints.measured) <= MOST_JOINTS else {}
    idle: Derived[float] = Derived(None, CHECK, 'no weight puts a torque on it: not judged')
    return tuple(
        replace(joint, limit=idle)
        if joint.limit.grade == ASK and most.get(joint.name, math.inf) == 0.0
        else joint
        for joint in joints.measured
    )
