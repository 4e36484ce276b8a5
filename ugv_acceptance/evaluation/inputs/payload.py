"""The declared payload: which messages are plausible, and which payload was in force when."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.inputs.frames import same_frame, without_prefix
from ugv_acceptance.evaluation.samples import PayloadColumns
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload, Robot
from ugv_acceptance.type_aliases import Floats, Times

# More than any load (kg) or reach (m) of a robot arm: the number is something else.
ABSURD_MASS = 1e5
ABSURD_DISTANCE = 1e3
# Most letters of a frame's name in a sentence.
LONGEST_NAME = 60
# A time (ns) before any message.
BEFORE = -(2**62)
# What stands for a load that was declared in a way that cannot be used.
NOT_KNOWN = Payload(math.nan, (math.nan,) * 3)


def payload_from(robot: Robot, mass: float, com: Sequence[float], frame: str) -> Payload | None:
    """Return the payload of a message, None if it cannot be used (`payload_fault` says why)."""
    if payload_fault(robot, mass, com, frame):
        return None
    x, y, z = (float(c) for c in com)
    return Payload(float(mass), (x, y, z))


def payload_fault(robot: Robot, mass: float, com: Sequence[float], frame: str) -> str:
    """Return why the payload of a message cannot be used, in words; '' if it can.

    The mass (kg) must be plausible and not negative, the centre of gravity (m) plausible and given
    in the axes of the robot's payload link (an empty frame means that link). A robot without a
    payload link can carry 0 kg only.
    """
    link = robot.payload_link
    if not 0.0 <= mass <= ABSURD_MASS:
        return f'expected a mass from 0 to {ABSURD_MASS:g} kg, got {mass:g} kg'
    if not math.hypot(*com) <= ABSURD_DISTANCE:
        place = ' '.join(f'{c:g}' for c in com)
        return f'expected a centre of gravity within {ABSURD_DISTANCE:g} m, got {place} m'
    if link is None and mass > 0.0:
        return f'expected 0 kg, since no payload.link is configured, got {mass:g} kg'
    if link is not None and frame and not same_frame(frame, link):
        return f'expected the frame {link}, got {shown_frame(frame)}'
    return ''


def shown_frame(frame: str) -> str:
    """Return a frame's name as people read it: quoted, on one line, at most 60 letters."""
    return repr(frame if len(frame) <= LONGEST_NAME else f'{frame[:LONGEST_NAME]}...')


@dataclass(slots=True)
class PayloadHistory:
    """The payloads in force while a recording is read; old ones are forgotten.

    From a declaration that cannot be used until the next good one the load is not known: NaN.
    """

    initial: Payload
    _since: list[int] = field(init=False)
    _declared: list[Payload] = field(init=False)

    def __post_init__(self) -> None:
        self._since, self._declared = [BEFORE], [self.initial]

    def declare(self, when: int, payload: Payload | None) -> None:
        """Add a payload, in force from the first joint state received at or after `when` (ns).

        None: what was declared cannot be used.
        """
        self._since.append(when)
        self._declared.append(payload or NOT_KNOWN)

    def at(self, times: Times) -> tuple[Floats | float, ...]:
        """Return mass and centre of gravity (4) in force at `times` (n,) in ns, in order.

        Floats if all are the same, else arrays (n,); NaN where the load is not known. Payloads that
        ended before the last of `times` are forgotten.
        """
        since = np.array(self._since)
        first, last = (np.searchsorted(since, times[[0, -1]], side='right') - 1).tolist()
        table = [(p.mass, *p.cog) for p in self._declared[first : last + 1]]
        del self._since[:last], self._declared[:last]
        if len(table) == 1:
            return table[0]
        place = np.searchsorted(since, times, side='right') - 1
        return tuple(np.array(table)[place - first].T)


@dataclass(slots=True)
class PayloadLog:
    """All payloads declared in a recording and since when (ns), to look one up later."""

    settings: Settings
    since: list[int] = field(default_factory=list)
    payloads: list[Payload] = field(default_factory=list)

    def take(self, segments: Sequence[PayloadColumns]) -> None:
        """Add the payload messages of a batch."""
        messages = [(int(t), s, k) for s in segments for k, t in enumerate(s.log_time)]
        for when, s, k in sorted(messages, key=lambda message: message[0]):
            frame = without_prefix(s.frame_id, self.settings.frame_prefix)
            payload = payload_from(self.settings.robot, s.mass[k], s.com[k], frame)
            if payload and payload != self.at(when):
                self.since.append(when)
                self.payloads.append(payload)

    def at(self, time: int) -> Payload:
        """Return the payload in force for a joint state received at `time` (ns)."""
        k = bisect_right(self.since, time)
        return self.payloads[k - 1] if k else self.settings.robot.payload
