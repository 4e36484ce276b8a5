"""Symbolic scalars, and the vector functions in which the formulas of the model are written.

A formula is an ordinary function of scalars (`x * y + sin(z)`). Run with floats it gives floats;
run with symbols it records its operations, and `kernels.compile_kernel` turns the record into code.
Constants are folded and signs moved out of products meanwhile, so that axis-aligned joints, fixed
links and missing velocities cost nothing.

Folding drops `0 * x` and `x - x`, so a NaN in a joint that cannot matter does not spread: callers
must check their inputs themselves. Constants of one product are multiplied first, so the last digit
may differ from that of the formula run with floats.
"""

import math
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

Number = Union[float, 'NDArray[np.float64]']
Scalar = Union['Expr', float]
Vec = tuple[Scalar, Scalar, Scalar]
Mat = tuple[Vec, Vec, Vec]


class Expr:
    """A symbolic scalar: an operation on other scalars, recorded for `compile_kernel`."""

    __slots__ = ('args', 'known', 'op')

    def __init__(self, op: str, args: tuple[Scalar, ...], known: dict[Any, 'Expr']) -> None:
        self.op = op
        self.args = args
        self.known = known

    def __add__(self, other: Scalar) -> Scalar:
        if _is(other, 0.0):
            return self
        if isinstance(other, Expr) and other.op == 'neg':
            return self - other.args[0]
        if self.op == 'neg':
            return other - self.args[0]
        return _node('+', self, other)

    __radd__ = __add__

    def __sub__(self, other: Scalar) -> Scalar:
        if other is self:
            return 0.0
        if _is(other, 0.0):
            return self
        if isinstance(other, Expr) and other.op == 'neg':
            return self + other.args[0]
        return _node('-', self, other)

    def __rsub__(self, other: Scalar) -> Scalar:
        return -self if _is(other, 0.0) else _node('-', other, self)

    def __mul__(self, other: Scalar) -> Scalar:
        if isinstance(other, float):
            return self._times(other)
        if self.op == 'neg':
            return -(self.args[0] * other)
        if other.op == 'neg':
            return -(self * other.args[0])
        return _node('*', self, other)

    __rmul__ = __mul__

    def _times(self, factor: float) -> Scalar:
        if factor == 0.0:
            return 0.0
        if factor == 1.0:
            return self
        if self.op == 'neg':
            return self.args[0] * -factor
        if factor == -1.0:
            return -self
        if self.op == '*' and isinstance(self.args[0], float):
            return self.args[1] * (self.args[0] * factor)
        return _node('*', factor, self)

    def __truediv__(self, other: Scalar) -> Scalar:
        return _node('/', self, other)

    def __rtruediv__(self, other: Scalar) -> Scalar:
        return 0.0 if _is(other, 0.0) else _node('/', other, self)

    def __neg__(self) -> Scalar:
        if self.op == 'neg':
            return self.args[0]
        if self.op == '-':
            return self.args[1] - self.args[0]
        if self.op == '*' and isinstance(self.args[0], float):
            return self.args[1] * -self.args[0]
        return _node('neg', self)


def _is(x: Scalar, value: float) -> bool:
    return isinstance(x, float) and x == value


def _node(op: str, *args: Scalar) -> Expr:
    """Return the node of an operation, the same one each time: a repeated term is computed once."""
    if op in '+*' and _order(args[1]) < _order(args[0]):
        args = (args[1], args[0])
    known = next(a.known for a in args if isinstance(a, Expr))
    # A float by its digits: 0.0 and -0.0 are equal, but not to atan2 and copysign.
    key = (op, *(repr(a) if isinstance(a, float) else id(a) for a in args))
    found = known.get(key)
    if found is None:
        found = known[key] = Expr(op, args, known)
    return found


def _order(x: Scalar) -> tuple[int, float]:
    return (0, x) if isinstance(x, float) else (1, float(id(x)))


def sin(x: Scalar) -> Scalar:
    """Return the sine of x (rad); of an array too, for robots that are used only once."""
    if isinstance(x, np.ndarray):
        return np.sin(x)  # type: ignore[return-value]  # Scalar leaves arrays out
    return math.sin(x) if isinstance(x, float) else _node('sin', x)


def cos(x: Scalar) -> Scalar:
    """Return the cosine of x (rad); of an array too."""
    if isinstance(x, np.ndarray):
        return np.cos(x)  # type: ignore[return-value]
    return math.cos(x) if isinstance(x, float) else _node('cos', x)


def sqrt(x: Scalar) -> Scalar:
    """Return the square root of x; of an array too."""
    if isinstance(x, np.ndarray):
        return np.sqrt(x)  # type: ignore[return-value]
    return math.sqrt(x) if isinstance(x, float) else _node('sqrt', x)


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Return the angle (rad) of the point (x, y)."""
    if isinstance(y, float) and isinstance(x, float):
        return math.atan2(y, x)
    return _node('atan2', y, x)


def copysign(x: Scalar, y: Scalar) -> Scalar:
    """Return |x| with the sign of y; of arrays too."""
    if isinstance(x, np.ndarray):
        return np.copysign(x, y)  # type: ignore[arg-type,return-value]
    if isinstance(y, float) and isinstance(x, float):
        return math.copysign(x, y)
    return _node('copysign', x, y)


def minimum(x: Scalar, y: Scalar) -> Scalar:
    """Return the smaller of two; NaN where either is NaN."""
    if isinstance(x, float) and isinstance(y, float):
        return x if math.isnan(x) else min(y, x)
    return _node('minimum', x, y)


def dot(a: Vec, b: Vec) -> Scalar:
    """Return the scalar product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vec, b: Vec) -> Vec:
    """Return the vector product a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def add(a: Vec, b: Vec) -> Vec:
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vec, b: Vec) -> Vec:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vec, factor: Scalar) -> Vec:
    """Return a times a factor."""
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def rotate(r: Mat, v: Vec) -> Vec:
    """Return the rotation matrix `r` applied to `v`."""
    return (dot(r[0], v), dot(r[1], v), dot(r[2], v))


def transpose(r: Mat) -> Mat:
    """Return the transposed matrix."""
    return (
        (r[0][0], r[1][0], r[2][0]),
        (r[0][1], r[1][1], r[2][1]),
        (r[0][2], r[1][2], r[2][2]),
    )


def matmul(a: Mat, b: Mat) -> Mat:
    """Return the matrix product a b."""
    t = transpose(b)
    return (rotate(t, a[0]), rotate(t, a[1]), rotate(t, a[2]))
