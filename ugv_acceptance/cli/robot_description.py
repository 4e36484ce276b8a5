"""Describes a robot in one posture as plain values, for `ugv-acceptance model`.

Keys end in their unit; an infinite number (no limit, no edge on that side) and NaN are None.
"""

import math
from collections.abc import Iterable
from typing import Any, SupportsFloat

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.terminal_output import complain
from ugv_acceptance.config import Config, quantity, rotation_from_rpy, worst_torques
from ugv_acceptance.config.poses import nearest_name, pose_named
from ugv_acceptance.evaluation.criteria.imu_mounting import mounting_words
from ugv_acceptance.evaluation.inputs.imu_mount import mounted
from ugv_acceptance.evaluation.rough_ground import cautious_angles, cautious_mechanics
from ugv_acceptance.evaluation.settings import AUTO
from ugv_acceptance.model.clearance import clearance, lowest_part, nearness_of
from ugv_acceptance.model.mechanics import Mechanics, Posture, mechanics_of, posture_of
from ugv_acceptance.model.reactions import Reactions, reactions_of
from ugv_acceptance.model.robot import Joint, Payload, Robot, Vector
from ugv_acceptance.model.stability import (
    RAISED,
    SIDES,
    STANDING,
    STATES,
    Stance,
    stability_of,
    stances_of,
    standing,
)
from ugv_acceptance.model.statics import payload_capacity
from ugv_acceptance.report.format import number_text
from ugv_acceptance.studies.postures import rest_posture

VERSION = 1

Values = dict[str, Any]


def describe(config: Config, posture: str = '', tilt: str = '', payload: str = '') -> Values:
    """Return links, joints, contacts and margins in a posture; arguments are those of the verb.

    Raises BadConfig where a joint is unknown or a value is no angle (length where prismatic).
    """
    robot = config.settings.robot
    q = posture_from(robot, posture)
    roll, pitch = tilt_from(tilt)
    gravity = tilted_gravity(robot, tilt)
    load = payload_from(robot, payload)
    mechanics = mechanics_of(robot)
    found = posture_of(mechanics, q, load.mass, load.cog)
    stance = standing(stances_of(mechanics, found), gravity)
    points = stance.points
    arm = _clearance(mechanics, stance, q, load)
    return {
        'version': VERSION,
        'robot': {'name': config.name, 'serial': config.serial, 'root': robot.root},
        'config': {
            'path': str(config.path),
            'urdf': str(config.urdf_path),
            'sha256': config.sha256,
        },
        'links': [_link(config, k) for k in range(len(robot.links))],
        'tilt': {'roll_deg': math.degrees(roll), 'pitch_deg': math.degrees(pitch)},
        'joints': _joints(config, q, reactions_of(mechanics, found, points, gravity)),
        'poses': _poses(robot),
        'payload': _payload(config, q, gravity, load),
        'total_mass_kg': found.mass,
        'centre_of_gravity_m': list(found.cog),
        'imu': _imu(config),
        'contacts': _contacts(robot, found, stance),
        'clearance': arm,
        **_stability(robot, stance, gravity, on_ground=arm['on_ground']),
        'ground': _ground(config, q, gravity, load),
        'uncertainty': dict(config.uncertainty),
        'warnings': [
            *config.warnings,
            *_outside(robot, q),
            *_grounded(arm),
            *_overload(config, load),
            *payload_doubts(robot, payload),
        ],
    }


def _imu(config: Config) -> str | None:
    """Return in words how the IMU is mounted; None: there is none."""
    settings = config.settings
    if not settings.hears_imu:
        return None
    auto = settings.imu.placed == AUTO
    if auto and not settings.imu.frame:
        return 'mounting: auto, by the frame_id of its messages'
    why = 'imu.mounting: unknown' if not auto else f'{settings.imu.frame} is no link of the URDF'
    return mounting_words(settings, mounted(settings, settings.imu.frame), why)


def posture_from(robot: Robot, text: str) -> list[float]:
    """Return joint positions (rad, m) from 'POSE,joint=30deg,...'; those left out are at rest.

    At rest is 0, or the middle of a range without it. The pose, one of the robot's, may be left
    out; positions given beside it replace the pose's. Raises BadConfig for a pose or joint that the
    robot has not, or a value that is no position.
    """
    at_rest = dict(zip(robot.joint_names, rest_posture(robot).tolist(), strict=True))
    return list((at_rest | positions_from(robot, text)).values())


def positions_from(robot: Robot, text: str) -> dict[str, float]:
    """Return the joints that such a text tells, with their positions (rad, m), and no others."""
    q: dict[str, float] = {}
    first, _, rest = text.partition(',')
    if first.strip() and '=' not in first and robot.poses:
        q |= pose_named(robot, first.strip(), '--posture')
        text = rest
    for name, value in _pairs(text, '--posture'):
        if name not in robot.joint_names:
            known = ', '.join(robot.joint_names) or 'none'
            hint = nearest_name(name, robot.joint_names)
            raise BadConfig(f'--posture: expected a measured joint ({known}), got {name}{hint}')
        kind = 'length' if robot.joint(name).slides else 'angle'
        q[name] = quantity(value, kind, f'--posture {name}={value}')
    return q


