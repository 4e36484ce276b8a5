"""Brakes of a simulated PackBot: what lifts or tips it must not pass, what does not may."""

import math

import pytest

from bench.chassis_trial import GROUNDED, LIFTED, Said, Trial, Verdict, braking, trials, tried
from ugv_acceptance.config import load

SETTINGS = load().settings
# Turret, shoulder, elbow: the arm stretched forward, and folded over the deck.
STRETCHED, FOLDED = (0.0, 0.3, 0.0), (0.0, math.radians(115), math.radians(-140))


def said(verdict: Verdict) -> tuple[Said, Said]:
    """Return what was said at both rates of the IMU."""
    return verdict.fast, verdict.slow


@pytest.mark.parametrize(('brake', 'hold'), [(4.5, 0.3), (6.0, 0.2), (8.0, 0.1), (4.5, 0.6)])
def test_a_brake_that_lifts_the_rear_does_not_pass(brake: float, hold: float) -> None:
    """With the arm stretched and 1.8 kg a short brake raises the rear; it is told as it happens."""
    found = tried(SETTINGS, braking(SETTINGS.robot, brake, hold, 1.8, STRETCHED))
    assert found.lift > LIFTED
    for one in said(found):
        assert one.verdict != 'PASS'
        assert one.caution < math.inf


def test_a_brake_that_tips_is_danger_before_the_balance() -> None:
    """DANGER comes while the robot could still come back by its static margin."""
    found = tried(SETTINGS, braking(SETTINGS.robot, 6.0, 0.4, 1.8, STRETCHED))
    assert found.tipped_at < math.inf
    for one in said(found):
        assert one.verdict == 'FAIL'
        assert one.danger < found.tipped_at


@pytest.mark.parametrize(('brake', 'arm'), [(1.5, STRETCHED), (4.5, FOLDED)])
def test_a_brake_that_lifts_nothing_passes(brake: float, arm: tuple[float, float, float]) -> None:
    """A gentle brake, or a hard one with the arm folded, lifts nothing and raises no alert."""
    found = tried(SETTINGS, braking(SETTINGS.robot, brake, 0.3, 1.8, arm))
    assert found.lift < GROUNDED
    assert {(one.verdict, one.caution) for one in said(found)} == {('PASS', math.inf)}


@pytest.mark.parametrize('trial', trials(SETTINGS.robot, 12, 5), ids=lambda t: f'{t.kind}_{t.seed}')
def test_random_trials_keep_to_the_truth(trial: Trial) -> None:
    """Brakes and turns that lift an end do not pass; where nothing lifts nothing is said."""
    found = tried(SETTINGS, trial)
    lifted = found.least < 0.0 or found.lift > LIFTED
    for one in said(found):
        if lifted and trial.kind in {'brake', 'turn'}:
            assert one.verdict != 'PASS'
        if found.least >= 0.0 and found.lift < GROUNDED:
            assert one.chassis == 'PASS'
