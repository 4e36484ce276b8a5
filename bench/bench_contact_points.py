"""Contact points derived from URDFs of other people, beside what a person measures in them.

MEASURED was computed by hand from the numbers in each URDF: origins of axles, radii and widths,
lengths of legs. A robot is right if its points and those agree, asked if it says what is doubtful
instead of passing it on; it must be one of them.

    python -m bench.bench_contact_points [folder of robots, by default ../shared/robots]
"""

import math
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np

from ugv_acceptance.config.urdf import Urdf, read_urdf
from ugv_acceptance.configure.collision import geometry_of
from ugv_acceptance.configure.contact_points import derive_contacts
from ugv_acceptance.configure.draft import Contacts
from ugv_acceptance.configure.posture import posture_of
from ugv_acceptance.type_aliases import Floats

ROBOTS = Path(__file__).resolve().parents[2] / 'shared' / 'robots'
# Points that differ by less (m) are the same.
SAME = 0.001
BOTH = (1.0, -1.0)
Point = tuple[float, float, float]


@dataclass(frozen=True)
class Measured:
    """What a person measures: contact points (m, root link's axes) in a posture (rad, m)."""

    urdf: str
    points: tuple[Point, ...]
    posture: Mapping[str, float] = field(default_factory=dict)
    says: str = ''


@dataclass(frozen=True)
class Row:
    """A line of the table: how far (m) the points are apart, what was asked, CPU time (s)."""

    name: str
    measured: Measured
    contacts: Contacts
    off: float
    seconds: float

    @property
    def verdict(self) -> str:
        """One of right, asked, WRONG."""
        if self.contacts.question:
            return 'asked'
        return 'right' if self.off <= SAME else 'WRONG'


def _wheels(xs: Sequence[float], y: float, half: float, z: float) -> tuple[Point, ...]:
    """Return the points of wheels on both sides: axles at x, middles at y, half as wide, m."""
    return tuple((x, side * (y + w * half), z) for x, side, w in product(xs, BOTH, BOTH))


def _turned(x: float, z: float, angle: float) -> tuple[float, float]:
    """Return a point of the xz-plane turned about y (rad)."""
    c, s = math.cos(angle), math.sin(angle)
    return x * c + z * s, z * c - x * s


def _legs(
    hip: tuple[float, float], thigh: float, shank: tuple[float, float], ball: float,
    at: tuple[float, float], rear: float = 1.0,
) -> tuple[Point, ...]:  # fmt: skip
    """Return the lowest points of four ball feet (radius `ball`), hips at x, y; hip joints at 0.

    The thigh is straight down, the middle of the ball `shank` (x, z) from the knee; `at` are hip
    and knee angles (rad) of the front legs, those of the rear legs are `rear` times as large, and
    the rear legs are mirrored if that is -1.
    """
    found = []
    for end, side in product(BOTH, BOTH):
        sign = rear if end < 0.0 else 1.0
        up, low = sign * at[0], sign * (at[0] + at[1])
        a, b = _turned(0.0, -thigh, up), _turned(sign * shank[0], shank[1], low)
        found.append((end * hip[0] + a[0] + b[0], side * hip[1], a[1] + b[1] - ball))
    return tuple(found)


def _standing(thigh: float, calf: float) -> dict[str, float]:
    legs = ('FL', 'FR', 'RL', 'RR')
    return {f'{leg}_{n}_joint': x for leg in legs for n, x in (('thigh', thigh), ('calf', calf))}


def _anymal(hip: float, knee: float) -> dict[str, float]:
    found: dict[str, float] = {}
    for leg, sign in (('LF', 1.0), ('RF', 1.0), ('LH', -1.0), ('RH', -1.0)):
        found |= {f'{leg}_HFE': sign * hip, f'{leg}_KFE': sign * knee}
    return found


_GO2 = ((0.1934, 0.0465 + 0.0955), 0.213, (-0.002, -0.213), 0.022)
_B1 = ((0.3455, 0.072 + 0.12675), 0.35, (0.0, -0.35), 0.04)
_ANYMAL = (
    (0.2999 + 0.0599, 0.104 + 0.08381 + 0.1003 + 0.01305),
    0.285,
    (0.08795, -0.33797 + 0.0225),
    0.03,
)
_HUSKY = _wheels((0.256, -0.256), 0.2854, 0.1143 / 2.0, 0.03282 - 0.1651)
_CASTERS = tuple(
    (x - 0.016, y * 0.102, 0.0985 - 0.0335 - 0.04 - 0.025)
    for x, y in product((0.1695, -0.1735), BOTH)
)

