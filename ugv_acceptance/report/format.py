"""Formats the numbers of a result as text; an unknown number is a dash, never a zero."""

import math

from ugv_acceptance.evaluation.criteria.quantities import DATA
from ugv_acceptance.evaluation.ground import FLAT
from ugv_acceptance.evaluation.margin_words import (
    number_beside,
    share_words,
    tipping_words,
    value_beside,
)
from ugv_acceptance.type_aliases import Json

DASH = '\N{EN DASH}'
# Less than this share of missing messages is jitter.
MISSING = 0.05
# From here on the digits of a number are counted, not read, and no column holds them.
LONG = 1e6
# Lines about joints that carried the robot.
_MOST_CARRYING = 4


def short_name(name: str, most: int = 32) -> str:
    """Return a name of `most` characters at most: a longer one has dots for its middle.

    Both ends stay, for names of one robot often begin alike.
    """
    if len(name) <= most:
        return name
    end = (most - 1) // 2
    return f'{name[: most - 1 - end]}…{name[-end:]}'


def number_text(value: float | None, digits: int = 1, unit: str = '') -> str:
    """Return a number with its unit, a long one with three digits; a dash where it is unknown."""
    if value is None:
        return DASH
    if abs(value) >= LONG:
        return f'{value:.3g} {unit}'.strip()
    # Adding 0.0 takes the sign off a rounded zero.
    return f'{round(value, digits) + 0.0:.{digits}f} {unit}'.strip()


def time_text(seconds: float | None, digits: int = 3) -> str:
    """Return a time in a suitable unit: 45 s, 3.2 min, 6.35 h; a dash where it is unknown."""
    if seconds is None:
        return DASH
    units = ((3600.0, 'h'), (60.0, 'min'))
    size, unit = next((u for u in units if seconds >= 2.0 * u[0]), (1.0, 's'))
    value = seconds / size
    places = max(0, digits - 1 - (value >= 10.0) - (value >= 100.0))
    text = f'{value:,.{places}f}'
    return f'{text.rstrip("0").rstrip(".") if places else text} {unit}'


def hours_text(hours: float | None) -> str:
    """Return a number of hours in a suitable unit, as `time_text` does."""
    if hours is None:
        return DASH
    # What is still to run of some hundred hours is planned by the hour.
    return time_text(3600.0 * hours, digits=4 if hours >= 100.0 else 3)


def seconds_text(value: float | None) -> str:
    """Return seconds since the start of the recording as text."""
    return 'the end' if value is None else f'{value:.2f} s'


def _in_unit(value: float | None, measured: Json) -> str:
    if value is None:
        return DASH
    if measured['signal'] == 'torque_utilisation':
        return share_words(value, 1)
    return f'{value:.{measured.get("digits", 4)}g} {measured["unit"]}'.strip()


def _beside_limit(value: float | None, measured: Json) -> str:
    """Return a measured value with as many digits as tell it from its limit."""
    if value is None:
        return DASH
    limit = measured['limit']
    if measured['signal'] == 'torque_utilisation':
        return f'{number_beside(100.0 * value, 100.0 * limit)} %'
    return f'{value_beside(value, limit)} {measured["unit"]}'.strip()


def _data_text(value: float | None, measured: Json) -> str:
    if value is None:
        return DASH
    if DATA[measured['quantity']].share:
        return share_words(value, 1)
    return f'{value:.4g} {measured["unit"]}'.strip()


def worst_text(measured: Json) -> str:
    """Return a criterion's measured value as text: the worst value, or its kind's own numbers."""
    if 'signal' in measured:
        return _beside_limit(measured['worst'], measured)
    if 'values' in measured:
        pairs = measured['values'].items()
        several = len(measured['values']) > 1
        texts = ((name, _data_text(x, measured)) for name, x in pairs)
        return ', '.join(f'{name} {text}' if several else text for name, text in texts)
    if 'share' in measured:
        share = share_words(measured['share'], 1)
        return f'{measured["visited"]} of {measured["cells"]} cells ({share})'
    count = measured['alerts']
    return 'no alert' if not count else f'{count} alert{"s" if count > 1 else ""}'


def limit_text(measured: Json) -> str:
    """Return a criterion's limit as text; a dash where the criterion is not a limit of a value."""
    if 'least' in measured or 'most' in measured:
        pairs = (('at least', measured['least']), ('at most', measured['most']))
        return ', '.join(
            f'{words} {_data_text(bound, measured)}' for words, bound in pairs if bound is not None
        )
    if 'signal' not in measured:
        return DASH
    return f'{measured["must_be"]} {_in_unit(measured["limit"], measured)}'


def bound_text(measured: Json) -> str:
    """Return the uncertainty of a worst value as text; a dash where it is unknown."""
    bound = measured.get('uncertainty')
    return DASH if not bound else _in_unit(bound['bound'], {**measured, 'digits': 2})


def missing_text(source: Json, duration: float) -> str:
    """Return the share of an input's messages that are missing by its rate; empty: hardly any."""
    expected = (source['rate_hz'] or 0.0) * duration
    share = 1.0 - source['messages'] / expected if expected else 0.0
    return f'{share_words(share)} missing' if share > MISSING else ''


