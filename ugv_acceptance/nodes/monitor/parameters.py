"""The monitor's parameters: their ranges, and which can change while it runs.

Names are those of the YAML file, units included. A set is checked as a whole and is accepted or
refused as a whole; values that belong together go into one set_parameters_atomically.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import partial
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from ugv_acceptance import BadConfig
from ugv_acceptance.evaluation.ground import KINDS
from ugv_acceptance.evaluation.permitted_limits import (
    RANGES,
    UNSAFE,
    Permitted,
    checked_reason,
    refused,
    torque_name,
)
from ugv_acceptance.evaluation.settings import ALWAYS, LEVEL, Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.nodes import parameter_types

ATTITUDES = ('auto', 'orientation', 'accelerometer')
# Stands for a limit that is not known, so not judged (an infinite number has no range).
NOT_JUDGED = 0.0


@dataclass(frozen=True, slots=True)
class TunableParameter:
    """A parameter that can change at run time: how to read it from settings and set it; its range.

    `permitted` describes the permitted values, without a reason and with one; such a range is
    checked by evaluation/permitted_limits.py, so that its error message says so.
    """

    name: str
    what: str
    get: Callable[[Settings], Any]
    put: Callable[[Settings, Any], Settings]
    lower: float | None = None
    upper: float | None = None
    permitted: str = ''

    def descriptor(self) -> ParameterDescriptor:
        """Return the descriptor with the range that ROS tools show and check."""
        if not self.permitted:
            return described(self.what, self.lower, self.upper)
        return ParameterDescriptor(description=self.what, additional_constraints=self.permitted)


def described(
    what: str, lower: float | None = None, upper: float | None = None, *, fixed: bool = False
) -> ParameterDescriptor:
    """Return a parameter's descriptor, with a range of floats if given."""
    ranges = []
    if lower is not None and upper is not None:
        ranges = [FloatingPointRange(from_value=float(lower), to_value=float(upper), step=0.0)]
    return ParameterDescriptor(description=what, floating_point_range=ranges, read_only=fixed)


def described_integer(what: str, lower: int, upper: int) -> ParameterDescriptor:
    """Return a parameter's descriptor with a range of integers."""
    ranges = [IntegerRange(from_value=lower, to_value=upper, step=1)]
    return ParameterDescriptor(description=what, integer_range=ranges)


# Parameters that are read on configuration or activation and stay as they are until the next.
AT_REST = ('config', 'urdf', 'depth', 'black_box', 'lock_parameters')
# What an operator declares: never locked. The load is also declared by messages.
LOAD = ('payload.mass_kg', 'payload.cog_m')
FREE = (*LOAD, 'ground.kind', 'hand_may_touch')
ALLOWED = 'allowed_publishers'


def check_at_rest(values: Mapping[str, Any]) -> None:
    """Raise BadConfig where a parameter cannot change while the monitor is active."""
    fixed = [name for name in AT_REST if name in values]
    if fixed:
        raise BadConfig(f'{fixed[0]}: cannot change while active: deactivate first')


def check_locked(values: Mapping[str, Any], tunables: Sequence[TunableParameter]) -> None:
    """Raise BadConfig where a parameter decides what is reported: all but the load's are locked."""
    locked = {tunable.name for tunable in tunables if tunable.name not in FREE} | {ALLOWED}
    found = [name for name in values if name in locked]
    if found:
        raise BadConfig(f'{found[0]}: locked by lock_parameters while active: deactivate first')


def declare_all(node: Node) -> None:
    """Declare the parameters that exist before the robot's files are read."""
    declare = partial(parameter_types.declare, node)
    declare('config', 'packbot', described('YAML file, or the name of one that ships'))
    declare('urdf', '', described('URDF in place of the one the YAML names'))
    what = 'configure and activate at once; false: a lifecycle manager does'
    declare('autostart', True, described(what, fixed=True))
    what = 'queue of each input; what comes while the processor is busy waits in it'
    declare('depth', 1000, described_integer(what, 1, 100_000))
    what = 'margin messages a second; 0: one for every input message'
    declare('publish_rate', 25.0, described(what, 0.0, 10_000.0))
    what = 'nodes that may publish the inputs, such as /driver; empty: any, but only one'
    declare(ALLOWED, [''], described(what))
    what = 'folder for a recording of each critical alert; empty: none is made'
    declare('black_box', '', described(what))
    what = 'no limit, delay or threshold can be set while the monitor is active'
    declare('lock_parameters', False, described(what))


def knobs_of(settings: Settings) -> tuple[TunableParameter, ...]:
    """Return the parameters of a robot that can change at run time."""
    torque = tuple(_torque_knob(settings, j) for j in range(len(settings.robot.joint_names)))
    return (*(_field_knob(of) for of in RANGES if of.live), *torque, *_CHOICES)


def _field_knob(of: Permitted) -> TunableParameter:
    def put(settings: Settings, value: float) -> Settings:
        section = getattr(settings, of.part)
        part = replace(section, **{of.key: value * of.factor})
        changed: Settings = replace(settings, **{of.part: part})
        return changed

    return TunableParameter(of.name, of.what, of.value, put, of.floor, of.ceiling, of.words)


def _torque_knob(settings: Settings, j: int) -> TunableParameter:

    def get(current: Settings) -> float:
        limit = current.limits.torque[j]
        return limit if math.isfinite(limit) else NOT_JUDGED

    def put(current: Settings, value: float) -> Settings:
        limits = list(current.limits.torque)
        limits[j] = value if value > 0 else math.inf
        return replace(current, limits=replace(current.limits, torque=tuple(limits)))

    name = torque_name(settings, j)
    joint = settings.robot.joint(settings.robot.joint_names[j])
    what = f'limit, {joint.units.effort}; 0: not known, so not judged'
    return TunableParameter(name, what, get, put, 0.0, 1e9)