def payload_from(robot: Robot, text: str) -> Payload:
    """Return the payload for a mass such as '4' (kg) or '10 lb'; if empty, the robot's own."""
    mass = quantity(text, 'mass', '--payload') if text else robot.payload.mass
    if mass < 0.0:
        raise BadConfig(f'--payload: expected a mass >= 0 kg, got {mass:g}')
    return Payload(mass, robot.payload.cog)


def payload_doubts(robot: Robot, text: str, option: str = '--payload') -> list[str]:
    """Return a warning where the mass given is more than the robot's own; else nothing."""
    mass = quantity(text, 'mass', option) if text else 0.0
    if mass <= robot.mass:
        return []
    bare = not any(letter.isalpha() for letter in text)
    question = 'are these grams?' if bare else 'is that the right unit?'
    return [f'{option} {mass:g} kg: more than the robot weighs ({robot.mass:.1f} kg): {question}']


def warn(sentences: Iterable[str]) -> None:
    """Print warnings to standard error."""
    for text in sentences:
        complain(f'warning: {text}')


def tilted_gravity(robot: Robot, text: str) -> Vector:
    """Return gravity (m/s2) in `base_link` at a tilt such as 'roll=10deg,pitch=5deg'."""
    roll, pitch = tilt_from(text)
    x, y, z = rotation_from_rpy((roll, pitch, 0.0))[2]
    return (-robot.gravity * x, -robot.gravity * y, -robot.gravity * z)


def tilt_from(text: str) -> tuple[float, float]:
    """Return roll and pitch (rad) of 'roll=10deg,pitch=5deg'."""
    tilt = {'roll': 0.0, 'pitch': 0.0}
    for name, value in _pairs(text, '--tilt'):
        if name not in tilt:
            raise BadConfig(f'--tilt: expected roll or pitch, got {name}')
        tilt[name] = quantity(value, 'angle', f'--tilt {name}={value}')
        if abs(tilt[name]) > math.pi:
            raise BadConfig(f'--tilt {name}={value}: expected at most 180 deg to either side')
    return tilt['roll'], tilt['pitch']


def _pairs(text: str, option: str) -> list[tuple[str, str]]:
    pairs = [part.partition('=') for part in text.split(',') if part.strip()]
    for name, equals, _ in pairs:
        if not equals:
            raise BadConfig(f'{option}: expected name=value,name=value, got {name}')
    names = [name.strip() for name, _, _ in pairs]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        raise BadConfig(f'{option}: expected each name once, got {twice} twice')
    return [(name.strip(), value) for name, _, value in pairs]


def _link(config: Config, k: int) -> Values:
    link = config.settings.robot.links[k]
    return {'name': link.name, 'mass_kg': link.mass, 'centre_of_gravity_m': list(link.cog)}


def _joints(config: Config, q: list[float], found: Reactions) -> list[Values]:
    """Return the measured joints in their order, then those that are held or follow another."""
    settings, robot = config.settings, config.settings.robot
    rows = []
    torque: Any = found.even
    for k, (name, given, position, limit, value) in enumerate(
        zip(robot.joint_names, settings.joints, q, settings.limits.torque, torque, strict=True)
    ):
        rows.append(
            _joint(robot.joint(name), position)
            | {
                'topic_name': given.topic_name,
                'limit': _finite(limit),
                'torque': float(value),
                'margin': _finite(limit - abs(value)),
                'utilisation': abs(value) / limit if math.isfinite(limit) else None,
                'carrying': _carrying(found, k),
                'passive': name in settings.passive,
            }
        )
    places = dict(robot.held)
    places |= {
        m.joint: m.multiplier * q[robot.joint_names.index(m.follows)] + m.offset
        for m in robot.mimics
    }
    follows = {m.joint: m.follows for m in robot.mimics}
    still = (j for j in robot.joints if j.kind != 'fixed' and j.name not in robot.joint_names)
    return rows + [
        _joint(j, places.get(j.name, 0.0)) | {'topic_name': None, 'follows': follows.get(j.name)}
        for j in still
    ]


def _poses(robot: Robot) -> list[Values]:
    """Return the named postures: every measured joint's position (rad, m), 0 where not named."""
    at_zero = dict.fromkeys(robot.joint_names, 0.0)
    return [{'name': p.name, 'positions': at_zero | dict(p.positions)} for p in robot.poses]


