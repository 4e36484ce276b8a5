"""A drill played to its end by script: who follows the advice passes, who ignores it fails."""

import pytest

from ugv_acceptance.config import load
from ugv_acceptance.drill.course import ENDED, Course
from ugv_acceptance.drill.outcome import Outcome
from ugv_acceptance.drill.script import run_script, script_from
from ugv_acceptance.drill.situations import SITUATIONS

SEED = 3


def outcomes(script: str, *names: str) -> dict[str, Outcome]:
    """Play situations (none: all) by a script; return what came of each."""
    course = Course(load('packbot'), SEED, names or tuple(SITUATIONS))
    run_script(course, script_from(script))
    assert course.phase == ENDED
    return {outcome.situation: outcome for outcome in course.outcomes}


@pytest.fixture(scope='module')
def followed() -> dict[str, Outcome]:
    """Return the outcomes of an operator who does what the monitor says."""
    return outcomes('all: follow-advice')


@pytest.fixture(scope='module')
def ignored() -> dict[str, Outcome]:
    """Return the outcomes of an operator who goes on as planned, and answers too late on stairs."""
    return outcomes('all: ignore\nstairs: follow-advice at 30 s')


def test_who_follows_the_advice_passes_every_situation(followed: dict[str, Outcome]) -> None:
    """What the monitor says in a situation is among the answers, and it ends the trouble."""
    assert list(followed) == list(SITUATIONS)
    assert {name: o.happened for name, o in followed.items() if not o.passed} == {}
    assert {o.answers for o in followed.values()} == {(('advice', 2.0),)}


def test_who_goes_on_as_planned_fails_every_situation(ignored: dict[str, Outcome]) -> None:
    """The alert ignored, each situation ends badly on the robot: it tips, gives in, or moves."""
    assert [name for name, outcome in ignored.items() if outcome.passed] == []
    happened = [outcome.happened for outcome in ignored.values()]
    assert [
        text for text in happened if not any(w in text for w in ('tipped', 'gave in', 'moved'))
    ] == []


def test_a_wrong_answer_is_told_what_happened_and_why(ignored: dict[str, Outcome]) -> None:
    """An outcome to repeat says when which way the robot tipped, and why the answer was wrong."""
    slope = ignored['slope']
    assert slope.happened.startswith('It tipped over to the ')
    assert 'the tilt left shrinks' in slope.lesson.lower()
    assert slope.least_deg < -10.0


def test_an_answer_after_the_fall_comes_too_late(ignored: dict[str, Outcome]) -> None:
    """The question stands only as long as the robot does; the record then has no answer."""
    assert (ignored['stairs'].passed, ignored['stairs'].answers) == (False, ())
    assert ignored['stairs'].lesson.startswith('No answer is an answer too')


def test_the_same_seed_and_script_give_the_same_outcome(ignored: dict[str, Outcome]) -> None:
    """Nothing in a drill depends on the computer: not the robot, nor the moment of an advice."""
    assert outcomes('all: ignore', 'sensor')['sensor'] == ignored['sensor']


def test_to_stop_is_safe_but_not_the_answer() -> None:
    """Who stops, and does nothing else in time, keeps an alert that never ends."""
    found = outcomes('load: stop at 1 s', 'load')['load']
    assert (found.passed, found.answers) == (False, (('stop', 1.0),))
    assert 'never ended' in found.happened


def test_help_that_is_sent_to_a_fallen_robot_is_a_fault() -> None:
    """With somebody beside it and its motors on a fallen robot moves: that is told in metres."""
    found = outcomes('fall: help', 'fall')['fall']
    assert not found.passed
    assert found.happened.startswith('With somebody beside it and its motors on it moved ')


def test_a_monitor_that_is_told_flat_ground_on_stairs_is_a_fault() -> None:
    """To silence the monitor by telling it something wrong fails, whatever the robot does."""
    assert not outcomes('stairs: flat', 'stairs')['stairs'].passed
