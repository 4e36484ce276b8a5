"""Reads who and what was tested, as a person enters it: KEY=VALUE,... or a YAML file."""

from difflib import get_close_matches
from pathlib import Path

from ugv_acceptance import BadConfig
from ugv_acceptance.config.document import read_document
from ugv_acceptance.config.files import text as text_of
from ugv_acceptance.config.units import shown

# Entries that a report shows; one that nobody entered is marked as missing.
PARTS = {
    'origin': 'simulated or real',
    'robot_serial': 'robot serial number',
    'payload': 'payload',
    'flippers': 'flippers',
    'firmware': 'firmware of the robot',
    'operator': 'operator',
    'witness': 'witness',
    'place': 'place',
    'surface': 'surface',
    'weather': 'weather',
    'date': 'date of the run',
    'deviations': 'deviations and waivers',
    'remarks': 'remarks',
}
LONGEST = 2000


def identity_from(text: str | None) -> dict[str, str]:
    """Return the identity entered as KEY=VALUE,KEY=VALUE or in the YAML file of that path.

    Raises BadConfig for a key that is not one of PARTS, or a value that is not a text or number.
    """
    if text is None:
        return {}
    if (path := file_of(text)) is not None:
        return _checked(_file(path), text)
    pairs: dict[object, object] = {}
    key = ''
    for part in text.split(','):
        name, sign, value = part.partition('=')
        if sign:
            key = name.strip()
            if key in pairs:
                raise BadConfig(f'--identity: {key}: given twice')
            pairs[key] = value.strip()
        elif key:  # a comma inside a value
            pairs[key] = f'{pairs[key]},{part}'
        else:
            raise BadConfig(f'--identity: expected KEY=VALUE, got {shown(part)}')
    return _checked(pairs, '--identity')


def file_of(text: str | None) -> Path | None:
    """Return the path that a text names; None if it is KEY=VALUE itself, or None."""
    return None if text is None or '=' in text else Path(text)


def _file(path: Path) -> dict[object, object]:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadConfig(
            f'{path}: expected KEY=VALUE,... or a YAML file of an identity, got: {error.strerror}'
        ) from None
    data = read_document(text_of(content, path), str(path)).data
    if not isinstance(data, dict):
        raise BadConfig(f'{path}: expected keys with values, got {shown(data)}')
    return data


def _checked(pairs: dict[object, object], where: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for key, value in pairs.items():
        if key not in PARTS:
            near = get_close_matches(str(key), PARTS, 1, 0.5)
            hint = f'did you mean {near[0]}?' if near else f'known are {", ".join(PARTS)}'
            raise BadConfig(f'{where}: {key}: unknown key; {hint}')
        if value is None or isinstance(value, list | dict) or len(str(value)) > LONGEST:
            raise BadConfig(
                f'{where}: {key}: expected a text up to {LONGEST} letters, got {shown(value)}'
            )
        found[str(key)] = str(value)
    return found
