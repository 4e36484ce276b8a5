"""A last line with a hash, which tells whether somebody edited a plan or criteria."""

import hashlib

SEAL = '# Not edited as long as this is the SHA-256 of all lines above: '


def sealed(text: str) -> str:
    """Return a YAML text with a last line, a comment, that fits it as it is now."""
    return f'{text}{SEAL}{_sha256(text)}\n'


def is_sealed(text: str) -> bool:
    """Return whether a text is as it was when it was sealed."""
    above, found, digest = text.rpartition(SEAL)
    return bool(found) and digest == f'{_sha256(above)}\n'


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode('utf-8', 'replace')).hexdigest()
