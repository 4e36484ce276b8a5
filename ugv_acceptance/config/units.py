"""Converts quantities with units, such as "30 deg" or a key that ends in _kg, to SI."""

import math
import re
from dataclasses import dataclass

from ugv_acceptance import BadConfig

_DEG = math.pi / 180.0
_LB = 0.45359237
_INCH = 0.0254
_LBF = 4.4482216152605

# Unit as written in a text -> kind of quantity and factor to SI. A key's ending is its unit without
# signs: position_m, limit_nm, tip_warn_deg.
UNITS: dict[str, tuple[str, float]] = {
    'rad': ('angle', 1.0),
    'deg': ('angle', _DEG),
    '°': ('angle', _DEG),
    'm': ('length', 1.0),
    'cm': ('length', 1e-2),
    'mm': ('length', 1e-3),
    'in': ('length', _INCH),
    'ft': ('length', 12 * _INCH),
    'kg': ('mass', 1.0),
    'g': ('mass', 1e-3),
    'lb': ('mass', _LB),
    'nm': ('torque', 1.0),
    'lbfft': ('torque', _LBF * 12 * _INCH),
    'lbfin': ('torque', _LBF * _INCH),
    'n': ('force', 1.0),
    'lbf': ('force', _LBF),
    's': ('time', 1.0),
    'ms': ('time', 1e-3),
    'rad/s': ('angular rate', 1.0),
    'deg/s': ('angular rate', _DEG),
    '°/s': ('angular rate', _DEG),
    'm/s': ('rate', 1.0),
    'mm/s': ('rate', 1e-3),
    'm/s2': ('acceleration', 1.0),
    'nm/rad': ('stiffness', 1.0),
    'nm/deg': ('stiffness', 1.0 / _DEG),
    'n/m': ('linear stiffness', 1.0),
}
KEY_ENDINGS = {
    **{u: u for u in UNITS if u.isalpha()},
    'radps': 'rad/s',
    'degps': 'deg/s',
    'mps': 'm/s',
    'mps2': 'm/s2',
    'nmprad': 'nm/rad',
    'nmpdeg': 'nm/deg',
    'npm': 'n/m',
}
# Kind of quantity -> an example of it, for errors.
EXAMPLES = {
    'angle': 'an angle such as 0.5 (rad) or "30 deg"',
    'length': 'a length such as 0.25 (m) or "25 cm"',
    'mass': 'a mass such as 4 (kg) or "10 lb"',
    'torque': 'a torque such as 50 (N m) or "30 lbf ft"',
    'force': 'a force such as 98 (N)',
    'time': 'a time such as 0.1 (s) or "100 ms"',
    'angular rate': 'an angular rate such as 0.6 (rad/s) or "36 deg/s"',
    'rate': 'a speed such as 0.1 (m/s)',
    'acceleration': 'an acceleration such as 9.81 (m/s2)',
    'stiffness': 'a stiffness such as 20 (N m/rad)',
    'linear stiffness': 'a stiffness such as 500 (N/m)',
}
# Kinds for which the command line requires a unit, because a bare number would be misunderstood:
# name, the unit people think in, the SI unit.
SPELLINGS = {
    'angle': ('an angle', 'deg', 'rad'),
    'angular rate': ('an angular rate', 'deg/s', 'rad/s'),
    'length': ('a length', 'mm', 'm'),
    'rate': ('a speed', 'mm/s', 'm/s'),
}
# Larger magnitudes are mistakes, and products of them would overflow.
LARGEST = 1e9

_TEXT = re.compile(r'\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*', re.DOTALL)


@dataclass(frozen=True, slots=True)
class Measure:
    """A value as written in a file, with the unit that its key ends in (a key of UNITS)."""

    value: object
    unit: str


@dataclass(frozen=True, slots=True)
class Given:
    """A number in SI, and the kind of the unit it was written with; None if without a unit."""

    value: float
    kind: str | None = None


def split_key(key: str) -> tuple[str, str | None]:
    """Return a key's name and the unit it ends in: limit_nm -> ('limit', 'nm')."""
    stem, _, ending = key.rpartition('_')
    unit = KEY_ENDINGS.get(ending)
    return (stem, unit) if stem and unit else (key, None)


def parse(value: object, kinds: tuple[str, ...]) -> Given:
    """Return a number in SI from a number, a text with a unit, or a Measure.

    Raises ValueError if it is not a finite number or its unit is not of one of `kinds`; without
    kinds a bare number is required.
    """
    if isinstance(value, Measure):
        kind, factor = UNITS[value.unit]
        if kind not in kinds:
            raise ValueError(f'expected {expected(kinds)}, got the unit {value.unit}')
        inner = parse(value.value, (kind,))
        # A text with its own unit has been converted by that one.
        return inner if inner.kind else Given(_checked(inner.value * factor, value.value), kind)
    if isinstance(value, str):
        return _from_text(value, kinds)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(  # noqa: TRY004 - pydantic reports ValueError only
            f'expected {expected(kinds)}, got {shown(value)}'
        )
    return Given(_checked(value, value), None)


def quantity(text: str, kind: str, what: str) -> float:
    """Return in SI a quantity that a user wrote on the command line; `what` names it in errors.

    A kind in SPELLINGS requires a unit, unless it is 0; a bare number of another kind is in SI.
    Raises BadConfig if it is not of `kind` (a key of EXAMPLES).
    """
    try:
        given = parse(text, (kind,))
    except ValueError as error:
        said = f'expected {_spelled(kind)}, got {shown(text)}' if kind in SPELLINGS else error
        raise BadConfig(f'{cut(what)}: {said}') from None
    if given.kind is None and given.value and kind in SPELLINGS:
        number = text.strip()
        raise BadConfig(f'{cut(what)}: expected {_spelled(kind, number)}, got {cut(number)}')
    return given.value


def _spelled(kind: str, number: str = '30') -> str:
    """Return how a number of a kind in SPELLINGS is to be written, in the usual unit and in SI."""
    name, usual, si = SPELLINGS[kind]
    in_si = float(number) * UNITS[usual][1]
    return f'{name} with its unit, such as "{cut(number)}{usual}" or "{in_si:.4g}{si}"'


def expected(kinds: tuple[str, ...]) -> str:
    """Return examples of quantities of these kinds, for an error."""
    return ' or '.join(EXAMPLES[kind] for kind in kinds) or 'a number'


def shown(value: object) -> str:
    """Return a value as text for an error: short, on one line, strings in quotes."""
    return cut(f'"{value}"' if isinstance(value, str) else str(value))


def cut(text: str) -> str:
    """Return a text on one line, cut to 60 characters."""
    text = ' '.join(text.split())
    return text if len(text) <= 60 else f'{text[:57]}...'


def _from_text(text: str, kinds: tuple[str, ...]) -> Given:
    match = _TEXT.fullmatch(text)
    if match is None:
        raise ValueError(f'expected {expected(kinds)}, got {shown(text)}')
    unit = re.sub(r'[\s*·.^]', '', match[2])
    unit = unit if unit in UNITS else unit.lower()
    if not unit:
        return Given(_checked(float(match[1]), text), None)
    kind, factor = UNITS.get(unit, ('', 0.0))
    if kind not in kinds:
        raise ValueError(f'expected {expected(kinds)}, got {shown(text)}')
    return Given(_checked(float(match[1]) * factor, text), kind)


def _checked(number: float, written: object) -> float:
    if not -LARGEST <= number <= LARGEST:  # NaN too: it compares false
        raise ValueError(f'expected a finite number below {LARGEST:g}, got {shown(written)}')
    return float(number)
