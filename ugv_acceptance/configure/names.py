"""Finds a URDF's names among those that messages use: a prefix, a suffix, other separators."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Affix:
    """What is before (`front`) or after the names of messages (`added`), or of the URDF, alone."""

    text: str
    front: bool
    added: bool

    def told(self, name: str) -> str | None:
        """Return what messages call a name of the URDF; None if it does not have this affix."""
        if self.added:
            return self.text + name if self.front else name + self.text
        if self.front:
            return name.removeprefix(self.text) if name.startswith(self.text) else None
        return name.removesuffix(self.text) if name.endswith(self.text) else None

    @property
    def words(self) -> str:
        """What it is, as text: the prefix r1_ of the messages."""
        kind = 'prefix' if self.front else 'suffix'
        return f'the {kind} {self.text} of the {"messages" if self.added else "URDF"}'


@dataclass(frozen=True, slots=True)
class Matched:
    """Names of the URDF with those that messages use for them (`told`).

    `affix` is by what they differ, None if by none; `spelt` are the names that differ in case or
    separators alone; `rivals` are affixes that fit equally well, of which none was taken.
    """

    told: Mapping[str, str]
    affix: Affix | None = None
    spelt: tuple[str, ...] = ()
    rivals: tuple[Affix, ...] = ()


def match_names(wanted: Sequence[str], told: Iterable[str]) -> Matched:
    """Return which told name is meant by each wanted one, as far as that is certain.

    Equal names first; then the one affix that explains most of the others, at least two or all of
    them; then names that differ in case or separators alone.
    """
    free = dict.fromkeys(told)
    found = {name: name for name in wanted if name in free}
    left = [name for name in wanted if name not in found]
    free = {name: None for name in free if name not in found}
    best = _affixes(left, list(free), len(wanted))
    affix = best[0] if len(best) == 1 else None
    if affix is not None:
        by_affix = {name: other for name in left if (other := affix.told(name)) in free}
        found |= {name: other for name, other in by_affix.items() if other is not None}
    spelt = []
    for name in left:
        alike = [t for t in free if _plain(t) == _plain(name) and t not in found.values()]
        twins = [other for other in left if _plain(other) == _plain(name)]
        if name not in found and len(alike) == 1 and len(twins) == 1:
            found[name] = alike[0]
            spelt.append(name)
    ordered = {name: found[name] for name in wanted if name in found}
    return Matched(ordered, affix, tuple(spelt), best if len(best) > 1 else ())


def _affixes(wanted: Sequence[str], told: Sequence[str], total: int) -> tuple[Affix, ...]:
    """Return the affixes that explain most of the wanted names; several if equally many."""
    counts: Counter[Affix] = Counter()
    for name in wanted:
        for other in told:
            if other.endswith(name):
                counts[Affix(other.removesuffix(name), front=True, added=True)] += 1
            elif other.startswith(name):
                counts[Affix(other.removeprefix(name), front=False, added=True)] += 1
            elif name.endswith(other):
                counts[Affix(name.removesuffix(other), front=True, added=False)] += 1
            elif name.startswith(other):
                counts[Affix(name.removeprefix(other), front=False, added=False)] += 1
    most = max(counts.values(), default=0)
    if most < min(2, total):
        return ()
    return tuple(affix for affix, count in counts.items() if count == most)


def _plain(name: str) -> str:
    return ''.join(c for c in name.casefold() if c.isalnum())
