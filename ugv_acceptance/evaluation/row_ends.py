"""The newest row of each input, which precedes the rows of the next part of a recording."""

from dataclasses import fields
from typing import Any

import numpy as np

from ugv_acceptance.evaluation.inputs.imu import ImuRows
from ugv_acceptance.evaluation.inputs.joint_rows import JointRows


def without_joints(imu: ImuRows) -> JointRows:
    """Return the joint states of a robot without measured joints, one row an IMU message."""
    none, no = np.empty((len(imu.time), 0)), np.zeros(len(imu.time), np.bool_)
    return JointRows(imu.time, imu.stamp, none, none, none, imu.time, no)


def preceded(before: Any, rows: Any) -> Any:  # noqa: ANN401 - JointRows or ImuRows
    """Return `rows` preceded by the newest row of the batch before."""
    names = [f.name for f in fields(rows)]
    return type(rows)(*(np.concatenate((getattr(before, n), getattr(rows, n))) for n in names))


def newest_row(rows: Any) -> Any:  # noqa: ANN401 - JointRows or ImuRows
    """Return the last row alone."""
    return type(rows)(*(getattr(rows, f.name)[-1:] for f in fields(rows)))
