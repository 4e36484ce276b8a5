"""The terminal's screen as text, drawn from a frame: what the page shows, at 80 by 24.

Colour is for what is abnormal, and never the only sign. `plain` leaves out what is not ASCII.
"""

from typing import Any

from rich.table import Table
from rich.text import Text

from ugv_acceptance.evaluation.alerts.state_machine import ERROR, LEVELS, OK, STALE, WARN

Plain = dict[str, Any]

# Level -> style and sign.
LOOKS = {
    LEVELS[OK]: ('dim', '\N{CHECK MARK}'),
    LEVELS[WARN]: ('bold black on yellow', '/!\\'),
    LEVELS[ERROR]: ('bold bright_white on dark_red', '<!>'),
    LEVELS[STALE]: ('bold black on grey70', '[?]'),
}
# The same for a number in a row: a sign stands before what is abnormal.
_MARKS = {LEVELS[WARN]: '! ', LEVELS[ERROR]: '!! ', LEVELS[STALE]: '? '}
_BAR = 20


def mark_of(level: str, word: str, *, plain: bool) -> Text:
    """Return a level's word with its sign and colour; OK is dim, with a check."""
    style, sign = LOOKS[level]
    # Appended, for the style of a whole text would be that of all that follows.
    if level == LEVELS[OK]:
        return Text().append(word if plain else f'{sign} {word}', style)
    # Hatched, as on the page: it must not look like a calm grey.
    edge = '/////' if level == LEVELS[STALE] else ''
    return Text().append(f'{edge} {sign} {word} {sign} {edge}', style)


def headline_of(frame: Plain, *, plain: bool) -> Text:
    """Return the headline: word, what and number, seconds, action, the cause once."""
    head = frame['headline']
    text = mark_of(frame['level'], frame['word'], plain=plain)
    fine = frame['level'] == LEVELS[OK]
    text.append(f'  {head["what"]}', '' if fine else 'bold')
    if head['number']:
        text.append(f'  {head["number"]}', '' if fine else 'bold')
    if frame['seconds'] is not None:
        text.append(f'   {frame["seconds"]:.1f} s', 'bold')
        text.append(f' to {frame["seconds_to"]}')
    if head['action']:
        text.append(f'\n{head["action"]}', 'bold reverse')
        text.append(f'  {head["detail"]}' if head['detail'] else '')
    if head['cause']:
        more = f' (and {head["more"]} more)' if head['more'] else ''
        text.append(f'\n{head["cause"]}{more}')
    for note in (*head['notes'], frame['assumed']):
        text.append(f'\n{note}' if note else '', 'dim')
    return text


def lamps_of(frame: Plain) -> Text:
    """Return what is running: a live robot or a recording, for how long, and the black box."""
    lamps, text = frame['lamps'], Text()
    head = frame.get('playback')
    if head is not None:
        text.append(f'recording {clock_words(head["position_s"])}')
        text.append('' if head['playing'] else ', paused', 'bold')
    else:
        running = lamps['running_s']
        since = '' if running is None else f', running {clock_words(running).partition(".")[0]}'
        text.append(lamps['source'] + since)
    if lamps['black_box'] in ('on', 'off'):
        text.append(f'   black box {lamps["black_box"]}')
    elif lamps['black_box']:
        text.append(f'   black box: {lamps["black_box"]}', 'bold black on yellow')
    return text


def clock_words(seconds: float) -> str:
    """Return a time (s) as minutes and seconds, from an hour on with hours: 5:26.0, 1:05:26."""
    minutes, rest = divmod(max(seconds, 0.0), 60.0)
    hours, minutes = divmod(int(minutes), 60)
    return (
        f'{hours}:{minutes:02}:{int(rest):02}'
        if hours
        else f'{minutes}:{int(rest * 10) / 10:04.1f}'
    )


def now_of(frame: Plain, width: int = _BAR) -> Text:
    """Return the tilt left to each side, and the joint that is used most, in two lines."""
    text = Text('deg to tipping: ')
    for row in frame['tilt']:
        text.append(f'{row["side"].upper()} ', '')
        _number(text, row)
        text.append('   ')
    worst = frame['worst_joint']
    if worst is not None:
        row = frame['torque'][worst]
        text.append(f'\n{_name(row["joint"])} ')
        _number(text, row)
        text.append(f' of its limit  [{bar_of(row["use"], width)}]')
    return text


