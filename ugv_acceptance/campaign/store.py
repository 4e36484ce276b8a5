"""Stores the result of each run under a hash of all it depends on, so that work can be resumed."""

import json
from pathlib import Path

from ugv_acceptance import AcceptanceError
from ugv_acceptance.bag.atomic_files import naming, write_text
from ugv_acceptance.type_aliases import Json

RUNS = 'runs'
# Hexadecimal digits of a key.
_KEY = 64


def prepare(folder: Path) -> None:
    """Make the folder. AcceptanceError where that cannot be."""
    with naming(folder):
        (folder / RUNS).mkdir(parents=True, exist_ok=True)


def known_keys(folder: Path) -> frozenset[str]:
    """Return the keys of the results in the folder."""
    return frozenset(p.stem for p in (folder / RUNS).glob('*.json') if len(p.stem) == _KEY)


def keep(folder: Path, key: str, text: str) -> None:
    """Write the JSON of a run's result, complete or not at all."""
    write_text(folder / RUNS / f'{key}.json', text)


def read(folder: Path, key: str) -> Json:
    """Return a run's result. Raises AcceptanceError where it is not as it was written."""
    path = folder / RUNS / f'{key}.json'
    try:
        result = json.loads(path.read_text('utf-8'))
        if not all(field in result for field in ('verdict', 'coverage', 'alerts', 'start_ns')):
            raise AcceptanceError(f'{path}: expected a result of a run; remove it')
    except (OSError, ValueError, TypeError, RecursionError) as error:
        raise AcceptanceError(
            f'{path}: expected a result of a run, got: {error}; remove it'
        ) from None
    found: Json = result
    return found
