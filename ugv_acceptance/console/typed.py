"""What a person types at a terminal: a load, its place. Units as on every command line."""

from ugv_acceptance import BadConfig
from ugv_acceptance.config import quantity

Place = tuple[float, float, float]


def place_from(text: str, what: str) -> Place:
    """Return a place (m) of three lengths such as 10cm,0,0; `what` names it in errors.

    Raises BadConfig where it is none.
    """
    places = text.split(',')
    if len(places) != 3:
        raise BadConfig(f'{what}: expected three lengths such as 10cm,0,0, got {text!r}')
    x, y, z = (quantity(place, 'length', what) for place in places)
    return x, y, z


def load_from(text: str) -> tuple[float, Place | None]:
    """Return mass (kg) and place (m; None: not told) of a load typed as "2.5kg 10cm,0,0".

    Raises BadConfig where it is none.
    """
    mass, _, place = text.strip().partition(' ')
    return quantity(mass, 'mass', 'load'), place_from(place, 'load') if place.strip() else None
