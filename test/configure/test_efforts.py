"""What efforts mean is derived from a recording: the keys to set, and the sentence."""

from dataclasses import replace
from pathlib import Path

import pytest
from cases.base import base
from made.run import write

from ugv_acceptance.config import load
from ugv_acceptance.configure.draft import CHECK
from ugv_acceptance.configure.efforts import EffortRemark, effort_remarks


def remarks(path: Path, scale: float) -> dict[str, EffortRemark]:
    """What is said of a PackBot at rest whose efforts are its torques times `scale`."""
    made = base()
    assert made.joints.effort is not None
    joints = replace(made.joints, effort=made.joints.effort * scale)
    found = effort_remarks(load(), write(path, replace(made, joints=joints).messages()))
    return {remark.joint: remark for remark in found}


def test_efforts_that_are_torques_need_nothing(tmp_path: Path) -> None:
    """It is said that they are."""
    elbow = remarks(tmp_path / 'run.mcap', 1.0)['elbow_joint']
    assert (elbow.effort_sign, elbow.effort_scale) == (None, None)
    assert elbow.sentence == 'the effort of elbow_joint is its torque in N m'


def test_efforts_of_the_other_sign_are_to_be_turned(tmp_path: Path) -> None:
    """Which is to be checked."""
    elbow = remarks(tmp_path / 'run.mcap', -1.0)['elbow_joint']
    assert elbow.effort_sign is not None
    assert (elbow.effort_sign.value, elbow.effort_sign.grade) == (-1.0, CHECK)


def test_efforts_in_another_unit_get_their_scale(tmp_path: Path) -> None:
    """The one that makes them torques again."""
    elbow = remarks(tmp_path / 'run.mcap', 0.12)['elbow_joint']
    assert elbow.effort_scale is not None
    assert elbow.effort_scale.value == pytest.approx(1.0 / 0.12, rel=0.1)
    assert elbow.effort_sign is None


def test_efforts_that_leave_gravity_out_are_told(tmp_path: Path) -> None:
    """There is no key for them."""
    elbow = remarks(tmp_path / 'run.mcap', 0.0)['elbow_joint']
    assert (elbow.effort_sign, elbow.effort_scale) == (None, None)
    assert 'gravity is compensated' in elbow.sentence
