"""Measures what criteria need while a recording is read: worst values, time in violation."""

import math
from dataclasses import dataclass, field
from heapq import nsmallest

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.criteria.criteria import (
    ANY,
    AlertDemand,
    CriteriaSet,
    Criterion,
    MapDemand,
    Value,
    Window,
)
from ugv_acceptance.evaluation.criteria.quantities import SIGNALS, columns_of, shown, subjects_of
from ugv_acceptance.evaluation.inputs.payload import PayloadLog
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.spans import Spans
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.type_aliases import Floats, Json, Times

# Number of worst rows, from different parts of the recording, whose uncertainty is computed.
CANDIDATES = 4


@dataclass(frozen=True, slots=True)
class Moment:
    """One row in full: time (ns), value and subject of a signal, posture, gravity, payload."""

    time: int
    value: float
    subject: str
    q: tuple[float, ...]
    gravity: tuple[float, float, float]
    payload: Payload


def moment_json(moment: Moment, settings: Settings) -> Json:
    """Return posture, attitude and payload of a moment for JSON, in degrees, metres and kg."""
    gx, gy, gz = moment.gravity
    joints: Json = {}
    for name, q in zip(settings.robot.joint_names, moment.q, strict=True):
        scale, unit = shown('position', name, settings)
        joints[name] = {'position': q * scale, 'unit': unit}
    return {
        'joints': joints,
        'roll_deg': math.degrees(math.atan2(-gy, -gz)),
        'pitch_deg': math.degrees(math.atan2(gx, math.hypot(gy, gz))),
        'payload_kg': moment.payload.mass,
        'payload_cog_m': list(moment.payload.cog),
    }


