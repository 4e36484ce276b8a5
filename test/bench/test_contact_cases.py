"""Margins on uneven feet against simulated tips: a few of the cases of bench/bench_contact.py."""

import numpy as np
import pytest

from bench.contact_cases import Case, random_case, robot_of, truth_of
from ugv_acceptance.model.stability import stability
from ugv_acceptance.simulation.vehicle import gravity_on_slope
from ugv_acceptance.type_aliases import Floats


def shown(case: Case, tilts: Floats, attitudes: Floats) -> Floats:
    """Return the least margins (rad) of the robot in these attitudes on these slopes."""
    slopes = zip(tilts, attitudes, strict=True)
    down = np.array([gravity_on_slope(9.81, t, case.heading) @ a for t, a in slopes])
    angles = stability(robot_of(case), np.zeros((len(down), 1)), down).angle
    least: Floats = np.min(np.array(angles), axis=0)
    return least


@pytest.mark.parametrize('seed', range(10))
def test_no_more_is_shown_than_is_left(seed: int) -> None:
    """On the way to the tip, up to the first zero, by no more than 2 deg."""
    case = random_case(seed)
    truth = truth_of(case)
    tilts = np.array([tilt for tilt, _ in truth.rests])
    margin = shown(case, tilts, np.array([attitude for _, attitude in truth.rests]))
    zeros = np.flatnonzero(margin <= 0.0)
    upto = int(zeros[0]) + 1 if len(zeros) else len(margin)
    left = min(truth.tilt, np.radians(75.0)) - tilts
    assert np.degrees((margin - left)[:upto].max()) < 2.0
    assert margin[0] > 0.0
