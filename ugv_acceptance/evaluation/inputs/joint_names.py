"""Names of joints that a topic tells, compared with those the configuration expects."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

# Names that are listed; names that differ by more than ALIKE (of 1) are not near.
MOST, ALIKE = 6, 0.8


def near_names(wanted: Sequence[str], names: Iterable[str]) -> dict[str, str]:
    """Return for each wanted name the told one that may be meant; without those that have none.

    It has a prefix or a suffix more or less, another case, other separators, or nearly the same
    letters. A name that two wanted ones would need is none.
    """
    told = sorted(set(names) - set(wanted))
    found = {name: _near(name, told) for name in wanted}
    taken = list(found.values())
    return {name: other for name, other in found.items() if other and taken.count(other) == 1}


def _near(name: str, told: Sequence[str]) -> str | None:
    plain = _plain(name)
    looks = (
        [t for t in told if _plain(t) == plain],
        [t for t in told if _plain(t).endswith(plain) or plain.endswith(_plain(t))],
        [t for t in told if _plain(t).startswith(plain) or plain.startswith(_plain(t))],
    )
    for found in looks:
        if found and _plain(found[0]):
            return min(found, key=len)
    close = get_close_matches(name, told, 1, ALIKE)
    return close[0] if close else None


def _plain(name: str) -> str:
    return ''.join(c for c in name.casefold() if c.isalnum())


def names_words(names: Sequence[str]) -> str:
    """Return a list of names as text, the first MOST of them."""
    more = len(names) - MOST
    return ', '.join(names[:MOST]) + (f' and {more} more' if more > 0 else '') or 'no names'


def what_to_set(wanted: Sequence[tuple[str, str]], names: Iterable[str]) -> str:
    """Return which keys of the configuration to set so that its joints are found; '' if unknown.

    `wanted` pairs the joint in the configuration with the name expected in messages.
    """
    near = near_names([topic_name for _, topic_name in wanted], names)
    keys = [
        f'joints.{joint}.topic_name: {near[topic_name]}'
        for joint, topic_name in wanted
        if topic_name in near
    ]
    if not keys:
        return ''
    common = _in_common(near)
    return f'set {"; ".join(keys)}' + (f' (all {common})' if common else '')


def _in_common(near: dict[str, str]) -> str:
    """Return the prefix or suffix by which all names differ, in words; '' if there is none."""
    before = {t.removesuffix(w) if t.endswith(w) else '' for w, t in near.items()}
    after = {t.removeprefix(w) if t.startswith(w) else '' for w, t in near.items()}
    for word, found in (('prefix', before), ('suffix', after)):
        if len(near) > 1 and len(found) == 1 and '' not in found:
            return f'with the {word} {found.pop()}'
    return ''