def origin_line(result: Json) -> str:
    """Return whether a recording is simulated or real, as far as it or a person says."""
    origin, entered = result['origin'], result['identity'].get('origin')
    said = 'simulated or real: the recording does not say'
    if origin['simulated']:
        said = 'simulated, as the recording says'
    elif origin['clock']:
        said = f'simulated or replayed: the recording has a clock, {origin["clock"]}'
    return f'{said}; entered: {entered}' if entered else said


def assumed_line(result: Json) -> str:
    """Return which numbers of the robot are only assumed, grouped by the reason."""
    assumed = result['robot']['assumed']
    if assumed is None:
        return "the robot's configuration does not say which of its numbers are only assumed"
    if not assumed:
        return 'no number of the robot is only assumed, its configuration says'
    by_reason: dict[str, list[str]] = {}
    for name, reason in assumed.items():
        by_reason.setdefault(reason, []).append(name)
    groups = (f'{", ".join(names)} ({reason})' for reason, names in by_reason.items())
    return f'assumed, not measured: {"; ".join(groups)}'


def ground_line(result: Json) -> str:
    """Return what the ground was taken for where somebody entered it; '' where nobody did."""
    ground = result.get('ground')
    if ground is None or not (ground['kind'] or ground['windows']):
        return ''
    parts = [f'{w["kind"]} from {w["start_s"]:g} to {w["end_s"]:g} s' for w in ground['windows']]
    kind = ground['kind'] or FLAT
    text = f'ground, as entered: {", ".join([*parts, f"else {kind}"]) if parts else kind}'
    if not is_bound(result):
        return text
    text += '; where it is not flat, margins in degrees are an upper bound'
    cautious = ground['cautious']
    if cautious is None:
        return text
    least = tipping_words(cautious['side'], math.radians(cautious['deg']))
    return f'{text}; taken cautiously {least} at {cautious["time_s"]:.2f} s'


def is_bound(result: Json) -> bool:
    """Return whether margins in degrees of a run are an upper bound: it was not on flat ground."""
    return result.get('ground', {}).get('upper_bound') is not None


def load_text(result: Json) -> str:
    """Return the load that was carried, by the configuration and the messages of the run."""
    load = result['load']
    if load['link'] is None:
        return 'this robot carries none'
    if not load['told']:
        return f'{load["configured_kg"]:.2f} kg, as configured; none was told during the run'
    told = ', '.join(f'{x["mass_kg"]:.2f} kg from {x["at_s"]:.2f} s' for x in load['told'])
    more = load['changes'] - len(load['told'])
    return f'{told}{f", and {more} more changes" if more else ""}: told during the run'


def doubts_of(result: Json) -> list[str]:
    """Return the reasons to doubt the margins or their limits, one sentence each."""
    doubts, wider = _waived(result), result.get('limits_relaxed')
    if wider:
        doubts = [
            *doubts,
            f'judged by relaxed limits ({wider["reason"]}): {", ".join(wider["limits"])}',
        ]
    said = set(result['reasons'])
    return [*doubts, *(text for text in result['model_check']['findings'] if text not in said)]


def _waived(result: Json) -> list[str]:
    """Return what the criteria waive that was not kept in this run."""
    return [
        f'{held["name"]} waived ({held["waived"]}), and not kept: {held["reasons"][0]}'
        for held in result.get('safeguards', ())
        if held['waived'] is not None and held['reasons']
    ]


def not_checked_lines(result: Json) -> list[str]:
    """Return what no number of the run tells, one line each."""
    return [_unchecked(one) for one in result['not_checked']]


def _unchecked(one: Json) -> str:
    seconds = f' ({one["seconds"]:.1f} s)' if one['seconds'] is not None else ''
    return f'{one["what"]}{seconds}: {one["why"]}'


def carrying_lines(result: Json) -> list[str]:
    """Return what joints held that carried the robot, at their worst moments: the most used few."""
    told = result.get('carrying', {})
    order = sorted(told, key=lambda name: -abs(told[name]['even']) / (told[name]['limit'] or 1e9))
    lines = [_carried(name, told[name]) for name in order[:_MOST_CARRYING]]
    more = len(order) - len(lines)
    return [*lines, *([f'and {more} more joints carried it (--json FILE lists all)'] * (more > 0))]


def _carried(name: str, told: Json) -> str:
    unit, numbers = told['unit'], {k: number_text(told[k]) for k in ('hanging', 'even')}
    ends = f'{number_text(told["least"])} to {number_text(told["most"])}'
    return (
        f'{name} carried the robot: {numbers["even"]} {unit} at {told["time_s"]:.1f} s with the '
        f'weight spread evenly, {ends} {unit} cannot be excluded (hanging in the air: '
        f'{numbers["hanging"]} {unit})'
    )


def interval_text(found: Json | None, unit: str = '') -> str:
    """Return a fitted number with its 95 % confidence interval."""
    if found is None:
        return DASH
    half = (found['high'] - found['low']) / 2.0
    return f'{_short(found["value"])} ± {_short(half)} {unit}'.strip()


def range_text(found: Json) -> str:
    """Return a number with both ends of its 95 % interval, which need not lie evenly about it."""
    return f'{found["value"]:.3g} ({found["low"]:.3g} to {found["high"]:.3g})'


def _short(value: float) -> str:
    """Return a number with two decimals, a large one with three digits."""
    return number_text(value, 2) if abs(value) < 100.0 else f'{value:.3g}'
