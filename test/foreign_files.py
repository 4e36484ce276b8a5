"""Files of robots whose names are those of no other: a mobile arm, a rover, an arm alone, legs.

Each function writes a URDF and a configuration into a folder and returns the configuration.
`prefix` stands before every name of a link or joint.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import yaml

UP, ACROSS, ALONG = '0 0 1', '0 1 0', '1 0 0'
# Half the wheelbase and track, radius and height of the axles above the root link (m).
X, Y, RADIUS, AXLE = 0.28, 0.26, 0.15, 0.02
WHEELS = {f'roller{k}': (x, y) for k, (x, y) in enumerate([(X, Y), (X, -Y), (-X, Y), (-X, -Y)])}


@dataclass(frozen=True)
class Part:
    """A joint and the link it carries: where on the parent, its axis, range, effort, mass, centre.

    Without a range (rad; m) it turns without end; `effort` (N m; N) 0: none is given.
    """

    joint: str
    parent: str
    child: str
    at: str
    axis: str = ACROSS
    kind: str = 'revolute'
    ends: tuple[float, float] | None = (-2.8, 2.8)
    effort: float = 0.0
    mass: float = 1.0
    centre: str = '0 0 0'


# Ahead at zero: turns, lifts, lifts, rolls, lifts, rolls. The dot is in no PackBot's name.
ARM = (
    Part('base.yaw', 'hull', 'post', '0.15 0 0.2', UP, effort=90, mass=3),
    Part(
        'big_lift',
        'post',
        'boom',
        '0 0 0.08',
        ends=(-2.9, 0.3),
        effort=45,
        mass=3.5,
        centre='0.2 0 0',
    ),
    Part(
        'mid_lift',
        'boom',
        'stick',
        '0.4 0 0',
        ends=(-2.2, 2.2),
        effort=18,
        mass=2,
        centre='0.17 0 0',
    ),
    Part('roll_a', 'stick', 'cuff', '0.34 0 0', ALONG, effort=15, mass=0.5),
    Part('nod', 'cuff', 'palm', '0.05 0 0', effort=15, mass=0.3),
    Part('roll_b', 'palm', 'claw', '0.05 0 0', ALONG, effort=9, mass=0.2),
)


def urdf_of(root: str, mass: float, parts: tuple[Part, ...], prefix: str = '') -> str:
    """Return the URDF of a root link (kg) and what hangs on it."""
    text = ['<robot name="foreign">', _link(prefix + root, mass, '0 0 0.08')]
    for part in parts:
        text.append(_link(prefix + part.child, part.mass, part.centre))
        ends = part.ends or (0.0, 0.0)
        limit = f'<limit lower="{ends[0]}" upper="{ends[1]}" effort="{part.effort}" velocity="2"/>'
        text.append(
            f'<joint name="{prefix}{part.joint}" type="{part.kind}">'
            f'<origin xyz="{part.at}"/><parent link="{prefix}{part.parent}"/>'
            f'<child link="{prefix}{part.child}"/><axis xyz="{part.axis}"/>'
            f'{limit if part.ends else ""}</joint>'
        )
    return '\n'.join([*text, '</robot>'])


def _link(name: str, mass: float, centre: str) -> str:
    size = mass * 0.02
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/><inertia '
        f'ixx="{size}" iyy="{size}" izz="{size}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def _wheels() -> tuple[Part, ...]:
    return tuple(
        Part(name, 'hull', f'{name}_tyre', f'{x} {y} {AXLE}', kind='continuous', ends=None, mass=2)
        for name, (x, y) in WHEELS.items()
    )


def _standing(prefix: str) -> dict[str, object]:
    feet = {
        f'{name}_{edge}': {
            'link': f'{prefix}hull', 'position_m': [x, y + off, round(AXLE - RADIUS, 3)]
        }
        for name, (x, y) in WHEELS.items()
        for edge, off in (('a', -0.04), ('b', 0.04))
    }  # fmt: skip
    return {
        'contacts': feet,
        'ground': {'height_m': round(AXLE - RADIUS, 3)},
        'held': {f'{prefix}{name}': 0 for name in WHEELS},
    }


def written(folder: Path, name: str, urdf: str, **sections: object) -> Path:
    """Write a URDF and its configuration; return the path of the latter."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f'{name}.urdf').write_text(urdf, 'utf-8')
    path = folder / f'{name}.yaml'
    document = {'robot': {'name': name}, 'urdf': f'{name}.urdf', **sections}
    path.write_text(yaml.safe_dump(document, sort_keys=False), 'utf-8')
    return path


def mobile_arm(
    folder: Path, *, prefix: str = '', payload: bool = True, limits: bool = True
) -> Path:
    """Write the rover with an arm of six joints; with its payload link and limits, or without."""
    urdf = urdf_of('hull', 35.0, (*_wheels(), *ARM), prefix)
    joints = {f'{prefix}{p.joint}': {} if limits else {'limit_nm': None} for p in ARM}
    load = {'payload': {'link': f'{prefix}claw', 'mass_kg': 2}} if payload else {}
    return written(folder, 'mobile_arm', urdf, joints=joints, **_standing(prefix), **load)


def rover(folder: Path, *, prefix: str = '') -> Path:
    """Write a rover on four wheels that tells no joints."""
    urdf = urdf_of('hull', 35.0, _wheels(), prefix)
    return written(folder, 'rover', urdf, topics={'joint_states': None}, **_standing(prefix))


def arm_alone(folder: Path) -> Path:
    """Write an arm that stands on nothing, its second lifting joint below zero only."""
    parts = tuple(
        replace(
            part,
            parent='hull' if part is ARM[0] else part.parent,
            ends=(-2.6, -0.2) if part.joint == 'mid_lift' else part.ends,
        )
        for part in ARM
    )
    urdf = urdf_of('hull', 5.0, parts)
    joints: dict[str, object] = {p.joint: {} for p in ARM}
    level = {'topics': {'imu': None}, 'imu': {'attitude': 'level'}}
    load = {'payload': {'link': 'claw', 'mass_kg': 1}}
    return written(folder, 'arm_alone', urdf, joints=joints, **level, **load)


def walker(folder: Path) -> Path:
    """Write a body on four legs of three joints."""
    parts: list[Part] = []
    for name, (x, y) in WHEELS.items():
        parts += [
            Part(f'{name}_out', 'hull', f'{name}_hip', f'{x} {y} 0', ALONG, effort=40),
            Part(f'{name}_swing', f'{name}_hip', f'{name}_upper', '0 0.05 0', effort=40),
            Part(f'{name}_bend', f'{name}_upper', f'{name}_lower', '0 0 -0.2', effort=40),
        ]
    feet = {n: {'link': f'{n}_lower', 'position_m': [0, 0, -0.2]} for n in WHEELS}
    urdf = urdf_of('hull', 12.0, tuple(parts))
    ground = {'height_m': -0.4}
    return written(
        folder, 'walker', urdf, joints={p.joint: {} for p in parts}, contacts=feet, ground=ground
    )
