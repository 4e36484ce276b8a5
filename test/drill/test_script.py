"""The script of a drill, and what of it is refused."""

import pytest

from ugv_acceptance import BadConfig
from ugv_acceptance.drill.script import Answer, script_from


def test_a_line_says_what_is_answered_and_when() -> None:
    """Answers are separated by commas; one without a time comes after 2 s; # begins a comment."""
    script = script_from('# Ada\nall: follow-advice\nslope: stop at 1.5 s, lower elbow at 4\n')
    assert script['all'] == (Answer('follow-advice', 2.0),)
    assert script['slope'] == (Answer('stop', 1.5), Answer('lower elbow', 4.0))


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('slpoe: stop', 'line 1: expected SITUATION: ANSWER, of slope, load'),
        ('all: stop\nslope stop', 'line 2: expected SITUATION: ANSWER, of slope, load, sensor, '),
        ('slope: stop, ', "line 1: expected ANSWER or ANSWER at 2 s, got ''"),
        ('# nothing', 'expected a line such as'),
    ],
)
def test_a_line_that_is_none_is_named(text: str, expected: str) -> None:
    """The error names the line, what was expected and what came."""
    with pytest.raises(BadConfig) as caught:
        script_from(text)
    assert expected in str(caught.value)
