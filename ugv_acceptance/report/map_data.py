"""The four maps over two joints as numbers: value, unit, levels and cause in each cell."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.evaluation.settings import Limits
from ugv_acceptance.model.robot import Payload, Robot, Vector
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.studies.bilinear import Grid
from ugv_acceptance.studies.capacity import CAUSES, lift_capacity, pull_capacity
from ugv_acceptance.studies.maps import Levels, rollover_map, torque_forms, utilisation_map
from ugv_acceptance.type_aliases import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The assumptions of a map; `gravity` (m/s2) and `direction` of the pull in `base_link`."""

    robot: Robot
    grid: Grid
    gravity: Vector
    payload: Payload
    limits: Limits
    friction: float = 0.7
    direction: Vector = (1.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class MapData:
    """A map: `value` (n, m) in `unit`; `margin` is the same turned so that larger is better.

    `levels` are in the margin's terms; `sign` turns a margin into a value. `cause` (n, m) is a
    number in `causes`: the tip edge's side, or what ends a pull.
    """

    kind: str
    what: str
    unit: str
    value: Floats
    levels: Levels
    sign: float = 1.0
    cause: np.ndarray | None = None
    causes: tuple[str, ...] = ()

    @property
    def margin(self) -> Floats:
        """The value with its sign turned where needed so that larger is better."""
        return self.sign * self.value


def _torque(scene: Scene) -> MapData:
    limits = np.array(scene.limits.torque)
    if np.isinf(limits).all():
        raise BadConfig('map torque: expected a torque limit for one joint at least, found none')
    forms = torque_forms(scene.robot, scene.grid, scene.gravity, scene.payload)
    used = utilisation_map(scene.robot, scene.grid, forms, limits)
    levels = Levels(-100.0 * scene.limits.torque_warn, -100.0 * scene.limits.torque_error)
    return MapData(
        'torque',
        'static torque of the most loaded joint, % of its limit',
        '%',
        100.0 * used,
        levels,
        -1.0,
    )


def _rollover(scene: Scene) -> MapData:
    found = rollover_map(scene.robot, scene.grid, scene.gravity, scene.payload)
    return MapData(
        'rollover',
        'tilt left before the robot tips',
        '°',
        np.degrees(found.angle),
        Levels(math.degrees(scene.limits.tip_warn), 0.0),
        cause=found.side,
        causes=SIDES,
    )


def _payload(scene: Scene) -> MapData:
    limits = np.array(scene.limits.torque)
    mass, cause = lift_capacity(scene.robot, scene.grid.postures(), scene.gravity, limits)
    carried = scene.payload.mass
    levels = Levels(carried / scene.limits.torque_warn, carried)
    what = f'largest payload, against {carried:g} kg'
    return MapData('payload', what, 'kg', mass, levels, cause=cause, causes=CAUSES)


def _drag(scene: Scene) -> MapData:
    found = pull_capacity(
        scene.robot,
        scene.grid.postures(),
        scene.gravity,
        scene.direction,
        np.array(scene.limits.torque),
        scene.friction,
        payload=scene.payload,
    )
    # No paper or standard names a pull that is enough: a tenth and a fifth of the robot's weight.
    weight = scene.robot.gravity * (scene.robot.mass + scene.payload.mass)
    return MapData(
        'drag',
        f'largest horizontal pull at the gripper, friction {scene.friction:g}',
        'N',
        found.force,
        Levels(0.2 * weight, 0.1 * weight),
        cause=found.cause,
        causes=CAUSES,
    )


KINDS: dict[str, Callable[[Scene], MapData]] = {
    'torque': _torque,
    'rollover': _rollover,
    'payload': _payload,
    'drag': _drag,
}


def map_of(kind: str, scene: Scene) -> MapData:
    """Return the map of one of KINDS. Raises BadConfig where the robot lacks what it needs."""
    if kind not in KINDS:
        raise BadConfig(f'map: expected {", ".join(KINDS)}, got {kind}')
    if kind != 'torque' and not scene.robot.contacts:
        raise BadConfig(f'map {kind}: expected contact points in the configuration, found none')
    if kind in {'payload', 'drag'} and scene.robot.payload_link is None:
        raise BadConfig(f'map {kind}: expected payload.link in the configuration, found none')
    return KINDS[kind](scene)
