"""The inputs of a recording as they would have been heard, and where the robot stood still."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import TypeVar

import numpy as np

from ugv_acceptance.bag.cdr import ImuSample, JointStateSample
from ugv_acceptance.bag.reader import Bag, Topics
from ugv_acceptance.bag.reading import Facts
from ugv_acceptance.evaluation.inputs.frames import same_frame
from ugv_acceptance.evaluation.samples import ImuColumns, JointStateColumns
from ugv_acceptance.evaluation.settings import ImuInput
from ugv_acceptance.inspection.heard import KEPT, Heard

AnyInput = TypeVar('AnyInput', JointStateColumns, ImuColumns)
# A robot that stands still does so for this long (ns), with no longer silence between messages.
LONG, SILENCE = 1_000_000_000, 200_000_000


def hear(bag: Bag, joints: Heard | None, imu: Heard | None, how: ImuInput) -> None:
    """Fill what was heard of each input from a recording, as far as `bag` is read.

    Of many messages KEPT samples are spread over all of them. Of the IMU, `still` are messages of
    the first second or more in which the gyro says that it stands still.
    """
    topics = Topics(joints.topic if joints else None, imu.topic if imu else None, None)
    reading = bag.batches(topics)
    told, felt = list[JointStateColumns](), list[ImuColumns]()
    for batch in reading:
        told += batch.joints
        felt += batch.imu
    facts = reading.facts
    if joints is not None:
        _fill(joints, told, _joint_state, facts)
    if imu is not None:
        _fill(imu, felt, _imu, facts)
        imu.still = [_imu(felt[k], i) for _, k, i in _standing(felt, how)]


def _fill(
    heard: Heard,
    held: Sequence[AnyInput],
    sample: Callable[[AnyInput, int], JointStateSample | ImuSample],
    facts: Facts,
) -> None:
    """Fill in the times of all messages, samples of them, and why some cannot be decoded."""
    times = sorted(chain.from_iterable(columns.log_time.tolist() for columns in held))
    rows = sorted(_rows(held, max(1, -(-len(times) // KEPT))), key=lambda row: row[0])
    heard.times = times
    heard.samples = [sample(held[k], i) for _, k, i in rows]
    heard.sampled = [time for time, _, _ in rows]
    count, reason = facts.malformed.get(heard.topic, (0, ''))
    heard.malformed = [reason] * count


_Row = tuple[int, int, int]  # log time (ns), number of the columns, row in them


def _rows(held: Sequence[AnyInput], every: int) -> Iterator[_Row]:
    """Yield every so many messages, wherever one group of columns ends and the next begins."""
    seen = 0
    for k, columns in enumerate(held):
        for i in range(-seen % every, len(columns.log_time), every):
            yield int(columns.log_time[i]), k, i
        seen += len(columns.log_time)


def _joint_state(columns: JointStateColumns, i: int) -> JointStateSample:
    arrays = (columns.position[i], columns.velocity[i], columns.effort[i])
    p, v, e = (tuple(array.tolist()) for array in arrays)
    return JointStateSample(int(columns.stamp[i]), '', columns.names, p, v, e)


def _imu(columns: ImuColumns, i: int) -> ImuSample:
    arrays = (columns.orientation[i], columns.angular_velocity[i], columns.linear_acceleration[i])
    q, w, a = (tuple(array.tolist()) for array in arrays)
    covariances = (
        columns.orientation_covariance_0[i],
        columns.angular_velocity_covariance_0[i],
        columns.linear_acceleration_covariance_0[i],
    )
    return ImuSample(int(columns.stamp[i]), columns.frame_id, q, w, a, *map(float, covariances))


@dataclass(slots=True)
class _Stand:
    """The messages since the robot began to stand still."""

    rows: list[_Row] = field(default_factory=list)

    @property
    def lasts(self) -> bool:
        return bool(self.rows) and self.rows[-1][0] - self.rows[0][0] >= LONG


def _standing(felt: Sequence[ImuColumns], how: ImuInput) -> list[_Row]:
    """Return the messages of the first time in which the robot stands still; none if it never does.

    Only those of one sensor: of the frame that is expected, else of the most frequent one.
    """
    counts: dict[str, int] = {}
    for columns in felt:
        counts[columns.frame_id] = counts.get(columns.frame_id, 0) + len(columns.log_time)
    expected = [frame for frame in counts if how.frame and same_frame(frame, how.frame)]
    frame = max(expected or counts, key=lambda name: counts[name], default='')
    rates = {
        k: np.linalg.norm(columns.angular_velocity, axis=1) <= how.rest_rate
        for k, columns in enumerate(felt)
        if columns.frame_id == frame
    }
    rows = sorted((time, k, i) for k in rates for i, time in enumerate(felt[k].log_time.tolist()))
    stand = _Stand()
    for row in rows:
        time, k, i = row
        broken = stand.rows and time - stand.rows[-1][0] > SILENCE
        if (broken or not rates[k][i]) and not stand.lasts:
            stand.rows = []
        elif broken or not rates[k][i] or len(stand.rows) >= KEPT:
            break
        if rates[k][i]:
            stand.rows.append(row)
    return stand.rows if stand.lasts else []
