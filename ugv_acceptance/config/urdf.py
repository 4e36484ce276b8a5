"""Reads a URDF: links, masses, joints, limits, collision and visual geometry.

urdf_xml.py parses the XML, urdf_tree.py finds the one tree in it.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.config.units import LARGEST, cut, shown
from ugv_acceptance.config.urdf_tree import FREE, tree_of
from ugv_acceptance.config.urdf_xml import bare_links, parse
from ugv_acceptance.model.robot import (
    IDENTITY,
    NO_INERTIA,
    ZERO,
    Joint,
    Link,
    Matrix,
    Mimic,
    Shape,
    Vector,
)

KINDS = ('revolute', 'continuous', 'prismatic', 'fixed')
ONE: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Urdf:
    """The links and joints of a URDF; `mimics` are the joints that follow others.

    `shapes` is the collision geometry of all links, `unlimited` the joints to which it gives an
    effort that is no limit, such as 0; `visuals` is the geometry that links are drawn with.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    mimics: tuple[Mimic, ...]
    warnings: tuple[str, ...]
    shapes: tuple[Shape, ...] = ()
    unlimited: tuple[str, ...] = ()
    visuals: tuple[Shape, ...] = ()


def read_urdf(text: bytes, source: str) -> Urdf:
    """Parse the links, joints and limits of a URDF; `source` names the file in errors.

    Raises BadConfig if it is not a URDF, a number is unusable, or the joints are not one tree.
    """
    root = parse(text, source)
    warnings: list[str] = []
    links = tuple(_link(e, source, warnings) for e in root.findall('link'))
    joints = tuple(_joint(e, source, warnings) for e in root.findall('joint'))
    _check_unique('link', [link.name for link in links], source)
    _check_unique('joint', [joint.name for joint in joints], source)
    links, joints = tree_of(links, joints, set(bare_links(root)), source, warnings)
    mimics = tuple(_mimics(root, joints, source))
    names = {link.name for link in links}
    shapes, visuals = (
        tuple(shape for shape in _shapes(root, of) if shape.link in names)
        for of in ('collision', 'visual')
    )
    return Urdf(
        root.get('name') or 'robot',
        links,
        joints,
        mimics,
        tuple(warnings),
        shapes,
        tuple(_without_strength(root)),
        visuals,
    )


def _link(element: Element, source: str, warnings: list[str]) -> Link:
    name = _name(element, 'link', source)
    inertial = element.find('inertial')
    if inertial is None:
        return Link(name)
    where = f'{source}: link {cut(name)}: inertial'
    mass = _number(inertial.find('mass'), 'value', f'{where}/mass', None)
    if mass < 0.0:
        raise BadConfig(f'{where}/mass: expected a mass >= 0 kg, got {mass:g}')
    if mass == 0.0:
        warnings.append(f'{where}/mass: is 0 kg')
    xyz, rotation = _origin(inertial, where)
    inertia = _inertia(inertial.find('inertia'), f'{where}/inertia')
    if mass > 0.0 and not _is_physical(inertia):
        warnings.append(f'{where}/inertia: not that of a rigid body (not positive definite)')
    turn = np.array(rotation)
    return Link(name, mass, xyz, _matrix(turn @ np.array(inertia) @ turn.T))


def _inertia(element: Element | None, where: str) -> Matrix:
    if element is None:
        return NO_INERTIA
    xx, xy, xz, yy, yz, zz = (
        _number(element, key, where, 0.0) for key in ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz')
    )
    return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))


def _is_physical(inertia: Matrix) -> bool:
    """Return whether principal moments are positive and none exceeds the sum of the other two."""
    moments = np.linalg.eigvalsh(np.array(inertia))
    # 0.1 %: files are written with few digits.
    return bool(moments[0] > 0.0 and moments[2] <= (moments[0] + moments[1]) * 1.001)


