"""Tells a driver that was restarted from two drivers under one name.

DDS keeps a process that was killed, with its publishers, for 20 s, so a driver that was started
again is known twice. Each publisher numbers its messages: a voice that speaks again after another
has spoken is alive, and so are both.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

# A publisher that is known this long (ns) beside a later one of its name is no dead one.
OUTLIVED = 25_000_000_000
# Times an earlier voice must be heard again: lost messages can make one voice look like that once.
_RETURNS = 2
# Voices told apart at a time.
_KEPT = 8
# Bytes of a publisher's identity that are its process's.
_PROCESS = 12


@dataclass(frozen=True, slots=True)
class Publisher:
    """A publisher as ROS knows it: the full name of its node, and its DDS identity.

    While it is not `named`, its node is some word that says so: a name can come seconds later.
    """

    node: str
    gid: bytes
    named: bool = True


@dataclass(slots=True)
class Voices:
    """The publishers of one input. `restarted` names nodes known twice of which one speaks."""

    restarted: list[str] = field(default_factory=list)
    _heads: list[int] = field(default_factory=list)
    _returns: int = 0
    _numbered: bool = True
    _since: dict[bytes, int] = field(default_factory=dict)

    def hear(self, number: int | None) -> None:
        """Take the number its publisher gave a message; None: this middleware gives none."""
        heads = self._heads
        if number is None:
            self._numbered = False
        elif heads and number == heads[0] + 1:
            heads[0] = number
        else:
            self._other(number)

    def _other(self, number: int) -> None:
        """Take a number that does not follow the last one: messages were lost, or another voice."""
        heads = self._heads
        mine = max((k for k in range(len(heads)) if heads[k] < number), key=self._last, default=-1)
        if mine >= 0:
            del heads[mine]
            self._returns += mine > 0
        heads.insert(0, number)
        del heads[_KEPT:]

    def _last(self, voice: int) -> tuple[int, int]:
        """Return the last number of a voice; of equal ones the voice heard last is larger."""
        return self._heads[voice], -voice

    def present(self, now: int, publishers: Sequence[Publisher]) -> list[str]:
        """Return the nodes that publish at `now` (ns), sorted: one that came back counts once."""
        seen = {p.gid: self._since.get(p.gid, now) for p in publishers}
        self._since = seen
        groups, nodes, self.restarted = _by_name(publishers), list[str](), []
        for node, group in groups.items():
            if len(group) > 1 and not self._together(now, [p.gid for p in group]):
                self.restarted.append(node)
                nodes.append(node)
            else:
                nodes += [p.node for p in group]
        if len(groups) == len(publishers):
            del self._heads[len(groups) :]
            self._returns = 0
        return sorted(nodes)

    def _together(self, now: int, gids: Sequence[bytes]) -> bool:
        """Return whether publishers of one name are there at the same time."""
        if not self._numbered or self._returns >= _RETURNS:
            return True
        if len({gid[:_PROCESS] for gid in gids}) < len(gids):
            return True
        return now - sorted(self._since[gid] for gid in gids)[1] > OUTLIVED


def _by_name(publishers: Sequence[Publisher]) -> dict[str, list[Publisher]]:
    """Return publishers by node; one without a name yet may be the only node there is, again."""
    names = {p.node for p in publishers if p.named}
    only = names.pop() if len(names) == 1 else ''
    groups = defaultdict[str, list[Publisher]](list)
    for publisher in publishers:
        groups[publisher.node if publisher.named else only or publisher.node].append(publisher)
    return groups
