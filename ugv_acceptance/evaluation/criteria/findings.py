"""What verdicts are made from, and the outcome of one criterion."""

from collections.abc import Sequence
from dataclasses import dataclass

from ugv_acceptance.evaluation.alerts.messages import describe, level_words
from ugv_acceptance.evaluation.alerts.rules import FAILURES
from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.criteria.criteria import (
    Criterion,
)
from ugv_acceptance.evaluation.criteria.measurement import (
    CriteriaMeasurement,
)
from ugv_acceptance.evaluation.criteria.statement import Statement
from ugv_acceptance.evaluation.criteria.uncertainty import Bounds
from ugv_acceptance.evaluation.holding_back import Span, drawn_in_doubt
from ugv_acceptance.evaluation.margin_words import percent_words, share_words
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.type_aliases import Json


@dataclass(frozen=True, slots=True)
class Findings:
    """What verdicts are made from: measurements, alerts, numbers about the data, uncertainty.

    `data` is the part of the result that `quantities.DATA` reads, `statements` are those of the
    examinations of the run. Alerts of the robot that rest on margins of the `doubtful` spans (ns)
    decide nothing.
    """

    measurement: CriteriaMeasurement
    alerts: Sequence[Alert]
    data: Json
    bounds: Bounds
    statements: Sequence[Statement] = ()
    doubtful: Sequence[Span] = ()

    @property
    def settings(self) -> Settings:
        """Settings of the evaluation."""
        return self.measurement.settings

    def seconds(self, time: int) -> float:
        """Return a log time (ns) as seconds since the start of the recording."""
        return (time - self.measurement.start) / 1e9

    def in_doubt(self, alert: Alert) -> bool:
        """Return whether an alert of the robot rests on margins that are contradicted."""
        return alert.rule.code in FAILURES and drawn_in_doubt(alert, self.doubtful)


@dataclass(frozen=True, slots=True)
class Outcome:
    """The verdict on one criterion with its reason, and the numbers and sentences behind it."""

    verdict: str
    reason: str
    measured: Json
    evidence: tuple[str, ...] = ()


def short_of_data(evaluated: int, criterion: Criterion, findings: Findings) -> str | None:
    """Return the reason if too little of a criterion's window was evaluated; None if enough was."""
    measurement = findings.measurement
    start, end = measurement.span_of(criterion.window)
    share, needed = evaluated / (end - start) if end > start else 0.0, measurement.criteria.coverage
    outside = start >= measurement.end
    if share >= needed and end > start and not outside:
        return None
    what = 'the recording'
    if outside and criterion.window is not None:
        return f'{criterion.name}: its window begins at {criterion.window[0]:g} s, after the end'
    if criterion.window is not None:
        what = f'{criterion.window[0]:g} to {criterion.window[1]:g} s'
    seen = f'only {share_words(share, 1)} of {what} could be evaluated'
    return f'{seen} ({percent_words(needed)} needed)'


def alert_words(alert: Alert, findings: Findings) -> str:
    """Return an alert as a sentence with level, code, begin and end."""
    end = 'the end' if alert.end is None else f'{findings.seconds(alert.end):.2f} s'
    name = f'{level_words(alert.rule.level)} {alert.rule.code}'
    start = f'{findings.seconds(alert.start):.2f} s'
    words = describe(alert, findings.settings, findings.measurement.start)
    return f'{name} from {start} to {end}: {words}'
