"""The code that is written for a formula: few names, each sine with its cosine, right values."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from robots import random_robot

from ugv_acceptance.model.expressions import Scalar, cos, sin, sqrt
from ugv_acceptance.model.kernels import Kernel, compile_kernel
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Contact


def names(kernel: Kernel) -> int:
    """Return how many names the code gives to values of its own."""
    return len(set(re.findall(r'\bt\d+', kernel.source)))


def test_a_name_is_free_as_soon_as_its_value_is_used_up() -> None:
    """A chain of operations needs one name, as few as there are values alive."""
    chain = compile_kernel(lambda x: [sqrt(sqrt(sqrt(x + 1.0) + 1.0) + 1.0)], ['x'])
    assert names(chain) == 1
    assert chain.one(8.0) == (math.sqrt(math.sqrt(3.0 + 1.0) + 1.0),)
    pair = compile_kernel(lambda x, y: [sqrt(x + y) * sqrt(x - y)], ['x', 'y'])
    assert names(pair) == 2
    assert pair.one(5.0, 4.0) == (3.0,)


def test_a_value_lives_until_its_last_use() -> None:
    """As an argument, twice of one operation, and as an output that others are made of."""

    def formula(x: Scalar) -> list[Scalar]:
        a = x + 1.0
        b = a * a
        c = b - a
        return [a, c * b, sqrt(c + a), a]

    kernel = compile_kernel(formula, ['x'])
    assert kernel.one(2.0) == (3.0, 54.0, 3.0, 3.0)
    assert kernel.run(np.array((2.0,)))[1].tolist() == [54.0]


@pytest.mark.parametrize('x', [-4.0, -0.3, 0.0, 0.9, 3.0])
def test_sine_and_cosine_of_one_angle_are_computed_together(x: float) -> None:
    """Where both are asked for, once or more often; alone they are numpy's own."""

    def formula(x: Scalar) -> list[Scalar]:
        return [sin(x), cos(x), sin(2.0 * x), cos(3.0 * x), sin(x) * cos(x)]

    kernel = compile_kernel(formula, ['x'])
    assert kernel.source.count('sincos(') == 1
    assert kernel.source.count('= sin(') == kernel.source.count('= cos(') == 1
    expected = [math.sin(x), math.cos(x), math.sin(2 * x), math.cos(3 * x), math.sin(2 * x) / 2]
    assert kernel.one(x) == pytest.approx(expected, abs=1e-15)
    many = [float(value[0]) for value in kernel.many(np.array((x,)))]
    assert many == pytest.approx(expected, abs=1e-15)


def test_sine_and_cosine_of_arrays_are_as_good_as_numpy_s() -> None:
    """To a few last digits, over several turns."""
    x = np.linspace(-20.0, 20.0, 10_001)
    s, c = compile_kernel(lambda x: [sin(x), cos(x)], ['x']).many(x)
    np.testing.assert_allclose(s, np.sin(x), rtol=0, atol=1e-15)
    np.testing.assert_allclose(c, np.cos(x), rtol=0, atol=1e-15)


@pytest.mark.parametrize('kernel', ['posture', 'holding', 'forces'])
def test_the_work_grows_with_the_number_of_joints_not_with_its_square(kernel: str) -> None:
    """Each further joint of an arm costs the same, contact points at its tip included."""
    operations = []
    for joints in (10, 20, 30, 40):
        robot = random_robot(np.random.default_rng(1), 4, arm=joints)
        tip = Contact('tip', robot.joints[-1].child, (0.1, 0.2, 0.3))
        whole = replace(robot, contacts=(*robot.contacts, tip))
        operations.append(getattr(mechanics_of(whole), kernel).source.count(' = '))
    first, *more = np.diff(operations)
    assert max(more) <= 1.2 * first
