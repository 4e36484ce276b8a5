"""Adds a last line with a hash to a plan or criteria file, which shows whether it was edited."""

import hashlib

SEAL = '# Not edited as long as this is the SHA-256 of all lines above: '


def sealed(text: str) -> str:
    """Return a YAML text with a last comment line that holds the SHA-256 of all lines above."""
    return f'{text}{SEAL}{_sha256(text)}\n'


def is_sealed(text: str) -> bool:
    """Return whether a text has a seal that still fits it: it was not edited since."""
    above, found, digest = text.rpartition(SEAL)
    return bool(found) and digest == f'{_sha256(above)}\n'


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode('utf-8', 'replace')).hexdigest()
