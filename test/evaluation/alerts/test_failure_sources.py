"""The paper's Figure 1 as a classification."""

import pytest

from ugv_acceptance.evaluation.alerts.failure_source import HUMAN, FailureSource
from ugv_acceptance.evaluation.alerts.messages import (
    ALERTS,
    LIVE,
    RECORDED,
    suspect_of,
)
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN


def test_the_leaves_are_those_of_the_paper() -> None:
    """Five physical categories, two human ones."""
    physical = {s.value for s in FailureSource if s.physical}
    assert physical == {'effector', 'sensor', 'control system', 'power', 'communications'}
    assert {s.value for s in HUMAN} == {'design', 'interaction'}


def test_a_path_says_the_branch() -> None:
    """A failure source's path names its branch, physical or human, and its category."""
    assert FailureSource.EFFECTOR.path == 'physical / effector'
    assert FailureSource.DESIGN.path == 'human / design'


@pytest.mark.parametrize('code', ALERTS)
def test_every_alert_says_what_to_do_and_where_to_look(code: str) -> None:
    """No row without a sentence, an action and a category."""
    text = ALERTS[code]
    assert text.happened
    assert len(text.to_do.split()) >= 3
    assert ' / ' in suspect_of(code)


def test_an_alert_is_recorded_or_of_a_live_node() -> None:
    """One a recording shows means something to who stands at the robot; the others have a level."""
    assert {*RECORDED, *LIVE} == set(ALERTS)
    assert not LIVE.keys() & set(RECORDED)
    assert all(ALERTS[code].meaning for code in RECORDED)
    assert set(LIVE.values()) <= {WARN, ERROR}
