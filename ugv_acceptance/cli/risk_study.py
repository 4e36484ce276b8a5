"""Converts the options of `risk` to random variables, and its results to text and JSON."""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.robot_description import payload_doubts, posture_from
from ugv_acceptance.config import Config
from ugv_acceptance.config.units import quantity
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Joint, Robot
from ugv_acceptance.report.format import short_name
from ugv_acceptance.studies.axes import check_drives
from ugv_acceptance.studies.risk import EVENTS, Risk, Study, estimate
from ugv_acceptance.studies.risk_kernel import known_names
from ugv_acceptance.studies.spread import NORMAL, Spread, normal, together, uniform

STEEPEST = math.radians(30.0)
# The paper's typical operating speed; of a joint that slides (m/s), at most half its fastest.
RATE, SLIDE_RATE = math.radians(7.2), 0.05
_CONFIGURED = re.compile(r'(?:cog_)?([xyz])_m|(mass)_kg')


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase of a mission: its random variables, how often it happens, and what was not varied."""

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
    """Return a warning where a random payload is mostly heavier than its robot."""
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
    check_drives(robot, 'risk')
    spreads, left = _uncertain(config)
    spreads |= {'slope': uniform(0.0, STEEPEST), 'heading': uniform(-math.pi, math.pi)}
    if robot.payload_link is not None and robot.payload.mass > 0.0:
        spreads['payload.mass'] = uniform(0.0, robot.payload.mass)
    limits = config.settings.limits.torque
    for joint, limit in zip(robot.joint_names, limits, strict=True):
        if math.isfinite(limit):
            spreads[f'{joint}.rate'] = normal(0.0, _rate(robot.joint(joint)))
        if not posture and not _moves_contact(robot, joint):
            spreads[f'{joint}.position'] = uniform(*robot.joint(joint).travel())
    for text in vary:
        key, spread = spread_from(robot, text)
        spreads[key] = spread
    fixed = tuple(posture_from(robot, posture))
    return Phase(
        name, Study(robot, dict(sorted(spreads.items())), fixed, limits), times, tuple(left)
    )


def _rate(joint: Joint) -> float:
    """Return the standard deviation of a joint's rate (rad/s; m/s)."""
    return min(SLIDE_RATE, joint.velocity / 2.0) if joint.slides else RATE


def _uncertain(config: Config) -> tuple[dict[str, Spread], list[str]]:
    """Return the configured +/- as uniform distributions, and the names that cannot be varied."""
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
    """Return the configured mass (kg) or coordinate (m) of a name: LINK.mass, JOINT.x, ..."""
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
    return joint in {robot.joint_names[k] for k, _ in mechanics_of(robot).carried}


def spread_from(robot: Robot, text: str) -> tuple[str, Spread]:
    """Return name and distribution of 'slope=0deg..20deg' or 'payload.mass=4kg+-0.2kg'."""
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
    slides = owner in robot.joint_names and robot.joint(owner).slides
    turning = {'position': 'angle', 'rate': 'angular rate', 'limit': 'torque'}
    sliding = {'position': 'length', 'rate': 'rate', 'limit': 'force'}
    fixed = {'mass': 'mass', 'x': 'length', 'y': 'length', 'z': 'length'}
    return {**(sliding if slides else turning), **fixed}[part]


# Letters of an input's name, for a table of 80 columns.
_NAME = 23
# Inputs shown: those that matter most.
SHOWN = 8
_ANGLES = ('slope', 'heading', '.position', '.rate')


