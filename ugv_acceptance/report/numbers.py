"""Numbers of a result as text: what is not known is a dash, never a zero."""

from typing import Any

Json = dict[str, Any]
DASH = '\N{EN DASH}'
# Numbers of the data that are shares of a whole.
SHARES = ('coverage', 'protected')


def number_text(value: float | None, digits: int = 1, unit: str = '') -> str:
    """Return a number with its unit; a dash where there is none."""
    if value is None:
        return DASH
    # Adding 0.0 takes the sign off a rounded zero.
    return f'{round(value, digits) + 0.0:.{digits}f} {unit}'.strip()


def seconds_text(value: float | None) -> str:
    """Return seconds since the start of the recording."""
    return 'the end' if value is None else f'{value:.2f} s'


def _in_unit(value: float | None, measured: Json) -> str:
    if value is None:
        return DASH
    if measured['signal'] == 'torque_utilisation':
        return f'{value:.1%}'
    return f'{value:.{measured.get("digits", 4)}g} {measured["unit"]}'.strip()


def worst_text(measured: Json) -> str:
    """Return what a criterion measured: the worst value, or the numbers of its kind."""
    if 'signal' in measured:
        return _in_unit(measured['worst'], measured)
    if 'values' in measured:
        pairs = measured['values'].items()
        share = measured['quantity'] in SHARES
        texts = (DASH if x is None else f'{x:.1%}' if share else f'{x:.4g}' for _, x in pairs)
        named = zip(measured['values'], texts, strict=True)
        several = len(measured['values']) > 1
        joined = ', '.join(f'{name} {text}' if several else text for name, text in named)
        return f'{joined} {measured["unit"]}'.strip()
    if 'share' in measured:
        return f'{measured["visited"]} of {measured["cells"]} cells ({measured["share"]:.1%})'
    count = measured['alerts']
    return 'no alert' if not count else f'{count} alert{"s" if count > 1 else ""}'


def limit_text(measured: Json) -> str:
    """Return the limit of a value; a dash for other criteria, whose demand is a sentence."""
    if 'signal' not in measured:
        return DASH
    return f'{measured["must_be"]} {_in_unit(measured["limit"], measured)}'


def bound_text(measured: Json) -> str:
    """Return the uncertainty of a worst value; a dash where none is known."""
    bound = measured.get('uncertainty')
    return DASH if not bound else _in_unit(bound['bound'], {**measured, 'digits': 2})


def interval_text(found: Json | None, unit: str = '') -> str:
    """Return a fitted number with its 95 % interval."""
    if found is None:
        return DASH
    half = (found['high'] - found['low']) / 2.0
    return f'{_short(found["value"])} ± {_short(half)} {unit}'.strip()


def _short(value: float) -> str:
    """Return a number of two places after the point, or three digits of a large one."""
    return number_text(value, 2) if abs(value) < 100.0 else f'{value:.3g}'
