"""Converts the options of `map`: axes, posture, gravity, limits, levels."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.cli.robot_description import payload_from, posture_from
from ugv_acceptance.config import Config
from ugv_acceptance.config.units import parse, quantity
from ugv_acceptance.evaluation.settings import Limits
from ugv_acceptance.model.robot import Joint, Robot
from ugv_acceptance.report.map_data import MapData, Scene
from ugv_acceptance.studies.axes import check_stands_still, map_axes
from ugv_acceptance.studies.bilinear import Grid
from ugv_acceptance.studies.maps import Levels
from ugv_acceptance.studies.orientations import ORIENTATIONS, gravity_of
from ugv_acceptance.type_aliases import Floats


@dataclass(frozen=True, slots=True)
class Wanted:
    """The options of `map` as they were typed."""

    x: str
    y: str
    posture: str
    orientation: str
    slope: str
    payload: str
    limit: str
    friction: float
    steps: int


def scene_from(loaded: Config, wanted: Wanted) -> Scene:
    """Return the assumptions of the map. Raises BadConfig naming the option that is wrong."""
    robot = loaded.settings.robot
    check_stands_still(robot, 'map')
    names = _axes(loaded, wanted)
    first, x = _axis(robot, '--x', names[0], wanted.steps, (0.0, math.pi))
    second, y = _axis(robot, '--y', names[1], wanted.steps, (0.0, 2.0 * math.pi))
    if first == second:
        raise BadConfig(
            f'--y: expected another joint than --x, got {robot.joint_names[first]} twice'
        )
    if wanted.orientation not in ORIENTATIONS:
        known = ', '.join(ORIENTATIONS)
        raise BadConfig(f'--orientation: expected one of {known}, got {wanted.orientation}')
    slope = quantity(wanted.slope, 'angle', f'--slope {wanted.slope}')
    if wanted.friction <= 0.0:
        raise BadConfig(f'--friction: expected a number > 0, got {wanted.friction:g}')
    q = np.array(posture_from(robot, wanted.posture))
    return Scene(
        robot,
        Grid(first, second, x, y, q),
        gravity_of(wanted.orientation, slope, robot.gravity),
        payload_from(robot, wanted.payload),
        _limits(robot, loaded.settings.limits, wanted.limit),
        wanted.friction,
    )


def _axes(loaded: Config, wanted: Wanted) -> tuple[str, str]:
    """Return both axes as typed; those left out are the arm's two joints that lift."""
    robot = loaded.settings.robot
    usual = map_axes(robot, loaded.settings.limits.torque)
    typed = (wanted.x.partition('=')[0], wanted.y.partition('=')[0])
    left = [name for name in usual if name not in typed]
    if len(left) < typed.count(''):
        raise BadConfig(
            f'map: expected two joints of an arm to map, {robot.name} has '
            f'{", ".join(usual) or "none"}: without an arm, plan and risk say where it tips'
        )
    x = wanted.x or (usual[0] if usual[0] in left else left[0])
    y = wanted.y or next(name for name in reversed(left) if name != x)
    return x, y


def _span(joint: Joint, default: tuple[float, float]) -> tuple[float, float]:
    """Return the ends of an axis whose range was not typed: the joint's, of at most one turn."""
    if joint.slides or math.isfinite(joint.lower) or math.isfinite(joint.upper):
        low, high = joint.travel()
        if joint.slides or high - low <= 2.0 * math.pi:
            return low, high
        middle = min(max(0.0, low + math.pi), high - math.pi)
        return middle - math.pi, middle + math.pi
    return default


def _axis(
    robot: Robot, option: str, text: str, steps: int, default: tuple[float, float]
) -> tuple[int, Floats]:
    name, _, span = text.partition('=')
    if name not in robot.joint_names:
        known = ', '.join(robot.joint_names) or 'none'
        raise BadConfig(f'{option}: expected a measured joint ({known}), got {name}')
    joint = robot.joint(name)
    slides = joint.slides
    low, high = _span(joint, default)
    if span:
        start, colon, end = span.partition(':')
        if not colon:
            raise BadConfig(f'{option}: expected {name}=FROM:TO, got {text}')
        kind = 'length' if slides else 'angle'
        low, high = (quantity(part, kind, f'{option} {text}') for part in (start, end))
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise BadConfig(
            f'{option}: expected {name}=FROM:TO with FROM below TO, got {low:g}:{high:g}'
        )
    return robot.joint_names.index(name), np.linspace(low, high, steps)


def _limits(robot: Robot, limits: Limits, text: str) -> Limits:
    torque = dict(zip(robot.joint_names, limits.torque, strict=True))
    for part in filter(None, (p.strip() for p in text.split(','))):
        name, equals, value = part.partition('=')
        if name not in torque or not equals:
            known = ', '.join(torque)
            raise BadConfig(f'--limit: expected JOINT=TORQUE with one of {known}, got {part}')
        kind = 'force' if robot.joint(name).slides else 'torque'
        torque[name] = quantity(value, kind, f'--limit: {name}')
        if torque[name] <= 0.0:
            raise BadConfig(f'--limit: {name}: expected a torque > 0 N m, got {torque[name]:g}')
    return replace(limits, torque=tuple(torque.values()))


# The kind of quantity a map's thresholds are, and what turns its SI number into the map's unit;
# those of a map that is not here are per cent.
_LEVELS = {'rollover': ('angle', 180.0 / math.pi), 'payload': ('mass', 1.0), 'drag': ('force', 1.0)}


def with_levels(data: MapData, caution: str, failure: str) -> MapData:
    """Return the map with its thresholds replaced where the user gave others."""
    levels = Levels(
        _level(data, '--caution', caution, data.levels.caution),
        _level(data, '--failure', failure, data.levels.failure),
    )
    if levels.caution < levels.failure:
        raise BadConfig(
            f'--caution: expected it on the safe side of --failure ({data.sign * levels.failure:g} '
            f'{data.unit}), got {data.sign * levels.caution:g} {data.unit}'
        )
    return replace(data, levels=levels)


def _level(data: MapData, option: str, text: str, usual: float) -> float:
    """Return a threshold converted to the map's margin. Raises BadConfig."""
    if not text:
        return usual
    if data.kind in _LEVELS:
        kind, scale = _LEVELS[data.kind]
        return data.sign * scale * quantity(text, kind, f'{option} {text}')
    try:
        return data.sign * parse(text.strip().removesuffix('%'), ()).value
    except ValueError as error:
        raise BadConfig(f'{option}: {error}') from None