def _joint(element: Element, source: str, warnings: list[str]) -> Joint:
    name = _name(element, 'joint', source)
    where = f'{source}: joint {cut(name)}'
    kind = element.get('type', '')
    if kind not in (*KINDS, *FREE):
        raise BadConfig(f'{where}: expected the type {", ".join(KINDS)}, got {shown(kind)}')
    ends = []
    for end in ('parent', 'child'):
        child = element.find(end)
        ends.append('' if child is None else child.get('link', ''))
        if not ends[-1]:
            raise BadConfig(f'{where}/{end}: expected the name of a link, got none')
    xyz, rotation = _origin(element, where)
    axis = (1.0, 0.0, 0.0) if kind == 'fixed' else _axis(element.find('axis'), f'{where}/axis')
    lower, upper = _range(element.find('limit'), kind, f'{where}/limit', warnings)
    effort = _limit(element.find('limit'), 'effort', f'{where}/limit')
    velocity = _limit(element.find('limit'), 'velocity', f'{where}/limit')
    return Joint(name, kind, ends[0], ends[1], xyz, rotation, axis, lower, upper, effort, velocity)


def _range(
    limit: Element | None, kind: str, where: str, warnings: list[str]
) -> tuple[float, float]:
    if kind not in ('revolute', 'prismatic'):
        return -math.inf, math.inf
    if limit is None:
        warnings.append(f'{where}: none given for a {kind} joint: taken as unlimited')
        return -math.inf, math.inf
    lower, upper = (_boundless(limit, key, where) for key in ('lower', 'upper'))
    if lower > upper:
        raise BadConfig(f'{where}: expected lower <= upper, got {lower:g} and {upper:g}')
    if lower == upper:
        warnings.append(f'{where}: lower and upper are both {lower:g}: taken as unlimited')
        return -math.inf, math.inf
    return lower, upper


def _limit(limit: Element | None, key: str, where: str) -> float:
    """Return an effort or velocity limit; infinite if it is missing, 0 or beyond all reason."""
    if limit is None:
        return math.inf
    value = _boundless(limit, key, where)
    if value < 0.0:
        raise BadConfig(f'{where}/{key}: expected a limit >= 0, got {value:g}')
    return value or math.inf


def _without_strength(root: Element) -> Iterable[str]:
    """Yield the joints to which the file gives an effort that is no limit: 0, or beyond reason."""
    for element in root.findall('joint'):
        limit = element.find('limit')
        given = limit is not None and limit.get('effort') is not None
        if given and math.isinf(_limit(limit, 'effort', '')):
            yield element.get('name', '')


def _mimics(root: Element, joints: tuple[Joint, ...], source: str) -> Iterable[Mimic]:
    """Yield the joints that follow others; BadConfig where one follows none, or itself."""
    follows = {}
    movable = {joint.name for joint in joints if joint.kind != 'fixed'}
    for element in root.findall('joint'):
        mimic, name = element.find('mimic'), element.get('name', '')
        if mimic is None or name not in movable:
            continue
        where, of = f'{source}: joint {cut(name)}/mimic', mimic.get('joint', '')
        if of not in movable:
            raise BadConfig(f'{where}: expected a movable joint, got {shown(of)}')
        factor = _number(mimic, 'multiplier', where, 1.0)
        follows[name] = Mimic(name, of, factor, _number(mimic, 'offset', where, 0.0))
    for name in follows:
        seen = [name]
        while (at := seen[-1]) in follows:
            if follows[at].follows in seen:
                raise BadConfig(f'{source}: joint {cut(name)}/mimic: the joints follow each other')
            seen.append(follows[at].follows)
    return tuple(follows.values())


def _shapes(root: Element, tag: str) -> Iterable[Shape]:
    """Yield the geometry of all links; what cannot be read is no error, but unread."""
    for link in root.findall('link'):
        name = link.get('name', '')
        for element in link.findall(tag):
            geometry = element.find('geometry')
            found = None if geometry is None else next(iter(geometry), None)
            kind = 'none' if found is None else str(found.tag)
            mesh = found.get('filename') if found is not None and kind == 'mesh' else None
            try:
                xyz, rotation = _origin(element, '')
                size = None if found is None else _size(kind, found)
                scale = (
                    ONE if mesh is None or found is None else _triple(found, 'scale', '', '1 1 1')
                )
            except BadConfig:
                yield Shape(name, kind, ZERO, IDENTITY, None)
            else:
                yield Shape(name, kind, xyz, rotation, size, mesh, scale)


