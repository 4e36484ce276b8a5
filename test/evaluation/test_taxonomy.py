"""The paper's Figure 1 as a classification."""

from ugv_acceptance.evaluation.taxonomy import HUMAN, Source


def test_the_leaves_are_those_of_the_paper() -> None:
    """Five physical categories, two human ones."""
    physical = {s.value for s in Source if s.physical}
    assert physical == {'effector', 'sensor', 'control system', 'power', 'communications'}
    assert {s.value for s in HUMAN} == {'design', 'interaction'}


def test_a_path_says_the_branch() -> None:
    """Physical or human, then the category."""
    assert Source.EFFECTOR.path == 'physical / effector'
    assert Source.DESIGN.path == 'human / design'
