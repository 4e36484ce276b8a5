"""The console as plain text where there is no terminal: one line whenever something changes."""

import re
import time
from collections.abc import Callable

from ugv_acceptance.console.frame import Plain, frame_of
from ugv_acceptance.console.snapshot import Feed
from ugv_acceptance.evaluation.alerts.state_machine import LEVELS, STALE
from ugv_acceptance.monitoring.drawing import figure_of

# Seconds between looks, as in a terminal, and between lines at least.
LISTEN, BETWEEN = 0.05, 1.0
_AGE = re.compile(r'\d+ s\b')


def line_of(frame: Plain) -> str:
    """Return a frame as one line: level, what and how much, what to do, cause, margins."""
    head = frame['headline']
    # Where nothing is to be done the number stands in the margins alone.
    what = f'{head["what"]} {head["number"]}'.rstrip() if head['action'] else head['what']
    what = '' if what == frame['word'] else what
    joint = ' ' if head['detail'].startswith('by ') else ': ' * bool(head['detail'])
    do = f'{head["action"]}{joint}{head["detail"]}'
    count = f'{frame["seconds_to"]} in {frame["seconds"]:.1f} s' if frame['seconds_to'] else ''
    more = f'and {head["more"]} more' if head['more'] else ''
    parts = [what, do, count, *head['notes'], head['cause'], more]
    return f'{frame["word"]:<7}  {"; ".join(part for part in parts if part)}'


def news_of(frame: Plain) -> object:
    """Return what of a frame makes a new line if it changes: all of one, but not the age of data.

    While there are no data, what was known last grows older; that alone is no news.
    """
    if frame['level'] != LEVELS[STALE]:
        return line_of(frame)
    head = frame['headline']
    return frame['word'], head['what'], head['action'], _AGE.sub('', head['cause']), head['more']


def show_lines(feed: Feed, say: Callable[[str], None], asked: Callable[[], bool]) -> None:
    """Print a line whenever something changes, until `asked` or a recording's end.

    Each begins with the time: of a recording the position in it, else that of the day. What is
    assumed and what is not checked stands behind the first line, and where it changes.
    """
    figure, due = figure_of(feed.settings.robot), 0.0
    news: object = None
    assumed = ''
    while not asked():
        snapshot, now = feed.snapshot(), time.monotonic()
        head = feed.extra().get('playback')
        over = head is not None and not head['playing']
        if now >= due or over:
            frame = frame_of(snapshot, feed.settings, figure)
            if news_of(frame) != news:
                when = time.strftime('%H:%M:%S') if head is None else f'{head["position_s"]:8.2f} s'
                taken = '' if frame['level'] == LEVELS[STALE] else frame['assumed']
                told = f'; {taken}' if taken not in {'', assumed} else ''
                say(f'{when}  {line_of(frame)}{told}')
                news, assumed, due = news_of(frame), taken or assumed, now + BETWEEN
        if over:
            return
        time.sleep(LISTEN)
