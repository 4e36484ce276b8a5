"""Writes a rosbag2 folder: an MCAP file with checksums, and metadata.yaml when it is closed."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import yaml
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from ugv_acceptance import BadBag, BadSample, __version__
from ugv_acceptance.bag.atomic_files import write_text
from ugv_acceptance.bag.mcap_index import ORIGIN, SIMULATED
from ugv_acceptance.bag.mcap_writer import Compression, McapWriter
from ugv_acceptance.bag.metadata import NAME

_NS = 1_000_000_000
_FOREVER = {'sec': 9223372036, 'nsec': 854775807}


@dataclass(frozen=True, slots=True)
class Qos:
    """The QoS that a publisher offered, as far as it decides whether a subscriber matches."""

    reliability: Literal['reliable', 'best_effort'] = 'reliable'
    durability: Literal['volatile', 'transient_local'] = 'volatile'


@dataclass(frozen=True, slots=True)
class _Topic:
    type: str
    channel: int
    profile: list[dict[str, Any]]
    type_hash: str


class BagWriter:
    """Records a rosbag2 folder; a context manager that closes it, also after an error.

    At most `flush_s` seconds of log time (or `chunk_bytes`) are held back, which is what a killed
    process loses; `flush` writes what is held at once, for a caller with a clock. A recording that
    is `simulated` says so with every topic. The folder must be new or empty, else BadBag.
    """

    def __init__(
        self,
        directory: Path | str,
        *,
        compression: Compression = 'zstd',
        chunk_bytes: int = 1 << 20,
        flush_s: float = 0.5,
        simulated: bool = False,
    ) -> None:
        self.directory = Path(directory)
        if self.directory.exists() and (
            not self.directory.is_dir() or any(self.directory.iterdir())
        ):
            raise BadBag(f'{self.directory}: expected a new or empty folder to record into')
        self.directory.mkdir(parents=True, exist_ok=True)
        self.path = self.directory / f'{self.directory.name}_0.mcap'
        self._chunk_bytes = chunk_bytes
        self._flush_ns = int(flush_s * _NS)
        self._origin = {ORIGIN: SIMULATED} if simulated else {}
        self._topics: dict[str, _Topic] = {}
        self._file = self.path.open('wb')
        self._mcap = McapWriter(self._file, f'ugv_acceptance {__version__}', compression)

    def __enter__(self) -> 'BagWriter':  # noqa: PYI034 (Self is Python 3.11)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def add_topic(self, name: str, type_: str, qos: Qos | None = None) -> None:
        """Declare a topic of a ROS 2 type such as sensor_msgs/msg/Imu; BadBag if it is unknown."""
        if name in self._topics:
            if self._topics[name].type != type_:
                raise BadBag(f'{name}: declared as {self._topics[name].type}, now as {type_}')
            return
        schema, type_hash = definition_of(type_)
        profile = [_profile(qos or Qos())]
        metadata = {
            'offered_qos_profiles': yaml.safe_dump(profile, sort_keys=False),
            'topic_type_hash': type_hash,
            **self._origin,
        }
        channel = self._mcap.channel(name, type_, schema, metadata)
        self._topics[name] = _Topic(type_, channel, profile, type_hash)

    def write(self, topic: str, log_time_ns: int, cdr: bytes) -> None:
        """Add a message, serialised with its encapsulation header, received at `log_time_ns`."""
        known = self._topics.get(topic)
        if known is None:
            raise BadBag(f'{topic}: not declared with add_topic')
        if not 0 <= log_time_ns < 1 << 63:
            raise BadSample(f'{topic}: expected a log time in ns from 0 to 2^63, got {log_time_ns}')
        if pending := self._mcap.pending:
            size, first = pending
            if size >= self._chunk_bytes or abs(log_time_ns - first) >= self._flush_ns:
                self._mcap.end_chunk()
        self._mcap.message(known.channel, log_time_ns, cdr)

    def flush(self) -> None:
        """Write the messages held back, and flush them to the operating system."""
        self._mcap.end_chunk()

    def close(self) -> None:
        """Finish the file and write metadata.yaml; further calls do nothing."""
        if self._file.closed:
            return
        try:
            self._mcap.finish()
        finally:
            self._file.close()
        text = yaml.safe_dump({'rosbag2_bagfile_information': self._metadata()}, sort_keys=False)
        write_text(self.directory / NAME, text)

    def _metadata(self) -> dict[str, Any]:
        first, last = self._mcap.span()
        counts = self._mcap.counts
        span = {
            'duration': {'nanoseconds': last - first},
            'starting_time': {'nanoseconds_since_epoch': first},
            'message_count': sum(counts.values()),
        }
        topics = [
            {
                'topic_metadata': {
                    'name': name,
                    'type': topic.type,
                    'serialization_format': 'cdr',
                    'offered_qos_profiles': topic.profile,
                    'type_description_hash': topic.type_hash,
                },
                'message_count': counts[topic.channel],
            }
            for name, topic in self._topics.items()
        ]
        return {
            'version': 9,
            'storage_identifier': 'mcap',
            **span,
            'topics_with_message_count': topics,
            'compression_format': '',
            'compression_mode': '',
            'relative_file_paths': [self.path.name],
            'files': [{'path': self.path.name, **span}],
            'custom_data': self._origin or None,
            'ros_distro': 'jazzy',
        }


def _profile(qos: Qos) -> dict[str, Any]:
    return {
        'history': 'unknown',
        'depth': 0,
        'reliability': qos.reliability,
        'durability': qos.durability,
        'deadline': dict(_FOREVER),
        'lifespan': dict(_FOREVER),
        'liveliness': 'automatic',
        'liveliness_lease_duration': dict(_FOREVER),
        'avoid_ros_namespace_conventions': False,
    }


@cache
def _typestore() -> Typestore:
    return get_typestore(Stores.ROS2_JAZZY)


@cache
def definition_of(type_: str) -> tuple[str, str]:
    """Return the text and the hash of a type's definition; BadBag if Jazzy does not have it."""
    try:
        text, _ = _typestore().generate_msgdef(type_, ros_version=2)
        return text, _typestore().hash_rihs01(type_)
    except Exception as error:  # rosbags raises KeyError and its own, by version
        raise BadBag(f'{type_!r}: not a message type of ROS 2 Jazzy') from error
