"""The paper's Figure 1 as a classification."""

from ugv_acceptance.evaluation.alerts.messages import FIRST_SUSPECT, HUMAN, WORDS, FailureSource


def test_the_leaves_are_those_of_the_paper() -> None:
    """Five physical categories, two human ones."""
    physical = {s.value for s in FailureSource if s.physical}
    assert physical == {'effector', 'sensor', 'control system', 'power', 'communications'}
    assert {s.value for s in HUMAN} == {'design', 'interaction'}


def test_a_path_says_the_branch() -> None:
    """A failure source's path names its branch, physical or human, and its category."""
    assert FailureSource.EFFECTOR.path == 'physical / effector'
    assert FailureSource.DESIGN.path == 'human / design'


def test_every_alert_has_a_first_suspect() -> None:
    """Every alert code has a category of likely cause, and no category names an unknown code."""
    assert FIRST_SUSPECT.keys() == WORDS.keys()