def phase_lines(phase: Phase, risk: Risk) -> list[str]:
    """Return the results of one phase as lines of text."""
    first = risk.estimates['either']
    lines = [
        f'{phase.name}: probability {first.probability:.6f} that a joint saturates or it tips',
        f'  {first.samples:,} samples, seed {risk.seed}, 95 % intervals',
    ]
    lines += [
        f'  {event:12}{found.probability:12.6f}   [{found.low:.6f}, {found.high:.6f}]'
        if event not in not_judged(phase)
        else f'  {event:12} not judged: no joint has a torque limit'
        for event, found in risk.estimates.items()
    ]
    lines.append('  convergence of "either"')
    for e in risk.history['either']:
        lines.append(f'  {e.samples:>14,}{e.probability:12.6f}   +/- {(e.high - e.low) / 2:.6f}')
    lines += ['  what matters most (share of the variance explained alone)']
    ranked = sorted(risk.sensitivity, key=lambda name: -max(risk.sensitivity[name].values()))
    shown = {name: short_name(name, _NAME) for name in ranked[:SHOWN]}
    wide = _NAME + 1
    lines.append(f'    {"input":{wide}}{"saturation":>11}{"rollover":>10}  drawn')
    for name in ranked[:SHOWN]:
        share, spread = risk.sensitivity[name], phase.study.spreads[name]
        numbers = f'{100 * share["saturation"]:10.1f}%{100 * share["rollover"]:9.1f}%'
        lines.append(f'    {shown[name]:{wide}}{numbers}  {words(name, spread, phase.study.robot)}')
    if phase.not_varied:
        lines.append(f'  not varied: {", ".join(phase.not_varied)}')
    return lines


def not_judged(phase: Phase) -> tuple[str, ...]:
    """Return the events of which a phase says nothing: no torque has a limit."""
    return () if any(map(math.isfinite, phase.study.limits)) else (EVENTS[0],)


def words(name: str, spread: Spread, robot: Robot) -> str:
    """Return a distribution as text; angles in degrees, positions of joints that slide in m."""
    owner = name.rpartition('.')[0]
    slides = owner in robot.joint_names and robot.joint(owner).slides
    angle = any(name == part or name.endswith(part) for part in _ANGLES)
    turn = angle and not slides
    low, high = ((math.degrees(x) if turn else x) for x in (spread.low, spread.high))
    unit = ('deg' if turn else 'm') + ('/s' if name.endswith('.rate') else '')
    unit = f' {unit}' if angle else ''
    if spread.kind == NORMAL:
        return f'normal, {low:.4g} +- {high:.4g}{unit}'
    return f'uniform, {low:.4g} to {high:.4g}{unit}'


def mission_lines(phases: Sequence[Phase], risks: Sequence[Risk]) -> list[str]:
    """Return the probability of a failure in the mission, each phase so often, as lines."""
    lines = ['mission: at least one failure, phases independent, 95 % intervals']
    for event, (low, middle, high) in mission_risk(phases, risks).items():
        lines.append(f'  {event:12}{middle:12.6f}   [{low:.6f}, {high:.6f}]')
    return lines


def mission_risk(
    phases: Sequence[Phase], risks: Sequence[Risk]
) -> dict[str, tuple[float, float, float]]:
    """Return the low, best and high probability of each event in the whole mission.

    Each phase's interval is exact at 1 - 0.05 / phases, so all hold together at 95 % (Bonferroni);
    the mission's probability rises with each phase's.
    """
    confidence = 1.0 - 0.05 / len(phases)
    times = [phase.times for phase in phases]
    found = {}
    for event in EVENTS:
        each = [
            estimate(r.estimates[event].failures, r.estimates[event].samples, confidence)
            for r in risks
        ]
        columns = ([e.low for e in each], [e.probability for e in each], [e.high for e in each])
        low, middle, high = (together(column, times) for column in columns)
        found[event] = (low, middle, high)
    return found


def as_document(phases: Sequence[Phase], risks: Sequence[Risk]) -> dict[str, Any]:
    """Return all results for JSON."""
    return {
        'phases': [
            {
                'name': phase.name,
                'times': phase.times,
                'seed': risk.seed,
                'estimates': {k: asdict(v) for k, v in risk.estimates.items()},
                'history': {k: [asdict(e) for e in v] for k, v in risk.history.items()},
                'sensitivity': risk.sensitivity,
                'spreads': {k: asdict(v) for k, v in phase.study.spreads.items()},
                'not_varied': list(phase.not_varied),
                'not_judged': list(not_judged(phase)),
            }
            for phase, risk in zip(phases, risks, strict=True)
        ],
        'mission': {
            event: {'low': low, 'probability': middle, 'high': high}
            for event, (low, middle, high) in mission_risk(phases, risks).items()
        },
    }
