"""Acceptance criteria as data, and the default ones from the limits of the robot.

Values are SI and radians; times in windows are seconds since the start of the recording. `config`
reads criteria from YAML, examination.py measures, verdicts.py judges. docs/criteria.md explains.
"""

import hashlib
import json
import math
from dataclasses import asdict, dataclass
from typing import Any

from ugv_acceptance.evaluation.settings import Settings

PASS, FAIL, INCONCLUSIVE = 'PASS', 'FAIL', 'INCONCLUSIVE'
# How bounds of several sources become one; IGNORED: a bound is shown but decides nothing.
RSS, WORST_CASE, IGNORED = 'rss', 'worst_case', 'ignored'
# Less of a window than this evaluated can never be a pass.
LEAST_COVERAGE = 0.95
# In less (s) no input can be told to be silent, nor an IMU to contradict itself.
LEAST_DURATION = 1.0
ANY = 'any'

Window = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Value:
    """A margin or input that must stay on one side of `limit`; the limit itself is a violation.

    `signal` is a key of signals.SIGNALS, `of` a joint, a side or any. With a time allowance (s, or
    a share of the evaluated time) violations up to it are accepted; with `dwell` the value must
    keep to its side for so many seconds at a stretch, and may do as it likes otherwise.
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
        """Whether not a single sample may be in violation."""
        allowances = (
            self.time_in_violation,
            self.longest_violation,
            self.share_in_violation,
            self.dwell,
        )
        return all(x is None for x in allowances)

    def distance(self, value: float) -> float:
        """Return what is left to the limit, negative in violation; unit of the signal."""
        return self.limit - value if self.below else value - self.limit


@dataclass(frozen=True, slots=True)
class AlertDemand:
    """An alert that has to be raised (start in the window), or must not be active in it.

    `code`, `of` and `level` choose alerts; None: any.
    """

    raised: bool
    code: str | None = None
    of: str | None = None
    level: str | None = None


@dataclass(frozen=True, slots=True)
class DataDemand:
    """A number about the data (a key of verdicts.DATA) within bounds; `fails`: else FAIL.

    Without `fails` data that do not meet the demand make the run INCONCLUSIVE.
    """

    quantity: str
    of: str | None = None
    least: float = -math.inf
    most: float = math.inf
    fails: bool = False


@dataclass(frozen=True, slots=True)
class MapDemand:
    """The share of the cells (rad, m) of two joints' ranges that the run has to visit."""

    joints: tuple[str, str]
    ranges: tuple[Window, Window]
    cell: tuple[float, float]
    least: float


Demand = Value | AlertDemand | DataDemand | MapDemand


@dataclass(frozen=True, slots=True)
class Criterion:
    """A demand with its name, the requirement in words, where that stands, and when it counts.

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
class CriteriaSet:
    """Criteria that are judged together. `sha256` is that of the file, or of the defaults' JSON."""

    name: str
    version: int
    criteria: tuple[Criterion, ...]
    sha256: str
    path: str | None = None
    coverage: float = LEAST_COVERAGE
    uncertainty: str = RSS

    def uncertainty_of(self, criterion: Criterion) -> str:
        """Return how bounds are combined for a criterion."""
        return criterion.uncertainty or self.uncertainty


def default_criteria(settings: Settings) -> CriteriaSet:
    """Return what holds without a file: every limit of the configuration, at every moment."""
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
        Criterion(
            'tip-over',
            Value('tip_angle', ANY, below=False, limit=limits.tip_error),
            'the robot keeps its tilt left before it tips',
        ),
        Criterion(
            'support',
            AlertDemand(raised=False, code='NO_SUPPORT', level='ERROR'),
            'the robot stands on its support polygon',
        ),
        Criterion(
            'coverage',
            DataDemand('coverage', least=LEAST_COVERAGE),
            'the recording could be evaluated',
        ),
        Criterion(
            'duration',
            DataDemand('duration', least=LEAST_DURATION),
            'the recording is long enough to show anything',
        ),
        Criterion('whole file', DataDemand('salvaged', most=0.0), 'no file breaks off'),
        Criterion('all messages', DataDemand('lost_messages', most=0.0), 'no message is missing'),
    )
    text = json.dumps([_plain(c) for c in criteria], sort_keys=True)
    sha256 = hashlib.sha256(text.encode()).hexdigest()
    return CriteriaSet('limits of the configuration', 1, criteria, sha256)


def _plain(criterion: Criterion) -> dict[str, Any]:
    return {'kind': type(criterion.demand).__name__, **asdict(criterion)}
