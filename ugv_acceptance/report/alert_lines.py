"""An alert of a result as documents say it: level, code, and the worst value beside its time."""

from ugv_acceptance.evaluation.alerts.level_words import level_words
from ugv_acceptance.evaluation.alerts.messages import HAVE_WORST
from ugv_acceptance.report.format import seconds_text
from ugv_acceptance.type_aliases import Json


def worst_time(alert: Json) -> float | None:
    """Return when the worst value of a result's alert came (s); None: it has none, or no time."""
    found: float | None = alert.get('worst_s')  # older results do not say it
    return found if alert['code'] in HAVE_WORST else None


def worst_words(alert: Json) -> str:
    """Return what an alert says first, with the worst value beside its own time.

    Such as "35 deg past tipping: RIGHT at 28.15 s" or "shoulder 110 % of its limit at 12.21 s".
    The whole message where it has no such value.
    """
    message: str = alert['message']
    at = worst_time(alert)
    if at is None:
        return message
    # Up to the time: what follows is its limit.
    before, time, _ = message.partition(f' at {at:.2f} s')
    return before + time


def alert_line(alert: Json) -> str:
    """Return an alert of a result as one line: from, to, level, code, worst value at its time.

    Such as "24.71 s to the end  DANGER  TIP_OVER  35 deg past tipping: RIGHT at 28.15 s".
    """
    when = f'{seconds_text(alert["start_s"])} to {seconds_text(alert["end_s"])}'
    return '  '.join((when, level_words(alert['level']), alert['code'], worst_words(alert)))
