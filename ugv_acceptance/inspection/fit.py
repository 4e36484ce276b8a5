"""Whether a recording is of a robot: its joint names, its description, its IMU."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ugv_acceptance import AcceptanceError, BadConfig, BadSample
from ugv_acceptance.bag.reader import Bag, Topics
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.bag.told_robot import descriptions_in
from ugv_acceptance.config import Config
from ugv_acceptance.config.files import shipped
from ugv_acceptance.config.loading import names_in_messages
from ugv_acceptance.config.same_robot import difference_of
from ugv_acceptance.evaluation.criteria.imu_mounting import mounting_words
from ugv_acceptance.evaluation.inputs.imu_mount import NAMELESS, mounted
from ugv_acceptance.evaluation.inputs.joint_names import near_names
from ugv_acceptance.evaluation.settings import UNKNOWN
from ugv_acceptance.inspection.look import Chosen
from ugv_acceptance.offline.own_robot import robot_of
from ugv_acceptance.offline.recorded_transforms import with_transforms
from ugv_acceptance.type_aliases import Json


@dataclass(frozen=True, slots=True)
class Named:
    """Names that messages carry: `joints`, and `frames` of the IMU with numbers of messages."""

    joints: frozenset[str]
    frames: Mapping[str, int]


def named_in(bag: Bag, joint_states: str | None, imu: str | None) -> Named:
    """Return the names that a recording tells on the two topics, as far as `bag` is read."""
    joints, frames = set[str](), dict[str, int]()
    if joint_states is None and imu is None:
        return Named(frozenset(), {})
    for batch in bag.batches(Topics(joint_states, imu, None)):
        for columns in batch.joints:
            joints.update(columns.names)
        for of_imu in batch.imu:
            frame = of_imu.frame_id
            frames[frame] = frames.get(frame, 0) + len(of_imu.log_time)
    return Named(frozenset(joints), frames)


def fitting(names: Iterable[str]) -> list[str]:
    """Return the shipped configurations whose joints are all among the names of messages."""
    told, found = set(names), []
    for name in shipped():
        with suppress(BadConfig):  # a file of somebody that cannot be used fits nothing
            expected = names_in_messages(name)
            if expected and told.issuperset(expected):
                found.append(name)
    return found


def config_of(
    recording: Recording, given: Path | None, urdf: Path | None, names: Iterable[str]
) -> tuple[Config | None, str]:
    """Return the configuration to look with, and why there is none.

    It is the one given, else the one `evaluate` takes, else the first that ships and fits.
    """
    known = fitting(names)
    if given is not None or urdf is not None:
        return robot_of(recording, given, urdf=urdf), ''
    default = robot_of(recording)
    if default.name in known or not known:
        return default, ''
    try:
        return robot_of(recording, known[0]), ''
    except AcceptanceError as error:
        return None, f'its joints are those of {known[0]}: {error}'


def robot_contents(
    recording: Recording, config: Config, named: Named, used: Mapping[str, Chosen]
) -> Json:
    """Return how a recording fits a configuration: joints, description, IMU."""
    wanted = [how.topic_name for how in config.settings.joints]
    missing = [name for name in wanted if name not in named.joints]
    return {
        'config': str(config.path),
        'name': config.name,
        'defaulted': config.defaulted,
        'urdf': str(config.urdf_path),
        'inputs': {name: {'topic': one.topic, 'why': one.why} for name, one in used.items()},
        'joints': {
            'expected': wanted,
            'missing': missing,
            'extra': sorted(named.joints - set(wanted)),
            'near': near_names(missing, named.joints),
        },
        'description': _description(recording, config),
        'imu': _imu(recording.bag, config, named),
    }


def _description(recording: Recording, config: Config) -> Json:
    """Return whether the recorded description is that in force: `same` None if none is held."""
    found = descriptions_in(recording, config.topics.robot_description)
    texts: list[str | BadSample] = [text.decode() for text in found.texts]
    texts += [BadSample(why) for why in found.unreadable]
    differences = (difference_of(config, text, found.where) for text in texts)
    other = next((text for text in differences if text), '')
    same = None if not texts else not other
    return {'topics': list(found.topics), 'same': same, 'difference': other or None}


def _imu(bag: Bag, config: Config, named: Named) -> Json | None:
    """Return the frames that the IMU names, and how it is mounted: `mounting` None if unknown."""
    if not config.settings.hears_imu:
        return None
    settings = with_transforms(config.settings, bag)
    frames = dict(sorted(named.frames.items(), key=lambda item: -item[1]))
    expected = settings.imu.frame or None
    told: Json = {'frames': frames, 'expected': expected, 'mounting': None, 'why': None}
    if not frames:
        return told | {'why': 'no message of it'}
    frame = next(iter(frames))
    found = mounted(settings, frame)
    if found is not None:
        return told | {'mounting': mounting_words(settings, found)}
    if settings.imu.placed == UNKNOWN:
        return told | {'why': 'the configuration declares it as unknown'}
    return told | {'why': f'its frame {frame!r} is no link of the URDF' if frame else NAMELESS}
