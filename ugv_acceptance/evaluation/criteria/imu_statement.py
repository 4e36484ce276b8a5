"""What the checks of the IMU judged in a recording, and what they cannot tell on it."""

from collections.abc import Iterator

from ugv_acceptance.evaluation.criteria.statement import NotChecked, Statement
from ugv_acceptance.evaluation.inputs.imu import ImuTracker
from ugv_acceptance.evaluation.inputs.imu_rates import AGREES
from ugv_acceptance.evaluation.inputs.imu_tally import Tally

IMU = 'imu'


def imu_statement(tracker: ImuTracker, rate: float) -> Statement:
    """Return the statement on a recording whose IMU sent `rate` messages a second (NaN: unknown).

    Its result stands under `imu_checks`: windows judged, those in which something turned, those
    that verified the orientation, and the worst statistic beside its threshold.
    """
    tally = tracker.motion.tally
    if tally is None:
        return Statement({'imu_checks': None})
    return Statement({'imu_checks': _result(tracker, tally)}, not_checked=tuple(_gaps(tracker, rate)))


def _result(tracker: ImuTracker, tally: Tally) -> dict[str, object]:
    gravity = {
        f'{rows // 10} s': {
            'windows': found.judged,
            'contradicting': found.wrong,
            'worst_mps2': found.worst if found.judged else None,
            'threshold_mps2': found.limit if found.judged else None,
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


def _gaps(tracker: ImuTracker, rate: float) -> Iterator[NotChecked]:
    """Yield what no number of this recording could tell about the IMU."""
    tally, seen, imu = tracker.motion.tally, tracker.seen, tracker.settings.imu
    if tally is None or not seen.messages:
        return
    if tracker.motion.frozen.varied <= 1 < seen.messages and not imu.noise_free:
        yield NotChecked(
            IMU, 'the IMU never varied: a frozen one looks the same; a simulator without noise is '
            'declared by imu.noise_free: true',
        )  # fmt: skip
    used, given = tracker.taken[0], any(found.judged for found in tally.gravity.values())
    if not used and not seen.rested:
        yield NotChecked('tilt', 'only the accelerometer tells it, and it was never verified at rest')
    elif used:
        yield NotChecked(
            'tilt errors', 'an orientation wrong by less than about 9 degrees (5 at rest), for less '
            'than 2 s, or by an IMU mounted up to 45 degrees wrong is not found'
            if given else 'no window held the orientation against the acceleration',
        )  # fmt: skip
    yield from _rate_gaps(tracker, tally, rate)
    declared = [name for name, count in (('rate', seen.no_rate), ('acceleration', seen.no_force)) if count]
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
    elif rate < 40.0:
        yield NotChecked(what, f'{rate:.0f} messages a second are too few: 40 are needed')
    elif not tally.turned:
        yield NotChecked(what, 'nothing turned faster than 0.1 rad/s and the noise')
    elif not tally.verified:
        yield NotChecked(what, 'no window in which something turned verified them')
