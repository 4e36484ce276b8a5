"""What the checks of the IMU judged in a recording, and what they cannot tell on it."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite

from ugv_acceptance.evaluation.criteria.statement import NotChecked, Statement
from ugv_acceptance.evaluation.inputs.imu import ImuTracker
from ugv_acceptance.evaluation.inputs.imu_rates import AGREES, LEAST_RATE
from ugv_acceptance.evaluation.inputs.imu_tally import Tally
from ugv_acceptance.evaluation.margin_table import MarginRows

IMU = 'imu'


@dataclass(frozen=True, slots=True)
class ImuExamination:
    """States what the checks of `tracker` judged; they look at the messages themselves.

    Its result stands under `imu_checks`: windows judged, those in which something turned, those
    that verified the orientation, and the worst statistic beside its threshold.
    """

    tracker: ImuTracker

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording: they tell nothing of this."""

    def statement(self, start: int, end: int) -> Statement:
        """Return what was judged in the recording from `start` to `end` (ns), and what was not."""
        tally, count = self.tracker.motion.tally, self.tracker.seen.messages
        if tally is None or not count:
            return Statement({'imu_checks': None})
        rate = count / max((end - start) * 1e-9, 1e-9)
        gaps = tuple(_gaps(self.tracker, tally, rate))
        return Statement({'imu_checks': _result(self.tracker, tally)}, not_checked=gaps)


def _result(tracker: ImuTracker, tally: Tally) -> dict[str, object]:
    gravity = {
        f'{rows // 10} s': {
            'windows': found.judged,
            'contradicting': found.wrong,
            'worst_mps2': _number(found.worst) if found.judged else None,
            'threshold_mps2': _number(found.limit) if found.judged else None,
        }
        for rows, found in tally.gravity.items()
    }
    return {
        'gravity': gravity,
        'rates': {
            'windows': tally.windows,
            'turning': tally.turned,
            'verified': tally.verified,
            'contradicting': tally.wrong,
            'worst_cosine': tally.cosine if tally.turned else None,
            'threshold_cosine': AGREES,
        },
        'unit': {'windows': tally.units},
        'two_sources': {'windows': tally.sources},
        'frozen': {'changes': tracker.motion.frozen.varied},
        'at_rest': {'messages': tracker.seen.rested},
    }


def _number(value: float) -> float | None:
    """Return a number for JSON, which knows none that is infinite."""
    return value if isfinite(value) else None


def _gaps(tracker: ImuTracker, tally: Tally, rate: float) -> Iterator[NotChecked]:
    """Yield what no number of this recording could tell about the IMU."""
    seen, imu = tracker.seen, tracker.settings.imu
    if tracker.motion.frozen.varied <= 1 < seen.messages and not imu.noise_free:
        yield NotChecked(
            IMU, 'the IMU never varied: a frozen one looks the same; a simulator without noise is '
            'declared by imu.noise_free: true',
        )  # fmt: skip
    used, given = tracker.taken[0], any(found.judged for found in tally.gravity.values())
    if not used and not seen.rested:
        yield NotChecked(
            'tilt', 'only the accelerometer tells it, and it was never verified at rest'
        )
    elif used:
        yield NotChecked(
            'tilt errors',
            'an orientation wrong by less than about 9 degrees (5 at rest), for less '
            'than 2 s, or by an IMU mounted up to 45 degrees wrong (turned about its upright '
            'axis: by any angle) is not found'
            if given else 'no window held the orientation against the acceleration',
        )  # fmt: skip
    yield from _rate_gaps(tracker, tally, rate)
    declared = [
        name for name, count in (('rate', seen.no_rate), ('acceleration', seen.no_force)) if count
    ]
    if declared:
        yield NotChecked(
            f'{" and ".join(declared)} of the IMU',
            'its covariance says not measured (-1, REP-145), but numbers come: they are used',
        )


def _rate_gaps(tracker: ImuTracker, tally: Tally, rate: float) -> Iterator[NotChecked]:
    if not tracker.taken[0]:
        return
    what = 'orientation against the gyro'
    if not tracker.seen.turned:
        yield NotChecked(what, 'the gyro sent nothing but 0')
    elif rate < LEAST_RATE:
        yield NotChecked(
            what, f'{rate:.0f} messages a second are too few, {LEAST_RATE:.0f} are needed'
        )
    elif not tally.turned:
        yield NotChecked(what, 'nothing turned faster than 6 deg/s and the noise')
    elif not tally.verified:
        yield NotChecked(what, 'no window in which something turned verified them')
