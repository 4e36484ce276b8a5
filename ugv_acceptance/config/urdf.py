"""Reads a URDF: links, masses, joints, limits, collision and visual geometry.

Parsed by defusedxml, which refuses entities and external files.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree.ElementTree import Element, ParseError

import numpy as np
from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from ugv_acceptance import BadConfig
from ugv_acceptance.config.units import LARGEST, shown
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

    `shapes` is the collision geometry of all links, `visuals` the geometry they are drawn with.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    mimics: tuple[Mimic, ...]
    warnings: tuple[str, ...]
    shapes: tuple[Shape, ...] = ()
    visuals: tuple[Shape, ...] = ()


def read_urdf(text: bytes, source: str) -> Urdf:
    """Parse the links, joints and limits of a URDF; `source` names the file in errors.

    Raises BadConfig if it is not a URDF, a number is unusable, or the joints are not one tree.
    """
    root = _parse(text, source)
    warnings: list[str] = []
    links = tuple(_link(e, source, warnings) for e in root.findall('link'))
    joints = tuple(_joint(e, source, warnings) for e in root.findall('joint'))
    _check_unique('link', [link.name for link in links], source)
    _check_unique('joint', [joint.name for joint in joints], source)
    _check_tree(links, joints, source)
    mimics = tuple(_mimics(root, joints, source))
    shapes, visuals = tuple(_shapes(root, 'collision')), tuple(_shapes(root, 'visual'))
    name = root.get('name') or 'robot'
    return Urdf(name, links, joints, mimics, tuple(warnings), shapes, visuals)


def _parse(text: bytes, source: str) -> Element:
    try:
        root: Element = fromstring(text, forbid_dtd=True)
    except DefusedXmlException:
        raise BadConfig(
            f'{source}: expected a URDF, got XML with a DTD or entities, which are refused'
        ) from None
    except (ParseError, ValueError, LookupError) as error:
        raise BadConfig(f'{source}: expected a URDF (XML), got {shown(str(error))}') from None
    if root.tag != 'robot':
        raise BadConfig(f'{source}: expected the root element <robot>, got <{shown(root.tag)}>')
    if any(isinstance(e.tag, str) and 'xacro' in e.tag for e in root.iter()):
        raise BadConfig(f'{source}: expected a URDF, got xacro macros: run xacro on it first')
    return root


def _link(element: Element, source: str, warnings: list[str]) -> Link:
    name = _name(element, 'link', source)
    inertial = element.find('inertial')
    if inertial is None:
        return Link(name)
    where = f'{source}: link {name}: inertial'
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
    where = f'{source}: joint {name}'
    kind = element.get('type', '')
    if kind not in KINDS:
        raise BadConfig(
            f'{where}: expected the type {", ".join(KINDS)}, got {shown(kind)}:'
            ' a joint of several degrees of freedom has to be written as several joints'
        )
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
    if kind in ('continuous', 'fixed'):
        return -math.inf, math.inf
    if limit is None:
        warnings.append(f'{where}: none given for a {kind} joint: taken as unlimited')
        return -math.inf, math.inf
    lower, upper = (_number(limit, key, where, 0.0) for key in ('lower', 'upper'))
    if lower > upper:
        raise BadConfig(f'{where}: expected lower <= upper, got {lower:g} and {upper:g}')
    if lower == upper:
        warnings.append(f'{where}: lower and upper are both {lower:g}: taken as unlimited')
        return -math.inf, math.inf
    return lower, upper


def _limit(limit: Element | None, key: str, where: str) -> float:
    """Return an effort or velocity limit; infinite if it is missing or 0."""
    if limit is None:
        return math.inf
    value = _number(limit, key, where, 0.0)
    if value < 0.0:
        raise BadConfig(f'{where}/{key}: expected a limit >= 0, got {value:g}')
    return value or math.inf


def _mimics(root: Element, joints: tuple[Joint, ...], source: str) -> Iterable[Mimic]:
    """Yield the joints that follow others; BadConfig where one follows none, or itself."""
    follows = {}
    movable = {joint.name for joint in joints if joint.kind != 'fixed'}
    for element in root.findall('joint'):
        mimic, name = element.find('mimic'), element.get('name', '')
        if mimic is None or name not in movable:
            continue
        where, of = f'{source}: joint {name}/mimic', mimic.get('joint', '')
        if of not in movable:
            raise BadConfig(f'{where}: expected a movable joint, got {shown(of)}')
        factor = _number(mimic, 'multiplier', where, 1.0)
        follows[name] = Mimic(name, of, factor, _number(mimic, 'offset', where, 0.0))
    for name in follows:
        seen = [name]
        while (at := seen[-1]) in follows:
            if follows[at].follows in seen:
                raise BadConfig(f'{source}: joint {name}/mimic: the joints follow each other')
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
        raise BadConfig(f'{where}/{key}: expected three numbers, got {shown(text)}')
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
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not -LARGEST <= number <= LARGEST:
        raise BadConfig(f'{where}: expected a finite number below {LARGEST:g}, got {shown(text)}')
    return number


def _matrix(m: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Matrix:
    a, b, c = ((float(x), float(y), float(z)) for x, y, z in m)
    return (a, b, c)


def _check_unique(what: str, names: list[str], source: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadConfig(f'{source}: expected {what} names once each, got twice: {", ".join(twice)}')


def _check_tree(links: tuple[Link, ...], joints: tuple[Joint, ...], source: str) -> None:
    """Raise BadConfig for missing links, links with two parents, cycles and several roots."""
    names = {link.name for link in links}
    parent_of: dict[str, str] = {}
    for joint in joints:
        for end in (joint.parent, joint.child):
            if end not in names:
                raise BadConfig(f'{source}: joint {joint.name}: link {shown(end)} does not exist')
        if joint.child in parent_of:
            raise BadConfig(f'{source}: joint {joint.name}: link {joint.child} has two parents')
        parent_of[joint.child] = joint.parent
    roots = [link.name for link in links if link.name not in parent_of]
    if len(roots) != 1:
        got = ', '.join(roots[:5]) or ('none: the joints are a cycle' if links else 'no link')
        raise BadConfig(f'{source}: expected one root link, got {got}')
    for name in parent_of:
        seen, at = {name}, name
        while at in parent_of:
            at = parent_of[at]
            if at in seen:
                raise BadConfig(f'{source}: joints are a cycle through link {at}')
            seen.add(at)
