"""A drill in a terminal of 80 columns and 24 lines: plain text, drawn ten times a second."""

import os
import select
import sys
import termios
import textwrap
import tty
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TextIO

from ugv_acceptance import BadSample
from ugv_acceptance.console.frame import frame_of
from ugv_acceptance.drill.course import ENDED
from ugv_acceptance.drill.feed import DrillFeed
from ugv_acceptance.drill.play import ACTING, ASK, JUDGED, WATCH
from ugv_acceptance.monitoring.drawing import figure_of

# Columns, lines, and seconds between two drawings.
WIDTH, HEIGHT, PERIOD = 80, 24, 0.1
# Lines that one part of the headline may take.
MOST = 2
# Level -> sign and colour (SGR): the sign says the same without colour.
LOOKS = {
    'OK': ('(OK)', '32'),
    'WARN': ('/!\\', '33'),
    'ERROR': ('<!>', '31'),
    'STALE': ('[?]', '7'),
}
# The first minutes: what is where, and what it means.
TOUR = """\
WHAT THE PAGE SHOWS

Read it in this order; page, terminal and this drill say the same.

  <!> DANGER      the word: OK, CAUTION, DANGER, NO DATA
  LOWER THE ELBOW          what to do; nothing to do: nothing here
  TO TIPPING: RIGHT  3 deg which way it tips, and how many degrees are left
                           (right is the robot's own right)
  4.2 s to tipping RIGHT   how long, if the motion continues
  below                    the margin to each side, and of each joint

CAUTION   a margin is small: do what it says before you go on
DANGER    a limit is passed: stop, do what it says
NO DATA   nobody knows: STOP, do not move on these numbers
          It is worse than DANGER.

To acknowledge says that you have seen it. It makes nothing better.

Now seven situations. Each begins with a story; then something goes wrong,
and you choose what to do. The simulated robot does it, and that decides."""


def tour() -> list[str]:
    """Return the lines that explain what page and terminal show."""
    return TOUR.splitlines()


def screen(frame: dict[str, Any], said: str = '') -> list[str]:
    """Return a frame of a drill as at most HEIGHT lines of at most WIDTH characters.

    `frame` is a frame of the console with its part `drill`; `said` answers the last key.
    """
    drill = frame['drill']
    if drill['phase'] == ENDED:
        return ['The drill is over.']
    top = [_title(drill), '', *_headline(frame), *_margins(frame), '-' * WIDTH]
    story = [*_wrap(drill['story']), ''] if drill['phase'] == WATCH else []
    body = [*story, *_asked(drill)]
    return [line[:WIDTH] for line in [*top, *body, said][: HEIGHT - 1]]


def _title(drill: dict[str, Any]) -> str:
    left = f'answer within {drill["left_s"]:.0f} s' if drill['left_s'] is not None else ''
    title = f'{drill["number"]} of {drill["of"]}  {drill["title"]}'
    return f'{title:<{WIDTH - len(left) - 1}} {left}'


def _headline(frame: dict[str, Any]) -> list[str]:
    """Return the word with what and how much, action, time, cause, what was known last."""
    head, (sign, _) = frame['headline'], LOOKS[frame['level']]
    said = '' if head['what'] == frame['word'] else head['what']
    what = '  '.join(part for part in (said, head['number']) if part)
    action = '  '.join(part for part in (head['action'], head['detail']) if part)
    seconds = f'{frame["seconds"]:.1f} s to {frame["seconds_to"]}' if frame['seconds_to'] else ''
    lines = [f'{sign} {frame["word"]}   {what}']
    for text in (action, seconds, head['cause'], *head['notes'][:1]):
        # What an integrator needs must not push the answers off the screen.
        lines += _wrap(text, '    ', MOST)
    return lines


