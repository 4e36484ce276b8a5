"""The geometry of a URDF: exact lowest points, and meshes in three formats."""

import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from configure.small_robots import (
    Triangle,
    block,
    box,
    files_in,
    link,
    mesh,
    shape,
    sphere,
    write_dae,
    write_obj,
    write_stl,
)
from hypothesis import given
from hypothesis import strategies as st

from ugv_acceptance.config.urdf import read_urdf
from ugv_acceptance.configure.collision import Geometry, Solid, geometry_of
from ugv_acceptance.type_aliases import Floats

ANGLES = st.floats(-3.0, 3.0)
KINDS = st.sampled_from(['box', 'cylinder', 'sphere'])
CYLINDER = '<cylinder radius="0.3" length="0.5"/>'


def read(geometry: str, finder: Callable[[str], Path | None] = lambda _: None) -> Geometry:
    """Return the geometry of a URDF of one link."""
    text = f'<robot name="one">{link("base_link", geometry)}</robot>'
    return geometry_of(read_urdf(text.encode(), 'one.urdf'), finder)


def surface(solid: Solid) -> Floats:
    """Return points all over a solid, by its definition, not by ours."""
    a, b = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 181), np.linspace(-1.0, 1.0, 61))
    if solid.kind == 'sphere':
        ring, high = np.cos(np.pi / 2.0 * b), np.sin(np.pi / 2.0 * b)
        local = solid.size[0] * np.stack([ring * np.cos(a), ring * np.sin(a), high], axis=-1)
    elif solid.kind == 'cylinder':
        r, h = solid.size[0], solid.size[2]
        local = np.stack([r * np.cos(a), r * np.sin(a), h * b], axis=-1)
    else:
        grid = np.linspace(-1.0, 1.0, 5)
        local = np.stack(np.meshgrid(grid, grid, grid), axis=-1) * solid.size
    points: Floats = solid.centre + local.reshape(-1, 3) @ solid.turn.T
    return points


@given(KINDS, ANGLES, ANGLES, ANGLES, ANGLES, st.floats(0.0, math.pi))
def test_the_lowest_point_is_that_of_the_whole_surface(
    kind: str, roll: float, pitch: float, yaw: float, heading: float, lean: float
) -> None:
    """No point of a densely sampled surface is lower, and the nearest is as low, however turned."""
    geometry = {'box': box(0.4, 0.2, 0.3), 'cylinder': CYLINDER, 'sphere': sphere(0.3)}[kind]
    (solid,) = read(shape(geometry, '0.1 -0.2 0.3', f'{roll} {pitch} {yaw}')).solids
    up = np.array(
        [math.sin(lean) * math.cos(heading), math.sin(lean) * math.sin(heading), math.cos(lean)]
    )
    heights = surface(solid) @ up
    lowest = float(solid.lowest(up) @ up)
    assert lowest <= heights.min() + 1e-12
    assert lowest == pytest.approx(heights.min(), abs=5e-4)


WRITERS: list[tuple[str, Callable[[Path, Sequence[Triangle]], Path]]] = [
    ('part.stl', write_stl),
    ('part.obj', write_obj),
    ('part.dae', write_dae),
]


@pytest.mark.parametrize(('name', 'write'), WRITERS)
def test_a_mesh_is_read_with_its_place_and_scale(
    tmp_path: Path, name: str, write: Callable[[Path, Sequence[Triangle]], Path]
) -> None:
    """STL, OBJ and COLLADA: corners of faces, in the axes of the link, each axis by its factor."""
    write(tmp_path / name, block(0.2, 0.4, 0.6, at=(0.0, 0.0, 0.1)))
    geometry = shape(mesh(f'package://some_description/{name}', '1 2 0.5'), '0 0 1')
    (solid,) = read(geometry, lambda _: tmp_path / name).solids
    assert solid.kind == 'mesh'
    assert solid.points.min(axis=0) == pytest.approx([-0.1, -0.4, 0.9])
    assert solid.points.max(axis=0) == pytest.approx([0.1, 0.4, 1.2])


def test_a_mesh_in_centimetres_is_read_in_metres(tmp_path: Path) -> None:
    """COLLADA tells its unit."""
    path = write_dae(tmp_path / 'part.dae', block(20.0, 40.0, 60.0), 0.01)
    (solid,) = read(shape(mesh('part.dae')), lambda _: path).solids
    assert np.ptp(solid.points, axis=0) == pytest.approx([0.2, 0.4, 0.6])


@pytest.mark.parametrize(
    ('name', 'content', 'why'),
    [
        ('none.stl', None, 'file not found'),
        ('bad.stl', b'no mesh', 'expected a mesh'),
        ('bad.dae', b'<COLLADA', 'expected a mesh, got'),
        ('empty.obj', b'v 0 0 0\n', 'expected a mesh'),
        ('far.obj', b'v 0 0 0\nv 1 0 1e300\nv 0 1 nan\nf 1 2 3\n', 'expected'),
        ('part.step', b'ISO-10303-21;', 'expected a mesh'),
    ],
)
def test_a_mesh_that_is_not_read_is_named_with_the_reason(
    tmp_path: Path, name: str, content: bytes | None, why: str
) -> None:
    """It is no error: what is read beside it counts, and nothing is taken in its place."""
    if content is not None:
        (tmp_path / name).write_bytes(content)
    found = read(shape(mesh(name)) + shape(box(1, 1, 1)), files_in(tmp_path))
    assert [solid.kind for solid in found.solids] == ['box']
    (unread,) = found.unread
    assert (unread.link, unread.drawn) == ('base_link', False)
    assert name in unread.what
    assert unread.why.startswith(why)


@pytest.mark.parametrize(('package', 'name'), [('trimesh', 'a.stl'), ('collada', 'a.dae')])
def test_without_the_package_that_reads_it_a_mesh_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, package: str, name: str
) -> None:
    """What to install is said."""
    write = write_stl if name.endswith('stl') else write_dae
    write(tmp_path / name, block(1.0, 1.0, 1.0))
    monkeypatch.setitem(sys.modules, package, None)
    found = read(shape(mesh(name)), files_in(tmp_path))
    assert not found.solids
    assert 'pip install' in found.unread[0].why
    assert 'trimesh' in found.unread[0].why


@pytest.mark.parametrize(
    'geometry',
    [
        '<capsule radius="1" length="1"/>',
        '<cylinder radius="x" length="1"/>',
        '<sphere radius="-1"/>',
        '<box size="0 0 0"/>',
    ],
)
def test_a_shape_without_a_size_is_not_read(geometry: str) -> None:
    """An unknown one, one whose numbers are none, and one of no size."""
    found = read(shape(geometry))
    assert (len(found.solids), len(found.unread)) == (0, 1)


def test_what_a_link_is_drawn_with_stands_in_for_missing_collision_geometry() -> None:
    """Only where it has none, and it is marked."""
    drawn = shape(sphere(0.1), tag='visual')
    assert [s.drawn for s in read(drawn).solids] == [True]
    assert [(s.kind, s.drawn) for s in read(drawn + shape(box(1, 1, 1))).solids] == [('box', False)]
