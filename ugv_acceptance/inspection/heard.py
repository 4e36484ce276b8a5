"""What was heard of one input, from a robot or from a recording, and the findings about it."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import ImuSample, JointStateSample

OK, WARN, FAIL = 'OK', 'CAUTION', 'FAIL'
# Samples of an input that are kept.
KEPT = 5000


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the result: level, subject, observation, and what to do (empty: nothing)."""

    level: str
    about: str
    seen: str
    do: str = ''


@dataclass(slots=True)
class Heard:
    """The messages of one input: receipt times (ns), samples, and the publishers.

    `publishers` are (node, type, why its QoS does not match), `vendors` their nodes' DDS where that
    is known. `alike` are the other topics with messages of the input's type, except those a monitor
    publishes. `sampled` are the receipt times
    of `samples`; empty: the samples are the messages of `times`. `still` are samples of a time in
    which the robot stood still; None: whoever asked for them lets it stand still.
    """

    topic: str
    type: str
    publishers: list[tuple[str, str, str]] = field(default_factory=list)
    alike: list[str] = field(default_factory=list)
    times: list[int] = field(default_factory=list)
    samples: list[Any] = field(default_factory=list)
    malformed: list[str] = field(default_factory=list)
    sampled: list[int] = field(default_factory=list)
    still: list[Any] | None = None
    vendors: dict[str, str] = field(default_factory=dict)

    def take(self, decode: Callable[[bytes], JointStateSample | ImuSample], data: bytes) -> None:
        """Decode a message and keep it, or the reason why it cannot be read."""
        now = time.time_ns()
        try:
            sample = decode(data)
        except BadSample as error:
            self.malformed.append(str(error))
        else:
            if len(self.samples) < KEPT:
                self.samples.append(sample)
                self.sampled.append(now)
        if len(self.times) < KEPT:
            self.times.append(now)

    def pairs(self) -> Iterator[tuple[int, Any]]:
        """Yield each sample with the time (ns) at which it was received."""
        return zip(self.sampled or self.times, self.samples, strict=False)


@dataclass(frozen=True, slots=True)
class Told:
    """The robot's descriptions on `topic`: their texts, or why a message could not be read.

    `obstacle` says why none of them could be taken as the robot's URDF; empty: one can.
    """

    topic: str
    texts: tuple[str | BadSample, ...]
    obstacle: str
