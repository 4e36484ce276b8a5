"""What must be right before a configuration is done: how it stands, what is told, where the IMU is.

The geometry is checked by config/setup_checks.py; here is what needs a recording, and what is open.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.config import Config
from ugv_acceptance.config.setup_checks import DOUBT, SetupDoubt, setup_doubts
from ugv_acceptance.config.urdf import Urdf
from ugv_acceptance.configure.evidence import Evidence, SeenImu
from ugv_acceptance.configure.imu_gravity import up_of
from ugv_acceptance.configure.outlines import FAR, away_from, outlines_of, reach_of
from ugv_acceptance.configure.questions import Question
from ugv_acceptance.configure.sources import MeshFinder
from ugv_acceptance.evaluation.inputs.frames import place_of
from ugv_acceptance.evaluation.margin_words import tipping_words
from ugv_acceptance.evaluation.settings import AUTO, UNKNOWN, Settings
from ugv_acceptance.model.mechanics import mechanics_of, posture_once
from ugv_acceptance.model.robot import ZERO, Matrix, Robot, Vector
from ugv_acceptance.model.roles import chain_to, roles_of
from ugv_acceptance.model.stability import NO_CONTACT, SIDES, stability_of, stances_of
from ugv_acceptance.model.stability import standing as stance_by
from ugv_acceptance.model.tree import body_positions, drives_of, point_of, pose_of, tree_of
from ugv_acceptance.type_aliases import Floats

OK, FAILS, OPEN, UNSEEN, LOOK = 'ok', 'FAILS', 'open', 'not seen', 'look'
STANDS = 'how it stands'
# A joint that nobody tells may carry so much of the mass, unless it is of the arm.
SHARE = 0.05
# A contact point so far (m) from all geometry is on none, whatever treads are not drawn.
SURELY = 0.05
# Up by the IMU at rest may be so far (rad) from up by the contact points: ground is not level.
SLOPE = math.radians(10.0)


@dataclass(frozen=True, slots=True)
class Check:
    """One check: what was looked at, its state, and why.

    FAILS and OPEN keep a configuration from being done; UNSEEN: nothing was there to see it by;
    LOOK: it may be so.
    """

    what: str
    state: str
    text: str


def checks_of(
    config: Config,
    urdf: Urdf,
    posture: Mapping[str, float],
    evidence: Evidence | None,
    meshes: MeshFinder,
    questions: Sequence[Question] = (),
) -> tuple[Check, ...]:
    """Return the checks of a configuration in a posture (rad, m), against what was seen if given.

    `questions` are those that nobody answered.
    """
    settings = config.settings
    found = [
        *_stands(config, urdf, posture, evidence),
        *_on_robot(config.settings.robot, urdf, posture, meshes),
        _told(settings, evidence),
        _gravity(config, posture, evidence),
        *(Check(q.key, OPEN, q.text) for q in questions),
    ]
    if not questions:
        found += [Check(key, OPEN, 'the configuration says unknown') for key in settings.unknown]
    return tuple(found)


def exit_code(checks: Sequence[Check]) -> int:
    """Return 1 where a check fails, 3 where something is open, else 0."""
    states = {check.state for check in checks}
    return 1 if FAILS in states else 3 if OPEN in states else 0


def positions_of(robot: Robot, posture: Mapping[str, float]) -> list[float]:
    """Return the positions of the measured joints in a posture, 0 where it does not say."""
    return [posture.get(name, 0.0) for name in robot.joint_names]


def _stands(
    config: Config, urdf: Urdf, posture: Mapping[str, float], evidence: Evidence | None
) -> Iterator[Check]:
    """Yield what the contact points say of how the robot stands."""
    settings = config.settings
    if not settings.judges_tilt:
        if not settings.hears_imu:
            yield Check(STANDS, UNSEEN, 'no IMU: tip-over is not judged')
        return
    known = [name for name, _ in config.assumed or ()]
    seen = posture if evidence is not None else None
    doubts = setup_doubts(settings.robot, urdf.shapes, posture=seen, known=known)
    for doubt in doubts:
        yield Check('.'.join(doubt.field), _state(doubt, evidence), doubt.words)
    if not doubts:
        words = _balance(settings.robot, posture)
        if evidence is None and roles_of(settings.robot).legs:
            how = 'no recording tells how its legs stand; with joints at 0, or mid of their range'
            yield Check(STANDS, UNSEEN, f'{how}: {words}')
        else:
            yield Check(STANDS, OK, words)


def _on_robot(
    robot: Robot, urdf: Urdf, posture: Mapping[str, float], meshes: MeshFinder
) -> Iterator[Check]:
    """Yield the contact points that are away from all geometry of the robot."""
    if not robot.contacts:
        return
    outlines = outlines_of(urdf, posture, meshes)
    reach, tree = reach_of(list(outlines.values())), tree_of(robot)
    pose = pose_of(tree, body_positions(drives_of(robot, tree), positions_of(robot, posture)))
    for contact in robot.contacts:
        at = np.array(point_of(tree, pose, contact.link, contact.position)[1], dtype=np.float64)
        off = away_from(at, reach)
        if off > FAR:
            # What was not read may be there.
            known = contact.link in outlines and off > SURELY
            words = f'{off * 1e3:.0f} mm away from all geometry of the robot that could be read'
            yield Check(f'contacts.{contact.name}', FAILS if known else OPEN, words)


def _state(doubt: SetupDoubt, evidence: Evidence | None) -> str:
    """Return how a doubt about the contact points counts.

    Where no recording tells a posture, the centre of gravity of another one is only worth a look.
    """
    if doubt.severity == DOUBT:
        return LOOK if len(doubt.field) == 1 and evidence is None else OPEN
    return FAILS


def _balance(robot: Robot, posture: Mapping[str, float]) -> str:
    """Return in words how the robot stands in a posture on level ground."""
    mechanics = mechanics_of(robot)
    found = posture_once(robot, positions_of(robot, posture), 0.0, ZERO)
    gravity = (0.0, 0.0, -robot.gravity)
    margins = stability_of(stance_by(stances_of(mechanics, found), gravity), gravity)
    if int(margins.state) >= NO_CONTACT:
        return f'{len(robot.contacts)} points'
    known = [(float(a), side) for a, side in zip(margins.angle, SIDES, strict=True)]
    least, side = min((a, side) for a, side in known if math.isfinite(a))
    return f'{len(robot.contacts)} points; level, {tipping_words(side, least)}'


def _told(settings: Settings, evidence: Evidence | None) -> Check:
    """Return whether every joint that matters is told by messages."""
    what, robot = 'joints told', settings.robot
    untold = _that_matter(robot)
    if evidence is None:
        return Check(what, UNSEEN, f'no recording: {len(robot.joint_names)} joints are to be told')
    seen = {joint.topic_name for joint in evidence.joints}
    missing = [
        name
        for name, given in zip(robot.joint_names, settings.joints, strict=True)
        if given.topic_name not in seen
    ]
    if missing:
        return Check(what, FAILS, f'{_list(missing)}: under joints, but no message tells them')
    if untold:
        return Check(what, FAILS, f'told by nobody, but where they stand matters: {_list(untold)}')
    return Check(what, OK, f'{len(robot.joint_names)} measured; held: {_list(_held(robot))}')


def _list(names: Sequence[str]) -> str:
    more = f' and {len(names) - 6} more' if len(names) > 6 else ''
    return ', '.join(names[:6]) + more or 'none'


def _held(robot: Robot) -> list[str]:
    moves = {*robot.joint_names, *(mimic.joint for mimic in robot.mimics)}
    return [j.name for j in robot.joints if j.kind != 'fixed' and j.name not in moves]


def _that_matter(robot: Robot) -> list[str]:
    """Return the held joints that carry much of the mass or are of the arm, wheels left out."""
    roles, total = roles_of(robot), robot.mass
    arm = chain_to(robot, robot.payload_link) if robot.payload_link else roles.arm
    masses = {link.name: link.mass for link in robot.links}
    found = []
    for name in _held(robot):
        if name in roles.wheels:
            continue
        links = [robot.joint(name).child]
        for link in links:
            links += [joint.child for joint in robot.joints if joint.parent == link]
        if name in arm or math.fsum(masses[link] for link in links) > SHARE * total:
            found.append(name)
    return found


def _gravity(config: Config, posture: Mapping[str, float], evidence: Evidence | None) -> Check:
    """Return whether gravity at rest, by the IMU as it is mounted, is along the root link."""
    what, settings = 'IMU against gravity', config.settings
    if not settings.hears_imu:
        return Check(what, UNSEEN, 'the robot has no IMU')
    if settings.imu.placed == UNKNOWN:
        return Check(what, OPEN, 'how the IMU is mounted is unknown')
    if evidence is None:
        return Check(what, UNSEEN, 'no recording: the monitor and evaluate look at it')
    imu = _imu_of(config, evidence)
    if imu is None:
        return Check(what, FAILS, f'no IMU on {config.topics.imu.name} in {evidence.place}')
    return Check(what, *_by_gravity(config, posture, evidence, imu))


def _by_gravity(
    config: Config, posture: Mapping[str, float], evidence: Evidence, imu: SeenImu
) -> tuple[str, str]:
    """Return the state of the check, and how far (deg) up is off the root link's z axis."""
    up = up_of(imu)
    if not up.directions:
        return UNSEEN, f'{imu.topic} does not tell gravity at rest'
    place = imu_place(config, posture, evidence, imu.frame)
    if place is None:
        return FAILS, f'its frame {imu.frame} is nowhere on the robot'
    turn: Floats = np.array(place[1])
    lean = max(_lean(turn @ np.array(direction)) for direction in up.directions)
    words = f'at rest up is {math.degrees(lean):.1f} deg off the root link'
    if lean > SLOPE:
        return FAILS, f'{words}: wrong mounting, or it stood on a slope'
    return OK, words


