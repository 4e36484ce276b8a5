"""What a console makes of what it hears: the newest of many messages, silence, the monitor's hints.

A picture needs no more than the newest message of each kind before it; the others are the monitor's
business, which judges every one.
"""

from collections import defaultdict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field

from ugv_acceptance import BadSample
from ugv_acceptance.bag.cdr import imu_decoder, joint_state_decoder
from ugv_acceptance.evaluation.settings import ImuInput

# Which messages of an input replace each other: those of the same kind.
Kind = Callable[[bytes], Hashable]


@dataclass(slots=True)
class Heartbeat:
    """How regularly something is heard; `last` and `period` in seconds of a monotonic clock."""

    last: float | None = None
    period: float = 0.0

    def beat(self, now: float) -> None:
        """Take one."""
        if self.last is not None:
            self.period += 0.1 * (min(now - self.last, 1.0) - self.period)
        self.last = now

    def silent(self, now: float, least: float) -> bool:
        """Return whether it was heard before, and not for `least` s and five of its periods."""
        return self.last is not None and now - self.last > max(least, 5.0 * self.period)


@dataclass(slots=True)
class Newest:
    """The messages of one input since the last look: of those of the same `kind`, the newest."""

    take: Callable[[bytes], None]
    kind: Kind
    _waiting: dict[Hashable, bytes] = field(default_factory=dict)
    _replaced: int = 0

    def __call__(self, data: bytes) -> None:
        """Keep a message in place of an older one."""
        kind = self.kind(data)
        self._replaced += self._waiting.pop(kind, None) is not None
        self._waiting[kind] = data

    def hand_on(self) -> int:
        """Hand on what was kept, in order of arrival; return how many were not kept."""
        for data in self._waiting.values():
            self.take(data)
        self._waiting.clear()
        replaced, self._replaced = self._replaced, 0
        return replaced


def joints_named() -> Kind:
    """Return the kind of a JointState: the names in it, for a driver may tell of some joints only.

    What cannot be read is of a kind of its own.
    """
    decode = joint_state_decoder().one

    def kind(data: bytes) -> Hashable:
        try:
            return decode(data)[2]
        except BadSample:
            return None

    return kind


def attitude_given(imu: ImuInput) -> Kind:
    """Return the kind of an Imu message: all are alike where the orientation is given and counts.

    Where the attitude comes from the smoothed acceleration, none replaces another.
    """
    decode = imu_decoder().one
    counts = imu.attitude != 'accelerometer' and not imu.specific_force

    def kind(data: bytes) -> Hashable:
        try:
            _, _, orientation, _, _, covariance_0, _, _ = decode(data)
        except BadSample:
            return None
        given = counts and covariance_0 != -1.0 and any(orientation[:3])
        return 'given' if given else object()

    return kind


def hints_of(values: Mapping[str, str]) -> tuple[str, ...]:
    """Return what a verdict's values tell beside the alerts, in plain words."""
    forms = (
        ('tip_in_s', 'it tips to the {tip_of} in {tip_in_s} s at this rate'),
        ('saturation_in_s', '{saturation_of} saturates in {saturation_in_s} s at this rate'),
        ('payload_estimate_kg', 'efforts tell of a payload of {payload_estimate_kg} kg'),
    )
    missing = defaultdict(lambda: '?', values)
    return tuple(form.format_map(missing) for key, form in forms if key in values)
