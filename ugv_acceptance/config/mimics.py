"""Joints that follow others: which measured or held joint each follows in the end."""

from collections.abc import Collection, Iterable, Sequence

from ugv_acceptance.model.robot import Mimic


def followed(mimics: Sequence[Mimic], stays: Collection[str]) -> Iterable[Mimic]:
    """Yield each joint that follows another, and which measured or held one it follows in the end.

    `stays` are the joints that are measured or held themselves: they do not follow.
    """
    of = {mimic.joint: mimic for mimic in mimics if mimic.joint not in stays}
    for mimic in of.values():
        found = mimic
        while found.follows in of:
            next_one = of[found.follows]
            factor = found.multiplier * next_one.multiplier
            offset = found.multiplier * next_one.offset + found.offset
            found = Mimic(mimic.joint, next_one.follows, factor, offset)
        yield found
