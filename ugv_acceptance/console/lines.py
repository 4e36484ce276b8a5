"""The console as plain text where there is no terminal: one line whenever something changes."""

import time
from collections.abc import Callable

from ugv_acceptance.console.frame import Plain, frame_of
from ugv_acceptance.console.snapshot import Feed
from ugv_acceptance.monitoring.drawing import figure_of

# Seconds between looks, as in a terminal, and between lines at least.
LISTEN, BETWEEN = 0.05, 1.0


def line_of(frame: Plain) -> str:
    """Return a frame as one line: level, word, cause, advice and remaining margins."""
    parts = [f'{frame["word"]:<7}  {frame["cause"]}']
    parts += [f'DO: {frame["advice"]}'] * bool(frame['advice'])
    parts += [f'now: {frame["left"]}'] * bool(frame['left'])
    return '; '.join(parts)


def show_lines(feed: Feed, say: Callable[[str], None], asked: Callable[[], bool]) -> None:
    """Print a line whenever it differs from the last, until `asked` or a recording's end.

    Each begins with the time: of a recording the position in it, else that of the day.
    """
    figure, told, due = figure_of(feed.settings.robot), '', 0.0
    while not asked():
        snapshot, now = feed.snapshot(), time.monotonic()
        head = feed.extra().get('playback')
        over = head is not None and not head['playing']
        if now >= due or over:
            text = line_of(frame_of(snapshot, feed.settings, figure))
            if text != told:
                when = time.strftime('%H:%M:%S') if head is None else f'{head["position_s"]:8.2f} s'
                say(f'{when}  {text}')
                told, due = text, now + BETWEEN
        if over:
            return
        time.sleep(LISTEN)
