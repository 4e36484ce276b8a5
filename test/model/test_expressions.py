"""Compiled formulas: the same values as the formula itself, on floats and on arrays."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import assume, given

from ugv_acceptance.model.expressions import (
    Mat,
    Scalar,
    Vec,
    add,
    atan2,
    copysign,
    cos,
    cross,
    dot,
    matmul,
    minimum,
    rotate,
    scale,
    sin,
    sqrt,
    subtract,
    transpose,
)
from ugv_acceptance.model.kernels import compile_kernel

EPS = 2.0**-52
TRIG = 1e-15  # error of a vectorised sine or cosine
INPUTS = 3
CONSTANTS = (0.0, -0.0, 1.0, -1.0, 2.0, 0.5, -0.75, math.pi)
OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    'neg': lambda x, _: -x,
    'sin': lambda x, _: sin(x),
    'cos': lambda x, _: cos(x),
    'root': lambda x, _: sqrt(x * x + 1.0),
    '+': lambda x, y: x + y,
    '-': lambda x, y: x - y,
    '*': lambda x, y: x * y,
    '/': lambda x, y: x / (y * y + 0.5),
    'atan2': atan2,
    'copysign': copysign,
    'minimum': minimum,
}

# One line of a program: an operation on two earlier values.
Line = tuple[str, int, int]


def programs() -> st.SearchStrategy[list[Line]]:
    """Straight-line programs: values are the inputs, the constants, then one a line."""
    line = st.tuples(
        st.sampled_from(sorted(OPERATIONS)), st.integers(0, 1000), st.integers(0, 1000)
    )
    return st.lists(line, min_size=1, max_size=25)


def formula(program: Sequence[Line], inputs: Sequence[Scalar]) -> list[Scalar]:
    """Run a program on scalars of any kind; return the value of every line."""
    values = [*inputs, *CONSTANTS]
    start = len(values)
    for op, i, j in program:
        x, y = values[i % len(values)], values[j % len(values)]
        values.append(OPERATIONS[op](x, y))
    return values[start:]


def bounded(program: Sequence[Line], inputs: Sequence[float]) -> list[tuple[float, float]]:
    """Return value and rounding error bound of every line; reject cases beside a discontinuity."""
    values = [(x, 0.0) for x in (*inputs, *CONSTANTS)]
    start = len(values)
    for op, i, j in program:
        values.append(step(op, values[i % len(values)], values[j % len(values)]))
    return values[start:]


def step(op: str, left: tuple[float, float], right: tuple[float, float]) -> tuple[float, float]:
    """Return one operation's value and error bound."""
    (x, ex), (y, ey) = left, right
    if op in {'atan2', 'copysign'}:
        assume(abs(y) > 4.0 * ey and (op == 'copysign' or y > 0.0 or abs(x) > 4.0 * ex))
        assume(y != 0.0 and abs(x) + abs(y) < 1e6)
    size = math.hypot(x, y)
    square = y * y + 0.5
    of_square = 2.0 * abs(y) * ey + ey * ey + 2.0 * EPS * square
    table = {
        'neg': lambda: (-x, ex),
        'sin': lambda: (math.sin(x), ex + TRIG),
        'cos': lambda: (math.cos(x), ex + TRIG),
        'root': lambda: (math.hypot(x, 1.0), ex + 4.0 * EPS * math.hypot(x, 1.0)),
        '+': lambda: (x + y, ex + ey),
        '-': lambda: (x - y, ex + ey),
        '*': lambda: (x * y, abs(x) * ey + abs(y) * ex + ex * ey),
        '/': lambda: (x / square, (ex + abs(x) / square * of_square) / square),
        'atan2': lambda: (math.atan2(x, y), (ex + ey) / (0.5 * size) + 4.0 * EPS),
        'copysign': lambda: (math.copysign(x, y), ex),
        'minimum': lambda: (min(x, y), max(ex, ey)),
    }
    value, error = table[op]()
    assume(abs(value) < 1e12)
    return value, error + 2.0 * EPS * abs(value)


numbers = st.floats(-4.0, 4.0, allow_subnormal=False)
samples = st.lists(st.tuples(*[numbers] * INPUTS), min_size=1, max_size=4)


@given(programs(), st.tuples(*[numbers] * INPUTS))
def test_a_kernel_on_floats_gives_the_formula(
    program: list[Line], inputs: tuple[float, ...]
) -> None:
    """Every line of a random program comes out of the compiled code as it comes out of math."""
    expected = bounded(program, inputs)
    kernel = compile_kernel(lambda *x: formula(program, x), ['x'] * INPUTS)
    for value, (exact, error) in zip(kernel.one(*inputs), expected, strict=True):
        assert abs(value - exact) <= 16.0 * error + 1e-300


