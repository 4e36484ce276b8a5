"""In what order beginnings and ends of alerts are told, live and of a recording."""

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.evaluation.alerts.state_machine import ERROR, Alert, Rule
from ugv_acceptance.monitoring.alarm_tracker import events_of

RULE = Rule('TIP_OVER', 'front', ERROR, 0.5, 0.5, 0, 0)
ALERTS = st.lists(
    st.tuples(st.integers(0, 5), st.none() | st.integers(0, 5)).map(
        lambda at: Alert(RULE, at[0], 1.0, None if at[1] is None else at[0] + at[1])
    ),
    max_size=12,
)


@given(ALERTS)
def test_events_come_by_time_and_no_end_before_its_beginning(log: list[Alert]) -> None:
    """Each alert begins once, ends once if it is over, and begins first, even for no time."""
    events = events_of(log, log)
    assert [e.time for e in events] == sorted(e.time for e in events)
    told = [(id(e.alert), e.begins) for e in events]
    for alert in log:
        began = told.index((id(alert), True))
        assert alert.end is None or told.index((id(alert), False)) > began
    assert len(told) == len(log) + sum(alert.end is not None for alert in log)


def test_what_ends_is_told_before_what_begins_at_the_same_moment() -> None:
    """Else an alert that follows another of its rule at once would be over before it began."""
    first, then = Alert(RULE, 1, 1.0, end=5), Alert(replace(RULE, subject='left'), 5, 1.0)
    for log in ([first, then], [then, first]):
        found = [(e.time, e.begins) for e in events_of(log, log)]
        assert found == [(1, True), (5, False), (5, True)]
