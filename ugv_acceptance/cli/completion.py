"""What a shell offers for the values of options: names that ship, words that are known.

A shell asks at every TAB, so nothing heavy is imported for a list of words: the lists stand here
and a test holds them to the tables they are of. Where a robot's own names are asked for, its
configuration is read. An empty answer leaves the word to the shell, which offers files.
"""

import os
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from ugv_acceptance.model.robot import Robot

GROUNDS = ('flat', 'uneven', 'stairs')
MAPS = ('torque', 'rollover', 'payload', 'drag')
MAP_FORMATS = ('svg', 'png', 'csv', 'npz')
ORIENTATIONS = (
    *('level', 'right', 'left', 'nose-up', 'nose-down'),
    *('nose-up-right', 'nose-up-left', 'nose-down-right', 'nose-down-left'),
)
FAULTS = (
    *('dropped', 'late', 'reordered', 'duplicated', 'dead', 'nan', 'dead-encoder'),
    *('frozen-encoder', 'effort-missing', 'imu-bias', 'wrong-mounting', 'identity-orientation'),
    *('clock-jump', 'second-publisher', 'heavy-payload', 'weak-motor'),
)
SCENARIOS = (
    *('gentle', 'overreach', 'fetch', 'work', 'tilt', 'swing', 'reach', 'grasp', 'snatch'),
    *('dash', 'climb', *(f'fault-{name}' for name in FAULTS)),
)
# Ends of the names of recordings.
RECORDINGS = ('.mcap', '.mcap.zstd', '.db3', '.db3.zstd', '.bag')
# Ids and groups of steps in a plan's YAML.
_STEP = re.compile(r'^\s*(?:- )?(?:id|group): *[\'"]?([^\s\'"]+)', re.MULTILINE)

Complete = Callable[[str], list[str]]


def typed_words() -> list[str]:
    """Return the whole words after the program that a shell asks completions for."""
    bash = os.environ.get('_UGV_ACCEPTANCE_COMPLETE', '').endswith('bash')
    typed = os.environ.get('COMP_WORDS' if bash else '_TYPER_COMPLETE_ARGS', '')
    # The last word may be only the start of one.
    return [*typed.split()[1:], *([''] if typed[-1:].isspace() else [])][:-1]


def words_like(*words: str) -> Complete:
    """Return a completion that offers those of the words that begin as what was typed."""

    def like(incomplete: str) -> list[str]:
        return _begin(words, incomplete)

    return like


def configs_like(incomplete: str) -> list[str]:
    """Return the configurations that ship and YAML files of this folder that begin so."""
    here = sorted(path.name for end in ('yaml', 'yml') for path in Path().glob(f'[!.]*.{end}'))
    return _begin([*shipped_configs(), *here], incomplete)


def shipped_configs() -> list[str]:
    """Return the names of the configurations that ship."""
    shares = [Path(__file__).resolve().parents[2], Path(sys.prefix, 'share', 'ugv_acceptance')]
    ros = filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep))
    shares += [Path(prefix, 'share', 'ugv_acceptance') for prefix in ros]
    return sorted({file.stem for share in shares for file in share.glob('msg_configs/*.yaml')})


def recordings_like(incomplete: str) -> list[str]:
    """Return recordings that begin so, with the folders on the way to others."""
    place, _, begun = incomplete.rpartition('/')
    folder = Path(place or ('/' if incomplete.startswith('/') else '.'))
    before = incomplete.removesuffix(begun)
    try:
        held = sorted(path for path in folder.iterdir() if not path.name.startswith('.'))
    except OSError:
        return []
    found = (before + path.name + _end_of(path) for path in held if _leads_to(path))
    return _begin(found, incomplete)


def _leads_to(path: Path) -> bool:
    return path.is_dir() or path.name.lower().endswith(RECORDINGS)


def _end_of(path: Path) -> str:
    """Return a slash after a folder that is no recording itself."""
    return '/' if path.is_dir() and not (path / 'metadata.yaml').exists() else ''


def poses_like(context: typer.Context, incomplete: str) -> list[str]:
    """Return the names of the robot's poses that begin so."""
    robot = _robot(context)
    return _begin((pose.name for pose in robot.poses), incomplete) if robot else []


def joints_like(context: typer.Context, incomplete: str) -> list[str]:
    """Return the robot's measured joints that begin so."""
    robot = _robot(context)
    return _begin(robot.joint_names, incomplete) if robot else []


def codes_like(incomplete: str) -> list[str]:
    """Return the codes of alerts that begin so."""
    from ugv_acceptance.evaluation.alerts.messages import ALERTS

    return _begin(ALERTS, incomplete)


def map_files_like(context: typer.Context, incomplete: str) -> list[str]:
    """Return names for a map's file, one a format; nothing for a path."""
    kind = context.params.get('kind') or 'robot'
    return _begin((f'{kind}_map.{end}' for end in MAP_FORMATS), incomplete)


def steps_like(context: typer.Context, incomplete: str) -> list[str]:
    """Return the steps and groups of the plan that was named, which begin so."""
    # An option without its value yet hides the arguments from typer.
    plans = [word for word in typed_words() if word.endswith(('.yaml', '.yml'))]
    plan = context.params.get('plan') or next(iter(plans), None)
    try:
        text = Path(plan).read_text('utf-8') if plan else ''
    except (OSError, UnicodeDecodeError):
        return []
    return _begin(dict.fromkeys(_STEP.findall(text)), incomplete)


def _begin(words: Iterable[str], incomplete: str) -> list[str]:
    return [word for word in words if word.startswith(incomplete)]


def _robot(context: typer.Context) -> 'Robot | None':
    from ugv_acceptance import AcceptanceError
    from ugv_acceptance.config import load

    named = context.params.get('config')
    try:
        return load(None if named is None else Path(named)).settings.robot
    except AcceptanceError:
        return None
