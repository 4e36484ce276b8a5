"""Acceptance of unmanned ground vehicles: torque and tip-over margins, live and from bags."""

import shlex

__version__ = '0.1.0'

# What only some verbs need, by pip's names. setup.py reads this table as text, the messages of
# those verbs are made of it: this package is on no index, so its name with [console] gets nothing.
EXTRAS: dict[str, tuple[str, ...]] = {
    # Older ones of s3fs know no `endpoint_url`; pip falls back to them beside a newer botocore.
    'cluster': ('dask', 'distributed', 'fsspec', 's3fs>=2023.1'),
    'console': ('starlette', 'textual', 'uvicorn', 'websockets'),
    'fast': ('isal',),
    'foxglove': ('foxglove-sdk',),
    'pdf': ('weasyprint',),  # over Debian's libpango-1.0-0 and libpangoft2-1.0-0
    'sim': ('mujoco',),
    'table': ('pyarrow',),
}


def pip_install(extra: str) -> str:
    """Return the command that installs what an extra needs."""
    return f'pip install {shlex.join(EXTRAS[extra])}'


class AcceptanceError(Exception):
    """An error a user can act on: says where, what was expected and what came."""


class BadConfig(AcceptanceError):
    """A robot description or configuration that cannot be used."""


class BadBag(AcceptanceError):
    """A recording that cannot be read."""


class BadSample(AcceptanceError):
    """A message whose content cannot be used."""
