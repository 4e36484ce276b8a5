"""Compiles a formula into Python code for one robot, for floats as well as for arrays.

`compile_kernel` runs a formula once with symbols, removes repeated terms and emits straight-line
code. It runs on Python floats for a live sample and on cache-sized blocks of arrays for a map or a
recording, so each formula is written once. Both follow IEEE 754: a division by zero is infinite or
NaN, never an exception. See docs/decisions/0002-formulas-compiled-per-robot.md.
"""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.model.expressions import Expr, Number, Scalar, minimum

# What a formula returns: scalars, or tuples of them nested as the caller wants them.
Outputs = Sequence[Any]


@dataclass(frozen=True, eq=False)
class Kernel:
    """A compiled formula: `one` takes floats, `many` takes arrays (or floats) that broadcast.

    Both return tuples nested as the formula's; an output that is constant for this robot is a
    float in either. Each is compiled when first asked for: most kernels are used in one form.
    `source` is the generated code, of `lines` that return something for `arguments`.
    """

    arguments: str
    lines: tuple[str, ...]

    @property
    def source(self) -> str:
        """The generated code of `many`."""
        return '\n    '.join([f'def kernel({self.arguments}):', *self.lines, ''])

    @cached_property
    def one(self) -> Callable[..., tuple[Any, ...]]:
        """The function of floats."""
        return _float_function(self)

    @cached_property
    def many(self) -> Callable[..., tuple[Any, ...]]:
        """The function of arrays."""
        return _function(self.source, _ARRAY)

    def run(self, *inputs: Number) -> tuple[Any, ...]:
        """Call `many` if any input is an array, else `one`."""
        if np.ndarray not in map(type, inputs):
            return self.one(*inputs)
        with np.errstate(all='ignore'):
            return self.many(*inputs)


def compile_kernel(formula: Callable[..., Outputs], inputs: Sequence[str]) -> Kernel:
    """Compile `formula`, a function of len(inputs) scalars, into a Kernel."""
    known: dict[Any, Expr] = {}
    symbols = [Expr('input', (), known) for _ in inputs]
    outputs = formula(*symbols)
    order, uses = _reachable(list(_flat(outputs)))
    emitter = _Emitter(uses, names={id(s): f'x{i}' for i, s in enumerate(symbols)})
    turned = {id(x.args[0]) for x in order if x.op == 'sin'}
    turned &= {id(x.args[0]) for x in order if x.op == 'cos'}
    for x in order:
        if x.op in {'sin', 'cos'} and id(x.args[0]) in turned:
            emitter.assign_both(x)
        elif x.op != 'input':
            emitter.assign(x)
    arguments = ', '.join(f'x{i}' for i in range(len(symbols)))
    return Kernel(arguments, (*emitter.lines, f'return {emitter.result(outputs)}'))


def _float_function(kernel: Kernel) -> Callable[..., tuple[float, ...]]:
    """Return the compiled function of floats; where Python would raise, it asks numpy instead."""

    def ieee(*values: float) -> tuple[Any, ...]:
        with np.errstate(all='ignore'):
            return kernel.many(*map(np.float64, values))

    body = '\n        '.join(['    try:', *kernel.lines])
    rescue = f'    except (ValueError, ZeroDivisionError):\n        return ieee({kernel.arguments})'
    source = f'def kernel({kernel.arguments}):\n{body}\n{rescue}\n'
    source = re.sub(r'sincos\((\w+)\)', r'sin(\1), cos(\1)', source)
    return _function(source, {**_FLOAT, 'ieee': ieee})


def _flat(outputs: Outputs) -> Iterator[Scalar]:
    for x in outputs:
        if isinstance(x, Expr | float):
            yield x
        else:
            yield from _flat(x)


def _reachable(outputs: Sequence[Scalar]) -> tuple[list[Expr], Counter[int]]:
    """Return the operations the outputs depend on, arguments first, and how often each is used."""
    order: list[Expr] = []
    uses = Counter(map(id, outputs))
    seen: set[int] = set()
    stack: list[tuple[Scalar, bool]] = [(x, False) for x in reversed(outputs)]
    while stack:
        x, done = stack.pop()
        if isinstance(x, float) or (not done and id(x) in seen):
            continue
        if done:
            order.append(x)
            continue
        seen.add(id(x))
        stack.append((x, True))
        uses.update(map(id, x.args))
        stack += [(arg, False) for arg in x.args]
    return order, uses


@dataclass(slots=True)
class _Emitter:
    """Writes straight-line code; reuses a variable's name once its value is not needed any more."""

    uses: Counter[int]
    lines: list[str] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)
    free: list[str] = field(default_factory=list)

    def text(self, x: Scalar) -> str:
        if isinstance(x, float):
            return f'({float(x)!r})'
        name = self.names[id(x)]
        self.uses[id(x)] -= 1
        if self.uses[id(x)] == 0 and name.startswith('t'):
            self.free.append(name)
        return name

    def name(self, x: Expr) -> str:
        if not self.free:
            self.free.append(f't{len(self.names)}')
        self.names[id(x)] = self.free.pop()
        return self.names[id(x)]

    def assign(self, x: Expr) -> None:
        a = [self.text(arg) for arg in x.args]
        if x.op in '+-*/':
            code = f'{a[0]} {x.op} {a[1]}'
        elif x.op == 'neg':
            code = f'-{a[0]}'
        else:
            code = f'{x.op}({", ".join(a)})'
        self.lines.append(f'{self.name(x)} = {code}')

    def assign_both(self, x: Expr) -> None:
        """Compute sine and cosine of one angle in one line, at the first use of either."""
        if id(x) in self.names:
            return
        (angle,) = x.args
        pair = [x.known[(op, id(angle))] for op in ('sin', 'cos')]
        self.text(angle)
        argument = self.text(angle)
        s, c = (self.name(part) for part in pair)
        self.lines.append(f'{s}, {c} = sincos({argument})')

    def result(self, x: Scalar | Outputs) -> str:
        if isinstance(x, Expr | float):
            return self.text(x)
        return f'({"".join(f"{self.result(part)}, " for part in x)})'


def _sincos(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return sine and cosine, exact to 4e-16, by the half-angle tangent.

    numpy's tangent is vectorised, its sine and cosine of doubles are not.
    """
    t = np.tan(0.5 * x)
    d = 2.0 / (1.0 + t * t)
    return t * d, d - 1.0


_FLOAT = {
    'sin': math.sin,
    'cos': math.cos,
    'sqrt': math.sqrt,
    'atan2': math.atan2,
    'copysign': math.copysign,
    'minimum': minimum,
}
_ARRAY = {
    'sin': np.sin,
    'cos': np.cos,
    'sincos': _sincos,
    'sqrt': np.sqrt,
    'atan2': np.arctan2,
    'copysign': np.copysign,
    'minimum': np.minimum,
}


def _function(source: str, functions: dict[str, Any]) -> Callable[..., tuple[Any, ...]]:
    """Compile the source of a function; it contains only our own names and numbers."""
    scope: dict[str, Any] = {'inf': math.inf, 'nan': math.nan, **functions}
    exec(compile(source, '<kernel>', 'exec'), scope)  # noqa: S102 - nothing foreign in the source
    function: Callable[..., tuple[Any, ...]] = scope['kernel']
    return function
