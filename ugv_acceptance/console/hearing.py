"""What a console makes of what it hears of a monitor: whether it still is heard, and its hints."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass


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


def hints_of(values: Mapping[str, str]) -> tuple[str, ...]:
    """Return what a verdict's values tell beside the alerts, in plain words."""
    forms = (
        ('tip_in_s', 'it tips to the {tip_of} in {tip_in_s} s at this rate'),
        ('saturation_in_s', '{saturation_of} saturates in {saturation_in_s} s at this rate'),
        ('payload_estimate_kg', 'efforts tell of a payload of {payload_estimate_kg} kg'),
    )
    missing = defaultdict(lambda: '?', values)
    return tuple(form.format_map(missing) for key, form in forms if key in values)
