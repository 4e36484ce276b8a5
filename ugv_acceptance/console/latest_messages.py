"""Keeps the newest message of each input for the next frame, and tells whether a sender is silent.

A picture needs only the newest message of each kind before it; the monitor judges every one.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import imu_decoder, joint_state_decoder
from ugv_acceptance.evaluation.criteria.not_judged import unknown_words
from ugv_acceptance.evaluation.settings import ImuInput, Settings

# Chooses which of an input's messages are evaluated, in order of arrival; at least one came.
Pick = Callable[[Sequence[bytes]], Sequence[bytes]]


@dataclass(slots=True)
class Heartbeat:
    """The regularity of a message: the time of the last and its period (s, monotonic clock)."""

    last: float | None = None
    period: float = 0.0

    def beat(self, now: float) -> None:
        """Record that a message came at `now` (s)."""
        if self.last is not None:
            self.period += 0.1 * (min(now - self.last, 1.0) - self.period)
        self.last = now

    def silent(self, now: float, least: float) -> bool:
        """Return whether messages came before, but none for `least` s and five of their periods."""
        return self.last is not None and now - self.last > max(least, 5.0 * self.period)


@dataclass(slots=True)
class Newest:
    """The messages of one input since the last frame, of which `pick` chooses those to evaluate."""

    take: Callable[[bytes], None]
    pick: Pick
    _waiting: list[bytes] = field(default_factory=list)

    def __call__(self, data: bytes) -> None:
        """Keep a message until the next frame."""
        self._waiting.append(data)

    @property
    def waiting(self) -> bool:
        """Whether any message came since the last frame."""
        return bool(self._waiting)

    def hand_on(self) -> int:
        """Pass the chosen messages to `take`; return the number of those dropped."""
        waiting, self._waiting = self._waiting, []
        picked = self.pick(waiting) if waiting else ()
        for data in picked:
            self.take(data)
        return len(waiting) - len(picked)


def newest_of_joints() -> Pick:
    """Return a pick of the newest JointState per set of joint names, for drivers that send parts.

    A message that cannot be read is always passed on, so that it is counted.
    """
    decode = joint_state_decoder().raw

    def pick(waiting: Sequence[bytes]) -> Sequence[bytes]:
        newest: dict[Hashable, bytes] = {}
        for k, data in enumerate(waiting):
            names: Hashable
            try:
                names = decode(data)[0].names
            except BadSample:
                names = k
            newest.pop(names, None)
            newest[names] = data
        return list(newest.values())

    return pick


def newest_attitude(imu: ImuInput) -> Pick:
    """Return a pick of the newest Imu message if its orientation is used, else of all messages.

    Where the attitude comes from the smoothed acceleration every message is needed. A message never
    replaces one of another length, which cannot be read as an Imu message.
    """
    decode = imu_decoder().one
    counts = imu.attitude != 'accelerometer' and not imu.specific_force

    def given(data: bytes) -> bool:
        try:
            _, _, orientation, _, _, covariance_0, _, _ = decode(data)
        except BadSample:
            return False
        return covariance_0 != -1.0 and any(orientation[:3])

    def pick(waiting: Sequence[bytes]) -> Sequence[bytes]:
        newest = waiting[-1]
        if len(waiting) == 1 or not counts or not given(newest):
            return waiting
        return [*(data for data in waiting if len(data) != len(newest)), newest]

    return pick


def hints_of(values: Mapping[str, str]) -> tuple[str, ...]:
    """Return the hints in a verdict's values beside alerts and countdown, in plain words."""
    mass = values.get('payload_estimate_kg')
    return () if mass is None else (f'measured efforts suggest a payload of {mass} kg',)


def problem_of(message: str, values: Mapping[str, str], settings: Settings) -> str:
    """Return why a verdict of NO DATA knows nothing: its sentence without the margins behind it.

    '' where it knows all there is, and only the configuration leaves something open.
    """
    why = message.partition(f'; {values.get("left")}')[0]
    return '' if settings.unknown and why == unknown_words(settings) else why
