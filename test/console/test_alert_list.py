"""The console's list of alerts against what the monitor publishes."""

import pytest

from ugv_acceptance.console.alert_list import AlertBook
from ugv_acceptance.console.snapshot import AlertRow
from ugv_acceptance.evaluation.alerts.state_machine import ERROR


def say(book: AlertBook, how: str, alarm: str, offers: str = '', **more: str) -> None:
    """Let the monitor publish a change."""
    values = {'state': how, 'code': 'TIP_OVER', 'subject': 'left', 'level': 'ERROR', 'do': 'stop'}
    values |= {'start_ns': '5', 'end_ns': '9' if alarm.startswith('over') else ''}
    book.take(values | {'alarm': alarm, 'offers': offers} | more, f'{how}: it tips')


def only(book: AlertBook) -> AlertRow:
    """Return the one row."""
    (row,) = book.also(())
    return row


def test_a_raised_alert_is_active_and_unseen() -> None:
    """What is raised is shown with its words, its advice, its state and what may be done."""
    book = AlertBook()
    say(book, 'raised', 'active, not acknowledged', 'acknowledge,shelve')
    row = only(book)
    assert (row.text, row.advice, row.level, row.start) == ('it tips', 'stop', ERROR, 5)
    assert (row.state, row.unseen, row.end) == ('active, not acknowledged', True, None)
    assert row.offers == ('acknowledge', 'shelve')


def test_acknowledging_clears_nothing() -> None:
    """An acknowledged alert stays, with who saw it and why, until the monitor lets go of it."""
    book = AlertBook()
    say(book, 'raised', 'active, not acknowledged')
    say(book, 'acknowledged', 'active, acknowledged', who='Ada', note='spotter is there')
    row = only(book)
    assert (row.unseen, row.end, row.note) == (False, None, 'Ada: spotter is there')
    say(book, 'cleared', 'over, latched until reset', 'reset')
    row = only(book)
    assert (row.end, row.note, row.offers) == (9, 'Ada: spotter is there', ('reset',))
    say(book, 'reset', 'normal')
    assert not book.rows


def test_the_node_that_sent_a_command_stands_beside_the_name() -> None:
    """Anybody can claim a name; an older monitor tells the name alone."""
    book = AlertBook()
    sent = {'who': 'Ada', 'note': 'stands well', 'from': '/acceptance_tell'}
    say(book, 'acknowledged', 'active, acknowledged', **sent)
    assert only(book).note == 'Ada (from /acceptance_tell): stands well'


def test_what_nobody_saw_stays() -> None:
    """An alert that is over and was not acknowledged stays unseen."""
    book = AlertBook()
    say(book, 'cleared', 'over, not acknowledged')
    assert (only(book).unseen, only(book).end) == (True, 9)


def test_a_shelved_alert_is_silent() -> None:
    """A shelved alert says so and calls nobody; unshelved it calls again."""
    book = AlertBook()
    say(book, 'shelved', 'active, not acknowledged', 'unshelve')
    assert (only(book).unseen, only(book).state) == (False, 'active, not acknowledged, shelved')
    say(book, 'unshelved', 'active, not acknowledged')
    assert only(book).unseen


def test_who_joins_late_sees_what_is_active() -> None:
    """A console that starts late adds the active alerts it finds itself, none twice."""
    book, own = (
        AlertBook(),
        AlertRow('TIP_OVER-left-ERROR', 'TIP_OVER', 'left', ERROR, '', '', '', 0),
    )
    assert book.also([own]) == (own,)
    say(book, 'raised', 'active, not acknowledged')
    assert len(book.also([own])) == 1


def test_strange_messages_are_taken() -> None:
    """A change without values is an alert without words, not an error."""
    book = AlertBook()
    book.take({'start_ns': 'x', 'level': '<b>'}, '')
    assert only(book).level == ERROR


@pytest.mark.parametrize('odd', ['²', '--5', '9' * 30, '9' * 5_000, '1e9'])
def test_a_time_that_is_none_is_taken_for_zero(odd: str) -> None:
    """Digits that are no number, and numbers that are no time, do not end the page."""
    book = AlertBook()
    say(book, 'raised', 'active, not acknowledged', start_ns=odd)
    assert only(book).start == 0