@given(programs(), samples)
def test_a_kernel_on_arrays_gives_the_formula(
    program: list[Line], inputs: list[tuple[float, ...]]
) -> None:
    """So does each sample of an array."""
    expected = [bounded(program, x) for x in inputs]
    kernel = compile_kernel(lambda *x: formula(program, x), ['x'] * INPUTS)
    columns = [np.array(column) for column in zip(*inputs, strict=True)]
    for k, value in enumerate(kernel.run(*columns)):
        for row, x in enumerate(np.broadcast_to(value, len(inputs))):
            exact, error = expected[row][k]
            assert abs(x - exact) <= 16.0 * error + 1e-300


@given(programs(), st.integers(0, 24))
def test_what_is_not_asked_for_does_not_change_what_is(program: list[Line], last: int) -> None:
    """One output compiled alone equals the same output among all: no name is overwritten alive."""
    last %= len(program)
    inputs = (0.3, -1.7, 2.9)
    everything = compile_kernel(lambda *x: formula(program, x), ['x'] * INPUTS)
    alone = compile_kernel(lambda *x: [formula(program, x)[last]], ['x'] * INPUTS)
    assert alone.one(*inputs)[0] == pytest.approx(
        everything.one(*inputs)[last], rel=1e-9, abs=1e-9, nan_ok=True
    )


def test_constants_are_folded() -> None:
    """Products with 0 and 1, sums with 0 and functions of constants leave no code behind."""
    kernel = compile_kernel(
        lambda x, y: [x * 1.0 + y * 0.0, -(0.0 - x) - 0.0, sin(0.0) * y, 2.0 * (0.5 * x)],
        ['x', 'y'],
    )
    assert ' '.join(kernel.source.split()) == 'def kernel(x0, x1): return (x0, x0, (0.0), x0, )'


def test_what_is_written_twice_is_computed_once() -> None:
    """Both x y and y x are one product; a sine and a cosine of one angle are one call."""
    kernel = compile_kernel(lambda x, y: [x * y + sin(x), y * x + cos(x)], ['x', 'y'])
    assert kernel.source.count('*') == 1
    assert kernel.source.count('sincos(') == 1
    assert kernel.one(2.0, 3.0) == (6.0 + math.sin(2.0), 6.0 + math.cos(2.0))


def test_the_sign_of_a_constant_zero_is_kept() -> None:
    """atan2 tells 0.0 from -0.0, though they are equal."""
    kernel = compile_kernel(lambda x: [atan2(0.0, x), atan2(-0.0, x)], ['x'])
    assert kernel.one(-1.0) == (math.pi, -math.pi)


def test_outputs_keep_their_nesting() -> None:
    """A formula that returns tuples of tuples gives them, on floats and on arrays."""
    kernel = compile_kernel(lambda x: [(x, (2.0 * x,)), 1.0], ['x'])
    assert kernel.run(3.0) == ((3.0, (6.0,)), 1.0)
    (x, (y,)), z = kernel.run(np.array([3.0, 4.0]))
    assert (x.tolist(), y.tolist(), z) == ([3.0, 4.0], [6.0, 8.0], 1.0)


@pytest.mark.parametrize('x', [0.0, math.inf, -math.inf, math.nan])
def test_no_number_raises(x: float) -> None:
    """Division by zero, the sine of infinity and NaN follow IEEE 754, on floats as on arrays."""
    kernel = compile_kernel(lambda x: [1.0 / x, sin(x), sqrt(x - 1.0), cos(x) / x], ['x'])
    one, many = kernel.run(x), kernel.run(np.array([x]))
    np.testing.assert_allclose(one, np.ravel(many), rtol=1e-15)


@pytest.mark.parametrize(('x', 'y'), [(math.nan, 1.0), (1.0, math.nan)])
def test_the_smaller_of_nan_and_a_number_is_nan(x: float, y: float) -> None:
    """An unknown margin is never hidden by a known one."""
    kernel = compile_kernel(lambda x, y: [minimum(x, y)], ['x', 'y'])
    assert math.isnan(kernel.run(x, y)[0])
    assert np.isnan(kernel.run(np.array([x]), np.array([y]))[0]).all()


