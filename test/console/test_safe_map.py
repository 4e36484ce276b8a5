"""The safe map against the margins of its postures, one at a time."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ugv_acceptance import BadSample
from ugv_acceptance.config import load
from ugv_acceptance.console.safe_map import CELLS, axes_of, key_of, probe, safe_map
from ugv_acceptance.console.snapshot import Snapshot
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import margins

SETTINGS = load().settings
ROBOT, LIMITS = SETTINGS.robot, SETTINGS.limits
TILTED = (0.0, -9.81 * math.sin(0.2), -9.81 * math.cos(0.2))
NOW = Snapshot(
    1, known=True, q=(-1.4, 0.5, 0.2, -0.1), gravity=TILTED, payload=Payload(4.0, (0.0, 0.0, 0.0))
)
ARM = ('shoulder_joint', 'elbow_joint')
cells = st.integers(0, CELLS - 1)


def class_of(x: float, y: float, axes: tuple[str, str]) -> int:
    """Return the class of one posture from its margins."""
    q = list(NOW.q)
    for name, value in zip(axes, (x, y), strict=True):
        q[ROBOT.joint_names.index(name)] = value
    found = margins(ROBOT, q, TILTED, NOW.payload)
    use = np.max(np.abs(found.torque) / LIMITS.torque)
    tilt = np.min(found.angle)
    over, tips = use >= LIMITS.torque_error, not tilt > LIMITS.tip_error
    if over or tips:
        return 4 if over and tips else 2 if over else 3
    return int(use >= LIMITS.torque_warn or tilt <= LIMITS.tip_warn)


@pytest.mark.parametrize(
    'axes', [ARM, ('turret_joint', 'shoulder_joint'), ('flipper_joint', 'elbow_joint')]
)
@settings(max_examples=25)
@given(cells, cells)
def test_a_cell_is_the_verdict_on_its_posture(axes: tuple[str, str], i: int, j: int) -> None:
    """A cell says what the margins of that posture say: turret and flippers too."""
    found = safe_map(NOW, SETTINGS, axes)
    (x0, x1), (y0, y1) = found['x_range'], found['y_range']
    x, y = np.linspace(x0, x1, CELLS)[i], np.linspace(y0, y1, CELLS)[j]
    assert int(found['cells'][i * CELLS + j]) == class_of(x, y, axes)


def test_this_map_has_every_class() -> None:
    """The case above is no empty one: safe, close, overloaded, tipping and both occur."""
    assert set(safe_map(NOW, SETTINGS, ARM)['cells']) == set('01234')


def test_a_probe_is_the_margins_there() -> None:
    """A pressed point tells the least tilt left and the most used joint of that posture."""
    found = probe(NOW, SETTINGS, ARM, (0.7, -0.4))
    there = margins(ROBOT, (-1.4, 0.7, -0.4, -0.1), TILTED, NOW.payload)
    assert found['tilt_deg'] == pytest.approx(math.degrees(there.angle.min()), abs=1e-5)
    assert found['use'] == pytest.approx(np.max(np.abs(there.torque) / LIMITS.torque), abs=1e-5)


def test_noise_makes_no_new_map() -> None:
    """A map depends on payload, attitude and the other joints, not on the two that are mapped."""
    key = key_of(NOW, SETTINGS, ARM)
    moved = replace(NOW, q=(-1.4, 1.0, 1.0, -0.1))
    assert key_of(moved, SETTINGS, ARM) == key
    assert key_of(replace(NOW, payload=Payload(2.0)), SETTINGS, ARM) != key
    assert key_of(replace(NOW, q=(0.0, 0.5, 0.2, -0.1)), SETTINGS, ARM) != key


def test_no_map_of_what_is_not_known() -> None:
    """Without gravity or with a missing joint there is no map."""
    assert key_of(replace(NOW, gravity=(math.nan,) * 3), SETTINGS, ARM) is None
    assert key_of(replace(NOW, q=(math.nan, 0.5, 0.2, -0.1)), SETTINGS, ARM) is None
    with pytest.raises(BadSample, match='known posture'):
        probe(replace(NOW, gravity=(math.nan,) * 3), SETTINGS, ARM, (0.0, 0.0))


def test_axes_are_two_joints_of_the_robot() -> None:
    """The joints with limits are mapped unless two others are wanted."""
    assert axes_of(SETTINGS) == ARM
    for wrong in (('elbow_joint', 'elbow_joint'), ('elbow_joint', '<b>')):
        with pytest.raises(BadSample, match='expected two of'):
            axes_of(SETTINGS, wrong)
