"""Whether posture and tilt of a run were measured at the same time.

Messages of the two inputs are paired by time of receipt: their stamps may come from clocks that
differ. If so, or if one input takes longer on its way, posture and tilt do not belong together.
"""

from dataclasses import dataclass, field

import numpy as np

from ugv_acceptance.evaluation.criteria.statement import NotChecked, Statement
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.type_aliases import Floats, Json, Times

# Difference (s) between the two inputs that is told, and messages of each part that are looked at.
APART, MOST = 0.1, 200


@dataclass(slots=True)
class InputTimes:
    """Compares receipt times and header stamps of both inputs: an examination without objection."""

    _joints: list[Floats] = field(default_factory=list)
    _imu: list[Floats] = field(default_factory=list)

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        joints, imu = rows.pairs.joints, rows.pairs.imu
        self._joints.append(_delays(joints.time, joints.stamp))
        self._imu.append(_delays(imu.time, imu.stamp))

    def statement(self, start: int, end: int) -> Statement:
        """Return how long messages of both inputs were on their way, by their stamps."""
        del start, end
        delays = [_typical(parts) for parts in (self._joints, self._imu)]
        result: Json = dict(zip(('joint_states_s', 'imu_s'), delays, strict=True))
        found = Statement({'stamps_before_receipt': result})
        if delays[0] is None or delays[1] is None or abs(delays[0] - delays[1]) <= APART:
            return found
        apart = abs(delays[0] - delays[1])
        why = (
            f'their stamps are {apart:.2f} s apart (joint_states {_words(delays[0])} receipt, imu '
            f'{_words(delays[1])} receipt); they are paired by time of receipt'
        )
        told = NotChecked('whether posture and tilt were measured at the same time', why)
        return Statement(found.result, (), (told,))


def _delays(time: Times, stamp: Times) -> Floats:
    """Return time since the stamp (s) of some of the messages that have one; not of the first."""
    step = max(1, len(time) // MOST)
    time, stamp = time[1::step], stamp[1::step]
    seconds: Floats = (time - stamp)[stamp > 0] / 1e9
    return seconds


def _typical(parts: list[Floats]) -> float | None:
    held = np.concatenate([np.zeros(0), *parts])
    return float(np.median(held)) if len(held) else None


def _words(seconds: float) -> str:
    return f'{abs(seconds):.2f} s {"before" if seconds >= 0.0 else "after"}'