# A formula of x and y, and how many operations are left of it.
FOLDED: list[tuple[Callable[[Any, Any], Any], int]] = [
    (lambda x, _: x + 0.0, 0),
    (lambda x, _: 0.0 + x, 0),
    (lambda x, _: x - 0.0, 0),
    (lambda x, _: x - x, 0),
    (lambda x, _: x * 1.0, 0),
    (lambda x, _: x * 0.0, 0),
    (lambda x, _: 0.0 / x, 0),
    (lambda x, _: -(0.0 - x), 0),
    (lambda x, _: -1.0 * (-1.0 * x), 0),
    (lambda x, _: 0.0 - (0.0 - x), 0),
    (lambda x, _: (0.25 * x) * 4.0, 0),
    (lambda x, _: x + 1.0, 1),
    (lambda x, _: x - 1.0, 1),
    (lambda x, _: 1.0 - x, 1),
    (lambda x, _: 1.0 / x, 1),
    (lambda x, _: x / 1.0, 1),
    (lambda x, _: -x * 3.0, 1),
    (lambda x, _: 3.0 * (2.0 * x), 1),
    (lambda x, _: -(3.0 * x), 1),
    (lambda x, _: -3.0 * (-2.0 * x), 1),
    (lambda x, y: x + (-y), 1),
    (lambda x, y: (-x) + y, 1),
    (lambda x, y: x - (-y), 1),
    (lambda x, y: -(x - y), 1),
    (lambda x, y: (-x) * (-y), 1),
    (lambda x, y: (-x) * (-1.0 * y), 1),
    (lambda x, y: -((-x) * y), 1),
    (lambda x, y: -(x * (-y)), 1),
    (lambda x, y: (x + y) - (y + x), 0),
    (lambda x, y: -(x * y), 2),
    (lambda x, y: -(x + y), 2),
    (lambda x, y: (x * y) * 2.0, 2),
    (lambda x, y: (x - y) * (x - y), 2),
    (lambda x, y: (x - y) * (y - x), 3),
]


@pytest.mark.parametrize('case', range(len(FOLDED)))
def test_no_operation_is_left_that_could_be_spared(case: int) -> None:
    """Neutral constants, double signs and constants of one product cost nothing."""
    formula, operations = FOLDED[case]
    kernel = compile_kernel(lambda x, y: [formula(x, y)], ['x', 'y'])
    assert kernel.source.count(' = ') == operations
    for x, y in ((1.5, -0.25), (-0.75, 2.0), (3.0, 1.25)):
        assert kernel.one(x, y)[0] == pytest.approx(formula(x, y), rel=1e-15)


def test_constants_equal_by_their_digits_are_one() -> None:
    """Two numbers written apart: one product."""
    halves = [float(text) for text in ('0.5', '5e-1')]
    kernel = compile_kernel(lambda x: [x * halves[0], halves[1] * x], ['x'])
    assert kernel.source.count('*') == 1


@pytest.mark.parametrize('x', [-0.5, 0.5, 2.0])
def test_a_function_of_a_number_and_a_symbol_is_not_folded(x: float) -> None:
    """Whichever of the two comes first."""

    def formula(x: Scalar) -> list[Scalar]:
        return [
            atan2(1.0, x), atan2(x, 1.0), copysign(2.0, x), copysign(x, -1.0),
            minimum(0.75, x), minimum(x, 0.75),
        ]  # fmt: skip

    expected = [
        math.atan2(1.0, x), math.atan2(x, 1.0), math.copysign(2.0, x), math.copysign(x, -1.0),
        min(0.75, x), min(x, 0.75),
    ]  # fmt: skip
    assert compile_kernel(formula, ['x']).one(x) == tuple(expected)
    assert formula(x) == expected


@pytest.mark.parametrize(('x', 'y'), [(math.nan, 1.0), (1.0, math.nan), (math.nan, math.nan)])
def test_minimum_of_numbers_is_nan_with_nan(x: float, y: float) -> None:
    """As numpy's."""
    assert math.isnan(float(minimum(x, y)))  # type: ignore[arg-type]


def test_vectors_and_matrices_are_numpy_s() -> None:
    """Sums, products, rotations and transposes of numbers."""
    rng = np.random.default_rng(0)
    (a, b), (m, n) = rng.normal(size=(2, 3)), rng.normal(size=(2, 3, 3))
    u, v = vector(a), vector(b)
    p, q = matrix(m), matrix(n)
    assert dot(u, v) == pytest.approx(a @ b)
    for ours, theirs in (
        (cross(u, v), np.cross(a, b)), (add(u, v), a + b), (subtract(u, v), a - b),
        (scale(u, 3.0), 3.0 * a), (rotate(p, v), m @ b), (transpose(p), m.T), (matmul(p, q), m @ n),
    ):  # fmt: skip
        np.testing.assert_allclose(np.array(ours), theirs, rtol=1e-13)


def vector(values: Any) -> Vec:
    """Return three numbers as a tuple."""
    x, y, z = (float(value) for value in values)
    return x, y, z


def matrix(rows: Any) -> Mat:
    """Return three rows as tuples."""
    a, b, c = map(vector, rows)
    return a, b, c
