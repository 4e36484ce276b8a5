"""Inertias that MuJoCo refuses, made ones it takes: those of no rigid body.

Others' URDFs have such numbers on small parts. The simulation then takes the mean of the three
principal moments for each, as MuJoCo's own `balanceinertia` does, and says of which links.
"""

from functools import lru_cache

import numpy as np

from ugv_acceptance.model.robot import Matrix, Robot
from ugv_acceptance.simulation.engine import mujoco

# Mass (kg) and inertia (kg m2) of links without any: MuJoCo needs some of moving bodies.
LEAST = 1e-12
# Below this, as a share of the largest moment, it is left to MuJoCo whether an inertia is one.
CLOSE = 1e-6


def full_inertia(inertia: Matrix) -> tuple[float, ...]:
    """Return xx, yy, zz, xy, xz, yz (kg m2) of an inertia, each moment by LEAST above what it is.

    One that is of no rigid body is balanced.
    """
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
    full = (xx + LEAST, yy + LEAST, zz + LEAST, xy, xz, yz)
    if is_taken(full):
        return full
    mean = max((xx + yy + zz) / 3.0, 0.0) + LEAST
    return (mean, mean, mean, 0.0, 0.0, 0.0)


@lru_cache(maxsize=1024)
def is_taken(full: tuple[float, ...]) -> bool:
    """Return whether MuJoCo takes an inertia: xx, yy, zz, xy, xz, yz in kg m2."""
    xx, yy, zz, xy, xz, yz = full
    least, middle, most = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if least > CLOSE * most and least + middle > (1.0 + CLOSE) * most:
        return True
    numbers = ' '.join(map(repr, full))
    text = (
        '<mujoco><worldbody><body><inertial pos="0 0 0" mass="1" '
        f'fullinertia="{numbers}"/></body></worldbody></mujoco>'
    )
    try:
        mujoco.MjModel.from_xml_string(text)
    except ValueError:
        return False
    return True


def balanced_links(robot: Robot) -> tuple[str, ...]:
    """Return the links whose inertia is of no rigid body, so that the simulation balances it."""
    found = []
    for link in robot.links:
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
        if not is_taken((xx + LEAST, yy + LEAST, zz + LEAST, xy, xz, yz)):
            found.append(link.name)
    return tuple(found)
