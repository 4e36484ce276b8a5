"""Tables of the quantities a criterion can be about: margins, other values, quality of the data."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.evaluation.criteria.criteria import ANY
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import SLIDING
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.type_aliases import Floats, Json

_DEGREES = 180.0 / np.pi


@dataclass(frozen=True, slots=True)
class SignalKind:
    """A value that a criterion can limit, with one column per joint, per side, or for the robot.

    `of` returns the columns (n, k), SI; `subjects` says what they belong to: joints, sides, robot.
    `kinds` are the quantities (config/units.py) of a limit for a rotary and a prismatic joint, ''
    without unit. `scale` converts to the `unit` people see. `detail`: it needs moments, energies
    or ZMP.
    """

    of: Callable[[MarginRows, Settings], Floats]
    subjects: str
    kinds: tuple[str, ...]
    unit: str
    words: str
    scale: float = 1.0
    detail: bool = False


def _limits(settings: Settings) -> Floats:
    """Return the torque limits; NaN for a joint without one, which has no margin."""
    limits = np.array(settings.limits.torque)
    return np.where(np.isfinite(limits), limits, np.nan)


def _utilisation(rows: MarginRows, settings: Settings) -> Floats:
    share: Floats = np.abs(rows.torque) / _limits(settings)
    return share


def _margin(rows: MarginRows, settings: Settings) -> Floats:
    return _limits(settings) - np.abs(rows.torque)


def _tilt(rows: MarginRows, _: Settings) -> Floats:
    g = rows.gravity
    with np.errstate(invalid='ignore'):
        return np.arctan2(np.hypot(g[:, 0], g[:, 1]), -g[:, 2])[:, None]


def _clearance(rows: MarginRows, _: Settings) -> Floats:
    height = rows.clearance if len(rows.clearance) else np.full(len(rows.time), np.nan)
    # Infinite: there is no arm.
    return np.where(np.isfinite(height), height, np.nan)[:, None]


SIGNALS = {
    'torque_utilisation': SignalKind(_utilisation, 'joints', ('',), '', 'torque utilisation'),
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
        lambda rows, _: rows.moment,
        'sides',
        ('torque',),
        'N m',
        'restoring moment about the edge',
        detail=True,
    ),
    'tip_energy': SignalKind(
        lambda rows, _: rows.energy, 'sides', ('',), 'J', 'energy needed to tip over', detail=True
    ),
    'zmp': SignalKind(
        lambda rows, _: rows.zmp[:, None],
        'robot',
        ('length',),
        'm',
        'distance of the ZMP inside the support polygon',
        detail=True,
    ),
    'clearance': SignalKind(
        _clearance, 'robot', ('length',), 'm', 'height of the arm above the ground'
    ),
    'tilt': SignalKind(_tilt, 'robot', ('angle',), 'deg', 'tilt of the base', _DEGREES),
}

# Signals that are tip-over margins.
OF_TIPPING = ('tip_angle', 'tip_moment', 'tip_energy', 'zmp')


def subjects_of(kind: SignalKind, settings: Settings) -> tuple[str, ...]:
    """Return the names of a signal's columns: joints, SIDES, or ('robot',)."""
    names = {'joints': settings.robot.joint_names, 'sides': SIDES, 'robot': ('robot',)}
    return names[kind.subjects]


def shown(signal: str, subject: str, settings: Settings) -> tuple[float, str]:
    """Return the factor from SI and the unit in which people see a signal of this subject."""
    kind = SIGNALS[signal]
    of_joint = kind.subjects == 'joints' and subject != ANY
    if not of_joint or not settings.robot.joint(subject).slides:
        return kind.scale, kind.unit
    units = {'N m': SLIDING.effort, 'deg': SLIDING.position, 'deg/s': SLIDING.rate}
    return 1.0, units.get(kind.unit, kind.unit)


def columns_of(
    signal: str, subject: str, rows: MarginRows, settings: Settings, *, largest: bool
) -> Floats:
    """Return a signal's values (n,), SI; for subject `any` the largest or smallest of all.

    NaN at rows where the value is not known.
    """
    kind = SIGNALS[signal]
    table = kind.of(rows, settings)
    if subject != ANY:
        column: Floats = table[:, subjects_of(kind, settings).index(subject)]
    else:
        column = _extreme(table, largest=largest)
    return column if rows.known.all() else np.where(rows.known, column, np.nan)


def _extreme(table: Floats, *, largest: bool) -> Floats:
    """Return the extreme over the columns (n,); NaN is skipped, and what comes of no column."""
    pick = np.fmax if largest else np.fmin
    found: Floats = pick.reduce(table, axis=1, initial=np.nan)
    return found


INPUTS = ('joint_states', 'imu')


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number about the data of a run, or of each of its inputs; a `share` is from 0 to 1.

    `of` takes it from the result of the run, or (`each_input`) from that of one input.
    """

    of: Callable[[Json], float | None]
    words: str
    unit: str = ''
    each_input: bool = False
    share: bool = False


def _shares(protected: str) -> float:
    return {'all': 1.0, 'part': 0.5}.get(protected, 0.0)


DATA = {
    'coverage': Quantity(
        lambda r: r['coverage']['fraction'], 'share of the recording evaluated', share=True
    ),
    'longest_unseen': Quantity(
        lambda r: r['coverage']['longest_unseen_s'], 'longest stretch without margins', 's'
    ),
    'duration': Quantity(lambda r: r['coverage']['duration_s'], 'length of the recording', 's'),
    'protected': Quantity(
        lambda r: _shares(r['bag']['protected']), 'share of chunks with a checksum', share=True
    ),
    'salvaged': Quantity(lambda r: float(r['bag']['salvaged'] is not None), 'truncated files'),
    'lost_messages': Quantity(
        lambda r: float(r['bag']['lost_messages']), 'messages counted but missing'
    ),
    'findings': Quantity(lambda r: float(len(r['bag']['findings'])), 'findings about the file'),
    'late_messages': Quantity(
        lambda r: float(r['inputs']['late_messages']), 'messages out of order'
    ),
    'messages': Quantity(lambda i: float(i['messages']), 'messages', each_input=True),
    'rate': Quantity(lambda i: i['rate_hz'], 'rate', 'Hz', each_input=True),
    'gaps': Quantity(lambda i: float(i['gaps']), 'gaps', each_input=True),
    'longest_gap': Quantity(lambda i: i['longest_gap_s'], 'longest gap', 's', each_input=True),
    'malformed': Quantity(lambda i: float(i['malformed']), 'malformed messages', each_input=True),
    'faults': Quantity(lambda i: float(len(i['faults'])), 'kinds of input fault', each_input=True),
}


def measured_of(quantity: str, of: str | None, result: Json) -> dict[str, float | None]:
    """Return the values of a quantity by name: 'run', or the input `of`, or (None) both inputs."""
    found = DATA[quantity]
    if not found.each_input:
        return {'run': found.of(result)}
    return {name: found.of(result['inputs'][name]) for name in INPUTS if of in (None, name)}


def unit_of(quantity: str) -> str:
    """Return the unit of a quantity of DATA as people see it; '' without unit."""
    return DATA[quantity].unit
