"""Small URDFs and meshes for the tests of configure."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ugv_acceptance.config.urdf import read_urdf
from ugv_acceptance.configure.contact_points import derive_contacts
from ugv_acceptance.configure.draft import Contacts

Triangle = tuple[tuple[float, float, float], ...]


def link(name: str, geometry: str = '', mass: float = 1.0, cog: str = '0 0 0') -> str:
    """Return a link with collision elements and a mass; 0: without an inertial."""
    inertial = (
        f'<inertial><origin xyz="{cog}"/><mass value="{mass}"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    return f'<link name="{name}">{inertial if mass else ""}{geometry}</link>'


def joint(
    child: str, xyz: str, kind: str = 'fixed', axis: str = '0 1 0', parent: str = 'base_link'
) -> str:
    """Return a joint to `child`; a moving one without limits turns up to 3 rad."""
    limit = '<limit lower="-3" upper="3" effort="9" velocity="9"/>' if kind != 'fixed' else ''
    return (
        f'<joint name="{child}_joint" type="{kind}"><origin xyz="{xyz}"/><parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


def shape(geometry: str, xyz: str = '0 0 0', rpy: str = '0 0 0', tag: str = 'collision') -> str:
    """Return a collision (or visual) element of a geometry such as box(...)."""
    return f'<{tag}><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{geometry}</geometry></{tag}>'


def box(x: float, y: float, z: float) -> str:
    """Return a box by its edges (m)."""
    return f'<box size="{x} {y} {z}"/>'


def sphere(radius: float) -> str:
    """Return a sphere (m)."""
    return f'<sphere radius="{radius}"/>'


def tyre(radius: float, width: float, tag: str = 'collision') -> str:
    """Return a cylinder about y (m) as a collision or visual element."""
    cylinder = f'<cylinder radius="{radius}" length="{width}"/>'
    return shape(cylinder, rpy=f'{math.pi / 2.0} 0 0', tag=tag)


def mesh(name: str, scale: str = '1 1 1') -> str:
    """Return a mesh."""
    return f'<mesh filename="{name}" scale="{scale}"/>'


def wheel(name: str, xyz: str, geometry: str, parent: str = 'base_link') -> str:
    """Return a wheel and its joint about y."""
    return link(name, geometry) + joint(name, xyz, 'continuous', parent=parent)


def rover(geometry: str, wheels: str, more: str = '', cog: str = '0 0 0') -> str:
    """Return a URDF: a base of 10 kg and what hangs on it."""
    return f'<robot name="rover">{link("base_link", geometry, 10.0, cog)}{wheels}{more}</robot>'


def four(geometry: str, x: float = 0.2, y: float = 0.2, z: float = 0.1) -> str:
    """Return four wheels at +/-x, +/-y, z (m)."""
    names = ('front_left', 'front_right', 'rear_left', 'rear_right')
    places = [f'{a} {b} {z}' for a in (x, -x) for b in (y, -y)]
    return ''.join(wheel(n, at, geometry) for n, at in zip(names, places, strict=True))


def derived(
    urdf: str,
    posture: Mapping[str, float] | None = None,
    meshes: Callable[[str], Path | None] = lambda _: None,
) -> Contacts:
    """Return what is derived of a URDF's text."""
    return derive_contacts(read_urdf(urdf.encode(), 'test.urdf'), posture or {}, meshes)


def files_in(folder: Path) -> Callable[[str], Path | None]:
    """Return what finds a mesh in a folder by the last part of its name."""

    def find(name: str) -> Path | None:
        path = folder / name.rpartition('/')[2]
        return path if path.is_file() else None

    return find


def block(
    x: float, y: float, z: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> list[Triangle]:
    """Return the triangles of a block by its edges, about `at` (m)."""
    corners = [
        (at[0] + a * x / 2.0, at[1] + b * y / 2.0, at[2] + c * z / 2.0)
        for a in (1, -1)
        for b in (1, -1)
        for c in (1, -1)
    ]
    found: list[Triangle] = [(corners[0], corners[k], corners[k + 1]) for k in range(1, 7)]
    return found


def drum(radius: float, width: float, count: int = 48) -> list[Triangle]:
    """Return the triangles of a wheel about y (m), with a boss on its axle that sticks out."""
    rims = [
        [(radius * math.cos(a), side * width / 2.0, radius * math.sin(a))
         for a in (2.0 * math.pi * k / count for k in range(count))]
        for side in (1.0, -1.0)
    ]  # fmt: skip
    found: list[Triangle] = []
    for rim, side in zip(rims, (1.0, -1.0), strict=True):
        boss = (0.0, side * width, 0.0)
        found += [(boss, rim[k - 1], rim[k]) for k in range(count)]
    return found


def write_stl(path: Path, triangles: Sequence[Triangle]) -> Path:
    """Write triangles as an STL file of text."""
    lines = ['solid made']
    for corners in triangles:
        lines += ['facet normal 0 0 1', 'outer loop']
        lines += [f'vertex {x} {y} {z}' for x, y, z in corners]
        lines += ['endloop', 'endfacet']
    path.write_text('\n'.join([*lines, 'endsolid made', '']), encoding='utf-8')
    return path


def write_obj(path: Path, triangles: Sequence[Triangle]) -> Path:
    """Write triangles as an OBJ file, with a corner that is part of none."""
    lines = ['v 9 9 -9', *(f'v {x} {y} {z}' for corners in triangles for x, y, z in corners)]
    lines += [f'f {3 * k + 2} {3 * k + 3} {3 * k + 4}' for k in range(len(triangles))]
    path.write_text('\n'.join([*lines, '']), encoding='utf-8')
    return path


def write_dae(path: Path, triangles: Sequence[Triangle], metres: float = 1.0) -> Path:
    """Write triangles as a COLLADA file whose unit is `metres` (m)."""
    numbers = ' '.join(f'{c}' for corners in triangles for corner in corners for c in corner)
    count = 3 * len(triangles)
    path.write_text(
        f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="made" meter="{metres}"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="{3 * count}">{numbers}</float_array>
<technique_common><accessor source="#a" count="{count}" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{len(triangles)}"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{' '.join(map(str, range(count)))}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
""",
        encoding='utf-8',
    )
    return path
