"""Finds, reads and validates a robot's YAML file and its URDF."""

import hashlib
import math
import sys
from dataclasses import dataclass
from pathlib import Path

from ugv_acceptance import BadConfig
from ugv_acceptance.config.build import Build, assumed_numbers, checked, settings_from
from ugv_acceptance.config.contact_check import compared, uneven_tracks
from ugv_acceptance.config.document import read_document
from ugv_acceptance.config.schema import File
from ugv_acceptance.config.setup_checks import setup_doubts
from ugv_acceptance.config.strength import worst_torques
from ugv_acceptance.config.topics import Topics, topics_from
from ugv_acceptance.config.urdf import read_urdf
from ugv_acceptance.evaluation.criteria.not_judged import LEAST
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.clearance import STANDS
from ugv_acceptance.model.robot import Contact, Payload

PACKAGE = 'ugv_acceptance'
DEFAULT = Path('packbot')
# A larger file (bytes) is not a robot description.
LARGEST_FILE = 20_000_000
# Share of the largest torque of any joint from which one without a limit is warned of.
HEAVY = 0.2


@dataclass(frozen=True, slots=True)
class Config:
    """A robot's configuration as read from its YAML file and URDF.

    `sha256` is that of both files' bytes. `uncertainty` pairs the names of numbers with their +/-
    as written in the file. `warnings` do not stop an evaluation; each names file and field.
    `not_compared` are the contact points that no collision geometry of the URDF could confirm.
    `assumed` pairs the names of numbers that nobody measured with the reason for their values; None
    if the file does not say which those are.
    """

    name: str
    serial: str | None
    settings: Settings
    topics: Topics
    path: Path
    urdf_path: Path
    sha256: str
    uncertainty: tuple[tuple[str, float], ...]
    warnings: tuple[str, ...]
    not_compared: tuple[str, ...] = ()
    assumed: tuple[tuple[str, str], ...] | None = None


def load(path: Path | str | None = None, *, urdf: Path | str | None = None) -> Config:
    """Load a robot's configuration from a YAML file; `urdf` replaces the URDF that it names.

    A name without folder and ending, such as packbot (the default), is a configuration that ships
    with this package.

    Raises
    ------
    BadConfig
        With file, line and field if something is missing, wrong or does not fit.

    Examples
    --------
    >>> import ugv_acceptance as ugv
    >>> config = ugv.load_config('packbot')
    >>> config.settings.robot.joint_names[:2]
    ('turret_joint', 'shoulder_joint')
    """
    at = find(DEFAULT if path is None else Path(path))
    yaml_bytes = _read(at, 'configuration')
    document = read_document(_text(yaml_bytes, at), str(at))
    file = checked(document, File)
    if urdf is None and file.urdf is None:
        raise BadConfig(f'{at}: urdf: expected the path of a URDF here or with --urdf, got none')
    urdf_at = _beside(at, str(file.urdf)) if urdf is None else Path(urdf)
    urdf_bytes = _read(urdf_at, 'URDF (give its path with --urdf)')
    model = read_urdf(urdf_bytes, str(urdf_at))
    build = Build(document, file, model, list(model.warnings))
    settings = settings_from(build)
    topics = topics_from(build, settings)
    _check_strength(build, settings)
    _check_unjudged(build, settings)
    doubts = _check_contacts(build, settings)
    return Config(
        file.robot.name,
        file.robot.serial,
        settings,
        topics,
        at,
        urdf_at,
        hashlib.sha256(yaml_bytes + urdf_bytes).hexdigest(),
        tuple(file.uncertainty.items()),
        tuple(build.warnings),
        doubts,
        assumed=assumed_numbers(build),
    )


def find(path: Path) -> Path:
    """Return the file of a path, or of the name of a configuration that ships; else BadConfig."""
    if path.parent != Path() or path.exists():
        return path
    name = path if path.suffix in ('.yaml', '.yml') else Path(f'{path}.yaml')
    places = [folder / 'msg_configs' / name for folder in _shares()]
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        folders = [place.parent for place in places if place.parent.is_dir()]
        known = sorted({file.stem for folder in folders for file in folder.glob('*.yaml')})
        raise BadConfig(
            f'{path}: expected a file, or one that ships ({", ".join(known) or "none found"})'
        )
    return found


