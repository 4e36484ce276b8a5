"""Who sent a command: the nodes whose publisher it may have come from, and whether they may.

A node's name is what its own process says it is; only SROS 2 makes it hold (docs/threats.md).
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from ugv_acceptance import BadConfig, BadSample
from ugv_acceptance.monitoring.publisher_identity import Publisher

# What is said in place of a node whose name ROS does not tell.
NAMELESS = 'a node without a name'
# The namespace and name that ROS gives programs that speak DDS and are no ROS nodes.
BARE, BARE_WORDS = '_CREATED_BY_BARE_DDS_APP_', 'a program that is no ROS node'


@dataclass(frozen=True, slots=True)
class Sender:
    """The nodes, by full name, one of which sent a message; a single one: it was that one.

    If not `settled`, ROS may know better a moment later.
    """

    nodes: tuple[str, ...]
    settled: bool = True

    @property
    def words(self) -> str:
        """The node, such as /acceptance_tell, or "one of /a, /b" where several may have sent it."""
        return self.nodes[0] if len(self.nodes) == 1 else f'one of {", ".join(self.nodes)}'


def sender_of(gid: bytes | None, publishers: Sequence[Publisher], *, comparable: bool) -> Sender:
    """Return who sent a message on a topic that has these `publishers`.

    `gid` is the identity that came with the message; None: none came. Where the middleware's
    identities are not `comparable` to those of the publishers, one that fits none tells nothing.
    """
    mine = [publisher for publisher in publishers if publisher.gid == gid]
    if gid is not None and (mine or comparable):
        return Sender((_name(mine[0]),), settled=mine[0].named) if mine else _NOBODY
    names = tuple(sorted({_name(publisher) for publisher in publishers}))
    return Sender(names, settled=all(p.named for p in publishers)) if names else _NOBODY


_NOBODY = Sender((NAMELESS,), settled=False)


def _name(publisher: Publisher) -> str:
    if not publisher.named:
        return NAMELESS
    return BARE_WORDS if BARE in publisher.node else publisher.node


def check_operator(sender: Sender, operators: Collection[str] | None) -> None:
    """Raise BadSample where a command's sender is not, or may not be, one of the `operators`.

    None: everybody may command.
    """
    if operators is None or all(node in operators for node in sender.nodes):
        return
    allowed = f'only {", ".join(operators)} may: `operators` in the configuration'
    if len(sender.nodes) > 1:
        raise BadSample(f'sent by {sender.words}, and which is not known; {allowed}')
    raise BadSample(f'sent by {sender.words}; {allowed}')


def check_named(node: str, operators: Collection[str] | None, why: str) -> None:
    """Raise BadConfig where a node of ours has to command and is not one of the `operators`."""
    if operators is not None and node not in operators:
        raise BadConfig(
            f'operators: expected {node} among them, because {why}; got {", ".join(operators)}'
        )


def full_names(names: Sequence[str] | None, namespace: str) -> tuple[str, ...] | None:
    """Return the full names of nodes; one without a leading / is in the monitor's `namespace`."""
    if names is None:
        return None
    at = namespace.rstrip('/')
    return tuple(name if name.startswith('/') else f'{at}/{name}' for name in names)
