"""Writes a rosbag2 folder: MCAP files with checksums, and metadata.yaml when it is closed."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from io import FileIO
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
    """The QoS that a publisher offered: reliability and durability, which decide who hears it.

    Times in ns, None for no limit: `deadline` between two messages, `lifespan` of one, `lease` in
    which it shows that it is alive.
    """

    reliability: Literal['reliable', 'best_effort'] = 'reliable'
    durability: Literal['volatile', 'transient_local'] = 'volatile'
    deadline: int | None = None
    lifespan: int | None = None
    liveliness: Literal['automatic', 'manual_by_topic'] = 'automatic'
    lease: int | None = None


@dataclass(slots=True)
class _Topic:
    type: str
    schema: str
    type_hash: str
    profile: list[dict[str, Any]]
    channel: int = 0
    # Messages in the parts that are finished.
    before: int = 0


@dataclass(frozen=True, slots=True)
class _Part:
    """A file of the recording that is finished: name, first and last log time (ns), messages."""

    name: str
    first: int
    last: int
    count: int

    def info(self) -> dict[str, Any]:
        return {'path': self.name, **_span([self])}


class BagWriter:
    """Records a rosbag2 folder; a context manager that closes it, also after an error.

    At most `flush_s` seconds of log time (or `chunk_bytes`) are held back, which is what a killed
    process loses; `flush` writes what is held at once, for a caller with a clock. A recording that
    is `simulated` says so with every topic. The folder must be new or empty, else BadBag. After an
    OSError, such as a full disk, the file ends with its last whole chunk and takes no more.
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
        self._chunk_bytes = chunk_bytes
        self._flush_ns = int(flush_s * _NS)
        self._compression = compression
        self._origin = {ORIGIN: SIMULATED} if simulated else {}
        self._topics: dict[str, _Topic] = {}
        self._parts: list[_Part] = []
        self._broken = False
        self._bytes = 0
        self.path, self._file, self._mcap = self._new_file()

    def __enter__(self) -> 'BagWriter':  # noqa: PYI034 (Self is Python 3.11)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def part_bytes(self) -> int:
        """Bytes in the present file."""
        return self._mcap.written

    @property
    def written_bytes(self) -> int:
        """Bytes in all files."""
        present = self.path.name not in {part.name for part in self._parts[-1:]}
        return self._bytes + (self._mcap.written if present else 0)

    def _new_file(self) -> tuple[Path, FileIO, McapWriter]:
        path = self.directory / f'{self.directory.name}_{len(self._parts)}.mcap'
        # Without a buffer: what cannot be written must not come again when the file is closed.
        file = path.open('xb', buffering=0)
        return path, file, McapWriter(file, f'ugv_acceptance {__version__}', self._compression)

    def add_topic(self, name: str, type_: str, qos: Qos | Sequence[Qos] | None = None) -> None:
        """Declare a topic of a ROS 2 type such as sensor_msgs/msg/Imu; BadBag if it is unknown.

        `qos` is that of its publisher, or of each of them.
        """
        if name in self._topics:
            if self._topics[name].type != type_:
                raise BadBag(f'{name}: declared as {self._topics[name].type}, now as {type_}')
            return
        schema, type_hash = definition_of(type_)
        topic = self._topics[name] = _Topic(type_, schema, type_hash, _profiles(qos))
        topic.channel = self._channel(name, topic)

    def offer(self, name: str, qos: Qos | Sequence[Qos]) -> None:
        """Set what the publishers of a declared topic have offered, also in later files."""
        self._topics[name].profile = _profiles(qos)

    def _channel(self, name: str, topic: _Topic) -> int:
        metadata = {
            'offered_qos_profiles': yaml.safe_dump(topic.profile, sort_keys=False),
            'topic_type_hash': topic.type_hash,
            **self._origin,
        }
        return self._mcap.channel(name, topic.type, topic.schema, metadata)

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
                self.flush()
        self._mcap.message(known.channel, log_time_ns, cdr)

    def flush(self) -> None:
        """Write the messages held back, and flush them to the operating system."""
        with self._ending_whole():
            self._mcap.end_chunk()

    def split(self) -> None:
        """Finish this file and go on in the next part, which has the same topics."""
        self._finish()
        self.path, self._file, self._mcap = self._new_file()
        for name, topic in self._topics.items():
            topic.channel = self._channel(name, topic)

    def close(self) -> None:
        """Finish the file and write metadata.yaml; further calls do nothing.

        After an OSError the folder gets no metadata.yaml, which could not be right.
        """
        if self._file.closed:
            return
        if self._broken:
            self._file.close()
            return
        self._finish()
        text = yaml.safe_dump({'rosbag2_bagfile_information': self._metadata()}, sort_keys=False)
        write_text(self.directory / NAME, text)

    def _finish(self) -> None:
        try:
            with self._ending_whole():
                self._mcap.finish()
        finally:
            self._file.close()
        counts = self._mcap.counts
        self._bytes += self._mcap.written
        self._parts.append(_Part(self.path.name, *self._mcap.span(), sum(counts.values())))
        for topic in self._topics.values():
            topic.before += counts[topic.channel]

    @contextmanager
    def _ending_whole(self) -> Iterator[None]:
        """Cut off, if writing fails, what of a record is in the file."""
        try:
            yield
        except OSError:
            self._broken = True
            with suppress(OSError):
                self._file.truncate(self._mcap.written)
            raise

    def _metadata(self) -> dict[str, Any]:
        topics = [
            {
                'topic_metadata': {
                    'name': name,
                    'type': topic.type,
                    'serialization_format': 'cdr',
                    'offered_qos_profiles': topic.profile,
                    'type_description_hash': topic.type_hash,
                },
                'message_count': topic.before,
            }
            for name, topic in self._topics.items()
        ]
        return {
            'version': 9,
            'storage_identifier': 'mcap',
            **_span(self._parts),
            'topics_with_message_count': topics,
            'compression_format': '',
            'compression_mode': '',
            'relative_file_paths': [part.name for part in self._parts],
            'files': [part.info() for part in self._parts],
            'custom_data': self._origin or None,
            'ros_distro': 'jazzy',
        }


def _span(parts: Sequence[_Part]) -> dict[str, Any]:
    """Return duration, start and number of messages of some files, as in metadata.yaml."""
    held = [part for part in parts if part.count]
    first = min((part.first for part in held), default=0)
    last = max((part.last for part in held), default=0)
    return {
        'duration': {'nanoseconds': last - first},
        'starting_time': {'nanoseconds_since_epoch': first},
        'message_count': sum(part.count for part in parts),
    }


def _profiles(qos: Qos | Sequence[Qos] | None) -> list[dict[str, Any]]:
    offers = [qos or Qos()] if qos is None or isinstance(qos, Qos) else list(qos) or [Qos()]
    return [_profile(offer) for offer in dict.fromkeys(offers)]


def _profile(qos: Qos) -> dict[str, Any]:
    return {
        'history': 'unknown',
        'depth': 0,
        'reliability': qos.reliability,
        'durability': qos.durability,
        'deadline': _time(qos.deadline),
        'lifespan': _time(qos.lifespan),
        'liveliness': qos.liveliness,
        'liveliness_lease_duration': _time(qos.lease),
        'avoid_ros_namespace_conventions': False,
    }


def _time(limit: int | None) -> dict[str, int]:
    """Return a time (ns) as rosbag2 writes it."""
    if limit is None:
        return dict(_FOREVER)
    sec, nsec = divmod(limit, _NS)
    return {'sec': sec, 'nsec': nsec}


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
