"""What every kind of criterion becomes, an outcome, and what it is judged from."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ugv_acceptance.evaluation.alerts import LEVELS, Alert
from ugv_acceptance.evaluation.bounds import Bounds
from ugv_acceptance.evaluation.criteria import Criterion
from ugv_acceptance.evaluation.examination import Examination
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.evaluation.wording import describe

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Findings:
    """What verdicts are made from: measures, alerts, the data's numbers (a result), bounds."""

    examination: Examination
    alerts: Sequence[Alert]
    data: Json
    bounds: Bounds

    @property
    def settings(self) -> Settings:
        """Return the settings of the evaluation."""
        return self.examination.settings

    def seconds(self, time: int) -> float:
        """Return seconds since the start of the recording."""
        return (time - self.examination.start) / 1e9


@dataclass(frozen=True, slots=True)
class Outcome:
    """A verdict, why, and the numbers and sentences behind it, ready for JSON."""

    verdict: str
    reason: str
    measured: Json
    evidence: tuple[str, ...] = ()


def short_of_data(evaluated: int, criterion: Criterion, findings: Findings) -> str | None:
    """Return why too little of a criterion's window was evaluated; None where enough was."""
    examination = findings.examination
    start, end = examination.span_of(criterion.window)
    share, needed = evaluated / (end - start) if end > start else 0.0, examination.criteria.coverage
    if share >= needed and end > start:
        return None
    what = 'the recording'
    if criterion.window is not None:
        what = f'{criterion.window[0]:g} to {criterion.window[1]:g} s'
    return f'only {share:.1%} of {what} could be evaluated ({needed:.0%} needed)'


def alert_words(alert: Alert, findings: Findings) -> str:
    """Return an alert as a sentence with its times."""
    end = 'the end' if alert.end is None else f'{findings.seconds(alert.end):.2f} s'
    return (
        f'{LEVELS[alert.rule.level]} {alert.rule.code} from {findings.seconds(alert.start):.2f} s '
        f'to {end}: {describe(alert, findings.settings)}'
    )
