"""Whether a recording is of the configured robot: its own URDF, and the names of its joints."""

from collections.abc import Iterator
from pathlib import Path

from ugv_acceptance import BadBag, BadConfig
from ugv_acceptance.bag.cdr import JOINT_STATE
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.bag.told_robot import Described, descriptions_in, joint_names_in
from ugv_acceptance.config import Config, description_topic, load
from ugv_acceptance.config.same_robot import (
    FILE_AND_ROBOT,
    FIRST_AND_LATER,
    Places,
    difference_words,
    differences,
)
from ugv_acceptance.config.urdf import Urdf, read_urdf
from ugv_acceptance.evaluation.criteria.criteria import INCONCLUSIVE
from ugv_acceptance.evaluation.criteria.statement import Objection, Statement
from ugv_acceptance.evaluation.inputs.joint_names import names_words

SAFEGUARD = 'robot_description'
# Of a campaign whose first run told the URDF.
TAKEN_AND_HERE: Places = ('in the first run', 'in this run')


def robot_of(
    recording: Recording, config: Path | str | None = None, *, urdf: Path | str | None = None
) -> Config:
    """Load the configuration of a recorded robot; its URDF is the recorded one if it names none.

    Raises BadConfig where neither says what the robot is.
    """
    topic = description_topic(config, urdf=urdf)
    if topic is None:
        return load(config, urdf=urdf)
    told = descriptions_in(recording, topic)
    if told.unreadable and not told.texts:
        raise BadConfig(f'{recording.paths[0]}: {told.where}: {told.unreadable[0]}')
    return load(config, urdf_text=told.texts[0] if told.texts else None)


def check_default(recording: Recording, config: Config) -> None:
    """Raise BadBag if nobody named a configuration, and the recording is of another robot.

    It is where messages name other joints, and at most half of those of the robot that ships.
    """
    if not config.defaulted:
        return
    advice = (
        f'which is taken where no configuration is named; '
        f'ugv-acceptance init {recording.paths[0]} -o robot.yaml writes one'
    )
    ours = [how.topic_name for how in config.settings.joints]
    held = any(topic.type == JOINT_STATE.type for topic in recording.topics.values())
    try:
        told = joint_names_in(recording, ours)
    except BadBag as error:
        if held:
            raise
        raise BadBag(f'{error}; nothing says that this is {config.name}, {advice}') from None
    matched = [name for name in ours if any(_is_meant(name, other) for other in told)]
    foreign = sorted(n for n in told if not any(_is_meant(name, n) for name in ours))
    if foreign and 2 * len(matched) <= len(ours):
        raise BadBag(
            f'{recording.paths[0]}: its joints ({names_words(foreign)}) are not those of '
            f'{config.name} ({names_words(ours)}), {advice}'
        )


def _is_meant(ours: str, told: str) -> bool:
    """Return whether a name is the one meant, with or without a prefix."""
    return told == ours or told.endswith(('_' + ours, '/' + ours, '.' + ours, '-' + ours))


def description_statement(recording: Recording, config: Config) -> Statement:
    """Return the objections to a run whose recorded descriptions are not the URDF in force."""
    told = descriptions_in(recording, config.topics.robot_description)
    return Statement(objections=tuple(_objections(told, config)))


def _objections(told: Described, config: Config) -> Iterator[Objection]:
    def objection(text: str) -> Objection:
        return Objection(SAFEGUARD, INCONCLUSIVE, f'CONFIG_DIFFERS: {text}')

    for why in told.unreadable[:1]:
        yield objection(f'{told.where} cannot be read: {why}')
    parsed = [_parsed(text, told.where) for text in told.texts]
    for error in (found for found in parsed if isinstance(found, BadConfig)):
        yield objection(f'the description that the recording holds is not a URDF: {error}')
    read = [found for found in parsed if isinstance(found, Urdf)]
    filed = config.description == 'file'
    held, places = (read, FILE_AND_ROBOT) if filed else (read[:1], TAKEN_AND_HERE)
    other = next(_differing(config.urdf, held, places), None)
    if other is not None:
        yield objection(f'the URDF in force is not that on {told.where}: {other}')
    changes = list(_differing(read[0], read[1:], FIRST_AND_LATER)) if read else []
    if changes:
        yield objection(
            f'the recording tells {len(changes) + 1} different robots on {told.where}: {changes[0]}'
        )


def _parsed(text: bytes, where: str) -> Urdf | BadConfig:
    try:
        return read_urdf(text, where)
    except BadConfig as error:
        return error


def _differing(one: Urdf, others: list[Urdf], places: Places) -> Iterator[str]:
    """Yield the differences of each of `others` that is not the same robot as `one`."""
    for other in others:
        found = differences(one, other, places)
        if found:
            yield difference_words(found)