MEASURED: dict[str, Measured] = {
    'husky': Measured('husky', _HUSKY),
    'husky_ur5': Measured('husky_ur5', _HUSKY),
    'jackal': Measured('jackal', _wheels((0.131, -0.131), 0.187795, 0.02, 0.0345 - 0.098)),
    'summit_xl': Measured('summit_xl', _wheels((0.229, -0.229), 0.235, 0.075, 0.11 - 0.11)),
    'leo': Measured(
        'leo',
        _wheels(
            (0.00263 + 0.15256, 0.00263 - 0.15256),
            0.14167 + 0.08214 - 0.04485,
            0.02,
            0.19783 - 0.04731 - 0.08802 - 0.0625,
        ),
    ),
    'dingo': Measured(
        'dingo',
        (
            *_wheels((0.0989838,), 0.2261616, 0.01016, 0.0345 - 0.049),
            (-0.244, 0.0, -0.00674 - 0.01),
        ),
        says='the caster is 2.2 mm lower than the wheels: 0.37 deg',
    ),
    'tb3_manip': Measured(
        'tb3_manip',
        (
            *_wheels((0.0,), 0.144, 0.009, 0.010 + 0.023 - 0.033),
            *((-0.177, side * 0.064, 0.010 - 0.004 - 0.001 - 0.0045) for side in BOTH),
        ),
        says='boxes stand for the casters, 0.5 mm above the wheels',
    ),
    'tiago': Measured(
        'tiago',
        (*((0.0, side * 0.2022, 0.0985 - 0.0985) for side in BOTH), *_CASTERS),
        says='spheres stand for wheels and casters',
    ),
    'go2, legs at 0': Measured('go2', _legs(*_GO2, (0.0, 0.0)), says='no posture: knees at 0'),
    'go2, standing': Measured('go2', _legs(*_GO2, (0.9, -1.8)), _standing(0.9, -1.8)),
    'b1, legs at 0': Measured('b1', _legs(*_B1, (0.0, 0.0)), says='no posture: knees at 0'),
    'b1, standing': Measured('b1', _legs(*_B1, (0.8, -1.5)), _standing(0.8, -1.5)),
    'anymal_c, legs at 0': Measured(
        'anymal_c', _legs(*_ANYMAL, (0.0, 0.0), -1.0), says='no posture: knees at 0'
    ),
    'anymal_c, standing': Measured(
        'anymal_c', _legs(*_ANYMAL, (0.4, -0.8), -1.0), _anymal(0.4, -0.8)
    ),
    'z1': Measured('z1', (), says='an arm alone: stands on nothing'),
}


def urdf_of(name: str, folder: Path = ROBOTS) -> Urdf:
    """Return the URDF of a robot of a folder of robots."""
    path = folder / name / f'{name}.urdf'
    return read_urdf(path.read_bytes(), str(path))


def in_root(urdf: Urdf, posture: Mapping[str, float], contacts: Contacts) -> Floats:
    """Return the derived points (n, 3) in the root link's axes, m."""
    frames = posture_of(urdf, posture, geometry_of(urdf, lambda _: None)).frames
    points = [
        frames[one.contact.link][1] + frames[one.contact.link][0] @ np.array(one.contact.position)
        for one in contacts.points
    ]
    return np.array(points).reshape(-1, 3)


def apart(points: Floats, others: Sequence[Point]) -> float:
    """Return how far (m) each point of either set is from the nearest of the other at most."""
    if not len(points) or not others:
        return 0.0 if len(points) == len(others) else math.inf
    away = np.linalg.norm(points[:, None] - np.array(others)[None], axis=2)
    return float(max(away.min(axis=0).max(), away.min(axis=1).max()))


def row_of(name: str, measured: Measured, folder: Path = ROBOTS) -> Row:
    """Derive the contact points of one robot and hold them beside the measured ones."""
    start = time.process_time()
    urdf = urdf_of(measured.urdf, folder)
    contacts = derive_contacts(urdf, measured.posture, lambda _: None)
    seconds = time.process_time() - start
    off = apart(in_root(urdf, measured.posture, contacts), measured.points)
    return Row(name, measured, contacts, off, seconds)


def main(folder: Path) -> None:
    """Print the table."""
    print(f'{"robot":21}{"points":>7}{"measured":>10}{"apart":>10}  {"":7}{"tilt":>9}{"CPU":>9}')
    for name, measured in MEASURED.items():
        row = row_of(name, measured, folder)
        found, tilt = len(row.contacts.points), math.degrees(row.contacts.tilt)
        print(
            f'{name:21}{found:7}{len(measured.points):10}{1e3 * row.off:7.2f} mm  '
            f'{row.verdict:7}{tilt:5.2f} deg{row.seconds:7.3f} s  {measured.says}'
        )
        if row.contacts.question:
            print(f'    {row.contacts.question}')


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROBOTS)
