"""Acceptance criteria as data, and the default ones from the limits of the robot.

Values are SI and radians; times in windows are seconds since the start of the recording. `config`
reads criteria from YAML, measurement.py measures, verdict.py judges. docs/criteria.md explains.
"""

import hashlib
import json
import math
from dataclasses import asdict, dataclass
from typing import Any

from ugv_acceptance.evaluation.ground import GroundWindow
from ugv_acceptance.evaluation.settings import Settings

PASS, FAIL, INCONCLUSIVE = 'PASS', 'FAIL', 'INCONCLUSIVE'
# How the uncertainties of several sources are combined; IGNORED: shown, but it decides nothing.
RSS, WORST_CASE, IGNORED = 'rss', 'worst_case', 'ignored'
# Rules by which criteria may judge tip-over on ground that is not flat.
TREND, CAUTIOUS = 'trend', 'cautious'
# Drills that show a trained operator: on this robot's configuration, or on any.
THIS_ROBOT, ANY_ROBOT = 'this_robot', 'any_robot'
# Share of a window that must be evaluated for a PASS.
LEAST_COVERAGE = 0.95
# A shorter recording (s) cannot show that an input is silent or that an IMU contradicts itself.
LEAST_DURATION = 1.0
# A stretch (s) without margins that is longer than this is one in which nobody saw what happened.
LONGEST_UNSEEN = 0.5
ANY = 'any'

Window = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Value:
    """The demand that a value stays on one side of `limit`; the limit itself is a violation.

    `signal` is a key of quantities.SIGNALS, `of` a joint, a side or any. With a time allowance (s,
    or a share of the evaluated time) violations up to it are accepted; with `dwell` the value must
    stay on its side for that many seconds without a break, once.
    """

    signal: str
    of: str
    below: bool
    limit: float
    time_in_violation: float | None = None
    longest_violation: float | None = None
    share_in_violation: float | None = None
    dwell: float | None = None

    @property
    def always(self) -> bool:
        """Whether no sample at all may be in violation."""
        allowances = (
            self.time_in_violation,
            self.longest_violation,
            self.share_in_violation,
            self.dwell,
        )
        return all(x is None for x in allowances)

    def distance(self, value: float) -> float:
        """Return a value's distance to the limit, negative in violation; unit of the signal."""
        return self.limit - value if self.below else value - self.limit


@dataclass(frozen=True, slots=True)
class AlertDemand:
    """The demand that an alert is raised in the window, or (not `raised`) that none is active.

    `code`, `of` and `level` choose alerts; None: any.
    """

    raised: bool
    code: str | None = None
    of: str | None = None
    level: str | None = None


@dataclass(frozen=True, slots=True)
class DataDemand:
    """The demand that a number about the data (a key of quantities.DATA) lies within bounds.

    Data that do not meet it make the run INCONCLUSIVE, or FAIL with `fails`.
    """

    quantity: str
    of: str | None = None
    least: float = -math.inf
    most: float = math.inf
    fails: bool = False


@dataclass(frozen=True, slots=True)
class MapDemand:
    """The demand that a run visits at least a share of the cells of two joints' ranges."""

    joints: tuple[str, str]
    ranges: tuple[Window, Window]
    cell: tuple[float, float]
    least: float


Demand = Value | AlertDemand | DataDemand | MapDemand


@dataclass(frozen=True, slots=True)
class Criterion:
    """A demand with its name, the requirement in words, its reference, and its time window.

    `window` in seconds since the start; None: the whole recording. `uncertainty` overrides the
    set's.
    """

    name: str
    demand: Demand
    requirement: str = ''
    reference: str = ''
    window: Window | None = None
    uncertainty: str | None = None


@dataclass(frozen=True, slots=True)
class AcceptedRule:
    """The rule (TREND or CAUTIOUS) that is accepted for tip-over where not flat, and why."""

    rule: str
    reason: str


@dataclass(frozen=True, slots=True)
class CriteriaSet:
    """A set of criteria judged together; `sha256` is of its file, or of the defaults as JSON.

    `coverage` is the share of each window that must be evaluated for a PASS, `waive` the names of
    safeguards that are not to hold, with the reason. `ground` is the rule accepted on ground that
    is not flat, None: none is. `ground_kind` and `ground_windows` say what the ground of a
    recording is, as in ground.Ground; None and none: they say nothing. `hand_may_touch` are the
    windows in which the arm may touch the ground. `operator_training` is THIS_ROBOT or ANY_ROBOT
    where an operator must have passed a drill, on this robot's configuration or on any.
    """

    name: str
    version: int
    criteria: tuple[Criterion, ...]
    sha256: str
    path: str | None = None
    coverage: float = LEAST_COVERAGE
    uncertainty: str = RSS
    waive: tuple[tuple[str, str], ...] = ()
    ground: AcceptedRule | None = None
    ground_kind: str | None = None
    ground_windows: tuple[GroundWindow, ...] = ()
    hand_may_touch: tuple[Window, ...] = ()
    operator_training: str | None = None

    def uncertainty_of(self, criterion: Criterion) -> str:
        """Return how uncertainties are combined for a criterion: RSS, WORST_CASE or IGNORED."""
        return criterion.uncertainty or self.uncertainty


def default_criteria(settings: Settings) -> CriteriaSet:
    """Return the criteria used without a file: the configuration's limits hold at all times."""
    robot, limits = settings.robot, settings.limits
    torque = [
        Criterion(
            f'torque {name}',
            Value('torque_utilisation', name, below=True, limit=limits.torque_error),
            f'{name} stays within its torque limit',
        )
        for name, limit in zip(robot.joint_names, limits.torque, strict=True)
        if math.isfinite(limit)
    ]
    criteria = (
        *torque,
        *(_standing(limits.tip_error) if settings.judges_tilt else ()),
        Criterion(
            'coverage',
            DataDemand('coverage', least=LEAST_COVERAGE),
            'the recording could be evaluated',
        ),
        Criterion(
            'duration',
            DataDemand('duration', least=LEAST_DURATION),
            'the recording is long enough for a verdict',
        ),
        Criterion('whole file', DataDemand('salvaged', most=0.0), 'no file is truncated'),
        Criterion('all messages', DataDemand('lost_messages', most=0.0), 'no message is missing'),
    )
    text = json.dumps([_plain(c) for c in criteria], sort_keys=True)
    sha256 = hashlib.sha256(text.encode()).hexdigest()
    return CriteriaSet('limits of the configuration', 1, criteria, sha256)


def _standing(tip_error: float) -> tuple[Criterion, ...]:
    """Return the criteria on how a robot stands, which only an IMU tells."""
    return (
        Criterion(
            'tip-over',
            Value('tip_angle', ANY, below=False, limit=tip_error),
            'the tilt left before the robot tips stays above its limit',
        ),
        Criterion(
            'support',
            AlertDemand(raised=False, code='NO_SUPPORT', level='ERROR'),
            'the robot has a support polygon under it',
        ),
    )


def _plain(criterion: Criterion) -> dict[str, Any]:
    return {'kind': type(criterion.demand).__name__, **asdict(criterion)}
