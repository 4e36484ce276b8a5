"""The values that criteria are about: each from a row made by hand, with its unit and subjects."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.hand_made import made
from evaluation.streams import settings

from ugv_acceptance.evaluation.criteria.criteria import ANY
from ugv_acceptance.evaluation.criteria.quantities import SIGNALS, columns_of, shown, subjects_of
from ugv_acceptance.evaluation.settings import Limits

TOLD = settings(limits=Limits((40.0, math.inf)))
DEG = 180.0 / math.pi
ROW = made(
    [0],
    torque=[(-30.0, 8.0)], q=[(0.3, -0.2)], qd=[(-0.5, 0.1)], effort=[(-12.0, 7.0)],
    angle=[(0.4, 0.3, 0.2, 0.1)], moment=[(1.0, 2.0, 3.0, 4.0)], energy=[(5.0, 6.0, 7.0, 8.0)],
    zmp=[0.25], clearance=[0.35], gravity=[(2.0, 1.0, -2.0)],
)  # fmt: skip


@pytest.mark.parametrize(
    ('signal', 'expected'),
    [
        ('torque_utilisation', (0.75, math.nan)),
        ('torque', (30.0, 8.0)),
        ('torque_margin', (10.0, math.nan)),
        ('effort', (12.0, 7.0)),
        ('position', (0.3, -0.2)),
        ('speed', (0.5, 0.1)),
        ('tip_angle', (0.4, 0.3, 0.2, 0.1)),
        ('tip_moment', (1.0, 2.0, 3.0, 4.0)),
        ('tip_energy', (5.0, 6.0, 7.0, 8.0)),
        ('zmp', (0.25,)),
        ('clearance', (0.35,)),
        ('tilt', (math.acos(2.0 / 3.0),)),
    ],
)
def test_a_signal_is_taken_from_its_column(signal: str, expected: tuple[float, ...]) -> None:
    """One number a subject, none of a joint without limit; tilt is gravity's from straight down."""
    kind = SIGNALS[signal]
    assert kind.of(ROW, TOLD)[0].tolist() == pytest.approx(expected, nan_ok=True)
    subjects = subjects_of(kind, TOLD)
    assert len(subjects) == len(expected)
    for name, number in zip(subjects, expected, strict=True):
        found = columns_of(signal, name, ROW, TOLD, largest=True)
        assert found.tolist() == pytest.approx([number], nan_ok=True)
    for largest, pick in ((True, max), (False, min)):
        found = columns_of(signal, ANY, ROW, TOLD, largest=largest)
        known = [number for number in expected if not math.isnan(number)]
        assert found.tolist() == pytest.approx([pick(known)])


def test_every_signal_is_tried_and_three_need_what_is_computed_on_demand() -> None:
    """Moments, energies and the ZMP cost time that no other signal has to pay."""
    assert len(SIGNALS) == 12
    assert {name for name, k in SIGNALS.items() if k.detail} == {'tip_moment', 'tip_energy', 'zmp'}


def test_nothing_is_known_of_no_joint_no_limit_and_no_arm() -> None:
    """A robot without joints, limits or an arm keeps no limit of them: there is no value."""
    bare = replace(ROW, torque=np.zeros((1, 0)))
    unlimited = settings(limits=Limits((math.inf, math.inf)))
    tried = [
        columns_of('torque', ANY, bare, TOLD, largest=True),
        columns_of('torque_utilisation', ANY, ROW, unlimited, largest=True),
        columns_of('torque_margin', ANY, ROW, unlimited, largest=False),
        columns_of('clearance', ANY, made([0], clearance=[math.inf]), TOLD, largest=False),
    ]
    np.testing.assert_equal(tried, np.full((4, 1), np.nan))


def test_a_value_is_unknown_where_the_row_is() -> None:
    """A value is NaN in a row without margins; of several joints unknown ones are left out."""
    torque = [(1.0, 2.0), (3.0, np.nan), (np.nan, np.nan)]
    rows = made([0, 1, 2], torque=torque)
    found = columns_of('torque', ANY, rows, TOLD, largest=True)
    np.testing.assert_equal(found, [2.0, 3.0, np.nan])
    unknown = made([0, 1], torque=torque[:2], known=[False, True])
    np.testing.assert_equal(
        columns_of('torque', 'lift', unknown, TOLD, largest=True), [np.nan, 3.0]
    )


@pytest.mark.parametrize(
    ('signal', 'subject', 'expected'),
    [
        ('position', 'lift', (DEG, 'deg')), ('position', 'slide', (1.0, 'm')),
        ('position', ANY, (DEG, 'deg')), ('speed', 'lift', (DEG, 'deg/s')),
        ('speed', 'slide', (1.0, 'm/s')), ('torque', 'lift', (1.0, 'N m')),
        ('torque', 'slide', (1.0, 'N')), ('effort', 'slide', (1.0, 'N')),
        ('torque_margin', 'slide', (1.0, 'N')), ('torque_utilisation', 'slide', (1.0, '')),
        ('tip_angle', 'left', (DEG, 'deg')), ('tip_moment', 'left', (1.0, 'N m')),
        ('tip_energy', ANY, (1.0, 'J')), ('zmp', 'robot', (1.0, 'm')),
        ('tilt', 'robot', (DEG, 'deg')),
    ],
)  # fmt: skip
def test_a_person_sees_degrees_of_what_turns_and_metres_of_what_slides(
    signal: str, subject: str, expected: Any
) -> None:
    """Factor and unit, by the kind of the joint."""
    scale, unit = shown(signal, subject, TOLD)
    assert scale == pytest.approx(expected[0])
    assert unit == expected[1]
