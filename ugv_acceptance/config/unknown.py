"""Values that a robot's file calls `unknown`: taken as absent, and named in the settings."""

from collections.abc import Callable
from typing import Any

from ugv_acceptance import BadConfig
from ugv_acceptance.config.document import Path
from ugv_acceptance.config.schema import UNKNOWN, File
from ugv_acceptance.evaluation.settings import CONTACTS, PAYLOAD_LINK

Refuse = Callable[[Path, str], BadConfig]


def known_of(file: File, refuse: Refuse) -> tuple[File, tuple[str, ...]]:
    """Return a file without its unknown values, and the keys of these as in `Settings.unknown`.

    Raises `refuse` of a load whose link is unknown: nobody could say where it is.
    """
    changes: dict[str, Any] = {}
    keys: list[str] = []
    if file.contacts is None:
        changes['contacts'] = {}
        keys.append(CONTACTS)
    if file.payload is not None and file.payload.link == UNKNOWN:
        if file.payload.mass > 0.0:
            raise refuse(
                ('payload', 'link'), f'expected the link that carries {file.payload.mass:g} kg'
            )
        changes['payload'] = None
        keys.append(PAYLOAD_LINK)
    joints = dict(file.joints or {})
    for name, section in joints.items():
        if section.limit is not None and section.limit.kind == UNKNOWN:
            joints[name] = section.model_copy(update={'limit': None})
            keys.append(f'joints.{name}.limit')
    if file.joints is not None:
        changes['joints'] = joints
    return file.model_copy(update=changes), tuple(keys)