def bar_of(share: float | None, width: int = _BAR) -> str:
    """Return a share of a limit as a bar, full from the limit on."""
    filled = '' if share is None else '#' * min(width, int(share * width))
    return f'{filled:.<{width}}'


def _name(joint: str) -> str:
    return joint.removesuffix('_joint').replace('_', ' ')


def _number(text: Text, row: Plain) -> None:
    """Append the words of a row, with sign and colour where it is abnormal."""
    if row['level'] in _MARKS:
        text.append(f'{_MARKS[row["level"]]}{row["words"]}', LOOKS[row['level']][0])
    else:
        text.append(str(row['words']), 'bold' if row['level'] else '')


def cards_of(frame: Plain, chosen: str | None = None) -> Text:
    """Return the alerts, one card a cause, with numbers to choose them; `chosen` is a key.

    What the headline says already is not said again. Those that are over follow, a line each.
    """
    text = Text()
    for number, card in enumerate(frame['cards'], 1):
        _card(text, card, number, frame['headline'], picked=card['key'] == chosen)
    if not frame['cards'] and frame['level'] == LEVELS[OK]:
        text.append('no alert\n', 'dim')
    first = len(frame['cards']) + 1
    for number, card in enumerate(frame['past'], first):
        _past(text, card, number, picked=card['key'] == chosen)
    text.rstrip()
    return text


def _title(text: Text, number: int, *, picked: bool) -> None:
    text.append(f'{">" if picked else " "}{number} ', 'bold reverse' if picked else 'bold')


def _card(text: Text, card: Plain, number: int, head: Plain, *, picked: bool) -> None:
    _title(text, number, picked=picked)
    style, sign = LOOKS[card['level']]
    text.append(f'{sign} {card["word"]} ', style)
    text.append(f' {card["title"]}', 'bold')
    worst = f'; worst: {card["worst"]}' if card['worst'] else ''
    text.append(f'  for {card["age_s"]:.1f} s{worst}\n')
    if card['text'] != head['cause']:
        text.append(f'   {card["text"]}\n')
        told = head['detail'] and head['detail'] in card['advice']
        text.append(f'   DO: {card["advice"]}\n' if card['advice'] and not told else '')
    for part in card['parts']:
        text.append(f'   also: {part}\n', 'dim')
    note = f'; {card["note"]}' if card['note'] else ''
    text.append(f'   {card["state"]}{note}', 'bold' if card['unseen'] else 'dim')
    offers = ', '.join(card['offers'])
    text.append(f'   can be: {offers}\n' if offers else '\n', 'dim')


def _past(text: Text, card: Plain, number: int, *, picked: bool) -> None:
    _title(text, number, picked=picked)
    style = 'bold' if card['unseen'] else 'dim'
    worst = f', worst: {card["worst"]}' if card['worst'] else ''
    text.append(f'{card["state"]}: {card["word"]} {card["title"]}{worst}\n', style)


def margins_of(frame: Plain) -> Table:
    """Return the torques as a table; empty where the margins are not known."""
    table = Table('Joint', 'Torque', 'Limit', 'Used', box=None, padding=(0, 1))
    if frame['level'] == LEVELS[STALE]:
        table.add_row(*([frame['word']] * 4))
        return table
    for row in frame['torque']:
        used = Text()
        if row['limit'] is not None:
            used.append(f'{bar_of(row["use"])} ')
        _number(used, row)
        limit = '-' if row['limit'] is None else f'{row["limit"]:g}'
        torque = '-' if row['torque'] is None else f'{round(row["torque"], 1) + 0.0:.1f}'
        table.add_row(Text(_name(row['joint'])), torque, limit, used)
    return table


def inputs_of(frame: Plain) -> Table:
    """Return the inputs as a table."""
    table = Table('Input', 'State', 'Rate', 'Published by', box=None, padding=(0, 1))
    for row in frame['inputs']:
        state = row['text'] or ('arriving' if row['level'] == LEVELS[OK] else 'silent')
        rate = '-' if row['rate_hz'] is None else f'{row["rate_hz"]:.0f} Hz'
        cells = (row['topic'], state, rate, ', '.join(row['publishers']))
        table.add_row(*(Text(str(cell)) for cell in cells))
    return table
