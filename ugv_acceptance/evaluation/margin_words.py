"""A margin in the few words that every surface for people says: page, terminal, log, report, card.

Numbers are cut towards less margin, never rounded, so that none reads as a limit which it has not
reached: 99.6 % of a limit is "99 %" and never "100 %"; 9.96 deg to tipping is "9.9 deg".
"""

import math

# Below this many degrees a decimal is worth reading.
_FINE = 10.0
# Half a unit in the last place of what a float makes of a decimal number.
_SLACK = 1e-9
# What is not smaller (degrees, percent) is none that anybody measured.
_MOST = 1e12


def degrees_words(angle: float) -> str:
    """Return an angle (rad) of tilt left, cut towards less: "6 deg", "5.9 deg"; '-': not known."""
    degrees = math.degrees(angle)
    if not abs(degrees) < _MOST:
        return '-'
    if abs(degrees) >= _FINE:
        return f'{math.floor(degrees + _SLACK)} deg'
    return f'{math.floor(10.0 * degrees + _SLACK) / 10.0:g} deg'


def tenths_words(angle: float) -> str:
    """Return an angle (rad) in degrees for a box, cut: "6.0", "22.9"; '-': not known."""
    degrees = math.degrees(angle)
    return f'{math.floor(10.0 * degrees + _SLACK) / 10.0:.1f}' if abs(degrees) < _MOST else '-'


def tipping_words(side: str, angle: float) -> str:
    """Return the tilt left (rad): "6 deg to tipping: RIGHT", or "1.4 deg past tipping: RIGHT"."""
    if angle < 0.0:
        return f'{degrees_words(angle).removeprefix("-")} past tipping: {side.upper()}'
    return f'{degrees_words(angle)} to tipping: {side.upper()}'


def share_words(share: float) -> str:
    """Return a share of a limit in percent, cut: only 1 or more reads "100 %"; '-': not known."""
    percent = 100.0 * share
    return f'{math.floor(percent + _SLACK)} %' if abs(percent) < _MOST else '-'


def rate_words(rate: float, unit: str) -> str:
    """Return a speed for people: rad/s as "36 deg/s", m/s as "0.25 m/s"."""
    if unit == 'rad/s':
        return f'{math.degrees(rate):.0f} deg/s'
    return f'{rate:.2f} {unit}'