@dataclass(slots=True)
class ValueMeasure:
    """The measurement of one criterion on a value; `span` is its window in log time (ns).

    `worst` holds the worst rows, at most one per part of the recording, the worst first; `first`
    is the first row in violation. `evaluated` (ns) is the time with a known value, `excused` that
    in which the hand might touch the ground and nobody can know it, `violation` the spans in
    violation, `kept` those without (for `dwell` only), `violators` the joints or sides that were in
    violation.
    """

    criterion: Criterion
    settings: Settings
    payloads: PayloadLog
    span: tuple[int, int]
    evaluated: int = 0
    excused: int = 0
    samples: int = 0
    worst: list[Moment] = field(default_factory=list)
    first: Moment | None = None
    violation: Spans = field(default_factory=Spans)
    kept: Spans = field(default_factory=Spans)
    violators: set[str] = field(default_factory=set)
    _last: tuple[int, int, float, bool] | None = None

    @property
    def demand(self) -> Value:
        """The demand of the criterion."""
        demand = self.criterion.demand
        assert isinstance(demand, Value)  # noqa: S101 - made only for such
        return demand

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        if not len(rows.time):
            return
        demand = self.demand
        self._settle(int(rows.time[0]))
        values = columns_of(demand.signal, demand.of, rows, self.settings, largest=demand.below)
        touches = np.isnan(values) & rows.touches if rows.touches.any() else None
        last = bool(touches is not None and touches[-1])
        self._last = (int(rows.time[-1]), int(rows.until[-1]), float(values[-1]), last)
        self._see(rows, values)
        self._spend(rows.time[:-1], rows.until[:-1], values[:-1])
        if touches is not None:
            self._excuse(rows.time[:-1][touches[:-1]], rows.until[:-1][touches[:-1]])

    def finish(self, now: int) -> None:
        """Finish at the end of the recording, `now` (ns)."""
        self._settle(now)
        self.violation.close()
        self.kept.close()

    def _settle(self, now: int) -> None:
        """Count the last row's time, now that the next message or the end (`now`, ns) is known."""
        if self._last is None:
            return
        time, until, value, excused = self._last
        one = np.array([time]), np.array([min(until, now)]), np.array([value])
        self._spend(*one)
        if excused:
            self._excuse(*one[:2])
        self._last = None

    def _excuse(self, start: Times, end: Times) -> None:
        """Add up the time (ns) inside the window in which the hand touched with permission."""
        start, end = np.maximum(start, self.span[0]), np.minimum(end, self.span[1])
        self.excused += int(np.maximum(end - start, 0).sum())

    def _spend(self, start: Times, end: Times, values: Floats) -> None:
        """Add up the time from `start` to `end` (n,) in ns for which `values` (n,) held."""
        start, end = np.maximum(start, self.span[0]), np.minimum(end, self.span[1])
        seen = (end > start) & ~np.isnan(values)
        self.evaluated += int((end - start)[seen].sum())
        bad = self._bad(values)
        some = seen & bad
        if some.any():
            self.violation.add(start[some], end[some])
        if self.demand.dwell is not None:
            good = seen & ~bad
            self.kept.add(start[good], end[good])

    def _bad(self, values: Floats) -> NDArray[np.bool_]:
        with np.errstate(invalid='ignore'):
            found: NDArray[np.bool_] = (
                values >= self.demand.limit if self.demand.below else values <= self.demand.limit
            )
        return found

    def _see(self, rows: MarginRows, values: Floats) -> None:
        """Keep the first row in violation, and these rows' worst if it is among the worst."""
        inside = (rows.time >= self.span[0]) & (rows.time <= self.span[1])
        if not inside.all():
            values = np.where(inside, values, np.nan)
        known = np.flatnonzero(~np.isnan(values))
        self.samples += known.size
        if not known.size:
            return
        sign = -1.0 if self.demand.below else 1.0
        order = sign * values
        # Infinite is a value too, as on a side without an edge.
        k = int(known[order[known].argmin()])
        if self.first is None and self._bad(values[[k]])[0]:
            at = int(self._bad(values).argmax())
            self.first = self._moment(rows, at, float(values[at]))
        if self._bad(values[[k]])[0]:
            self._name_violators(rows)
        if len(self.worst) == CANDIDATES and order[k] >= sign * self.worst[-1].value:
            return
        moments = [*self.worst, self._moment(rows, k, float(values[k]))]
        self.worst = nsmallest(CANDIDATES, moments, key=lambda m: sign * m.value)

    def _name_violators(self, rows: MarginRows) -> None:
        kind, of = SIGNALS[self.demand.signal], self.demand.of
        names = subjects_of(kind, self.settings)
        bad = np.asarray(self._bad(kind.of(rows, self.settings)).any(axis=0))
        self.violators.update(
            name for name, any_bad in zip(names, bad, strict=True) if any_bad and of in (ANY, name)
        )

    def _moment(self, rows: MarginRows, k: int, value: float) -> Moment:
        j, i = int(rows.pairs.of_joints[k]), int(rows.pairs.of_imu[k])
        joints = rows.pairs.joints
        return Moment(
            int(rows.time[k]),
            value,
            self._subject(rows, k, value),
            tuple(joints.q[j].tolist()),
            tuple(rows.pairs.imu.gravity[i].tolist()),
            self.payloads.at(int(joints.time[j])),
        )

    def _subject(self, rows: MarginRows, k: int, value: float) -> str:
        demand = self.demand
        if demand.of != ANY:
            return demand.of
        kind = SIGNALS[demand.signal]
        line = kind.of(rows, self.settings)[k]
        return subjects_of(kind, self.settings)[int(np.flatnonzero(line == value)[0])]


