"""Finds, reads and validates a robot's YAML file and its URDF."""

import hashlib
import math
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Literal

from ugv_acceptance import BadConfig
from ugv_acceptance.config.build import Build, assumed_numbers, checked, settings_from
from ugv_acceptance.config.contact_check import compared, uneven_tracks
from ugv_acceptance.config.document import Document, read_document
from ugv_acceptance.config.files import LARGEST_FILE, beside, find, read, text
from ugv_acceptance.config.schema import File
from ugv_acceptance.config.setup_checks import setup_doubts
from ugv_acceptance.config.strength import worst_torques
from ugv_acceptance.config.topics import Topics, topics_from, topics_named
from ugv_acceptance.config.urdf import Urdf, read_urdf
from ugv_acceptance.evaluation.criteria.not_judged import LEAST
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.clearance import STANDS
from ugv_acceptance.model.robot import Contact, Payload

DEFAULT = Path('packbot')
NO_URDF = Urdf('', (), (), (), ())
# Share of the largest torque of any joint from which one without a limit is warned of.
HEAVY = 0.2


@dataclass(frozen=True, slots=True)
class Config:
    """A robot's configuration as read from its YAML file and URDF.

    `sha256` is that of both files' bytes. `uncertainty` pairs the names of numbers with their +/-
    as written in the file. `warnings` do not stop an evaluation; each names file and field.
    `not_compared` are the contact points that no collision geometry of the URDF could confirm.
    `assumed` pairs the names of numbers that nobody measured with the reason for their values; None
    if the file does not say which those are. `urdf_text` is the URDF in force as it was read,
    `urdf` what it means, and `description` says where it came from: a file, or the robot's own
    topic (then `urdf_path` is that topic's name). `defaulted`: nobody named a configuration.
    `operators` are the nodes that may command the monitor, a name without a leading / in its own
    namespace; None: anybody may.
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
    urdf: Urdf = field(repr=False, default=NO_URDF)
    urdf_text: bytes = field(repr=False, default=b'')
    description: Literal['file', 'robot_description'] = 'file'
    defaulted: bool = field(compare=False, default=False)
    operators: tuple[str, ...] | None = None

    @property
    def urdf_sha256(self) -> str:
        """The SHA-256 of the URDF in force."""
        return _sha256(self.urdf_text)


@lru_cache(maxsize=4)
def _sha256(text: bytes) -> str:
    """Return a hash that diagnostics tell each second."""
    return hashlib.sha256(text).hexdigest()


def load(
    path: Path | str | None = None,
    *,
    urdf: Path | str | None = None,
    urdf_text: bytes | None = None,
) -> Config:
    """Load a robot's configuration from a YAML file; `urdf` replaces the URDF that it names.

    A name without folder and ending, such as packbot (the default), is a configuration that ships
    with this package. `urdf_text` is the robot's own description, as on /robot_description; it is
    used if neither the file nor `urdf` names a URDF.

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
    at, yaml_bytes, document, file = _read_file(path)
    urdf_bytes, urdf_at, described = _urdf_of(at, file, urdf, urdf_text)
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
        urdf=model,
        urdf_text=urdf_bytes,
        description='robot_description' if described else 'file',
        defaulted=path is None,
        operators=file.operators,
    )


def description_topic(
    path: Path | str | None = None, *, urdf: Path | str | None = None
) -> str | None:
    """Return the topic that the URDF must come from; None if a file is named.

    Raises BadConfig as `load` does for a YAML file that cannot be used.
    """
    _, _, _, file = _read_file(path)
    if urdf is not None or file.urdf is not None:
        return None
    return file.topics.robot_description.name


def name_and_topics(
    path: Path | str | None = None, *, urdf: Path | str | None = None
) -> tuple[str, Topics]:
    """Return a robot's name and topics, also where only the robot itself tells its URDF.

    Raises BadConfig as `load` does.
    """
    _, _, _, file = _read_file(path)
    if urdf is None and file.urdf is None:
        return file.robot.name, topics_named(file)
    config = load(path, urdf=urdf)
    return config.name, config.topics


def names_in_messages(path: Path | str) -> tuple[str, ...] | None:
    """Return the joint names that a YAML file expects in messages; None: those of its URDF.

    The URDF is not read. Raises BadConfig as `load` does for a YAML file that cannot be used.
    """
    _, _, _, file = _read_file(path)
    if file.joints is None:
        return None
    return tuple(section.topic_name or name for name, section in file.joints.items())


def _read_file(path: Path | str | None) -> tuple[Path, bytes, Document, File]:
    at = find(DEFAULT if path is None else Path(path))
    content = read(at, 'configuration')
    return at, content, *_parsed(at, content)


@lru_cache(maxsize=4)
def _parsed(at: Path, content: bytes) -> tuple[Document, File]:
    """Return a YAML file as it was parsed: who asks for its topics then asks for all of it."""
    document = read_document(text(content, at), str(at))
    return document, checked(document, File)


def _urdf_of(
    at: Path, file: File, urdf: Path | str | None, told: bytes | None
) -> tuple[bytes, Path, bool]:
    """Return the URDF, where it is from, and whether that is the robot's own description."""
    if urdf is None and file.urdf is None:
        topic = Path('/', file.topics.robot_description.name)
        if told is None:
            raise BadConfig(
                f'{at}: urdf: expected the path of a URDF here or with --urdf, or a robot or a'
                f' recording that tells it on {topic}, got none'
            )
        if len(told) > LARGEST_FILE:
            raise BadConfig(f'{topic}: expected a URDF below 20 MB, got a larger text')
        return told, topic, True
    urdf_at = beside(at, str(file.urdf)) if urdf is None else Path(urdf)
    return read(urdf_at, 'URDF (give its path with --urdf)'), urdf_at, False


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
