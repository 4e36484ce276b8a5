"""Faults that only a live node can see: foreign publishers, QoS mismatch, undecodable messages.

They are alerts like those of the evaluation and are written to the same log.
"""

from dataclasses import dataclass, field

from ugv_acceptance.evaluation.alerts.messages import FIRST_SUSPECT, FailureSource, advice, describe
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Alert, Rule, Signal
from ugv_acceptance.evaluation.settings import Settings

# Time (ns) a fault must be gone before its alert is cleared.
OFF_DELAY = 2_000_000_000

# Code -> (level, what happened, what to do). {detail} is the publisher or the reason.
WORDS = {
    'SECOND_PUBLISHER': (
        WARN,
        '{subject} has {peak:.0f} publishers: {detail}',
        "stop all but the robot's own driver; samples of two sources are mixed",
    ),
    'FOREIGN_PUBLISHER': (
        WARN,
        '{subject} is published by {detail}, which allowed_publishers does not name',
        'stop that node, or add it to allowed_publishers',
    ),
    'INPUT_MALFORMED': (
        ERROR,
        '{subject}: {peak:.0f} messages could not be decoded; the last: {detail}',
        'check the type and the version of the node that publishes it',
    ),
    'INPUT_QOS': (
        ERROR,
        'a publisher of {subject} offers a quality of service that does not match: {detail}',
        'set the reliability and durability of the topic in the configuration to what is offered',
    ),
    'MESSAGES_LOST': (
        WARN,
        '{peak:.0f} messages of {subject} were lost before the monitor could take them',
        'raise the parameter depth, or free the processor',
    ),
    'EFFORT_SIGN': (
        WARN,
        'the effort of {subject} is the opposite of what its load needs',
        'if nothing holds the arm up, set effort_sign of this joint in the configuration',
    ),
    'NO_CLOCK': (
        WARN,
        'use_sim_time is true but nothing came on /clock',
        'start the simulation, or set use_sim_time to false',
    ),
    'PAYLOAD_DIFFERS': (
        WARN,
        '{detail}',
        'declare the load that is in the hand; else see what the arm touches',
    ),
    'MONITOR_FAULT': (
        ERROR,
        'the monitor could not evaluate a message of {subject}: {detail}',
        'report this with the log of the node: it is a fault of the program',
    ),
}

# Where to look first, as in evaluation/alerts/messages.py.
SUSPECTS = {
    'SECOND_PUBLISHER': FailureSource.CONTROL_SYSTEM,
    'FOREIGN_PUBLISHER': FailureSource.CONTROL_SYSTEM,
    'INPUT_MALFORMED': FailureSource.COMMUNICATIONS,
    'INPUT_QOS': FailureSource.DESIGN,
    'MESSAGES_LOST': FailureSource.COMMUNICATIONS,
    'EFFORT_SIGN': FailureSource.DESIGN,
    'NO_CLOCK': FailureSource.CONTROL_SYSTEM,
    'PAYLOAD_DIFFERS': FailureSource.INTERACTION,
    'MONITOR_FAULT': FailureSource.CONTROL_SYSTEM,
}


@dataclass(slots=True)
class Faults:
    """The alerts of faults, one signal for each code and subject; `log` is the evaluation's."""

    log: list[Alert]
    _signals: dict[tuple[str, str], Signal] = field(default_factory=dict)
    _details: dict[tuple[str, str], str] = field(default_factory=dict)

    def set(self, now: int, code: str, subject: str, count: float, detail: str = '') -> None:
        """Report that a fault is present at `now` (ns); `count` is its size, such as messages."""
        key = (code, subject)
        self._details[key] = detail
        if key not in self._signals:
            rule = Rule(code, subject, WORDS[code][0], 0.5, 0.5, 0, OFF_DELAY)
            self._signals[key] = Signal(rule, self.log)
        self._signals[key].step(now, count)

    def clear(self, now: int, code: str, subject: str) -> None:
        """Report that a fault is absent at `now` (ns)."""
        signal = self._signals.get((code, subject))
        if signal is not None:
            signal.step(now, 0.0)

    def advance(self, now: int) -> None:
        """Let time pass to `now` (ns): clear alerts whose fault has been gone long enough."""
        for signal in self._signals.values():
            signal.advance(now)

    @property
    def active(self) -> list[Alert]:
        """Alerts of faults that are active now."""
        return [s.alert for s in self._signals.values() if s.alert is not None]

    def sentence(self, alert: Alert, settings: Settings) -> str:
        """Return the sentence of any alert, of the evaluation or of these faults."""
        rule = alert.rule
        if rule.code not in WORDS:
            return describe(alert, settings)
        detail = self._details.get((rule.code, rule.subject), '')
        text = WORDS[rule.code][1]
        return text.format(subject=rule.subject, peak=alert.peak, detail=detail)


def suspect_of(code: str) -> str:
    """Return where to look first for the failure behind an alert, such as "physical / sensor"."""
    return (SUSPECTS.get(code) or FIRST_SUSPECT[code]).path


def what_to_do(code: str) -> str:
    """Return what to do in general about an alert of the evaluation or of these faults."""
    return WORDS[code][2] if code in WORDS else advice(code)