def _margins(frame: dict[str, Any]) -> list[str]:
    tilt = '  '.join(f'{row["side"]} {row["words"]}' for row in frame['tilt'])
    judged = [row for row in frame['torque'] if row['limit'] is not None]
    name = str.removesuffix
    joints = '  '.join(f'{name(row["joint"], "_joint")} {row["words"]}' for row in judged)
    return [f'    degrees to tipping: {tilt}', f'    joints: {joints}']


def _asked(drill: dict[str, Any]) -> list[str]:
    """Return what is asked, chosen, or came of it."""
    phase = drill['phase']
    if phase == WATCH:
        return ['Watch the robot. You will be asked.']
    words = {choice['key']: choice['words'] for choice in drill['choices']}
    chosen = f'You: {words.get(drill["answer"], "no answer")}'
    if phase == ASK:
        lines = [drill['question']]
        for number, text in enumerate(words.values(), 1):
            lines += _wrap(text, f'  {number} ')
        return lines
    if phase == ACTING:
        return [chosen, '', 'Watch what the robot does.']
    verdict = '[OK] PASSED' if drill['passed'] else '[X] TO REPEAT'
    return [
        chosen,
        '',
        verdict,
        *_wrap(drill['happened']),
        '',
        *_wrap(drill['lesson']),
        '',
        'n next, r repeat with other numbers, q leave',
    ]


def _wrap(text: str, first: str = '', most: int | None = None) -> list[str]:
    """Return text in lines, at least one and at most so many, the first after `first`."""
    indent = ' ' * len(first)
    lines = textwrap.wrap(
        text,
        WIDTH,
        initial_indent=first,
        subsequent_indent=indent,
        max_lines=most,
        placeholder=' ...',
    )
    return lines or ['']


def coloured(lines: Sequence[str], level: str) -> list[str]:
    """Return the lines of a screen with the word in the colour of its level."""
    _, colour = LOOKS[level]
    return [f'\x1b[1;{colour}m{line}\x1b[0m' if k == 2 else line for k, line in enumerate(lines)]


def do(feed: DrillFeed, key: str) -> str:
    """Carry out a key of a drill; return the answer in words, '' for a key without meaning."""
    drill = feed.extra()['drill']
    try:
        if key.isdigit() and drill['phase'] == ASK and 0 < int(key) <= len(drill['choices']):
            return feed.command('choose', {'choice': drill['choices'][int(key) - 1]['key']})
        if drill['phase'] == JUDGED and key in 'nr':
            return feed.command('next' if key == 'n' else 'repeat', {})
    except BadSample as error:
        return str(error)
    return ''


@contextmanager
def keys() -> Iterator[Callable[[float], str]]:
    """Yield a function that waits some seconds for a key, and returns it or ''."""
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)

    def key(seconds: float) -> str:
        ready, _, _ = select.select([descriptor], [], [], seconds)
        return os.read(descriptor, 1).decode(errors='replace') if ready else ''

    tty.setcbreak(descriptor)
    try:
        yield key
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def play(feed: DrillFeed, out: TextIO, asked: Callable[[], bool], *, colour: bool) -> None:
    """Play a drill in the terminal until its end, q, or until `asked` to end."""
    figure, said = figure_of(feed.settings.robot), ''
    out.write('\x1b[2J')
    with keys() as key:
        if len(feed.course.names) > 1:
            _show(out, [*tour(), '', 'Press a key to begin.'])
            while not asked() and not key(PERIOD):
                pass
            feed.restart()
        while not asked() and feed.course.phase != ENDED:
            snapshot = feed.snapshot()
            frame = {**frame_of(snapshot, feed.settings, figure), **feed.extra()}
            lines = screen(frame, said)
            _show(out, coloured(lines, frame['level']) if colour else lines)
            pressed = key(PERIOD)
            if pressed in {'q', 'Q'}:
                return
            said = do(feed, pressed) if pressed else said


def _show(out: TextIO, lines: Sequence[str]) -> None:
    """Draw lines from the top of the screen, each over what was there, and clear the rest."""
    out.write('\x1b[H' + ''.join(f'{line}\x1b[K\n' for line in lines) + '\x1b[J')
    out.flush()
