"""Adds to a result who acknowledged which alert and when, if the monitor's alerts were recorded."""

from collections.abc import Iterator

from ugv_acceptance.bag.reader import Bag
from ugv_acceptance.bag.statuses import alert_topics, statuses
from ugv_acceptance.type_aliases import Json

# The monitor dates alerts by its own clock: starts that differ by less (ns) belong to one alert.
SAME = 500_000_000
# Times (ns) have 64 bits; what is larger is none.
MOST = 2**63


def add_acknowledgements(result: Json, bag: Bag) -> None:
    """Add to a result's alerts when, by whom and with what note each was acknowledged.

    `acknowledged_by` is the person the command named, `acknowledged_from` the node that sent it,
    which older monitors did not tell. `acknowledged_s` is None where the topic was recorded but
    nobody acknowledged; without the topic nothing is added.
    """
    topics = alert_topics(bag)
    if not topics:
        return
    seen = list(_acknowledged(bag, topics))
    for alert in result['alerts']:
        start = bag.start_ns + round(alert['start_s'] * 1e9)
        of = [values for values in seen if _is_of(values, alert, start)]
        first = min(of, key=lambda values: int(values['time_ns']), default=None)
        alert['acknowledged_s'] = (int(first['time_ns']) - bag.start_ns) / 1e9 if first else None
        alert['acknowledged_by'] = first.get('who', '') if first else None
        if first and 'from' in first:
            alert['acknowledged_from'] = first['from']
        alert['note'] = first.get('note', '') if first else None


def _is_of(values: dict[str, str], alert: Json, start: int) -> bool:
    named = all(values.get(key) == alert[key] for key in ('code', 'subject', 'level'))
    return named and abs(int(values['start_ns']) - start) <= SAME


def _acknowledged(bag: Bag, topics: list[str]) -> Iterator[dict[str, str]]:
    """Yield the values of every recorded status that says an alert was acknowledged."""
    for values in statuses(bag, topics):
        if values.get('state') == 'acknowledged' and _dated(values):
            yield values


def _dated(values: dict[str, str]) -> bool:
    try:
        return all(0 <= int(values.get(key, '')) < MOST for key in ('time_ns', 'start_ns'))
    except ValueError:
        return False
