"""Formulas written once on scalars, specialised to one robot, run on floats or on arrays.

A formula is an ordinary function of scalars (`x * y + sin(z)`). `compile_kernel` runs it once with
symbols, folds what is constant for this robot (zeros of axis-aligned joints, fixed links, missing
velocities), shares what is computed twice, and emits straight-line code. The code runs on Python
floats for a live sample and on cache-sized blocks of arrays for a map or a recording, so there is
one formula and no scalar twin. See docs/decisions/0002-formulas-compiled-per-robot.md.

Folding drops `0 * x`, so a NaN in a joint that cannot matter does not spread; whoever calls must
judge the inputs themselves.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
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
        return self if _is(other, 0.0) else _node('+', self, other)

    __radd__ = __add__

    def __sub__(self, other: Scalar) -> Scalar:
        return self if _is(other, 0.0) else _node('-', self, other)

    def __rsub__(self, other: Scalar) -> Scalar:
        return -self if _is(other, 0.0) else _node('-', other, self)

    def __mul__(self, other: Scalar) -> Scalar:
        if isinstance(other, float):
            if other == 0.0:
                return 0.0
            if other == 1.0:
                return self
            if other == -1.0:
                return -self
        return _node('*', self, other)

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Scalar:
        return _node('/', self, other)

    def __rtruediv__(self, other: Scalar) -> Scalar:
        return 0.0 if _is(other, 0.0) else _node('/', other, self)

    def __neg__(self) -> Scalar:
        return self.args[0] if self.op == 'neg' else _node('neg', self)


def _is(x: Scalar, value: float) -> bool:
    return isinstance(x, float) and x == value


def _node(op: str, *args: Scalar) -> Expr:
    """Return the one node of this operation, so that what is written twice is computed once."""
    if op in '+*' and _order(args[1]) < _order(args[0]):
        args = (args[1], args[0])
    known = next(a.known for a in args if isinstance(a, Expr))
    key = (op, *(a if isinstance(a, float) else id(a) for a in args))
    found = known.get(key)
    if found is None:
        found = known[key] = Expr(op, args, known)
    return found


def _order(x: Scalar) -> tuple[int, float]:
    return (0, x) if isinstance(x, float) else (1, float(id(x)))


def sin(x: Scalar) -> Scalar:
    """Return the sine of x (rad)."""
    return math.sin(x) if isinstance(x, float) else _node('sin', x)


def cos(x: Scalar) -> Scalar:
    """Return the cosine of x (rad)."""
    return math.cos(x) if isinstance(x, float) else _node('cos', x)


def sqrt(x: Scalar) -> Scalar:
    """Return the square root of x."""
    return math.sqrt(x) if isinstance(x, float) else _node('sqrt', x)


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Return the angle (rad) of the point (x, y)."""
    if isinstance(y, float) and isinstance(x, float):
        return math.atan2(y, x)
    return _node('atan2', y, x)


def copysign(x: Scalar, y: Scalar) -> Scalar:
    """Return |x| with the sign of y."""
    if isinstance(y, float) and isinstance(x, float):
        return math.copysign(x, y)
    return _node('copysign', x, y)


def dot(a: Vec, b: Vec) -> Scalar:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vec, b: Vec) -> Vec:
    """Return the vector product."""
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
    """Return the matrix product."""
    t = transpose(b)
    return (rotate(t, a[0]), rotate(t, a[1]), rotate(t, a[2]))


@dataclass(frozen=True, slots=True)
class Kernel:
    """A compiled formula: `one` takes floats, `many` takes arrays (or floats) that broadcast.

    Both return a tuple; an output that is constant for this robot is a float in either.
    """

    source: str
    one: Callable[..., tuple[float, ...]]
    many: Callable[..., tuple[Any, ...]]


@dataclass(slots=True)
class _Emitter:
    """Writes straight-line code; a name is used again as soon as its last value is dead."""

    uses: dict[int, int]
    lines: list[str] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)
    free: list[str] = field(default_factory=list)
    count: int = 0

    def text(self, x: Scalar) -> str:
        if isinstance(x, float):
            return f'({float(x)!r})'
        name = self.names[id(x)]
        self.uses[id(x)] -= 1
        if self.uses[id(x)] == 0 and name.startswith('t'):
            self.free.append(name)
        return name

    def assign(self, x: Expr) -> None:
        a = [self.text(arg) for arg in x.args]
        if x.op in '+-*/':
            code = f'{a[0]} {x.op} {a[1]}'
        elif x.op == 'neg':
            code = f'-{a[0]}'
        else:
            code = f'{x.op}({", ".join(a)})'
        if not self.free:
            self.free.append(f't{self.count}')
            self.count += 1
        self.names[id(x)] = self.free.pop()
        self.lines.append(f'    {self.names[id(x)]} = {code}')


def _reachable(outputs: Sequence[Scalar]) -> tuple[list[Expr], dict[int, int]]:
    """Return the operations the outputs need, arguments first, and how often each is used."""
    order: list[Expr] = []
    uses: dict[int, int] = {}
    seen: set[int] = set()
    stack: list[tuple[Scalar, bool]] = [(x, False) for x in reversed(outputs)]
    for x in outputs:
        uses[id(x)] = uses.get(id(x), 0) + 1
    while stack:
        x, done = stack.pop()
        if isinstance(x, float) or (not done and id(x) in seen):
            continue
        if done:
            order.append(x)
            continue
        seen.add(id(x))
        stack.append((x, True))
        for arg in x.args:
            uses[id(arg)] = uses.get(id(arg), 0) + 1
            stack.append((arg, False))
    return order, uses


def compile_kernel(formula: Callable[..., Sequence[Scalar]], inputs: Sequence[str]) -> Kernel:
    """Return `formula` (a function of len(inputs) scalars to a flat sequence) as a Kernel."""
    known: dict[Any, Expr] = {}
    symbols = [Expr('input', (), known) for _ in inputs]
    outputs = formula(*symbols)
    order, uses = _reachable(outputs)
    emitter = _Emitter(uses, names={id(s): f'x{i}' for i, s in enumerate(symbols)})
    for x in order:
        if x.op != 'input':
            emitter.assign(x)
    result = ''.join(f'{emitter.text(x)}, ' for x in outputs)
    arguments = ', '.join(f'x{i}' for i in range(len(symbols)))
    source = '\n'.join([f'def kernel({arguments}):', *emitter.lines, f'    return ({result})', ''])
    return Kernel(source, _function(source, _FLOAT), _function(source, _ARRAY))


_FLOAT = {
    'sin': math.sin,
    'cos': math.cos,
    'sqrt': math.sqrt,
    'atan2': math.atan2,
    'copysign': math.copysign,
}
_ARRAY = {
    'sin': np.sin,
    'cos': np.cos,
    'sqrt': np.sqrt,
    'atan2': np.arctan2,
    'copysign': np.copysign,
}


def _function(source: str, functions: dict[str, Any]) -> Callable[..., tuple[Any, ...]]:
    """Return the compiled function; the source holds only our own names and numbers."""
    scope: dict[str, Any] = {'inf': math.inf, 'nan': math.nan, **functions}
    exec(compile(source, '<kernel>', 'exec'), scope)  # noqa: S102 - nothing foreign in the source
    function: Callable[..., tuple[Any, ...]] = scope['kernel']
    return function
