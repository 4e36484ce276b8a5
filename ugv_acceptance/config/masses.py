"""What a robot weighs, and which of its links weigh nothing though they look as if they did."""

from collections.abc import Callable, Sequence

from ugv_acceptance import BadConfig
from ugv_acceptance.config.document import Path
from ugv_acceptance.config.units import cut
from ugv_acceptance.model.robot import Joint, Link, Shape

# Lighter robots are mistakes of unit (kg).
LEAST_MASS = 1e-6
# Geometry of at most this half size (m) only marks a frame.
_MARK = 0.01


def check_masses(
    links: Sequence[Link],
    joints: Sequence[Joint],
    shapes: Sequence[Shape],
    refuse: Callable[[Path, str], BadConfig],
    warn: Callable[[Path, str], None],
) -> None:
    """Warn of links with collision geometry and without mass; BadConfig if none has a mass.

    A link whose mass stands on a link of its own, fixed to it and without geometry, has its mass.
    """
    solid = {shape.link for shape in shapes if shape.size is None or max(shape.size) > _MARK}
    massless = [link.name for link in links if link.mass < LEAST_MASS]
    carriers = {link.name for link in links} - {shape.link for shape in shapes} - {*massless}
    weighed = {j.parent for j in joints if j.kind == 'fixed' and j.child in carriers}
    hollow = [name for name in massless if name in solid - weighed]
    if len(massless) == len(links):
        first = (hollow or massless)[0]
        raise refuse(
            ('urdf',),
            f'expected links with mass, got none in {_some(hollow or massless)}: weigh the parts '
            f'and enter them, as links: {{{cut(first)}: {{mass_kg: ..., cog_m: [x, y, z]}}}}, or '
            'take a URDF that has <inertial>',
        )
    if hollow:
        warn(
            ('links',),
            f'{_some(hollow)}: collision geometry without mass in the URDF: taken as massless; '
            'mass_kg and cog_m under links replace that',
        )


def _some(names: Sequence[str]) -> str:
    return ', '.join(map(cut, names[:8])) + (', ...' if len(names) > 8 else '')
