"""A console whose robot falls silent: what was known last is kept, and what is over is not OK."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest
from nodes.live_case import Live, live_nodes, session_of

from ugv_acceptance.config import load
from ugv_acceptance.console.headline import UNKNOWN, Headline, headline_of, view_of
from ugv_acceptance.nodes.console_feed import ConsoleNode

SPACE = '/silent'
# A roll (rad) at which the folded robot lies on its right side.
LYING = 1.4


@dataclass
class Site:
    """A console beside a monitor; the driver leans to its right by `roll`."""

    live: Live
    console: ConsoleNode
    driver: Any
    roll: float = 0.0

    def send(self) -> None:
        """Send one message of each input."""
        self.driver.send(roll=self.roll)

    def head(self) -> Headline:
        """Return the headline now."""
        return headline_of(view_of(self.console.snapshot(), self.console.settings))

    def until(self, condition: Callable[[Headline], Any], *, sending: bool = True) -> Headline:
        """Return the first headline for which a condition holds."""
        found: list[Headline] = []

        def holds() -> bool:
            found.append(self.head())
            return bool(condition(found[-1]))

        self.live.until(holds, self.send if sending else lambda: None)
        return found[-1]


@pytest.fixture
def site() -> Iterator[Site]:
    """Return a console that knows the margins of a folded robot."""
    with live_nodes() as live:
        monitor = live.monitor(arguments=('-r', f'__ns:={SPACE}'))
        console = ConsoleNode(load(), namespace=SPACE)
        made = Site(live, console, live.driver(namespace=SPACE))
        try:
            live.until(lambda: session_of(monitor).evaluator.margins is not None, made.send)
            made.until(lambda head: head.what == 'ALL MARGINS KEPT')
            yield made
        finally:
            console.close()


def test_what_is_known_last_outlives_the_sensors(site: Site) -> None:
    """STOP, the margins known last, the cause; after a fall, stand clear: sensors dead or not."""
    head = site.until(lambda head: head.what == 'NO DATA', sending=False)
    assert head.action == 'STOP'
    assert head.notes[0].startswith('last known ')
    # The last verdict still says that all margins are kept.
    assert 'kept' not in head.cause
    head = site.until(lambda head: head.cause != UNKNOWN, sending=False)
    assert head.cause.startswith('no message from ')
    site.until(lambda head: head.what == 'ALL MARGINS KEPT' or not head.action)
    site.roll = LYING
    site.until(lambda head: head.what == 'IT HAS TIPPED RIGHT')
    fallen = site.until(lambda head: head.cause.startswith('no message'), sending=False)
    assert (fallen.what, fallen.action) == ('IT HAS TIPPED RIGHT', 'STAND CLEAR')
    assert 'past tipping: RIGHT' in fallen.notes[0]
