"""One recording judged in several ways that must not matter: the same bytes of result each time."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from bag.bag_cases import Message, write_mcap
from hardening.outcome import Outcome

from ugv_acceptance.bag.cdr import (
    Decoder,
    ImuSample,
    PayloadSample,
    imu_decoder,
    joint_state_decoder,
    payload_decoder,
)
from ugv_acceptance.bag.raw import messages
from ugv_acceptance.bag.reader import Bag, Topics, open_bag
from ugv_acceptance.bag.reading import Facts
from ugv_acceptance.bag.recording import Recording
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.samples import Batch, ImuColumns, JointStateColumns, PayloadColumns
from ugv_acceptance.offline.judge import judge


@dataclass(frozen=True, slots=True)
class Way:
    """A bag read by so many threads, or message by message by the decoder of the live monitor."""

    bag: Bag
    workers: int = 1
    single: bool = False

    def __getattr__(self, name: str) -> Any:
        """Be the bag in all but its batches."""
        return getattr(self.bag, name)

    def batches(self, topics: Topics, workers: int = 1) -> Any:
        """Return what `Bag.batches` returns, read this way unless that is asked for."""
        if self.single:
            return Singly(self.bag, topics)
        return self.bag.batches(topics, workers=workers or self.workers)


class Singly(Iterator[Batch]):
    """Batches of one message each."""

    def __init__(self, bag: Bag, topics: Topics) -> None:
        kinds: dict[str | None, Decoder[Any]] = {
            topics.joint_states: joint_state_decoder(),
            topics.imu: imu_decoder(),
            topics.payload: payload_decoder(),
        }
        self._decoders = {name: decoder for name, decoder in kinds.items() if name}
        self._messages = messages(bag, self._decoders)
        self._counts = dict.fromkeys(self._decoders, 0)

    def __next__(self) -> Batch:
        message = next(self._messages)
        self._counts[message.topic] += 1
        sample = self._decoders[message.topic].one(message.data)
        time, stamp = np.array([message.log_time]), np.array([sample.stamp])
        if isinstance(sample, ImuSample):
            vectors = [np.array([v]) for v in sample[2:5]]
            firsts = [np.array([v]) for v in sample[5:8]]
            return Batch([], [ImuColumns(sample.frame_id, time, stamp, *vectors, *firsts)], [])
        if isinstance(sample, PayloadSample):
            mass, com = np.array([sample.mass]), np.array([sample.com])
            return Batch([], [], [PayloadColumns(sample.frame_id, time, stamp, mass, com)])
        arrays = [np.array([v], np.float64).reshape(1, -1) for v in sample[3:6]]
        return Batch([JointStateColumns(sample.names, time, stamp, *arrays)], [], [])

    @property
    def facts(self) -> Facts:
        """Counts alone: the recordings given to this are whole."""
        return Facts(dict(self._counts), complete=True)


def result(way: Any) -> str:
    """Return the result as it is written, but for the paths and the hash of the files."""
    found = judge(Recording(way), load().settings)[0]
    for key in ('path', 'sha256', 'findings'):
        del found['bag'][key]
    return json.dumps(found, indent=2, allow_nan=False, default=str)


def split(recording: Path, folder: Path, parts: int) -> list[Path]:
    """Write a recording again as files of equal length in time."""
    bag = open_bag(recording)
    found: list[Message] = [
        (m.topic, bag.topics[m.topic].type, m.log_time, m.data) for m in messages(bag, bag.topics)
    ]
    size = -(-len(found) // parts)
    return [
        write_mcap(folder / f'part_{k}.mcap', found[k * size : (k + 1) * size], chunk_size=60_000)
        for k in range(parts)
    ]


def trial(recording: Path, folder: Path) -> Outcome:
    """Judge a recording twice, by one and two threads, in parts, parts turned round, and singly."""
    bag = open_bag(recording)
    parts = split(recording, folder, 3)
    ways = {
        'again': Way(open_bag(recording)),
        'one thread': Way(bag, 1),
        'two threads': Way(bag, 2),
        'four threads': Way(bag, 4),
        'in three files': Way(open_bag(parts)),
        'files turned round': Way(open_bag(parts[::-1])),
        'message by message': Way(bag, single=True),
    }
    first = result(Way(bag))
    odd = [name for name, way in ways.items() if result(way) != first]
    text = f'{recording.name}: {len(ways) - len(odd)} of {len(ways)} ways give the same bytes'
    return Outcome(text + (f'; not: {", ".join(odd)}' if odd else ''), not odd)
