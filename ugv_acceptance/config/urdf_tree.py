"""From the links and joints of a URDF to one tree: its root, what hangs on nothing, cycles."""

from collections.abc import Collection, Sequence

from ugv_acceptance import BadConfig
from ugv_acceptance.config.units import cut, shown
from ugv_acceptance.model.robot import Joint, Link

# Joints of several degrees of freedom: known only where they say how the base stands in the world.
FREE = ('floating', 'planar')
Tree = tuple[tuple[Link, ...], tuple[Joint, ...]]


def tree_of(
    links: Sequence[Link],
    joints: Sequence[Joint],
    bare: Collection[str],
    source: str,
    warnings: list[str],
) -> Tree:
    """Return the links and joints of the robot: one tree; what was left out is warned of.

    Left out are a world without mass to which the base is tied by a floating or planar joint, and
    frames that hang on nothing; `bare` are the links that are only frames. Raises BadConfig for
    missing links, links with two parents, cycles, several roots, and floating joints elsewhere.
    """
    _check_ends(links, joints, source)
    links, joints = _from_the_base(links, joints, source, warnings)
    links, joints = _one_root(links, joints, bare, source, warnings)
    parent_of = {joint.child: joint.parent for joint in joints}
    for name in parent_of:
        seen, at = {name}, name
        while at in parent_of:
            at = parent_of[at]
            if at in seen:
                raise BadConfig(f'{source}: joints are a cycle through link {cut(at)}')
            seen.add(at)
    return tuple(links), tuple(joints)


def _check_ends(links: Sequence[Link], joints: Sequence[Joint], source: str) -> None:
    names, children = {link.name for link in links}, set()
    for joint in joints:
        where = f'{source}: joint {cut(joint.name)}'
        for end in (joint.parent, joint.child):
            if end not in names:
                raise BadConfig(f'{where}: link {shown(end)} does not exist')
        if joint.child in children:
            raise BadConfig(f'{where}: link {cut(joint.child)} has two parents')
        children.add(joint.child)


def _from_the_base(
    links: Sequence[Link], joints: Sequence[Joint], source: str, warnings: list[str]
) -> tuple[Sequence[Link], Sequence[Joint]]:
    """Leave out a free joint between a world and the base, and that world."""
    children = {joint.child for joint in joints}
    mass = {link.name: link.mass for link in links}
    for joint in joints:
        if joint.kind not in FREE:
            continue
        beside = [other for other in joints if other.parent == joint.parent]
        where = f'{source}: joint {cut(joint.name)}'
        if joint.parent in children or len(beside) > 1 or mass[joint.parent] > 0.0:
            raise BadConfig(
                f'{where}: expected the type revolute, continuous, prismatic, fixed, got '
                f'{shown(joint.kind)}: a joint of several degrees of freedom has to be written as '
                'several joints, unless it ties the base to a world without mass'
            )
        warnings.append(
            f'{where}: {joint.kind}, from {cut(joint.parent)}: {cut(joint.child)} is taken as the '
            'base, and the joint is ignored'
        )
        links = [link for link in links if link.name != joint.parent]
        joints = [other for other in joints if other is not joint]
    return links, joints


def _one_root(
    links: Sequence[Link],
    joints: Sequence[Joint],
    bare: Collection[str],
    source: str,
    warnings: list[str],
) -> tuple[Sequence[Link], Sequence[Joint]]:
    """Leave out frames that hang on nothing; BadConfig if more than one root is left."""
    parts = _parts(links, joints)
    if not parts:
        got = 'none: the joints are a cycle' if links else 'no link'
        raise BadConfig(f'{source}: expected one root link, got {got}')
    whole = {root: names for root, names in parts.items() if not all(n in bare for n in names)}
    if len(parts) == 1 or len(whole) != 1:
        if len(parts) > 1:
            raise _several(links, whole or parts, source)
        return links, joints
    loose = [name for root, names in parts.items() if root not in whole for name in names]
    warnings.append(
        f'{source}: {_listed(loose)}: on no joint that leads to {cut(next(iter(whole)))}, without '
        'mass and geometry: ignored'
    )
    left = set(loose)
    kept = [joint for joint in joints if joint.child not in left and joint.parent not in left]
    return [link for link in links if link.name not in left], kept


def _parts(links: Sequence[Link], joints: Sequence[Joint]) -> dict[str, list[str]]:
    """Return each root link with the names of all links that hang on it, itself first."""
    below: dict[str, list[str]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint.child)
    children = {joint.child for joint in joints}
    parts = {}
    for root in (link.name for link in links if link.name not in children):
        names = [root]
        for name in names:
            names += below.get(name, [])
        parts[root] = names
    return parts


def _several(links: Sequence[Link], parts: dict[str, list[str]], source: str) -> BadConfig:
    mass = {link.name: link.mass for link in links}
    weights = {root: sum(mass[name] for name in names) for root, names in parts.items()}
    # The heaviest, or of equal ones that of the most links.
    order = sorted(parts, key=lambda root: (weights[root], len(parts[root])), reverse=True)
    told = [
        f'{cut(r)} ({len(parts[r])} link{"s" * (len(parts[r]) > 1)}, {weights[r]:g} kg)'
        for r in order
    ]
    return BadConfig(
        f'{source}: expected one root link, got {_some(told)}: add a joint from a link of '
        f'{cut(order[0])} to {_listed(order[1:])}, or leave out what is not part of the robot'
    )


def _listed(names: Sequence[str]) -> str:
    return _some([cut(name) for name in names])


def _some(texts: Sequence[str]) -> str:
    return ', '.join(texts[:5]) + (', ...' if len(texts) > 5 else '')
