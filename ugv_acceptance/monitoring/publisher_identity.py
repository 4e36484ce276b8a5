"""Distinguishes a driver that was restarted from two drivers with the same name.

DDS lists a killed process and its publishers for another 20 s, so that a restarted driver appears
twice. Each publisher numbers its messages: if messages of one numbering come after messages of
another (a *voice* each), both publishers are alive.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

# A publisher listed this long (ns) together with a later one of its name is not a dead one.
OUTLIVED = 25_000_000_000
# Times an earlier voice must return: lost messages can look like one return.
_RETURNS = 2
# Number of voices that are tracked.
_KEPT = 8
# Leading bytes of a publisher's DDS identity (GID) that identify its process.
_PROCESS = 12


@dataclass(frozen=True, slots=True)
class Publisher:
    """A publisher as ROS lists it: the full name of its node, and its DDS identity (GID).

    If not `named`, ROS does not know the node's name yet (it can come seconds later) and `node` is
    a placeholder.
    """

    node: str
    gid: bytes
    named: bool = True


@dataclass(slots=True)
class Voices:
    """The live publishers of one input; `restarted` are nodes listed twice of which one is dead."""

    restarted: list[str] = field(default_factory=list)
    _heads: list[int] = field(default_factory=list)
    _returns: int = 0
    _numbered: bool = True
    _since: dict[bytes, int] = field(default_factory=dict)

    def hear(self, number: int | None) -> None:
        """Take a message's publisher sequence number; None if the middleware has none."""
        heads = self._heads
        if number is None:
            self._numbered = False
        elif heads and number == heads[0] + 1:
            heads[0] = number
        else:
            self._other(number)

    def _other(self, number: int) -> None:
        """Take a number that does not follow the last: lost messages, or another voice."""
        heads = self._heads
        mine = max((k for k in range(len(heads)) if heads[k] < number), key=self._last, default=-1)
        if mine >= 0:
            del heads[mine]
            self._returns += mine > 0
        heads.insert(0, number)
        del heads[_KEPT:]

    def _last(self, voice: int) -> tuple[int, int]:
        """Return the sort key of a voice: its last number, then how recently it was heard."""
        return self._heads[voice], -voice

    def present(self, now: int, publishers: Sequence[Publisher]) -> list[str]:
        """Return the nodes that publish at `now` (ns), sorted; a restarted one counts once."""
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
        """Return whether publishers of one name are alive at the same time."""
        if not self._numbered or self._returns >= _RETURNS:
            return True
        if len({gid[:_PROCESS] for gid in gids}) < len(gids):
            return True
        return now - sorted(self._since[gid] for gid in gids)[1] > OUTLIVED


def _by_name(publishers: Sequence[Publisher]) -> dict[str, list[Publisher]]:
    """Return publishers by node; one without a name counts as the only named node, if just one."""
    names = {p.node for p in publishers if p.named}
    only = names.pop() if len(names) == 1 else ''
    groups = defaultdict[str, list[Publisher]](list)
    for publisher in publishers:
        groups[publisher.node if publisher.named else only or publisher.node].append(publisher)
    return groups
