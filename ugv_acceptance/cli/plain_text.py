"""What a stream can show, decided once: UTF-8 or ASCII, colour or none, and how many columns.

`prepare` sets standard output and error up before a verb begins. What an ASCII terminal cannot
show is written in ASCII: a box with + - |, other characters by the sign next to them or as a
Python escape. A file name of bytes that are no UTF-8 goes out as these bytes.
"""

import codecs
import os
import sys
from typing import TextIO

# Columns of a page where the stream is no terminal; prose is never set wider than WIDEST.
COLUMNS, WIDEST = 80, 100
_NARROWEST = 20
_HANDLER = 'ugv_acceptance.plain'
_C = ('C', 'POSIX', '')

# One sign for one, or the columns of tables would not meet.
_SIGNS = {
    **dict.fromkeys('─━┄┈╌═╴╶╸╺', '-'),
    **dict.fromkeys('│┃║╎', '|'),
    **dict.fromkeys('┌┐└┘├┤┬┴┼╭╮╯╰╞╡╪┡┩╇', '+'),
    **dict.fromkeys('–—−', '-'),  # noqa: RUF001 - dashes
    **dict.fromkeys('‘’', "'"),  # noqa: RUF001 - quotes
    **dict.fromkeys('“”', '"'),
    **dict.fromkeys('·•×', '*'),  # noqa: RUF001 - a multiplication sign
    '…': '~',
    '±': '+-',
    '°': ' deg',
    '²': '2',
    '³': '3',
    '≤': '<=',
    '≥': '>=',
    '→': '->',
    '\N{NO-BREAK SPACE}': ' ',
}


def _plain(error: UnicodeError) -> tuple[bytes, int]:
    """Return what stands for the characters that an encoding has not."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = error.object[error.start : error.end]
    return b''.join(map(_bytes_of, letters)), error.end


def _bytes_of(letter: str) -> bytes:
    if '\udc80' <= letter <= '\udcff':  # a byte of a file name that is no UTF-8
        return bytes([ord(letter) - 0xDC00])
    return _SIGNS.get(letter, '').encode() or letter.encode('ascii', 'backslashreplace')


codecs.register_error(_HANDLER, _plain)


def prepare() -> None:
    """Let standard output and error show every text, in the signs their terminal has."""
    for stream in (sys.stdout, sys.stderr):
        change = getattr(stream, 'reconfigure', None)
        if change is None:
            continue
        encoding = 'utf-8' if has_utf8(stream) else 'ascii'
        change(encoding=encoding, errors=_HANDLER)


def has_utf8(stream: TextIO) -> bool:
    """Return whether a stream takes UTF-8: Python says so, and the locale or the user does too.

    In the C locale Python takes UTF-8 for granted, and says so in LC_CTYPE; a terminal of that
    locale need not know it.
    """
    if not (stream.encoding or '').lower().replace('_', '-').startswith('utf'):
        return False
    told = os.environ
    if told.get('PYTHONIOENCODING') or told.get('PYTHONUTF8') == '1':
        return True
    if told.get('LC_ALL'):
        return told['LC_ALL'] not in _C
    kind, general = told.get('LC_CTYPE', ''), told.get('LANG', '')
    coerced = kind in ('C.UTF-8', 'C.utf8', 'UTF-8') and general in _C
    return not coerced and (kind or general) not in _C


def is_terminal(stream: TextIO) -> bool:
    """Return whether a stream is a terminal that can move its cursor, and may be told to.

    With NO_COLOR set no escape sequence is sent, so nothing is drawn again in place.
    """
    return (
        _is_tty(stream) and os.environ.get('TERM') not in ('dumb', 'unknown') and not _no_colour()
    )


def takes_colour(stream: TextIO) -> bool:
    """Return whether a stream gets colour: a terminal does, or all with FORCE_COLOR; see NO_COLOR.

    Either is set by any text (https://no-color.org), NO_COLOR before FORCE_COLOR; FORCE_COLOR=0 is
    none.
    """
    if _no_colour():
        return False
    return is_terminal(stream) or os.environ.get('FORCE_COLOR', '') not in ('', '0')


def columns_of(stream: TextIO) -> int:
    """Return the columns of a terminal, or those of a page where the stream is none."""
    told = os.environ.get('COLUMNS', '')
    if told.isdigit() and int(told):
        return max(int(told), _NARROWEST)
    try:
        width = os.get_terminal_size(stream.fileno()).columns if _is_tty(stream) else 0
    except (OSError, ValueError):
        width = 0
    return max(width or COLUMNS, _NARROWEST)


def _no_colour() -> bool:
    return bool(os.environ.get('NO_COLOR'))


def _is_tty(stream: TextIO) -> bool:
    try:
        return stream.isatty()
    except ValueError:  # closed
        return False