def _size(kind: str, element: Element) -> Vector | None:
    """Return half the size (m) of a box, cylinder or sphere; None for another geometry."""
    if kind == 'box':
        x, y, z = _triple(element, 'size', '', '')
        return (x / 2.0, y / 2.0, z / 2.0)
    if kind == 'cylinder':
        radius = _number(element, 'radius', '', None)
        return (radius, radius, _number(element, 'length', '', None) / 2.0)
    if kind == 'sphere':
        radius = _number(element, 'radius', '', None)
        return (radius, radius, radius)
    return None


def _name(element: Element, what: str, source: str) -> str:
    name = element.get('name', '')
    if not name:
        raise BadConfig(f'{source}: expected a name on every {what}, got one without')
    return name


def _origin(element: Element, where: str) -> tuple[Vector, Matrix]:
    origin = element.find('origin')
    if origin is None:
        return ZERO, IDENTITY
    xyz = _triple(origin, 'xyz', f'{where}/origin', '0 0 0')
    return xyz, rotation_from_rpy(_triple(origin, 'rpy', f'{where}/origin', '0 0 0'))


def rotation_from_rpy(rpy: Vector) -> Matrix:
    """Return the rotation matrix of roll, pitch and yaw (rad) about fixed axes, as in a URDF."""
    if rpy == ZERO:
        return IDENTITY  # without negative zeros
    (sr, sp, sy), (cr, cp, cy) = map(math.sin, rpy), map(math.cos, rpy)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def _axis(element: Element | None, where: str) -> Vector:
    axis = (1.0, 0.0, 0.0) if element is None else _triple(element, 'xyz', where, '1 0 0')
    length = math.hypot(*axis)
    if length < 1e-9:
        raise BadConfig(f'{where}: expected a direction, got {axis[0]:g} {axis[1]:g} {axis[2]:g}')
    x, y, z = (x / length for x in axis)
    return (x, y, z)


def _triple(element: Element, key: str, where: str, default: str) -> Vector:
    text = element.get(key, default)
    parts = text.split()
    if len(parts) != 3:
        raise BadConfig(f'{where}/{key}: expected three numbers, got {shown(text)}{_comma(text)}')
    x, y, z = (_parsed(part, f'{where}/{key}') for part in parts)
    return (x, y, z)


def _number(element: Element | None, key: str, where: str, default: float | None) -> float:
    text = None if element is None else element.get(key)
    if text is None:
        if default is None:
            raise BadConfig(f'{where}/{key}: expected a number, got none')
        return default
    return _parsed(text, f'{where}/{key}')


def _parsed(text: str, where: str) -> float:
    number = _float(text)
    if not -LARGEST <= number <= LARGEST:
        raise BadConfig(
            f'{where}: expected a finite number below {LARGEST:g}, got {shown(text)}{_comma(text)}'
        )
    return number


def _boundless(limit: Element, key: str, where: str) -> float:
    """Return a number of a limit, 0 if missing; infinite beyond LARGEST: exporters write 1e30."""
    number = _float(limit.get(key, '0'))
    return (
        math.copysign(math.inf, number)
        if abs(number) > LARGEST
        else _number(limit, key, where, 0.0)
    )


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _comma(text: str) -> str:
    return ': numbers have a decimal point, and spaces between them' if ',' in text else ''


def _matrix(m: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Matrix:
    a, b, c = ((float(x), float(y), float(z)) for x, y, z in m)
    return (a, b, c)


def _check_unique(what: str, names: list[str], source: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadConfig(
            f'{source}: expected {what} names once each, got twice: {", ".join(map(cut, twice))}'
        )
