"""Which payload was in force at any moment of a recording, kept to the end."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.payload import payload_from
from ugv_acceptance.evaluation.samples import PayloadColumns
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload


@dataclass(slots=True)
class PayloadLog:
    """Every declared payload and since when (ns), so that a row's can be found again."""

    settings: Settings
    since: list[int] = field(default_factory=list)
    payloads: list[Payload] = field(default_factory=list)

    def take(self, segments: Sequence[PayloadColumns]) -> None:
        """Take the payload messages of a batch."""
        messages = [(int(t), s, k) for s in segments for k, t in enumerate(s.log_time)]
        for when, s, k in sorted(messages, key=lambda message: message[0]):
            payload = payload_from(self.settings.robot, s.mass[k], s.com[k], s.frame_id)
            if payload and payload != self.at(when):
                self.since.append(when)
                self.payloads.append(payload)

    def at(self, time: int) -> Payload:
        """Return the payload in force for a joint state received at `time` (ns)."""
        k = int(np.searchsorted(np.array(self.since, dtype=np.int64), time, side='right'))
        return self.payloads[k - 1] if k else self.settings.robot.payload
