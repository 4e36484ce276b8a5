"""What the options of the verb risk mean: what varies and how, a phase at a time."""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.robot_description import payload_doubts, posture_from
from ugv_acceptance.config import Config
from ugv_acceptance.config.units import quantity
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.studies.postures import joint_range
from ugv_acceptance.studies.risk import Study
from ugv_acceptance.studies.risk_kernel import known_names
from ugv_acceptance.studies.spread import NORMAL, Spread, normal, uniform

STEEPEST = math.radians(30.0)
# The paper's typical operating speed.
RATE = math.radians(7.2)
_CONFIGURED = re.compile(r'(?:cog_)?([xyz])_m|(mass)_kg')


@dataclass(frozen=True, slots=True)
class Phase:
    """A part of a mission: what is drawn, how often it happens, and what was left at its value."""

    name: str
    study: Study
    times: int
    not_varied: tuple[str, ...]


def phases_from(
    config: Config, posture: str, vary: Sequence[str], mission: Path | None
) -> list[Phase]:
    """Return the phases to study: those of the mission's file, else one.

    Raises BadConfig naming the option, or the phase and key, that does not fit.
    """
    if mission is None:
        return [_phase(config, 'robot', posture, vary, 1)]
    found = []
    for k, entry in enumerate(_entries(mission)):
        where = f'{mission}: phases[{k}]'
        unknown = set(entry) - {'name', 'posture', 'vary', 'times'}
        if unknown:
            key = min(unknown)
            raise BadConfig(f'{where}: expected name, posture, vary, times, got {key}')
        times = entry.get('times', 1)
        if not isinstance(times, int) or times < 1:
            raise BadConfig(f'{where}.times: expected a whole number >= 1, got {times}')
        ways = entry.get('vary', {})
        if not isinstance(ways, dict) or not isinstance(entry.get('posture', ''), str):
            raise BadConfig(f'{where}: expected vary as a table and posture as a text')
        both = [*vary, *(f'{name}={spread}' for name, spread in ways.items())]
        name = str(entry.get('name', f'phase {k + 1}'))
        found.append(_phase(config, name, entry.get('posture', '') or posture, both, times))
    return found


def doubts(phases: Sequence[Phase]) -> list[str]:
    """Return a sentence where a payload that is drawn is mostly heavier than its robot."""
    found = []
    for phase in phases:
        spread = phase.study.spreads.get('payload.mass')
        if spread is not None:
            mass = spread.low if spread.kind == NORMAL else spread.high
            found += payload_doubts(phase.study.robot, f'{mass:g}', '--vary payload.mass')
    return list(dict.fromkeys(found))


def _entries(mission: Path) -> list[dict[str, Any]]:
    try:
        document = json.loads(mission.read_text(encoding='utf-8'))
    except OSError as error:
        raise BadConfig(f'{mission}: expected a readable file, got: {error.strerror}') from None
    except ValueError as error:
        raise BadConfig(f'{mission}: expected JSON, got: {error}') from None
    entries = document.get('phases') if isinstance(document, dict) else None
    if (
        not isinstance(entries, list)
        or not entries
        or not all(isinstance(e, dict) for e in entries)
    ):
        raise BadConfig(f'{mission}: expected {{"phases": [{{...}}, ...]}}, got something else')
    return entries


def _phase(config: Config, name: str, posture: str, vary: Sequence[str], times: int) -> Phase:
    robot = config.settings.robot
    spreads, left = _uncertain(config)
    spreads |= {'slope': uniform(0.0, STEEPEST), 'heading': uniform(-math.pi, math.pi)}
    if robot.payload_link is not None and robot.payload.mass > 0.0:
        spreads['payload.mass'] = uniform(0.0, robot.payload.mass)
    limits = config.settings.limits.torque
    for joint, limit in zip(robot.joint_names, limits, strict=True):
        if math.isfinite(limit):
            spreads[f'{joint}.rate'] = normal(0.0, RATE)
        if not posture and not _moves_contact(robot, joint):
            spreads[f'{joint}.position'] = uniform(*joint_range(robot, joint))
    for text in vary:
        key, spread = spread_from(robot, text)
        spreads[key] = spread
    fixed = tuple(posture_from(robot, posture))
    return Phase(
        name, Study(robot, dict(sorted(spreads.items())), fixed, limits), times, tuple(left)
    )


def _uncertain(config: Config) -> tuple[dict[str, Spread], list[str]]:
    """Return the configured +/- as even spreads, and the names that cannot be varied."""
    robot = config.settings.robot
    known, spreads, left = set(known_names(robot)), {}, []
    for name, size in config.uncertainty:
        owner, _, what = name.rpartition('.')
        match = _CONFIGURED.fullmatch(what)
        key = f'{owner}.{match[1] or match[2]}' if match else name
        if match is None or key not in known:
            left.append(name)
            continue
        middle = nominal(robot, key)
        spreads[key] = uniform(middle - size, middle + size)
    return spreads, left


def nominal(robot: Robot, key: str) -> float:
    """Return the robot's own value of a mass (kg) or a coordinate (m): LINK.mass, JOINT.x, ..."""
    owner, _, part = key.rpartition('.')
    if owner == 'payload':
        return robot.payload.mass if part == 'mass' else robot.payload.cog['xyz'.index(part)]
    if owner in robot.joint_names:
        tree = mechanics_of(robot).tree
        body = next(body for body in tree.bodies if body.joint == owner)
        return body.offset['xyz'.index(part)]
    link = robot.link(owner)
    return link.mass if part == 'mass' else link.cog['xyz'.index(part)]


def _moves_contact(robot: Robot, joint: str) -> bool:
    tree = mechanics_of(robot).tree
    for contact in robot.contacts:
        body = tree.frames[contact.link][0]
        while body > 0:
            if tree.bodies[body].joint == joint:
                return True
            body = tree.bodies[body].parent
    return False


def spread_from(robot: Robot, text: str) -> tuple[str, Spread]:
    """Return name and spread of 'slope=0deg..20deg' or 'payload.mass=4kg+-0.2kg'."""
    key, equals, value = text.partition('=')
    if not equals or key not in known_names(robot):
        raise BadConfig(
            f'--vary: expected NAME=LOW..HIGH with slope, heading, payload.mass, JOINT.position, '
            f'JOINT.rate, JOINT.limit, LINK.mass or the like, got {text}'
        )
    kind = _kind(robot, key)
    for sign, make in (('..', uniform), ('+-', normal), ('±', normal)):
        first, found, second = value.partition(sign)
        if found:
            low, high = (quantity(part, kind, f'--vary {text}') for part in (first, second))
            if high < (low if make is uniform else 0.0):
                raise BadConfig(f'--vary: {key}: expected LOW..HIGH or MEAN+-SD, got {value}')
            return key, make(low, high)
    fixed = quantity(value, kind, f'--vary {text}')
    return key, uniform(fixed, fixed)


def _kind(robot: Robot, key: str) -> str:
    owner, _, part = key.rpartition('.')
    if key in {'slope', 'heading'}:
        return 'angle'
    slides = owner in robot.joint_names and robot.joint(owner).kind == 'prismatic'
    turning = {'position': 'angle', 'rate': 'angular rate', 'limit': 'torque'}
    sliding = {'position': 'length', 'rate': 'rate', 'limit': 'force'}
    fixed = {'mass': 'mass', 'x': 'length', 'y': 'length', 'z': 'length'}
    return {**(sliding if slides else turning), **fixed}[part]