def _with_payload(settings: Settings, mass: float, cog: Sequence[float]) -> Settings:
    if len(cog) != 3 or not all(map(math.isfinite, cog)):
        raise BadConfig(f'payload.cog_m: expected three finite numbers (m), got {list(cog)}')
    payload = Payload(float(mass), (float(cog[0]), float(cog[1]), float(cog[2])))
    return replace(settings, robot=replace(settings.robot, payload=payload))


def _with_attitude(settings: Settings, value: str) -> Settings:
    level = LEVEL in (value, settings.imu.attitude)  # what a file says of inputs stays
    if value not in ATTITUDES or level:
        if value == settings.imu.attitude:
            return settings
        raise BadConfig(f'imu.attitude: expected one of {", ".join(ATTITUDES)}, got {value!r}')
    return replace(settings, imu=replace(settings.imu, attitude=value))


def _with_ground(settings: Settings, value: str) -> Settings:
    if value and value not in KINDS:
        raise BadConfig(f'ground.kind: expected one of {", ".join(KINDS)}, got {value!r}')
    return replace(settings, ground=replace(settings.ground, kind=value or None))


def _with_reason(settings: Settings, value: str) -> Settings:
    try:
        return replace(settings, unsafe=checked_reason(value) if value else '')
    except ValueError as error:
        raise BadConfig(f'{UNSAFE}: {error}') from None


_CHOICES = (
    TunableParameter(
        UNSAFE,
        'why limits may be wider than permitted; empty: they may not',
        lambda s: s.unsafe,
        _with_reason,
    ),
    TunableParameter(
        'payload.mass_kg',
        'mass of the load carried, kg, until the payload topic says otherwise',
        lambda s: float(s.robot.payload.mass),
        lambda s, v: _with_payload(s, v, s.robot.payload.cog),
        0.0,
        1e6,
    ),
    TunableParameter(
        'payload.cog_m',
        'centre of gravity of the load in the axes of the payload link, m',
        lambda s: list(s.robot.payload.cog),
        lambda s, v: _with_payload(s, s.robot.payload.mass, v),
    ),
    TunableParameter(
        'ground.kind',
        f'what the robot stands on: {", ".join(KINDS)}; empty: not entered, taken as flat',
        lambda s: s.ground.kind or '',
        _with_ground,
    ),
    TunableParameter(
        'hand_may_touch',
        'the arm may touch the ground, to pick something up: torques are not known while it does',
        lambda s: bool(s.hand_may_touch),
        lambda s, v: replace(s, hand_may_touch=ALWAYS if v else ()),
    ),
    TunableParameter(
        'imu.attitude',
        f'where gravity comes from: {", ".join(ATTITUDES)}',
        lambda s: s.imu.attitude,
        _with_attitude,
    ),
    TunableParameter(
        'imu.specific_force',
        'the accelerometer takes the place of gravity in every margin',
        lambda s: s.imu.specific_force,
        lambda s, v: replace(s, imu=replace(s.imu, specific_force=bool(v))),
    ),
    TunableParameter(
        'frame_prefix',
        "what stands before the names of this robot's frames, such as r1/",
        lambda s: s.frame_prefix,
        lambda s, v: replace(s, frame_prefix=v),
    ),
)


def unknown(names: Sequence[str], tunables: Sequence[TunableParameter]) -> list[str]:
    """Return a warning for each given parameter that the node does not have."""
    found = []
    for name in sorted(names):
        near = get_close_matches(name, [tunable.name for tunable in tunables], 1)
        hint = f'; did you mean {near[0]}?' if near else ''
        found.append(f'parameter {name} is not known and not used{hint}')
    return found


def changed(
    settings: Settings, tunables: Sequence[TunableParameter], values: Mapping[str, Any]
) -> Settings:
    """Return settings with parameters changed. Raises BadConfig naming the one refused.

    A value that is what it was changes nothing, so that no digit is lost in a unit's conversion.
    """
    for tunable in tunables:
        value = values.get(tunable.name, tunable.get(settings))
        if value == tunable.get(settings) or list_of(value) == list_of(tunable.get(settings)):
            continue
        if isinstance(value, float) and not math.isfinite(value):
            raise BadConfig(f'{tunable.name}: expected a finite number, got {value}')
        lower, upper = tunable.lower, tunable.upper
        ranged = lower is not None and upper is not None and not tunable.permitted
        if ranged and not lower <= value <= upper:
            raise BadConfig(f'{tunable.name}: expected {lower:g} to {upper:g}, got {value}')
        settings = tunable.put(settings, value)
    _check(settings)
    return settings


def list_of(value: Any) -> Any:  # noqa: ANN401 - a parameter's value
    """Return an array parameter as a list, anything else as it is."""
    return list(value) if not isinstance(value, str | float | int | bool) else value


def _check(settings: Settings) -> None:
    limits, wrong = settings.limits, refused(settings)
    if wrong is not None:
        raise BadConfig(f'{wrong.name}: {wrong.refusal}')
    if limits.torque_warn > limits.torque_error:
        raise BadConfig(
            f'limits.torque_warn: expected at most limits.torque_error ({limits.torque_error:g}), '
            f'got {limits.torque_warn:g}'
        )
    if limits.tip_warn < limits.tip_error:
        raise BadConfig(
            f'limits.tip_warn_deg: expected at least limits.tip_error_deg '
            f'({math.degrees(limits.tip_error):g}), got {math.degrees(limits.tip_warn):g}'
        )
