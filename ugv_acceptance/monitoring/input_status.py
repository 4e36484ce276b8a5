"""The state of one input of a running monitor as diagnostics show it: rate, publishers, alerts."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from ugv_acceptance.evaluation.alerts.state_machine import OK, STALE, Alert
from ugv_acceptance.evaluation.criteria.imu_mounting import mounting_words
from ugv_acceptance.monitoring.message_order import in_order
from ugv_acceptance.monitoring.session import Session
from ugv_acceptance.monitoring.status import Status


class Subscribed(Protocol):
    """What diagnostics need to know of a subscription."""

    @property
    def topic_name(self) -> str:
        """The name of its topic, with remappings and namespace applied."""


class Publishing(Protocol):
    """What diagnostics need to know of the publishers of an input."""

    @property
    def restarted(self) -> Sequence[str]:
        """Names of the drivers that were restarted."""


class InputSources(Protocol):
    """What diagnostics need of the inputs' subscriptions; see nodes/monitor/subscriptions.py."""

    @property
    def publishers(self) -> Mapping[str, Sequence[str]]:
        """The full names of the nodes that publish each input."""

    @property
    def subscriptions(self) -> Mapping[str, Subscribed]:
        """The subscription of each input."""

    @property
    def voices(self) -> Mapping[str, Publishing]:
        """The live publishers of each input, see publisher_identity.py."""


def input_status(
    name: str, session: Session, inputs: InputSources | None, worst_first: Sequence[Alert]
) -> Status:
    """Return the status of an input; `worst_first` are the active alerts, by severity."""
    count, now = session.counts[name], session.clock.now()
    mine = [a for a in worst_first if a.rule.subject == name]
    nodes = inputs.publishers.get(name, []) if inputs else []
    age = (now - count.last) / 1e9 if count.taken else float('nan')
    rate = session.rates.get(name, 0.0)
    values: dict[str, object] = {
        'topic': inputs.subscriptions[name].topic_name if inputs else '',
        'rate_hz': rate,
        'age_s': age,
        'messages': count.taken,
        'malformed': count.malformed,
        'lost': count.lost,
        'publishers': len(nodes),
        'published_by': ', '.join(nodes),
    }
    if inputs and inputs.voices[name].restarted:
        values['restarted'] = ', '.join(inputs.voices[name].restarted)
    if name == 'imu':
        of = session.evaluator.orientations
        values |= {f'orientation_{how}': number for how, number in of.items()}
        mount = session.evaluator.mount
        values['mounting'] = mounting_words(mount.settings, mount.found, mount.why)
    if count.reason:
        values['last_malformed'] = count.reason
    level = max([a.rule.level for a in mine], default=OK)
    if not count.taken and name != 'payload':
        level = STALE
    return Status(level, f'Input {name}', _words(mine, session) or f'{rate:.1f} Hz', values)


def _words(alerts: Sequence[Alert], session: Session) -> str:
    """Return what the alerts of an input say: the first with what to do, then the others."""
    if not alerts:
        return ''
    first, *others = [session.faults.sentence(alert, session.settings) for alert in alerts]
    return in_order(first, session.advisory.do(alerts[0]), *others)