@dataclass(slots=True)
class MapMeasure:
    """The measurement of a map criterion: the cells of two joints' ranges that a run visited."""

    criterion: Criterion
    settings: Settings
    span: tuple[int, int]
    visited: NDArray[np.bool_] = field(init=False)

    def __post_init__(self) -> None:
        self.visited = np.zeros(self._counts(), np.bool_)

    @property
    def demand(self) -> MapDemand:
        """The demand of the criterion."""
        demand = self.criterion.demand
        assert isinstance(demand, MapDemand)  # noqa: S101 - made only for such
        return demand

    def _counts(self) -> tuple[int, int]:
        pairs = zip(self.demand.ranges, self.demand.cell, strict=True)
        x, y = (max(1, int(np.ceil((high - low) / cell - 1e-9))) for (low, high), cell in pairs)
        return x, y

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        names = self.settings.robot.joint_names
        inside = rows.known & (rows.time >= self.span[0]) & (rows.time <= self.span[1])
        q = rows.q[inside]
        places, keep = [], np.ones(len(q), np.bool_)
        for axis, name in enumerate(self.demand.joints):
            low, high = self.demand.ranges[axis]
            x = q[:, names.index(name)]
            keep &= (x >= low) & (x <= high)
            place = np.floor((x - low) / self.demand.cell[axis])
            places.append(np.clip(place, 0, self.visited.shape[axis] - 1).astype(np.intp))
        self.visited[places[0][keep], places[1][keep]] = True

    def finish(self, now: int) -> None:
        """Do nothing at the end of the recording: nothing is pending."""


@dataclass(slots=True)
class KnownTime:
    """The time (ns) for which the margins were known within a window `span` in log time (ns)."""

    span: tuple[int, int]
    evaluated: int = 0
    _last: tuple[int, int] | None = None

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        if not len(rows.time):
            return
        self._settle(int(rows.time[0]))
        some = rows.known[:-1]
        start = np.maximum(rows.time[:-1][some], self.span[0])
        end = np.minimum(rows.until[:-1][some], self.span[1])
        self.evaluated += int(np.maximum(end - start, 0).sum())
        if rows.known[-1]:
            self._last = int(rows.time[-1]), int(rows.until[-1])

    def finish(self, now: int) -> None:
        """Finish at the end of the recording, `now` (ns)."""
        self._settle(now)

    def _settle(self, now: int) -> None:
        if self._last is not None:
            start, end = max(self._last[0], self.span[0]), min(self._last[1], now, self.span[1])
            self.evaluated += max(end - start, 0)
        self._last = None


Measure = ValueMeasure | MapMeasure | KnownTime


@dataclass(slots=True)
class CriteriaMeasurement:
    """The measurements of all criteria of a set, by the criterion's name; `start`, `end` in ns."""

    criteria: CriteriaSet
    settings: Settings
    start: int
    end: int
    payloads: PayloadLog = field(init=False)
    measures: dict[str, Measure] = field(init=False)

    def __post_init__(self) -> None:
        self.payloads, self.measures = PayloadLog(self.settings), {}
        for criterion in self.criteria.criteria:
            span = self.span_of(criterion.window)
            if isinstance(criterion.demand, Value):
                self.measures[criterion.name] = ValueMeasure(
                    criterion, self.settings, self.payloads, span
                )
            elif isinstance(criterion.demand, MapDemand):
                self.measures[criterion.name] = MapMeasure(criterion, self.settings, span)
            elif isinstance(criterion.demand, AlertDemand):
                self.measures[criterion.name] = KnownTime(span)

    @property
    def detail(self) -> bool:
        """Whether a criterion needs moments, energies or ZMP, which are computed only on demand."""
        demands = [c.demand for c in self.criteria.criteria]
        return any(SIGNALS[d.signal].detail for d in demands if isinstance(d, Value))

    def span_of(self, window: Window | None) -> tuple[int, int]:
        """Return a window in log time (ns)."""
        if window is None:
            return self.start, self.end
        return self.start + round(window[0] * 1e9), self.start + round(window[1] * 1e9)

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording."""
        for measure in self.measures.values():
            measure.add(rows)

    def finish(self, now: int) -> None:
        """Finish at the end of the recording, `now` (ns)."""
        for measure in self.measures.values():
            measure.finish(now)
