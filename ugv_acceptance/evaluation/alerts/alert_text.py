"""The texts of one kind of alert."""

from dataclasses import dataclass

from ugv_acceptance.evaluation.alerts.failure_source import FailureSource


@dataclass(frozen=True, slots=True)
class AlertText:
    """What an alert tells people: what happened, what to do, what it means at the robot.

    `happened` names the joint, input or robot as {subject} (a side of a fall as {side}) and the
    worst value as {peak}, with {at} behind it where its own time is worth telling. `suspect`
    is where to look first: an alert shows an effect, so this is a suspicion, no verdict: a robot
    that tips was most often led there, an input that is silent most often lost its way. `level` is
    that of a fault only a live node sees; the others have it from their rules.
    """

    happened: str
    to_do: str
    suspect: FailureSource
    meaning: str = ''
    level: int | None = None
