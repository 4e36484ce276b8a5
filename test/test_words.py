"""One voice on every surface that people read: levels, margins, percentages and speeds."""

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from cli.here import ugv as here_ugv

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.advice.tipped import STAND_CLEAR
from ugv_acceptance.evaluation.alerts.level_words import LEVELS_FOR_PEOPLE, MEANS
from ugv_acceptance.evaluation.alerts.messages import ALERTS, HAVE_WORST, advice, describe
from ugv_acceptance.evaluation.alerts.state_machine import ERROR, STALE, WARN, Alert, Rule
from ugv_acceptance.evaluation.ground import bound_words
from ugv_acceptance.evaluation.least_margins import with_most_used
from ugv_acceptance.evaluation.permitted_limits import RANGES
from ugv_acceptance.model.stability import SIDES
from ugv_acceptance.monitoring.trends import end_words
from ugv_acceptance.report.alert_lines import alert_line, worst_words

SETTINGS = load().settings
S = 1_000_000_000
# What people read no more -> what they read instead.
OLD_WORDS = {
    r'\b(WARN|ERROR|STALE)\b': 'CAUTION, DANGER, NO DATA',
    r'\bwarning limit\b': 'CAUTION from 10 deg on',
    r'\d (degrees|deg) of tilt left|tilt (is|are) left|degrees of tilt left before':
        '6 deg to tipping: RIGHT',
    r'\d (degrees|deg) past (its|the) tipping point|before (it|the robot) tips to the':
        '1.4 deg past tipping: RIGHT',
    r'\d rad/s\b': '36 deg/s',
    r'\d%': '99 %',
}  # fmt: skip


def old_words(text: str) -> list[str]:
    """Return the old words of a text, each with what stands in its place."""
    found = ((re.search(old, text), new) for old, new in OLD_WORDS.items())
    return [f'{match.group()!r}: say {new}' for match, new in found if match]


def shown(html: str) -> str:
    """Return the text that a page shows, without tags, styles and drawings."""
    text = re.sub(r'<(style|svg).*?</\1>', '', html, flags=re.DOTALL)
    return re.sub(r'<[^>]*>', '', text)


def alerts() -> Iterator[Alert]:
    """Yield an alert of every code at every level, of each kind of subject."""
    for code in ALERTS:
        for level in (WARN, ERROR, STALE):
            for subject in ('shoulder_joint', 'right', 'imu'):
                rule = Rule(code, subject, level, 0.6, 0.5, 0, 0)
                yield Alert(rule, S, 0.7, detail='seen', worst_at=3 * S)


@pytest.mark.parametrize('code', ALERTS)
def test_no_alert_says_the_old_words(code: str) -> None:
    """Whatever its level and subject: what happened, what it means, what to do."""
    said = [ALERTS[code].meaning]
    said += [describe(a, SETTINGS, start) for a in alerts() for start in (None, 0)
             if a.rule.code == code]  # fmt: skip
    said += [advice(code, SETTINGS.robot)]
    assert not [(text, old_words(text)) for text in said if old_words(text)]


@pytest.mark.parametrize('code', sorted(HAVE_WORST))
def test_an_alert_with_a_worst_value_says_when_it_came(code: str) -> None:
    """And only once, in the sentence and in the short words of a list."""
    for alert in alerts():
        if alert.rule.code == code:
            text = describe(alert, SETTINGS, 0)
            assert text.count('at 3.00 s') == 1
            told = {'code': code, 'message': text, 'worst_s': 3.0}
            assert worst_words(told).endswith('at 3.00 s')


@pytest.mark.parametrize('side', SIDES)
def test_every_sentence_on_tilt_names_the_side_in_capitals(side: str) -> None:
    """Ahead, in motion, on stairs, past tipping."""
    for code in ('TIP_OVER', 'TIP_MOVING', 'ACCELERATION', 'TRACK_LIFT', 'TIP_AHEAD'):
        for peak in (-0.1, 0.1):
            alert = Alert(Rule(code, side, WARN, -0.2, -0.3, 0, 0), 0, peak)
            assert side.upper() in describe(alert, SETTINGS)
    assert side.upper() in bound_words(side, 0.2, 0.1)
    assert side.upper() in end_words(side, '0.8', tips=True)


