"""Compares two URDFs by what they mean: links, joints, mimics, limits and collision numbers.

Bytes, comments, the order of elements, visuals and the names of mesh files do not count: a robot's
description names meshes by package, a file beside a configuration by path.
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from ugv_acceptance import BadConfig, BadSample
from ugv_acceptance.config.urdf import Urdf, read_urdf

if TYPE_CHECKING:
    from ugv_acceptance.config.loading import Config

# Numbers that differ by less, or by this share, are the same number printed twice.
ALIKE = 1e-9
# Differences named in one sentence.
MOST = 2
# Where two descriptions come from, in the words of a difference.
Places = tuple[str, str]
FILE_AND_ROBOT: Places = ('in the file', 'on the robot')
THEN_AND_NOW: Places = ('when it was taken', 'now')
FIRST_AND_LATER: Places = ('first', 'later')

# Attribute, its name for people, its unit.
_LINK = (('mass', 'mass', 'kg'), ('cog', 'centre of gravity', 'm'), ('inertia', 'inertia', 'kg m2'))
_JOINT = (
    ('kind', 'type', ''),
    ('parent', 'parent', ''),
    ('child', 'child', ''),
    ('xyz', 'origin', 'm'),
    ('rotation', 'rotation', ''),
    ('axis', 'axis', ''),
    ('lower', 'lower limit', ''),
    ('upper', 'upper limit', ''),
    ('effort', 'effort limit', ''),
    ('velocity', 'velocity limit', ''),
)
_MIMIC = (('follows', 'mimics', ''), ('multiplier', 'multiplier', ''), ('offset', 'offset', ''))
_SHAPE = (
    ('kind', 'geometry', ''),
    ('xyz', 'place', 'm'),
    ('rotation', 'rotation', ''),
    ('size', 'half size', 'm'),
    ('scale', 'scale', ''),
)
Fields = Sequence[tuple[str, str, str]]


def differences(one: Urdf, other: Urdf, places: Places = FILE_AND_ROBOT) -> tuple[str, ...]:
    """Return the differences of two descriptions, one phrase each; empty: the same robot.

    A phrase names the part and both values, each with its place: `link base: mass 10 kg in the
    file, 12 kg on the robot`.
    """
    return tuple(_differences(one, other, places))


def difference_words(found: Sequence[str]) -> str:
    """Return the first differences and the number of the others as one text."""
    more = len(found) - MOST
    return '; '.join(found[:MOST]) + (f'; and {more} more differences' if more > 0 else '')


def difference_of(config: 'Config', told: str | BadSample, topic: str) -> str:
    """Return how a description told on a topic differs from the URDF in force; empty: not at all.

    What cannot be read is a difference.
    """
    if isinstance(told, BadSample):
        return f'{topic} cannot be read: {told}'
    try:
        other = read_urdf(told.encode(), topic)
    except BadConfig as error:
        return str(error)
    places = FILE_AND_ROBOT if config.description == 'file' else THEN_AND_NOW
    return difference_words(differences(config.urdf, other, places))


def _differences(one: Urdf, other: Urdf, places: Places) -> Iterator[str]:
    def by_name(parts: Iterable[Any]) -> dict[str, Any]:
        return {part.name: part for part in parts}

    def mimic_of(urdf: Urdf) -> dict[str, Any]:
        return {mimic.joint: mimic for mimic in urdf.mimics}

    yield from _of_all('link', by_name(one.links), by_name(other.links), _LINK, places)
    yield from _of_all('joint', by_name(one.joints), by_name(other.joints), _JOINT, places)
    yield from _of_all('mimic joint', mimic_of(one), mimic_of(other), _MIMIC, places)
    yield from _of_all('collision of', _shapes(one), _shapes(other), _SHAPE, places)


def _shapes(urdf: Urdf) -> dict[str, Any]:
    """Return the collision geometry by the name of its link, with a number from the second on."""
    found: dict[str, Any] = {}
    seen: Counter[str] = Counter()
    for shape in urdf.shapes:
        seen[shape.link] += 1
        number = seen[shape.link]
        found[f'{shape.link} no. {number}' if number > 1 else shape.link] = shape
    return found


def _of_all(
    what: str, one: dict[str, Any], other: dict[str, Any], fields: Fields, places: Places
) -> Iterator[str]:
    for names, place in ((one.keys() - other.keys(), places[0]), (other.keys() - one, places[1])):
        yield from (f'{what} {name}: only {place}' for name in sorted(names))
    for name, part in one.items():
        if name in other:
            found = next(_of_part(part, other[name], fields, places), None)
            if found is not None:
                yield f'{what} {name}: {found}'


def _of_part(one: object, other: object, fields: Fields, places: Places) -> Iterator[str]:
    for key, word, unit in fields:
        a, b = getattr(one, key, None), getattr(other, key, None)
        if not _same(a, b):
            first, second = _pair(a, b, unit)
            yield f'{word} {first} {places[0]}, {second} {places[1]}'


def _same(one: object, other: object) -> bool:
    a, b = list(_flat(one)), list(_flat(other))
    return len(a) == len(b) and all(
        math.isclose(x, y, rel_tol=ALIKE, abs_tol=ALIKE)
        if isinstance(x, float) and isinstance(y, float)
        else x == y
        for x, y in zip(a, b, strict=True)
    )


def _flat(value: object) -> Iterator[object]:
    if isinstance(value, tuple):
        for part in value:
            yield from _flat(part)
    else:
        yield float(value) if isinstance(value, int) else value


def _pair(one: object, other: object, unit: str) -> tuple[str, str]:
    """Return both values as texts that differ, with as few digits as that takes."""
    for digits in (4, 9, 17):
        first, second = _text(one, unit, digits), _text(other, unit, digits)
        if first != second:
            break
    return first, second


def _text(value: object, unit: str, digits: int) -> str:
    if value is None or value in (math.inf, -math.inf):
        return 'none'
    parts = (f'{x:.{digits}g}' if isinstance(x, float) else str(x) for x in _flat(value))
    return f'{" ".join(parts)} {unit}'.strip()
