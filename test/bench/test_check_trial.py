"""Planned motions against MuJoCo: a few of the cases of bench/check_trial.py."""

import pytest

from bench.check_trial import Result, judged, run_of
from ugv_acceptance.config import load
from ugv_acceptance.evaluation.planned_motion import PERMITTED, REFUSED

SEED, NUMBERS = 1, range(10)


@pytest.fixture(scope='module')
def results() -> list[Result]:
    """Return what was said of some random motions, and what they did."""
    settings = judged(load().settings)
    return [run_of(settings, number, SEED) for number in NUMBERS]


def test_what_tips_or_saturates_was_refused(results: list[Result]) -> None:
    """Each of them."""
    wrong = [of for of in results if of.truth.wrong]
    assert wrong
    assert not [of for of in wrong if of.said.verdict == PERMITTED]


def test_what_goes_well_is_hardly_ever_refused(results: list[Result]) -> None:
    """One of these ten at most."""
    fine = [of for of in results if not of.truth.wrong]
    assert len(fine) >= len(results) // 2
    assert sum(of.said.verdict == REFUSED for of in fine) <= 1


def test_the_torque_that_was_told_is_that_of_the_motors(results: list[Result]) -> None:
    """Never a tenth of the limit less than MuJoCo's motors exert where none is at its limit."""
    for of in results:
        if not of.truth.wrong:
            assert of.said.joint is not None
            assert of.truth.share <= of.said.joint.share + 0.1