def test_a_joint_just_below_its_limit_is_not_at_it() -> None:
    """99.6 % of a torque limit is told as 99 %, in the alert and in what is left."""
    limit = SETTINGS.limits.torque[SETTINGS.robot.joint_names.index('shoulder_joint')]
    close = 0.9996 * limit
    alert = Alert(Rule('TORQUE_LIMIT', 'shoulder_joint', WARN, 0.8 * limit, 0.7, 0, 0), 0, close)
    torque = [close if math.isfinite(x) else 0.0 for x in SETTINGS.limits.torque]
    for text in (describe(alert, SETTINGS), with_most_used('', torque, SETTINGS)):
        assert '99 % of its limit' in text
        assert '100' not in text


def test_what_is_said_of_limits_names_the_levels_of_people() -> None:
    """Such as in the descriptions of parameters."""
    assert not [p.what for p in RANGES if old_words(p.what)]


def test_the_documents_of_a_run_say_the_same(repository: Path, tmp_path: Path) -> None:
    """Report and printed result; the result for machines keeps its names, and has worst times."""
    html, result = tmp_path / 'r.html', tmp_path / 'r.json'
    done = here_ugv(
        'evaluate', repository / 'bags' / 'packbot_fail', '--report', html, '--json', result
    )
    page = shown(html.read_text('utf-8'))
    assert not old_words(page)
    assert '35 deg past tipping: RIGHT at 28.15 s' in page
    assert not [words for words in old_words(done.stdout) if '%' not in words]
    found = json.loads(result.read_text('utf-8'))
    assert {alert['level'] for alert in found['alerts']} <= {'WARN', 'ERROR', 'STALE'}
    tip = next(a for a in found['alerts'] if a['code'] == 'TIP_OVER' and a['level'] == 'ERROR')
    assert alert_line(tip) == (
        '25.25 s to the end  DANGER  TIP_OVER  35 deg past tipping: RIGHT at 28.15 s'
    )
    assert tip['start_s'] < tip['worst_s'] == found['stability']['time_of_min_s']


def test_the_card_of_a_plan_says_the_same(tmp_path: Path) -> None:
    """Levels with what to do, NO DATA and a fall included."""
    card = tmp_path / 'card.html'
    here_ugv('plan', '--short', '-o', tmp_path / 'plan.yaml', '--card', card)
    text = shown(card.read_text('utf-8'))
    assert not old_words(text)
    assert all(meaning in text and do in text for meaning, do in MEANS.values())
    assert STAND_CLEAR.partition(': ')[2] in text


def test_the_manual_begins_with_what_to_do(repository: Path) -> None:
    """Its first table is that of the levels, in the words of the card; a fall is the last row."""
    text = (repository / 'docs' / 'operator.md').read_text('utf-8')
    rows = [line.strip('| ').split(' | ') for line in text.splitlines() if line.startswith('| **')]
    plain = [[cell.replace('**', '') for cell in row] for row in rows]
    assert plain[: len(MEANS)] == [[word, *told] for word, told in MEANS.items()]
    assert list(MEANS) == list(LEVELS_FOR_PEOPLE.values())
    assert plain[-1][0] == 'it has tipped'
    assert f'it has tipped: {plain[-1][2]}' == STAND_CLEAR
    assert text.index('| **OK**') < text.index('\n## ')


@pytest.mark.parametrize('page', ['operator', 'glossary', 'training', 'console'])
def test_the_pages_for_operators_say_the_same(repository: Path, page: str) -> None:
    """But where they say what ROS and files call a level."""
    path = repository / 'docs' / f'{page}.md'
    if page == 'training' and not path.exists():
        return
    text = path.read_text('utf-8')
    text = re.sub(r'OK, WARN, ERROR(,| and) STALE', '', text)
    assert not old_words(text)
