"""Whether the load that a recording tells is one to judge by, and all that it tells is read."""

from collections import Counter
from collections.abc import Iterator

from ugv_acceptance.bag.cdr import PAYLOAD
from ugv_acceptance.bag.mcap_index import Channel
from ugv_acceptance.bag.reader import Bag, Topics
from ugv_acceptance.bag.reading import Facts, normal_type, wire_of
from ugv_acceptance.evaluation.criteria.criteria import INCONCLUSIVE
from ugv_acceptance.evaluation.criteria.statement import Objection, Statement
from ugv_acceptance.evaluation.inputs.payload import PayloadLog

# As often within this time (ns) is a load told again that another one had replaced, where two tell
# it in turn: nobody sets a load down and takes it up so fast.
RETURNS, RETURNED = 3, 10_000_000_000


def unread_load(bag: Bag, topics: Topics, configured: str, facts: Facts) -> Statement:
    """Return the objections to a recording of whose load some messages were not read.

    `topics` are those that are read, `configured` is the name that the payload's should have.
    """
    return Statement(
        objections=tuple(
            Objection('payload', INCONCLUSIVE, f'the load is told in messages that {why}')
            for why in _unread(bag, topics.payload, configured.lstrip('/'), facts)
        )
    )


def disputed_load(told: PayloadLog) -> Statement:
    """Return the objection to a load that two or more tell differently, in turn; `told` in ns."""
    loads = told.payloads
    back = [k for k in range(2, len(loads)) if loads[k] in loads[max(0, k - 4) : k - 1]]
    for first, last in zip(back, back[RETURNS - 1 :], strict=False):
        if told.since[last] - told.since[first] <= RETURNED:
            masses = sorted({load.mass for load in loads[first - 2 : last + 1]})
            where = '' if len(masses) > 1 else 'at different places, '
            why = f'{" and ".join(f"{mass:g}" for mass in masses)} kg {where}in turn: two tell it'
            objection = Objection('payload', INCONCLUSIVE, f'the load is told as {why}')
            return Statement(objections=(objection,))
    return Statement()


def _unread(bag: Bag, chosen: str | None, configured: str, facts: Facts) -> Iterator[str]:
    number, reason = facts.malformed.get(chosen or '', (0, ''))
    if number:
        yield f'cannot be decoded: {number} of {facts.counts[chosen or ""]} of {chosen} ({reason})'
    held = _held(bag)
    if chosen is None:
        # By its type, or by the name of its topic.
        others = {
            k: n for k, n in held.items() if k[1] == PAYLOAD.type or k[0].lstrip('/') == configured
        }
        several = sorted({kind[0] for kind in others if _readable(kind)})
        if len(several) > 1:
            names = ' and '.join(several)
            yield (
                f'are not read: nothing says which of {names} is meant; set topics.payload.name in '
                'the configuration'
            )
            return
    else:
        others = {k: n for k, n in held.items() if k[0] == chosen and not _readable(k)}
    for (name, kind, encoding), count in sorted(others.items()):
        yield (
            f'are not read: {count} of {name} are {kind or "of no known type"} ({encoding}), not '
            f'{PAYLOAD.type} (cdr)'
        )


# Name of a topic, type and encoding of its messages.
_Kind = tuple[str, str, str]


def _held(bag: Bag) -> Counter[_Kind]:
    """Return the number of messages of each kind; kinds without any are left out."""
    held: Counter[_Kind] = Counter()
    for member in bag.members:
        for number, channel in member.index.channels.items():
            kind = channel.topic, normal_type(channel.type), channel.encoding
            count = member.index.counts.get(number, 0)
            held[kind] += count
    return +held


def _readable(kind: _Kind) -> bool:
    return kind[1] == PAYLOAD.type and wire_of(Channel(0, *kind)) is not None
