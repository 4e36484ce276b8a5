"""The recorded run packbot_pass with other efforts, positions or loads than it had."""

from collections.abc import Callable, Sequence
from pathlib import Path

from mcap.reader import make_reader

from ugv_acceptance.bag.cdr import JointStateSample, joint_state_decoder
from ugv_acceptance.bag.encode import inertia_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter

# Joint states are changed by a function of the seconds since the start and the message.
Change = Callable[[float, JointStateSample], JointStateSample]
JOINTS, PAYLOAD = '/joint_states', '/payload'


def rewritten(source: Path, folder: Path, change: Change, declared: float | None = None) -> Path:
    """Write `folder`: the recording `source` with its joint states changed; return it.

    `declared` (kg) replaces every payload that is told.
    """
    decode = joint_state_decoder().one
    with source.open('rb') as stream, BagWriter(folder) as bag:
        reader = make_reader(stream)
        start: int | None = None
        known = set()
        for schema, channel, message in reader.iter_messages():
            start = message.log_time if start is None else start
            if channel.topic not in known and schema is not None:
                known.add(channel.topic)
                bag.add_topic(channel.topic, schema.name)
            data = message.data
            if channel.topic == JOINTS:
                sample = change((message.log_time - start) / 1e9, decode(data))
                data = joint_state_cdr(
                    sample.stamp, sample.frame_id, sample.names, sample.position,
                    sample.velocity, sample.effort,
                )  # fmt: skip
            elif channel.topic == PAYLOAD and declared is not None:
                data = inertia_cdr(message.publish_time, 'gripper_link', declared, (0.0, 0.0, 0.0))
            bag.write(channel.topic, message.log_time, data)
    return folder


def efforts(of: Callable[[float, JointStateSample], Sequence[float]]) -> Change:
    """Return a change of the efforts alone."""
    return lambda at, sample: sample._replace(effort=tuple(of(at, sample)))