def imu_place(
    config: Config, posture: Mapping[str, float], evidence: Evidence | None, frame: str = ''
) -> tuple[Vector, Matrix] | None:
    """Return where the IMU is in the root link's axes in a posture, and its axes; None: unknown.

    `frame` is what its messages name, where the configuration names none.
    """
    robot, imu = config.settings.robot, config.settings.imu
    link, xyz, turn = imu.link or robot.root, imu.position, imu.mounting
    if imu.placed == UNKNOWN:
        return None
    if imu.placed == AUTO:
        told = evidence.transforms if evidence is not None else ()
        transforms = [(t.parent, t.child, t.xyz, t.rotation) for t in told]
        name = frame or imu.frame
        found = place_of(robot, name, transforms) if name else None
        if found is None:
            return None
        link, xyz, turn = found.link, found.xyz, found.rotation
    tree = tree_of(robot)
    pose = pose_of(tree, body_positions(drives_of(robot, tree), positions_of(robot, posture)))
    body, own, _ = tree.frames[link]
    at = np.array(point_of(tree, pose, link, xyz)[1], dtype=np.float64)
    axes = np.array(pose.rotation[body], dtype=np.float64) @ np.array(own) @ np.array(turn)
    a, b, c = ((float(i), float(j), float(k)) for i, j, k in axes)
    return (float(at[0]), float(at[1]), float(at[2])), (a, b, c)


def _lean(up: Floats) -> float:
    return math.acos(max(-1.0, min(1.0, float(up[2]))))


def _imu_of(config: Config, evidence: Evidence) -> SeenImu | None:
    name = config.topics.imu.name.lstrip('/')
    on = [imu for imu in evidence.imus if imu.topic.lstrip('/') == name]
    frame = config.settings.imu.frame
    named = [imu for imu in on if not frame or imu.frame.lstrip('/') == frame]
    return (named or on or [None])[0]  # type: ignore[list-item]
