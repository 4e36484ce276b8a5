"""Reads numbers from the values of the monitor's verdict; what is no number is not known."""

import math
from collections.abc import Mapping

from ugv_acceptance.console.snapshot import Countdown
from ugv_acceptance.model.robot import Payload

# The verdict tells numbers with six digits.
_SAME = 2e-6


def number_of(values: Mapping[str, str], name: str) -> float:
    """Return a number of the verdict; NaN where it is missing or none."""
    try:
        return float(values.get(name, 'nan'))
    except ValueError:
        return math.nan


def countdown_of(values: Mapping[str, str], age: float = 0.0) -> Countdown | None:
    """Return the margin that is used up first by a verdict told `age` (s) ago; None if none is."""
    found = [
        Countdown(tips, values.get(f'{kind}_of', '?'), max(seconds - age, 0.0))
        for kind, tips in (('tip', True), ('saturation', False))
        if math.isfinite(seconds := number_of(values, f'{kind}_in_s'))
    ]
    return min(found, key=lambda each: each.seconds, default=None)


def load_of(values: Mapping[str, str]) -> Payload | None:
    """Return the payload in force at the monitor (kg, m); None where it does not know or tell."""
    mass = number_of(values, 'payload_kg')
    places = values.get('payload_cog_m', '').split(',')
    cog = [number_of({'place': place}, 'place') for place in places]
    if len(cog) != 3 or not all(map(math.isfinite, (mass, *cog))):
        return None
    return Payload(mass, (cog[0], cog[1], cog[2]))


def same_load(told: Payload, own: Payload) -> bool:
    """Return whether a payload is the one that was told, as far as it was told."""
    pairs = zip((told.mass, *told.cog), (own.mass, *own.cog), strict=True)
    return all(math.isclose(a, b, rel_tol=_SAME, abs_tol=1e-9) for a, b in pairs)
