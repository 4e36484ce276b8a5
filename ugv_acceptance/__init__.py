"""Acceptance of unmanned ground vehicles: torque and tip-over margins, live and from recordings.

`evaluate` judges a recording, `LiveEvaluator` a running robot, `open_recording` reads messages,
`load_config` reads a robot's configuration. They are loaded when first used, so that the import
itself costs next to nothing.
"""

from importlib import import_module

# What typing's own is to type checkers; importing that takes longer than all of this file.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from ugv_acceptance.bag.recording import Recording as Recording
    from ugv_acceptance.bag.recording import Sample as Sample
    from ugv_acceptance.bag.recording import open_recording as open_recording
    from ugv_acceptance.config import Config as Config
    from ugv_acceptance.config import load as load_config
    from ugv_acceptance.model.robot import Payload as Payload
    from ugv_acceptance.monitoring.live_evaluator import LiveEvaluator as LiveEvaluator
    from ugv_acceptance.monitoring.live_evaluator import LiveMargins as LiveMargins
    from ugv_acceptance.offline.evaluate import evaluate as evaluate
    from ugv_acceptance.offline.evaluation import Evaluation as Evaluation
    from ugv_acceptance.offline.margins import MarginColumns as MarginColumns

__version__ = '0.1.0'

# Public name -> the module that defines it, and its name there.
_PUBLIC = {
    'Config': ('config', 'Config'),
    'Evaluation': ('offline.evaluation', 'Evaluation'),
    'LiveEvaluator': ('monitoring.live_evaluator', 'LiveEvaluator'),
    'LiveMargins': ('monitoring.live_evaluator', 'LiveMargins'),
    'MarginColumns': ('offline.margins', 'MarginColumns'),
    'Payload': ('model.robot', 'Payload'),
    'Recording': ('bag.recording', 'Recording'),
    'Sample': ('bag.recording', 'Sample'),
    'evaluate': ('offline.evaluate', 'evaluate'),
    'load_config': ('config', 'load'),
    'open_recording': ('bag.recording', 'open_recording'),
}

__all__ = [
    'AcceptanceError',
    'BadBag',
    'BadConfig',
    'BadSample',
    'Config',
    'Evaluation',
    'LiveEvaluator',
    'LiveMargins',
    'MarginColumns',
    'Payload',
    'Recording',
    'Sample',
    'evaluate',
    'load_config',
    'open_recording',
]

# Packages that only some commands need, by their names on PyPI. setup.py reads this table as text,
# and those commands name them in their error messages: this package itself is not on PyPI, so
# there its name with an extra behind it would install nothing.
EXTRAS: dict[str, tuple[str, ...]] = {
    # Older versions of s3fs lack `endpoint_url`; pip falls back to them beside a newer botocore.
    'cluster': ('dask', 'distributed', 'fsspec', 's3fs>=2023.1'),
    'console': ('starlette', 'textual', 'uvicorn', 'websockets'),
    'fast': ('isal',),
    'foxglove': ('foxglove-sdk',),
    'init': ('pycollada', 'trimesh', 'xacro'),
    'pdf': ('weasyprint',),  # over Debian's libpango-1.0-0 and libpangoft2-1.0-0
    'sim': ('mujoco',),
    'table': ('pyarrow',),
}


def pip_install(extra: str) -> str:
    """Return the pip command that installs the packages of one of EXTRAS."""
    import shlex  # noqa: PLC0415 - only errors need it: the import of the package stays cheap

    return f'pip install {shlex.join(EXTRAS[extra])}'


class AcceptanceError(Exception):
    """An error a user can act on: the message says where, what was expected and what was found."""


class BadConfig(AcceptanceError):
    """A robot description or configuration that cannot be used."""


class BadBag(AcceptanceError):
    """A recording that cannot be read."""


class BadSample(AcceptanceError):
    """A message whose content cannot be used."""


def __getattr__(name: str) -> object:
    """Load a public name when it is first asked for (PEP 562)."""
    if name not in _PUBLIC:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    module, attribute = _PUBLIC[name]
    value: object = getattr(import_module(f'{__name__}.{module}'), attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names, loaded or not."""
    return sorted([*globals(), *_PUBLIC])
