"""The values a criterion can be about: how each is taken from margin rows, its unit, its words."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.criteria import ANY
from ugv_acceptance.evaluation.rows import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.stability import SIDES

Floats = NDArray[np.float64]
_DEGREES = 180.0 / np.pi


@dataclass(frozen=True, slots=True)
class SignalKind:
    """A signal: `of` gives its columns (n, k); `subjects` says what they are: joints, sides, robot.

    `kinds` are the quantities (config/units.py) of a limit for a turning and a sliding joint, ''
    without unit. `scale` and `unit` show it to a person. `detail`: moments, energies and ZMP are
    needed.
    """

    of: Callable[[MarginRows, Settings], Floats]
    subjects: str
    kinds: tuple[str, ...]
    unit: str
    words: str
    scale: float = 1.0
    detail: bool = False


def _utilisation(rows: MarginRows, settings: Settings) -> Floats:
    share: Floats = np.abs(rows.torque) / np.array(settings.limits.torque)
    return share


def _margin(rows: MarginRows, settings: Settings) -> Floats:
    return np.array(settings.limits.torque) - np.abs(rows.torque)


def _tilt(rows: MarginRows, _: Settings) -> Floats:
    g = rows.gravity
    with np.errstate(invalid='ignore'):
        return np.arctan2(np.hypot(g[:, 0], g[:, 1]), -g[:, 2])[:, None]


SIGNALS = {
    'torque_utilisation': SignalKind(_utilisation, 'joints', ('',), '', 'torque / limit'),
    'torque': SignalKind(
        lambda rows, _: np.abs(rows.torque),
        'joints',
        ('torque', 'force'),
        'N m',
        'static torque (magnitude)',
    ),
    'torque_margin': SignalKind(_margin, 'joints', ('torque', 'force'), 'N m', 'torque margin'),
    'effort': SignalKind(
        lambda rows, _: np.abs(rows.effort),
        'joints',
        ('torque', 'force'),
        'N m',
        'measured effort (magnitude)',
    ),
    'position': SignalKind(
        lambda rows, _: rows.q, 'joints', ('angle', 'length'), 'deg', 'position', _DEGREES
    ),
    'speed': SignalKind(
        lambda rows, _: np.abs(rows.qd),
        'joints',
        ('angular rate', 'rate'),
        'deg/s',
        'speed',
        _DEGREES,
    ),
    'tip_angle': SignalKind(
        lambda rows, _: rows.angle, 'sides', ('angle',), 'deg', 'tilt left', _DEGREES
    ),
    'tip_moment': SignalKind(
        lambda rows, _: rows.moment, 'sides', ('torque',), 'N m', 'moment that holds', detail=True
    ),
    'tip_energy': SignalKind(
        lambda rows, _: rows.energy, 'sides', ('',), 'J', 'energy to tip', detail=True
    ),
    'zmp': SignalKind(
        lambda rows, _: rows.zmp[:, None], 'robot', ('length',), 'm', 'ZMP inside', detail=True
    ),
    'tilt': SignalKind(_tilt, 'robot', ('angle',), 'deg', 'tilt of the base', _DEGREES),
}


def subjects_of(kind: SignalKind, settings: Settings) -> tuple[str, ...]:
    """Return the names of a signal's columns."""
    names = {'joints': settings.robot.joint_names, 'sides': SIDES, 'robot': ('robot',)}
    return names[kind.subjects]


def shown(signal: str, subject: str, settings: Settings) -> tuple[float, str]:
    """Return factor and unit with which a person sees a signal of a joint, side or the robot."""
    kind = SIGNALS[signal]
    sliding = (
        kind.subjects == 'joints'
        and subject != ANY
        and settings.robot.joint(subject).kind == 'prismatic'
    )
    if not sliding:
        return kind.scale, kind.unit
    units = {'N m': 'N', 'deg': 'm', 'deg/s': 'm/s'}
    return 1.0, units.get(kind.unit, kind.unit)


def columns_of(
    signal: str, subject: str, rows: MarginRows, settings: Settings, *, largest: bool
) -> Floats:
    """Return a signal's values (n,), SI; of `any` the largest or smallest of all subjects.

    NaN where the value is not known at a row.
    """
    kind = SIGNALS[signal]
    table = kind.of(rows, settings)
    if subject != ANY:
        column: Floats = table[:, subjects_of(kind, settings).index(subject)]
    else:
        column = _extreme(table, largest=largest)
    return column if rows.known.all() else np.where(rows.known, column, np.nan)


def _extreme(table: Floats, *, largest: bool) -> Floats:
    """Return the extreme of the columns; columns of NaN alone (not judged) do not count."""
    pick = np.fmax if largest else np.fmin
    found: Floats = pick.reduce(table, axis=1)
    return found