def _shares() -> list[Path]:
    """Return the folders our data may be in: the checkout, and the installed share folders."""
    checkout, ros = Path(__file__).resolve().parents[2], _share_of(PACKAGE)
    return [checkout, *([ros] if ros else []), Path(sys.prefix) / 'share' / PACKAGE]


def _share_of(package: str) -> Path | None:
    """Return the share folder of a ROS package; None without ROS or without that package."""
    try:
        from ament_index_python.packages import (  # noqa: PLC0415 - ROS may be absent
            get_package_share_directory,
        )

        return Path(get_package_share_directory(package))
    except (ImportError, LookupError, OSError, ValueError):  # OSError: no AMENT_PREFIX_PATH
        return None


def _beside(at: Path, urdf: str) -> Path:
    """Return the path of a URDF: relative to its configuration file, or package://NAME/PATH."""
    if urdf.startswith('package://'):
        package, _, inside = urdf.removeprefix('package://').partition('/')
        share = _share_of(package)
        if share is None:
            raise BadConfig(f'{at}: urdf: expected a ROS package of this set-up, got {package}')
        return share / inside
    try:
        return (at.resolve().parent / urdf.removeprefix('file://')).resolve()
    except (OSError, ValueError, RuntimeError) as error:
        raise BadConfig(f'{at}: urdf: expected a path, got {error}') from None


def _read(path: Path, what: str) -> bytes:
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise BadConfig(f'{path}: expected a {what} below 20 MB, got a larger file')
        return path.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, 'strerror', None) or str(error)
        raise BadConfig(f'{path}: expected a {what}, got: {reason}') from None


def _text(content: bytes, path: Path) -> str:
    try:
        return content.decode('utf-8')
    except UnicodeDecodeError as error:
        raise BadConfig(f'{path}: expected UTF-8 text, got byte {error.start} of another') from None


def _check_strength(build: Build, settings: Settings) -> None:
    """Warn of torque limits that are too small to hold the arm's own weight in every posture."""
    names = settings.robot.joint_names
    for worst in worst_torques(settings.robot, Payload()):
        limit = settings.limits.torque[names.index(worst.joint)]
        if math.isfinite(limit) and worst.torque > limit:
            build.warn(
                ('joints', worst.joint, 'limit'),
                f'{limit:g} {worst.unit} cannot hold the own weight in every posture:'
                f' {worst.torque:.1f} {worst.unit} needed',
            )


def _check_unjudged(build: Build, settings: Settings) -> None:
    """Warn of joints without a limit that carry much of the arm's weight and of its payload."""
    robot, limits = settings.robot, settings.limits.torque
    if all(map(math.isfinite, limits)):
        return
    found = worst_torques(robot, robot.payload)
    for worst, limit in zip(found, limits, strict=False):
        largest = max(other.torque for other in found if other.unit == worst.unit)
        if worst.joint in settings.passive:
            continue
        if math.isinf(limit) and worst.torque > max(HEAVY * largest, LEAST):
            build.warn(
                ('joints', worst.joint, 'limit'),
                f'no limit, so its torque is not judged: it carries up to {worst.torque:.1f} '
                f'{worst.unit}',
            )


def _check_contacts(build: Build, settings: Settings) -> tuple[str, ...]:
    """Warn of contact points outside the collision geometry; return those without geometry."""
    found = compared(settings.robot, build.urdf.shapes)
    for contact, off in found.outside:
        build.warn(
            ('contacts', contact.name, 'position'),
            f'{off:.2f} m outside of the collision geometry of the URDF: can it stand there?',
        )
    uneven = uneven_tracks(settings.robot)
    if uneven is not None:
        build.warn(
            ('contacts',),
            f'{", ".join(uneven.names)} are not in one plane: one is {uneven.off * 1e3:.1f} mm off'
            f' that of three others, so {math.degrees(uneven.rocking):.1f} deg of rocking are taken'
            ' from every margin until all of them carry',
        )
    _check_setup(build, settings)
    return tuple(contact.name for contact in found.unknown)


def _check_setup(build: Build, settings: Settings) -> None:
    """Warn of what is doubtful of how the robot stands; with few points build.py has warned."""
    contacts = build.file.contacts or {}
    if len(contacts) < STANDS:
        return
    given = [Contact(name, c.link, c.position) for name, c in contacts.items()]
    known = tuple(build.file.assumed or ())
    for doubt in setup_doubts(settings.robot, build.urdf.shapes, given, known=known):
        build.warn(doubt.field, doubt.words)
