"""Trajectories as rosbags serialises them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from bag.bag_cases import STORE

from ugv_acceptance.bag.trajectory import FIELDS, NS, TYPE

T = STORE.types


def trajectory(
    rows: Sequence[Sequence[float]],
    given: Sequence[str] = ('positions',),
    *,
    names: Sequence[str] = (),
    times: Sequence[float] = (),
    stamp: int = 5 * NS + 1,
) -> Any:
    """Return a message of rosbags: `rows` (n, m) are the numbers of each field that is `given`.

    `times` (n,) in s; without them point k is due at k s and 7 k ns.
    """
    empty = np.empty(0)
    due = [int(t * NS) for t in times] or [k * (NS + 7) for k in range(len(rows))]
    points = [
        T['trajectory_msgs/msg/JointTrajectoryPoint'](
            *(np.array(row, np.float64) if field in given else empty for field in FIELDS),
            time_from_start=T['builtin_interfaces/msg/Duration'](*divmod(at, NS)),
        )
        for row, at in zip(rows, due, strict=True)
    ]
    header = T['std_msgs/msg/Header'](T['builtin_interfaces/msg/Time'](*divmod(stamp, NS)), 'äh')
    called = list(names) or [f'joint_{"x" * j}' for j in range(len(rows[0]) if rows else 1)]
    return T[TYPE](header=header, joint_names=called, points=points)


def encoded(message: Any, *, little: bool = True) -> bytes:
    """Serialise a message of rosbags."""
    return bytes(STORE.serialize_cdr(message, TYPE, little_endian=little))
