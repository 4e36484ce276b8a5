"""Reads the section `uncertainty:` of a robot file: the +/- of masses, lengths, limits, angles."""

from collections.abc import Sequence
from difflib import get_close_matches

from ugv_acceptance import BadConfig
from ugv_acceptance.config.loading import Config
from ugv_acceptance.config.units import UNITS, split_key
from ugv_acceptance.evaluation.criteria.uncertainty import CONTACTS, IMU, PAYLOAD, Source
from ugv_acceptance.model.robot import Robot

_AXES = ('x', 'y', 'z')
# First part of a key -> (what is uncertain, axis); _UNITS: what -> quantities its unit may be of.
_VECTOR = {f'cog_{name}': ('cog', axis) for axis, name in enumerate(_AXES)}
_PLACE = {name: ('place', axis) for axis, name in enumerate(_AXES)}
_LINK = {'mass': ('mass', 0), **_VECTOR}
_JOINT = {**_PLACE, 'offset': ('offset', 0), 'limit': ('limit', 0)}
_IMU = {'roll': ('roll', 0), 'pitch': ('pitch', 0)}
_UNITS = {
    'mass': ('mass',),
    'cog': ('length',),
    'place': ('length',),
    'offset': ('angle', 'length'),
    'limit': ('torque', 'force'),
    'roll': ('angle',),
    'pitch': ('angle',),
}


def sources_from(config: Config) -> tuple[Source, ...]:
    """Return a configuration's sources of uncertainty; BadConfig for a key that fits nothing."""
    robot = config.settings.robot
    return tuple(_source(config, robot, name, value) for name, value in config.uncertainty)


def _source(config: Config, robot: Robot, name: str, value: float) -> Source:
    subject, _, ending = name.rpartition('.')
    known = _known(robot, subject)
    if not known:
        subjects = [*_subjects(robot), PAYLOAD, CONTACTS, IMU]
        raise _refused(config, name, 'a link, joint, payload, contacts or imu', subject, subjects)
    stem, unit = split_key(ending)
    if stem not in known or unit is None:
        raise _refused(config, name, f'one of {", ".join(known)} with a unit', ending, list(known))
    what, axis = known[stem]
    kind, factor = UNITS[unit]
    if kind not in _UNITS[what]:
        raise BadConfig(
            f'{config.path}: uncertainty.{name}: expected a unit of {" or ".join(_UNITS[what])}, '
            f'got {unit}'
        )
    return Source(name, subject, what, value * factor, axis)


def _known(robot: Robot, subject: str) -> dict[str, tuple[str, int]]:
    """Return what can be uncertain of a subject; {} if nothing has that name."""
    if subject == PAYLOAD:
        return _LINK
    if subject == CONTACTS:
        return _PLACE
    if subject == IMU:
        return _IMU
    if subject in {link.name for link in robot.links}:
        return _LINK
    if subject in {joint.name for joint in robot.joints}:
        return _JOINT if subject in robot.joint_names else _PLACE
    return {}


def _subjects(robot: Robot) -> list[str]:
    return [link.name for link in robot.links] + [joint.name for joint in robot.joints]


def _refused(config: Config, name: str, expected: str, got: str, known: Sequence[str]) -> BadConfig:
    near = get_close_matches(got, known, 1, 0.5)
    hint = f'; did you mean {near[0]}?' if near else ''
    return BadConfig(f'{config.path}: uncertainty.{name}: expected {expected}, got "{got}"{hint}')
