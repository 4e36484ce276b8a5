"""Encodes diagnostics, markers, polygons and points for viewers as CDR, without ROS."""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import chain

from ugv_acceptance.bag.encode import message_head, put_count, put_floats, put_text

Point = tuple[float, float, float]
Colour = tuple[float, float, float, float]

_NS = 1_000_000_000
_STAMP = struct.Struct('<iI')
# Pose and scale of a marker, and its colour.
_PLACE = struct.Struct('<10d4f')
_HEAD = b'\x00\x01\x00\x00'
# Marker.action.
_ADD, _DELETE = 0, 2


@dataclass(frozen=True, slots=True)
class Shape:
    """A shape for a viewer, sent as one marker: `points` (m), or a `text` at `position` (m).

    `kind` is the number in visualization_msgs/Marker; `colours` has one per point, or is empty;
    `size` (m) is the width of lines, the diameter of spheres, the height of letters. Without points
    and text the marker of this name is deleted.
    """

    name: str
    kind: int
    colour: Colour
    size: float
    points: tuple[Point, ...] = ()
    colours: tuple[Colour, ...] = ()
    text: str = ''
    position: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """The fields of a diagnostic_msgs/DiagnosticStatus; `level` is 0 to 3 (OK to STALE)."""

    level: int
    name: str
    message: str
    hardware_id: str
    values: Mapping[str, str]


def diagnosis_cdr(diagnosis: Diagnosis) -> bytes:
    """Encode a diagnostic_msgs/DiagnosticStatus."""
    out = bytearray(_HEAD)
    _put_diagnosis(out, diagnosis)
    return bytes(out)


def diagnoses_cdr(stamp_ns: int, diagnoses: Sequence[Diagnosis]) -> bytes:
    """Encode a diagnostic_msgs/DiagnosticArray."""
    out = message_head(stamp_ns, '')
    put_count(out, len(diagnoses))
    for diagnosis in diagnoses:
        _put_diagnosis(out, diagnosis)
    return bytes(out)


def _put_diagnosis(out: bytearray, diagnosis: Diagnosis) -> None:
    out.append(diagnosis.level)
    for text in (diagnosis.name, diagnosis.message, diagnosis.hardware_id):
        put_text(out, text)
    put_count(out, len(diagnosis.values))
    for text in chain.from_iterable(diagnosis.values.items()):
        put_text(out, text)


def markers_cdr(stamp_ns: int, frame_id: str, lifetime_s: float, shapes: Sequence[Shape]) -> bytes:
    """Encode a visualization_msgs/MarkerArray; its shapes vanish after `lifetime_s` seconds."""
    out = bytearray(_HEAD)
    put_count(out, len(shapes))
    stamp, lifetime = _time(stamp_ns), _time(round(lifetime_s * _NS))
    for shape in shapes:
        _put_marker(out, stamp, frame_id, lifetime, shape)
    return bytes(out)


def polygon_cdr(stamp_ns: int, frame_id: str, points: Sequence[Point]) -> bytes:
    """Encode a geometry_msgs/PolygonStamped (m), whose coordinates are single floats."""
    out = message_head(stamp_ns, frame_id)
    put_count(out, len(points))
    out += struct.pack(f'<{3 * len(points)}f', *chain.from_iterable(points))
    return bytes(out)


def point_cdr(stamp_ns: int, frame_id: str, point: Point) -> bytes:
    """Encode a geometry_msgs/PointStamped (m)."""
    out = message_head(stamp_ns, frame_id)
    put_floats(out, point, 3)
    return bytes(out)


def _time(ns: int) -> bytes:
    return _STAMP.pack(*divmod(ns, _NS))


def _put_marker(out: bytearray, stamp: bytes, frame_id: str, lifetime: bytes, shape: Shape) -> None:
    _align(out)
    action = _ADD if shape.points or shape.text else _DELETE
    out += stamp + _named(frame_id, shape.name, shape.kind, action)
    out += bytes(-(len(out) - 4) % 8)
    size = shape.size
    out += _PLACE.pack(*shape.position, 0.0, 0.0, 0.0, 1.0, size, size, size, *shape.colour)
    out += lifetime + bytes(4)  # frame_locked
    put_count(out, len(shape.points))
    put_floats(out, tuple(chain.from_iterable(shape.points)))
    put_count(out, len(shape.colours))
    out += struct.pack(f'<{4 * len(shape.colours)}f', *chain.from_iterable(shape.colours))
    out += _no_texture()
    put_text(out, shape.text)
    _align(out)
    out += _no_mesh()


@lru_cache(maxsize=256)
def _named(frame_id: str, name: str, kind: int, action: int) -> bytes:
    """Return a marker's frame, name, number, kind and action, from a multiple of four on."""
    out = bytearray()
    put_text(out, frame_id)
    put_text(out, name)
    for number in (0, kind, action):
        put_count(out, number)
    return bytes(out)


@cache
def _no_texture() -> bytes:
    """Return a marker's empty texture_resource, texture and uv_coordinates."""
    out = bytearray()
    put_text(out, '')
    _align(out)
    out += _time(0)
    for _ in ('frame_id', 'format'):
        put_text(out, '')
    for _ in ('data', 'uv_coordinates'):
        put_count(out, 0)
    return bytes(out)


@cache
def _no_mesh() -> bytes:
    """Return a marker's empty mesh_resource and mesh_file, and mesh_use_embedded_materials."""
    out = bytearray()
    for _ in ('mesh_resource', 'mesh_file.filename'):
        put_text(out, '')
    put_count(out, 0)  # mesh_file.data
    return bytes(out) + b'\0'


def _align(out: bytearray) -> None:
    out += bytes(-len(out) % 4)
