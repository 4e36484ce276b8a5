"""Joints without messages: where each is held, by the file or for want of anything better."""

from collections.abc import Iterable, Sequence

from ugv_acceptance.config.combining import Build, known, listed, of_joint
from ugv_acceptance.config.mimics import followed
from ugv_acceptance.model.robot import Joint


def held_joints(build: Build, measured: tuple[str, ...]) -> Iterable[tuple[str, float]]:
    """Yield every movable joint without messages with the position at which it is held."""
    held, silent = build.file.held, []
    follows = {m.joint: m for m in followed(build.urdf.mimics, {*measured, *held})}
    movable = {joint.name: joint for joint in build.urdf.joints if joint.kind != 'fixed'}
    for name in held:
        known(build, ('held', name), name, list(movable), 'movable joint')
        if name in measured:
            raise build.refuse(('held', name), 'expected a joint that is not under joints too')
    for name, joint in movable.items():
        if name in held:
            yield name, _declared(build, joint)
        elif name in follows:
            of = follows[name]
            if of.follows in measured:
                continue
            led = held[of.follows].value if of.follows in held else movable[of.follows].nearest(0.0)
            yield name, of.multiplier * led + of.offset
        elif name not in measured:
            silent.append(joint)
    yield from _silent(build, silent)


def _declared(build: Build, joint: Joint) -> float:
    """Return where the file says that a joint is held; one beyond its range is warned of."""
    path = ('held', joint.name)
    at = of_joint(build, path, joint, build.file.held[joint.name], 'angle', 'length')
    if at != joint.nearest(at):
        unit = joint.units.position
        build.warn(path, f'{at:g} is outside its range, {joint.lower:g} .. {joint.upper:g} {unit}')
    return at


def _silent(build: Build, joints: Sequence[Joint]) -> Iterable[tuple[str, float]]:
    """Yield where joints that nobody tells are held: at 0, or the nearest end of their range."""
    if joints:
        names = listed([joint.name for joint in joints])
        build.warn(('joints',), f'neither under joints nor held, so held at 0: {names}')
    for joint in joints:
        if at := joint.nearest(0.0):
            build.warn(('joints',), f'{joint.name}: its range is without 0, so held at {at:g}')
            yield joint.name, at
