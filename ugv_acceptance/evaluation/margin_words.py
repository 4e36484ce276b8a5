"""A margin in the few words that every surface for people says: page, terminal, log, report, card.

Numbers are cut downwards, never rounded, so that none reads as a limit which it has not reached:
99.6 % of a limit is "99 %" and never "100 %"; 9.96 deg to tipping is "9.9 deg". Only far past
tipping, where no limit is, the nearest whole degree is said.
"""

import math

# Below this many degrees a decimal is worth reading.
_FINE = 10.0
# Half a unit in the last place of what a float makes of a decimal number.
_SLACK = 1e-9
# Decimals at most that tell a value from its limit.
_MOST = 4


def degrees_words(angle: float) -> str:
    """Return an angle (rad) of tilt left, cut towards less: "6 deg", "5.9 deg"; '-': not known."""
    degrees = math.degrees(angle)
    if not math.isfinite(degrees):
        return '-'
    if degrees <= -_FINE:
        return f'{round(degrees)} deg'
    if degrees >= _FINE:
        return f'{math.floor(degrees + _SLACK)} deg'
    return f'{math.floor(10.0 * degrees + _SLACK) / 10.0:g} deg'


def excess_words(angle: float) -> str:
    """Return by how much (rad) something is too far, cut towards more: 3.41 deg is "3.5 deg"."""
    degrees = math.degrees(angle)
    if not math.isfinite(degrees):
        return '-'
    if abs(degrees) >= _FINE:
        return f'{math.ceil(degrees - _SLACK)} deg'
    return f'{math.ceil(10.0 * degrees - _SLACK) / 10.0:g} deg'


def tenths_words(angle: float) -> str:
    """Return an angle (rad) in degrees for a box, cut: "6.0", "22.9"; '-': not known."""
    tenths = 10.0 * math.degrees(angle)
    return f'{math.floor(tenths + _SLACK) / 10.0:.1f}' if math.isfinite(tenths) else '-'


def tipping_words(side: str, angle: float) -> str:
    """Return the tilt left (rad): "6 deg to tipping: RIGHT", or "1.4 deg past tipping: RIGHT"."""
    if angle < 0.0:
        return f'{degrees_words(angle).removeprefix("-")} past tipping: {side.upper()}'
    return f'{degrees_words(angle)} to tipping: {side.upper()}'


def share_words(share: float, digits: int = 0) -> str:
    """Return a share of a limit in percent, cut: only 1 or more reads "100 %"; '-': not known."""
    if not math.isfinite(1e3 * share):
        return '-'
    return f'{_cut(100.0 * share, digits):.{digits}f} %'


def percent_words(share: float) -> str:
    """Return a share that is exact, such as a limit, in percent: "95 %", "99.5 %"."""
    return f'{100.0 * share:g} %'


def number_beside(value: float, limit: float, digits: int = 1) -> str:
    """Return a value, cut, with as many decimals more than `digits` as tell it from its limit."""
    for more in range(digits, max(digits, _MOST) + 1):
        found = _cut(value, more)
        if (found > limit) == (value > limit) and (found < limit) == (value < limit):
            return f'{found:.{more}f}'
    return f'{value:.{digits}f}'


def value_beside(value: float, limit: float) -> str:
    """Return a value of any size, cut to three digits, or as many as tell it from its limit."""
    size = abs(value) if math.isfinite(value) and value else 1.0
    digits = min(max(0, 2 - math.floor(math.log10(size))), _MOST)
    text = number_beside(value, limit, digits)
    return text.rstrip('0').rstrip('.') if '.' in text else text


def rate_words(rate: float, unit: str) -> str:
    """Return a speed for people: rad/s as "36 deg/s", m/s as "0.25 m/s"."""
    if unit == 'rad/s':
        degrees = math.degrees(rate)
        return f'{degrees:.0f} deg/s' if abs(degrees) >= _FINE else f'{degrees:.1f} deg/s'
    return f'{rate:.2f} {unit}'


def rate_beside(rate: float, limit: float, unit: str) -> str:
    """Return a speed for people with as many decimals as tell it from its limit; both in `unit`."""
    if unit == 'rad/s':
        fine = abs(math.degrees(rate)) < _FINE
        return f'{number_beside(math.degrees(rate), math.degrees(limit), int(fine))} deg/s'
    return f'{number_beside(rate, limit, 2)} {unit}'


def _cut(value: float, digits: int) -> float:
    """Return a number cut to so many decimals, towards minus infinity."""
    scaled = 10.0**digits * value + _SLACK
    return math.floor(scaled) / 10.0**digits if math.isfinite(scaled) else value
