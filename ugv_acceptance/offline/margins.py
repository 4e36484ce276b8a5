"""The margins of a whole recording as columns: for files, for Python, for Arrow and pandas."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.bag.reader import Bag, Topics
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.samples import Batch
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.stability import SIDES, STATES
from ugv_acceptance.offline.stretches import stretches
from ugv_acceptance.type_aliases import Floats, Times

Column = Floats | Times | NDArray[np.str_]
# Units in column names, for a rotary and for a prismatic joint.
POSITION, TORQUE = ('rad', 'm'), ('nm', 'n')
# Left out of the CSV, because it is `time_s` counted from the epoch.
NOT_IN_CSV = frozenset({'log_time_ns'})


@dataclass(frozen=True, slots=True, eq=False)
class MarginColumns:
    """Margins of a recording as columns, one row a message of joint states or IMU, as received.

    `joints` names the columns of `position` (n, j) in rad (m if prismatic), `static_torque` and
    `torque_margin` (n, j) in N m (N); `sides` those of `tip_angle` (n, 4), the tilt left in rad,
    negative past tipping. `time_s` (n,) counts from the start of the recording, `log_time_ns` and
    `stamp_ns` (n,) from the epoch. `known` (n,) says which rows have margins; elsewhere they are
    NaN. `state` (n,) is one of ugv_acceptance.model.stability.STATES.
    """

    joints: tuple[str, ...]
    sides: tuple[str, ...]
    time_s: Floats
    log_time_ns: Times
    stamp_ns: Times
    known: NDArray[np.bool_]
    state: NDArray[np.str_]
    position: Floats
    static_torque: Floats
    torque_margin: Floats
    tip_angle: Floats

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.time_s)


def margin_rows(
    bag: Bag, topics: Topics, settings: Settings, *, detail: bool = False
) -> Iterator[MarginRows]:
    """Read a recording again and yield its margins part by part.

    Moments, energies and ZMP distances are included only with `detail`.
    """
    evaluator = RecordedEvaluator(settings, detail=detail)
    evaluator.start(bag.start_ns)
    for batch in stretches(bag.batches(topics)):
        yield evaluator.batch(batch)


def margin_columns(bag: Bag, topics: Topics, settings: Settings) -> MarginColumns:
    """Read a recording again and return all its margins, held in memory."""
    robot, limits = settings.robot, np.array(settings.limits.torque)
    parts = list(margin_rows(bag, topics, settings)) or [_no_rows(settings)]
    torque = np.concatenate([rows.torque for rows in parts])
    time = np.concatenate([rows.time for rows in parts])
    return MarginColumns(
        robot.joint_names,
        tuple(SIDES),
        (time - bag.start_ns) / 1e9,
        time,
        np.concatenate([rows.stamp for rows in parts]),
        np.concatenate([rows.known for rows in parts]),
        np.array(STATES)[np.concatenate([rows.state for rows in parts])],
        np.concatenate([rows.q for rows in parts]),
        torque,
        limits - np.abs(torque),
        np.concatenate([rows.angle for rows in parts]),
    )


def _no_rows(settings: Settings) -> MarginRows:
    return RecordedEvaluator(settings).batch(Batch())


def named_columns(rows: MarginRows, settings: Settings, start: int) -> dict[str, Column]:
    """Return the margins of a part of a recording as columns (n,) whose names end in their units.

    `start` is the log time (ns) of the recording's first message. Unknown margins are NaN.
    """
    robot, limits = settings.robot, np.array(settings.limits.torque)
    margin = limits - np.abs(rows.torque)
    return {
        'time_s': (rows.time - start) / 1e9,
        'log_time_ns': rows.time,
        'stamp_ns': rows.stamp,
        'state': np.array(STATES)[rows.state],
        **_by_name(rows.q, joint_columns(robot, 'position', POSITION)),
        **_by_name(rows.torque, joint_columns(robot, 'static_torque', TORQUE)),
        **_by_name(margin, joint_columns(robot, 'torque_margin', TORQUE)),
        **_by_name(np.degrees(rows.angle), [f'{side}_angle_deg' for side in SIDES]),
        **_by_name(rows.moment, [f'{side}_moment_nm' for side in SIDES]),
        **_by_name(rows.energy, [f'{side}_energy_j' for side in SIDES]),
        'zmp_m': rows.zmp,
    }


def csv_columns(settings: Settings) -> list[str]:
    """Return the names of the columns of a CSV file, in order."""
    rows = RecordedEvaluator(settings, detail=True).batch(Batch())
    return [name for name in named_columns(rows, settings, 0) if name not in NOT_IN_CSV]


def arrow_table(pyarrow: Any, columns: Mapping[str, Column]) -> Any:  # noqa: ANN401 - an extra
    """Return columns as an Arrow table; NaN becomes null."""
    return pyarrow.table(
        {
            name: pyarrow.array(column, mask=np.isnan(column))
            if column.dtype.kind == 'f'
            else pyarrow.array(column)
            for name, column in columns.items()
        }
    )


def joint_columns(robot: Robot, what: str, units: tuple[str, str]) -> list[str]:
    """Return a column name for each joint; `units` are for rotary and for prismatic joints."""
    turns, slides = units
    return [
        f'{name}_{what}_{slides if robot.joint(name).slides else turns}'
        for name in robot.joint_names
    ]


def _by_name(table: Floats, names: list[str]) -> dict[str, Column]:
    return {name: table[:, k] for k, name in enumerate(names)}
