"""The console's list of alerts against what the monitor publishes."""

from typing import Any

import pytest

from ugv_acceptance.console.alert_book import AlertBook
from ugv_acceptance.console.snapshot import AlertRow
from ugv_acceptance.evaluation.alerts import ERROR


def say(
    book: AlertBook, state: str, level: str = 'ERROR', code: str = 'TIP_OVER', **more: str
) -> None:
    """Let the monitor publish a change."""
    values = {'state': state, 'code': code, 'subject': 'left', 'level': level, 'do': 'stop'}
    end = '9' if state == 'cleared' else ''
    book.take(values | {'start_ns': '5', 'end_ns': end} | more, f'{state}: it tips')


def only(book: AlertBook) -> AlertRow:
    """Return the one row."""
    (row,) = book.also(())
    return row


def test_a_raised_alert_is_active_and_unseen() -> None:
    """What is raised is shown with its words, its advice and its state."""
    book = AlertBook()
    say(book, 'raised')
    row = only(book)
    assert (row.text, row.advice, row.level, row.start) == ('it tips', 'stop', ERROR, 5)
    assert (row.state, row.unseen, row.end) == ('active, not acknowledged', True, None)


def test_acknowledging_clears_nothing() -> None:
    """An acknowledged alert stays active until the monitor clears it."""
    book = AlertBook()
    say(book, 'raised')
    say(book, 'acknowledged')
    assert only(book).state == 'active, acknowledged'
    say(book, 'cleared')
    assert not book.rows


def test_a_danger_that_nobody_saw_stays() -> None:
    """A failure of the robot that is over stays until it is acknowledged."""
    book = AlertBook()
    say(book, 'raised')
    say(book, 'cleared')
    assert only(book).state == 'over, not acknowledged'
    say(book, 'acknowledged', end_ns='9')
    assert not book.rows


@pytest.mark.parametrize('change', [{'level': 'WARN'}, {'code': 'CLOCK'}])
def test_lesser_alerts_go_when_they_are_over(change: dict[str, Any]) -> None:
    """A caution, or a fault of an input, goes by itself."""
    book = AlertBook()
    say(book, 'raised', **change)
    say(book, 'cleared', **change)
    assert not book.rows


def test_what_the_monitor_offers_is_offered() -> None:
    """A state in the monitor's words and what it offers are shown as they are."""
    book = AlertBook()
    say(book, 'raised', alarm='shelved', offers='acknowledge,shelve')
    row = only(book)
    assert (row.state, row.offers) == ('shelved', ('acknowledge', 'shelve'))
    say(book, 'reset', alarm='normal')
    assert not book.rows


def test_who_joins_late_sees_what_is_active() -> None:
    """What a console itself sees is added, but not twice."""
    book, own = (
        AlertBook(),
        AlertRow('TIP_OVER-left-ERROR', 'TIP_OVER', 'left', ERROR, '', '', '', 0),
    )
    assert book.also([own]) == (own,)
    say(book, 'raised')
    assert len(book.also([own])) == 1


def test_a_note_stands_with_what_it_was_for() -> None:
    """A person's note is kept with what was not acknowledged when it was written."""
    book = AlertBook()
    say(book, 'raised')
    book.annotate('Ada, spotter is there')
    say(book, 'acknowledged')
    assert only(book).note == 'Ada, spotter is there'


def test_strange_messages_are_taken() -> None:
    """A change without values is an alert without words, not an error."""
    book = AlertBook()
    book.take({'start_ns': 'x', 'level': '<b>'}, '')
    assert only(book).level == ERROR
