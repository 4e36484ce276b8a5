"""Reads a planned motion from YAML, as `ros2 topic echo` prints it and `ros2 topic pub` takes it.

Also as the goal of an action (below `trajectory`), and with times as plain numbers of seconds.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.config.document import Document, read_document
from ugv_acceptance.evaluation.planned_motion.request import Trajectory
from ugv_acceptance.type_aliases import Floats

# The keys by which a point's time is told, and those of a duration's two numbers.
TIMES, SECONDS, NANOSECONDS = ('time_from_start', 'time'), ('sec', 'secs'), ('nanosec', 'nsecs')
FIELDS = ('positions', 'velocities', 'accelerations')
# What a point may have besides; efforts are no part of a motion.
KNOWN = (*FIELDS, *TIMES, 'effort')


def read_trajectory(text: str, source: str) -> Trajectory:
    """Return the trajectory of a YAML text; `source` names it in errors.

    Raises BadConfig, with line and field, for what is none. Numbers are taken as they are: NaN and
    times that do not increase are for whoever judges the motion.
    """
    # `ros2 topic echo` ends each message so.
    document = read_document(text.rstrip().removesuffix('---'), source)
    found, path = document.data, list[str | int]()
    if isinstance(found, dict) and 'trajectory' in found:
        found, path = found['trajectory'], ['trajectory']
    if not isinstance(found, dict) or not {'joint_names', 'points'} <= found.keys():
        raise BadConfig(
            f'{document.where(path)}: expected a trajectory_msgs/JointTrajectory: joint_names and '
            f'points, got {_short(found)}'
        )
    names = found['joint_names']
    if not isinstance(names, list) or not all(isinstance(n, str) and n for n in names):
        raise _wrong(document, [*path, 'joint_names'], 'a list of names', names)
    points = found['points']
    if not isinstance(points, list) or not points:
        raise _wrong(document, [*path, 'points'], 'a list of points', points)
    rows = [_point(document, [*path, 'points', k], p, len(names)) for k, p in enumerate(points)]
    times, *tables = zip(*rows, strict=True)
    positions, rates, more = (_table(rows_of, len(names)) for rows_of in tables)
    if positions is None:
        positions = np.empty((len(times), 0))
    return Trajectory(tuple(names), np.array(times), positions, rates, more)


def _table(rows: Sequence[Sequence[float]], count: int) -> Floats | None:
    """Return rows as an array; None where no point has any, NaN where one has none."""
    if not any(rows):
        return None
    return np.array([row or (math.nan,) * count for row in rows], np.float64)


def _point(document: Document, path: list[str | int], point: Any, count: int) -> tuple[Any, ...]:  # noqa: ANN401 - of YAML
    """Return time (s), positions, velocities and accelerations of a point; () where none."""
    if not isinstance(point, dict):
        raise _wrong(document, path, 'positions and time_from_start', point)
    unknown = [key for key in point if key not in KNOWN]
    if unknown:
        raise _wrong(document, [*path, str(unknown[0])], f'one of {", ".join(KNOWN)}', unknown[0])
    tables = [_numbers(document, [*path, name], point.get(name), count) for name in FIELDS]
    if not tables[0]:
        given = point.get('positions')
        raise _wrong(document, [*path, 'positions'], f'{count} numbers, one a joint', given)
    told = [name for name in TIMES if name in point]
    if len(told) != 1:
        raise _wrong(document, path, 'time_from_start, or time in seconds', point)
    return _time(document, [*path, told[0]], point[told[0]]), *tables


def _numbers(
    document: Document,
    path: list[str | int],
    given: Any,  # noqa: ANN401 - of YAML
    count: int,
) -> tuple[float, ...]:
    """Return one number a joint; () where there are none."""
    if given is None or given == []:
        return ()
    if not isinstance(given, list) or len(given) != count:
        raise _wrong(document, path, f'{count} numbers, one a joint', given)
    return tuple(_number(document, [*path, k], x) for k, x in enumerate(given))


def _number(document: Document, path: Sequence[str | int], given: Any) -> float:  # noqa: ANN401 - of YAML
    if isinstance(given, bool) or not isinstance(given, int | float):
        hint = '; print it whole: ros2 topic echo --full-length' if given == '...' else ''
        raise _wrong(document, path, f'a number{hint}', given)
    return float(given)


def _time(document: Document, path: list[str | int], given: Any) -> float:  # noqa: ANN401 - of YAML
    """Return a time in s: a number, or sec and nanosec."""
    if not isinstance(given, dict):
        return _number(document, path, given)
    keys = {*SECONDS, *NANOSECONDS}
    if not given or not given.keys() <= keys:
        raise _wrong(document, path, 'sec and nanosec', given)
    parts = []
    for names in (SECONDS, NANOSECONDS):
        told = [name for name in names if name in given] or [names[0]]
        parts.append(_number(document, [*path, told[0]], given.get(told[0], 0)))
    return parts[0] + parts[1] / 1e9


def _wrong(document: Document, path: Sequence[str | int], expected: str, got: object) -> BadConfig:
    return BadConfig(f'{document.where(path)}: expected {expected}, got {_short(got)}')


def _short(found: object) -> str:
    text = repr(found)
    return text if len(text) <= 60 else f'{text[:57]}...'
