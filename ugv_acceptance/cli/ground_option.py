"""Reads the option --ground: the kind of ground of a recording, all the time or in windows."""

from collections.abc import Sequence

from ugv_acceptance import BadConfig
from ugv_acceptance.config import quantity
from ugv_acceptance.evaluation.ground import KINDS, Ground, GroundWindow


def ground_from(texts: Sequence[str] | None) -> Ground | None:
    """Return the ground of options such as stairs or stairs=12s..40s; None if none is given.

    Raises BadConfig for another kind, for times that are none, and where two kinds hold always.
    """
    if not texts:
        return None
    kinds = [_kind(text, text) for text in texts if '=' not in text]
    if len(kinds) > 1:
        raise BadConfig(f'--ground: expected one kind for all the time, got {" and ".join(kinds)}')
    windows = tuple(_window(text) for text in texts if '=' in text)
    return Ground(kinds[0] if kinds else None, windows=windows)


def _kind(word: str, text: str) -> str:
    if word.strip() not in KINDS:
        raise BadConfig(f'--ground {text}: expected one of {", ".join(KINDS)}, got {word!r}')
    return word.strip()


def _window(text: str) -> GroundWindow:
    word, _, times = text.partition('=')
    first, dots, last = times.partition('..')
    if not dots:
        raise BadConfig(f'--ground {text}: expected times such as stairs=12s..40s, got {times!r}')
    start, end = (quantity(part, 'time', f'--ground {text}') for part in (first, last))
    if not 0.0 <= start < end:
        raise BadConfig(f'--ground {text}: expected a start from 0 on and an end after it')
    return GroundWindow(_kind(word, text), start, end)
