"""What a recording or a robot's files hold that an evaluation did not read."""

from collections.abc import Iterator

from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.criteria.statement import NotChecked

# Contact points named in one line.
MOST = 6


def not_read(recording: Recording, config: Config) -> Iterator[NotChecked]:
    """Yield the inputs that the configuration leaves out, and contacts without a known shape."""
    for key, topic in (('imu', config.topics.imu), ('joint_states', config.topics.joint_states)):
        names = [name for name, held in recording.topics.items() if held.type == topic.type]
        if names and not topic.used:
            why = f'the recording has it, but the configuration does not use topics.{key}'
            yield NotChecked(' and '.join(names), why)
    if config.not_compared and config.settings.hears_imu:
        more = len(config.not_compared) - MOST
        names_of = ', '.join(config.not_compared[:MOST]) + (f' and {more} more' if more > 0 else '')
        why = 'not compared with the shape of the robot: the URDF has none there, or only meshes'
        yield NotChecked(f'place of {names_of}', why)