def _carrying(found: Reactions, k: int) -> Values | None:
    """Return what is known of the torque of a joint that carries the robot; None: it does not."""
    if k not in found.carrying:
        return None
    ends: Any = (found.hanging[k], found.least[k], found.most[k])
    hanging, least, most = map(float, ends)
    return {'hanging': hanging, 'least': least, 'most': most}


def _joint(joint: Joint, position: float) -> Values:
    return {
        'name': joint.name,
        'kind': joint.kind,
        'parent': joint.parent,
        'child': joint.child,
        'unit': joint.units.position,
        'torque_unit': joint.units.effort,
        'lower': _finite(joint.lower),
        'upper': _finite(joint.upper),
        'position': position,
    }


def _payload(
    config: Config, q: list[float], gravity: tuple[float, float, float], load: Payload
) -> Values:
    robot = config.settings.robot
    largest = math.inf
    if robot.payload_link is not None and q:
        largest = float(payload_capacity(robot, q, gravity, config.settings.limits.torque))
    return {
        'link': robot.payload_link,
        'mass_kg': load.mass,
        'centre_of_gravity_m': list(load.cog),
        'largest_kg': _finite(max(largest, 0.0)),
        'holds_itself': largest >= 0.0,
    }


def _contacts(robot: Robot, found: Posture, stance: Stance) -> list[Values]:
    return [
        {
            'name': contact.name,
            'link': contact.link,
            'position_m': list(point),
            'corner': stance.footing is not None and k in stance.footing.polygon,
        }
        for k, (contact, point) in enumerate(zip(robot.contacts, found.contacts, strict=True))
    ]


def _clearance(mechanics: Mechanics, stance: Stance, q: list[float], load: Payload) -> Values:
    """Return how high the arm is above the ground, and which part of it is lowest."""
    face = stance.ground_face
    height = float(clearance(mechanics, face, q, load.cog))
    return {
        'height_m': _finite(height),
        'lowest': lowest_part(mechanics, face, q, load.cog) or None,
        'on_ground': height <= nearness_of(mechanics).touches,
    }


def _grounded(arm: Values) -> list[str]:
    if not arm['on_ground']:
        return []
    height = arm['height_m']
    where = f'{abs(height):.2f} m {"above" if height > 0.0 else "below"}'
    words = 'so the arm stands on it: no margin is valid, and torques are those of one in the air'
    return [f'--posture: {arm["lowest"]} is {where} the ground, {words}']


def _stability(
    robot: Robot, stance: Stance, gravity: tuple[float, float, float], *, on_ground: bool
) -> Values:
    """Return the support polygon (names, counter-clockwise from above) and the margins."""
    margins, footing = stability_of(stance, gravity), stance.footing
    # Upside down, or on its arm, it does not stand on these points: their edges say nothing.
    stands = margins.state in (STANDING, RAISED) and not on_ground
    return {
        'support_polygon': [robot.contacts[k].name for k in footing.polygon] if footing else [],
        'state': STATES[int(margins.state)],
        'sides': {
            side: {
                'tilt_left_deg': _finite(math.degrees(margins.angle[k])) if stands else None,
                'restoring_moment_nm': _finite(margins.moment[k]) if stands else None,
                'energy_j': _finite(margins.energy[k]) if stands else None,
            }
            for k, side in enumerate(SIDES)
        },
        'zmp_margin_m': _finite(margins.zmp) if stands else None,
    }


def _ground(
    config: Config, q: list[float], gravity: tuple[float, float, float], load: Payload
) -> Values:
    """Return what the ground is taken for; where it is not flat also the cautious margins."""
    robot, ground = config.settings.robot, config.settings.ground
    found: Values = {'kind': ground.kind, 'pitch_m': ground.pitch, 'cautious_deg': None}
    if ground.rough:
        short = cautious_mechanics(robot, ground.pitch)
        angles = cautious_angles(short, q, gravity, load)
        pairs = zip(SIDES, angles, strict=True)
        found['cautious_deg'] = {side: _finite(math.degrees(angle)) for side, angle in pairs}
    return found


def _outside(robot: Robot, q: list[float]) -> list[str]:
    return [
        f'--posture: {name}: {position:g} is outside its range {joint.lower:g} .. {joint.upper:g}'
        for name, position in zip(robot.joint_names, q, strict=True)
        if not (joint := robot.joint(name)).lower <= position <= joint.upper
    ]


def _overload(config: Config, load: Payload) -> list[str]:
    """Return a sentence for each torque limit that cannot hold the payload in every posture."""
    robot, limits = config.settings.robot, config.settings.limits.torque
    return [
        f'{worst.joint}: limit {limit:g} {worst.unit} cannot hold {load.mass:g} kg'
        f' in every posture: up to {number_text(worst.torque, 1, worst.unit)} needed'
        for worst, limit in zip(worst_torques(robot, load), limits, strict=False)
        if load.mass > 0.0 and worst.torque > limit
    ]


def _finite(value: SupportsFloat) -> float | None:
    return float(value) if math.isfinite(value) else None
