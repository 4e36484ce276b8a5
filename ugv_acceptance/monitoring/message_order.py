"""The order of a message: what happened, what to do, then the rest.

rqt_robot_monitor, terminals and syslog cut a long message, so what to do has to come before.
"""

# Letters of a message that are shown; letters of the cause that are kept before what to do.
SHOWN, LEAST = 140, 40
_BETWEEN, _DOTS = '; ', ' ...'


def in_order(cause: str, do: str, *rest: str, before: str = '', more: str = '') -> str:
    """Return a message: `before`, the cause and `more` behind it, what to do, and the rest.

    Where the cause is so long that not even the first clause of what to do would be shown, it is
    cut there and stands in full at the end.
    """
    room = SHOWN - len(before) - len(more) - len(_BETWEEN)
    clauses = clauses_of(do)
    if not do or len(cause) + len(clauses[-1]) <= room:
        return _BETWEEN.join(filter(None, (f'{before}{cause}{more}', do, *rest)))
    left = next((room - len(c) for c in clauses if room - len(c) >= LEAST), room - len(clauses[-1]))
    return _BETWEEN.join(filter(None, (f'{before}{_cut(cause, left)}{more}', do, *rest, cause)))


def clauses_of(do: str) -> tuple[str, ...]:
    """Return what to do: the whole, up to its first semicolon, and up to its first comma."""
    first = do.partition(';')[0]
    commas = (k for k, letter in enumerate(first) if letter == ',')
    # A comma in brackets ends nothing.
    ends = (k for k in commas if first.count('(', 0, k) == first.count(')', 0, k))
    return do, first, first[: next(ends, None)]


def _cut(text: str, room: int) -> str:
    """Return the words of a text that find room, with dots behind."""
    kept = text[: max(room - len(_DOTS), 0)]
    return (kept.rpartition(' ')[0] or kept).rstrip(' ,;:') + _DOTS
