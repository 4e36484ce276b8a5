"""What `check` is asked: the trajectory of a file, the conditions of the options."""

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ugv_acceptance import BadBag, BadConfig, BadSample

if TYPE_CHECKING:
    from ugv_acceptance.bag.raw import Logged
    from ugv_acceptance.bag.reader import Bag
    from ugv_acceptance.evaluation.planned_motion import Conditions, Trajectory
    from ugv_acceptance.evaluation.settings import Settings
    from ugv_acceptance.model.robot import Payload

TEXTS = ('.yaml', '.yml', '.json')
# Times of a recording's trajectories that are named in an error, bytes of YAML that are read.
FEW, LARGEST = 6, 20_000_000


def trajectory_of(source: Path, topic: str, when: str) -> 'Trajectory':
    """Return the trajectory of a YAML file, of standard input (-), or of a recording's topic.

    `when` says which of a topic: the last at that time. Raises BadConfig or BadBag.
    """
    if source == Path('-') or (source.suffix in TEXTS and not source.is_dir()):
        for option, given in (('--topic', topic), ('--when', when)):
            if given:
                raise BadConfig(f'{option}: only a recording takes it, not {source}')
        from ugv_acceptance.config.trajectory_file import read_trajectory

        return read_trajectory(_text_of(source), str(source))
    return _recorded(source, topic, when)


def _text_of(source: Path) -> str:
    from ugv_acceptance.config.files import text as text_of

    try:
        if source == Path('-'):
            return sys.stdin.read(LARGEST)
        with source.open('rb') as file:
            content = file.read(LARGEST)
    except UnicodeDecodeError:
        raise BadConfig('standard input: expected UTF-8 text, got another encoding') from None
    except OSError as error:
        raise BadConfig(f'{source}: expected a trajectory in YAML, got: {error.strerror}') from None
    return text_of(content, source)


def _recorded(source: Path, topic: str, when: str) -> 'Trajectory':
    from ugv_acceptance.bag.raw import messages
    from ugv_acceptance.bag.reader import open_bag
    from ugv_acceptance.bag.trajectory import trajectory_from
    from ugv_acceptance.evaluation.planned_motion import Trajectory

    bag = open_bag([source])
    name = _topic(bag, source, topic)
    message = _chosen(bag, name, list(messages(bag, [name])), when)
    try:
        found = trajectory_from(message.data)
    except BadSample as error:
        raise BadBag(f'{source}: {name}: {error}') from None
    return Trajectory(
        found.names, found.times / 1e9, found.positions, found.velocities, found.accelerations
    )


def _topic(bag: 'Bag', source: Path, topic: str) -> str:
    """Return the topic that is asked for, or the only one of trajectories."""
    from ugv_acceptance.bag.reading import normal_type
    from ugv_acceptance.bag.trajectory import TYPE

    found = [name for name, of in bag.topics.items() if normal_type(of.type) == TYPE and of.count]
    listed = ', '.join(found) or 'none'
    if topic and topic not in found:
        raise BadBag(f'{source}: --topic: expected a topic of {TYPE} ({listed}), got {topic}')
    if not topic and len(found) != 1:
        raise BadBag(f'{source}: expected --topic, one of {TYPE}: {listed}')
    return topic or found[0]


def _chosen(bag: 'Bag', topic: str, found: list['Logged'], when: str) -> 'Logged':
    """Return the message that is meant: the last at a time, or the only one."""
    if not found:
        raise BadBag(f'{bag.paths[0]}: {topic}: no message can be read')
    seconds = [(message.log_time - bag.start_ns) / 1e9 for message in found]
    if not when:
        if len(found) > 1:
            times = ', '.join(f'{s:.2f} s' for s in seconds[:FEW])
            more = f' and {len(found) - FEW} more' if len(found) > FEW else ''
            raise BadConfig(
                f'{topic}: it has {len(found)} trajectories, at {times}{more}: expected --when'
            )
        return found[0]
    from ugv_acceptance.config import quantity

    asked = quantity(when, 'time', '--when')
    before = [message for s, message in zip(seconds, found, strict=True) if s <= asked + 5e-3]
    if not before:
        raise BadConfig(
            f'--when {when}: {topic} has none before: the first is at {seconds[0]:.2f} s'
        )
    return before[-1]


def conditions_of(
    settings: 'Settings', trajectory: 'Trajectory', options: dict[str, str], ground: str | None
) -> 'Conditions':
    """Return the conditions of the options posture, tilt, payload and at (texts).

    Joints of the trajectory stand at its first point where `posture` tells none of them.
    """
    from ugv_acceptance.cli.robot_description import positions_from, tilted_gravity
    from ugv_acceptance.evaluation.planned_motion import Conditions

    robot = settings.robot
    told = positions_from(robot, options['posture'])
    posture = tuple(told.get(name, math.nan) for name in robot.joint_names)
    gravity = tilted_gravity(robot, options['tilt'])
    load = _payload(settings, options['payload'], options['at'])
    return Conditions(
        gravity, load, ground, posture, from_first_point=not any(_told(settings, trajectory, told))
    )


def _told(settings: 'Settings', trajectory: 'Trajectory', told: dict[str, float]) -> Iterator[bool]:
    """Yield whether the posture tells of each joint of a trajectory."""
    pairs = zip(settings.robot.joint_names, settings.joints, strict=True)
    names = {of.topic_name: name for name, of in pairs}
    yield from (names.get(name) in told for name in trajectory.names)


def _payload(settings: 'Settings', mass: str, at: str) -> 'Payload':
    from dataclasses import replace

    from ugv_acceptance.cli.robot_description import payload_from

    load = payload_from(settings.robot, mass)
    if not at:
        return load
    from ugv_acceptance.console.typed import place_from

    return replace(load, cog=place_from(at, '--at'))


def ground_kind(texts: list[str] | None) -> str | None:
    """Return the kind of ground of the option --ground; a motion has one kind, and no times."""
    from ugv_acceptance.cli.ground_option import ground_from

    ground = ground_from(texts)
    if ground is not None and ground.windows:
        raise BadConfig('--ground: expected a kind for all the motion, got one for a time')
    return None if ground is None else ground.kind
