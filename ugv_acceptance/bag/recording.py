"""The Python front door to recordings: `open_recording`, topics, and messages one by one."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import (
    IMU,
    JOINT_STATE,
    PAYLOAD,
    Decoder,
    ImuSample,
    JointStateSample,
    PayloadSample,
)
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import Bag, Topic, Topics, choose_topics, open_bag

Paths = Path | str | Sequence[Path | str]
# The topics of joint states, IMU and payload where nobody names others.
Names = tuple[str | None, str | None, str]
NAMES: Names = ('joint_states', 'imu/data', 'payload')
Message = JointStateSample | ImuSample | PayloadSample | BadSample


class Sample(NamedTuple):
    """One decoded message of a recording: log time (ns since the epoch), topic and content.

    `message` is a BadSample, which says what is wrong, if the content cannot be decoded.
    """

    time_ns: int
    topic: str
    message: Message


@dataclass(frozen=True, slots=True)
class Recording:
    """An opened recording; iterating it yields the samples that an evaluation reads, in log order.

    `names` are the topics of joint states, IMU and payload; if there is no topic of that name, the
    only topic of the type is used. None: that input is not read.

    Examples
    --------
    >>> import ugv_acceptance as ugv
    >>> recording = ugv.open_recording('bags/packbot_pass')
    >>> round(recording.duration_s)
    28
    >>> next(iter(recording)).topic
    '/payload'
    """

    bag: Bag = field(repr=False)
    names: Names | None = None

    @property
    def paths(self) -> tuple[Path, ...]:
        """The files of the recording."""
        return self.bag.paths

    @property
    def start_ns(self) -> int:
        """Log time (ns since the epoch) of the first message."""
        return self.bag.start_ns

    @property
    def duration_s(self) -> float:
        """Seconds from the first to the last message."""
        return self.bag.duration_s

    @property
    def topics(self) -> Mapping[str, Topic]:
        """Every topic of the recording, with its type and number of messages."""
        return self.bag.topics

    @property
    def findings(self) -> tuple[str, ...]:
        """Sentences about what is odd with the files: broken off, counts that disagree."""
        broken = (self.bag.salvaged,) if self.bag.salvaged else ()
        return (*broken, *self.bag.findings)

    def chosen(self, *, imu_required: bool = True) -> Topics:
        """Return the topics to read; BadBag if the choice is ambiguous."""
        return choose_topics(self.bag, *(self.names or NAMES), imu_required=imu_required)

    def __iter__(self) -> Iterator[Sample]:
        """Yield every joint state, IMU and payload message in the order in which it was logged."""
        topics = self.chosen(imu_required=False)
        kinds = ((JOINT_STATE, topics.joint_states), (IMU, topics.imu), (PAYLOAD, topics.payload))
        decoders: dict[str, Decoder[Any]] = {
            name: Decoder(kind) for kind, name in kinds if name is not None
        }
        for logged in messages(self.bag, decoders):
            yield Sample(
                logged.log_time, logged.topic, _decoded(decoders, logged.topic, logged.data)
            )


def _decoded(decoders: Mapping[str, Decoder[Any]], topic: str, data: bytes) -> Message:
    try:
        message: Message = decoders[topic].one(data)
    except BadSample as error:
        return error
    return message


def open_recording(path: Paths, *, names: Names | None = None) -> Recording:
    """Open a recording: a rosbag2 folder, MCAP (also .zstd), SQLite or ROS 1 files.

    Several paths are the parts of one recording. `names` are the topics of joint states, IMU and
    payload, by default joint_states, imu/data and payload.

    Raises
    ------
    BadBag
        If nothing can be read; the message says which file and why.

    Examples
    --------
    >>> import ugv_acceptance as ugv
    >>> sorted(ugv.open_recording('bags/packbot_pass').topics)
    ['/imu/data', '/joint_states', '/payload']
    """
    return Recording(open_bag(path), names)
