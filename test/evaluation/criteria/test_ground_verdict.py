"""Tip-over on ground that is not flat: a FAIL or INCONCLUSIVE, a PASS by an accepted rule only."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config, load
from ugv_acceptance.config.criteria import load_criteria
from ugv_acceptance.evaluation.ground import CARRIED, FLAT, STAIRS, UNEVEN, Ground, GroundWindow
from ugv_acceptance.offline.evaluate import evaluate

BAGS = Path(__file__).parents[3] / 'bags'
CONFIG = load()
BODY = 'criteria: {tilt: {value: tip_angle, above_deg: 5}, load: {data: coverage, at_least: 0.9}}\n'
HEAD = 'version: 1\nname: site\n'
PART = Ground(windows=(GroundWindow(STAIRS, 12.0, 20.0),))


def judged(
    ground: Ground | None = None,
    bag: str = 'packbot_pass',
    criteria: Path | None = None,
    config: Config = CONFIG,
) -> dict[str, Any]:
    """Return the result of a recording on this ground."""
    return dict(evaluate(BAGS / bag, config=config, criteria=criteria, ground=ground).result)


def site(folder: Path, text: str, body: str = BODY) -> Path:
    """Return a file of criteria that says this of the ground."""
    path = folder / 'site.yaml'
    path.write_text(f'{HEAD}{text}{body}', 'utf-8')
    return path


def lines(result: Mapping[str, Any], what: str) -> list[str]:
    """Return why something was not checked."""
    return [one['why'] for one in result['not_checked'] if one['what'] == what]


def test_without_an_entry_only_the_line_on_the_ground_differs() -> None:
    """A run without a kind is judged as on flat ground, and says that nobody entered it."""
    free, flat = judged(), judged(Ground(FLAT))
    assert free['verdict'] == flat['verdict'] == 'PASS'
    assert lines(free, 'ground') == [f'nobody entered its kind: {lines(flat, "ground")[0]}']
    for key in ('not_checked', 'ground', 'declared_ground'):
        free.pop(key, None)
        flat.pop(key, None)
    assert free == flat


@pytest.mark.parametrize(
    ('ground', 'kind', 'seconds'),
    [(Ground(UNEVEN), UNEVEN, 28.0), (Ground(STAIRS), STAIRS, 28.0), (PART, STAIRS, 8.0)],
)
def test_a_good_run_is_inconclusive(ground: Ground, kind: str, seconds: float) -> None:
    """However much tilt was left: it is an upper bound. The reason says how long, what to do."""
    result = judged(ground)
    assert result['verdict'] == 'INCONCLUSIVE'
    assert result['reasons'][0].startswith(f'the ground was taken as {kind} for {seconds:.1f} s: ')
    assert 'ground: accept' in result['reasons'][0]
    assert len(result['reasons']) == 1
    (tip,) = (c for c in result['criteria']['results'] if c['name'] == 'tip-over')
    assert tip['verdict'] == 'INCONCLUSIVE'
    found = result['ground']
    assert found['seconds'][kind] == pytest.approx(seconds, abs=0.05)
    assert sum(found['seconds'].values()) == pytest.approx(result['coverage']['evaluated_s'])
    assert found['cautious']['deg'] < found['upper_bound']['deg']
    assert any('upper bound' in why for why in lines(result, 'ground'))


def test_a_bad_run_fails_on_any_ground() -> None:
    """Too little tilt for flat ground is too little for any."""
    result = judged(Ground(STAIRS), 'packbot_fail')
    assert result['verdict'] == 'FAIL'
    assert any(' past tipping: ' in reason for reason in result['reasons'])


def test_a_window_after_the_end_changes_no_verdict() -> None:
    """Where the robot was never on such ground there is nothing to object to."""
    assert judged(Ground(windows=(GroundWindow(STAIRS, 100.0, 120.0),)))['verdict'] == 'PASS'


def test_an_accepted_trend_passes_a_run_that_did_not_begin_to_tip(tmp_path: Path) -> None:
    """The rule and the reason for it stand in the first line, windows come from the file."""
    text = (
        'ground:\n  windows: [{kind: stairs, between_s: [12, 20]}]\n'
        '  accept: trend\n  reason: belayed, no drop at the top\n'
    )
    result = judged(criteria=site(tmp_path, text))
    assert result['verdict'] == 'PASS'
    said = 'the trend accepted on ground that is not flat (belayed, no drop at the top)'
    assert result['reasons'][0] == said
    assert result['ground']['accepted'] == {
        'rule': 'trend',
        'reason': 'belayed, no drop at the top',
    }
    assert result['ground']['trend_known_share'] == 1.0


def test_an_accepted_trend_fails_a_run_that_began_to_tip(tmp_path: Path) -> None:
    """A TIP_TREND of level ERROR is then a failure of the run, in words."""
    text = 'ground: {kind: uneven, accept: trend, reason: r}\n'
    body = 'criteria: {load: {data: coverage, at_least: 0.9}}\n'
    result = judged(None, 'packbot_fail', site(tmp_path, text, body))
    assert result['verdict'] == 'FAIL'
    (held,) = (one for one in result['safeguards'] if one['name'] == 'ground')
    assert held['verdict'] == 'FAIL'
    assert 'the robot begins to tip' in held['reasons'][0]


def test_a_trend_that_is_hardly_known_passes_nothing(tmp_path: Path) -> None:
    """On stairs for a moment only, no trend is known."""
    text = 'ground: {windows: [{kind: stairs, between_s: [12, 12.15]}], accept: trend, reason: r}\n'
    result = judged(criteria=site(tmp_path, text))
    assert result['verdict'] == 'INCONCLUSIVE'
    assert any('the trend of the tilt left is known for' in reason for reason in result['reasons'])


def test_an_accepted_cautious_margin_decides(tmp_path: Path) -> None:
    """Below the limit with shortened tracks a run is INCONCLUSIVE; with a small pitch it passes."""
    path = site(tmp_path, 'ground: {kind: stairs, accept: cautious, reason: r}\n')
    found = judged(criteria=path)
    assert found['verdict'] == 'INCONCLUSIVE'
    assert any('taken cautiously for stairs' in reason for reason in found['reasons'])
    settings = CONFIG.settings
    fine = replace(settings, ground=replace(settings.ground, pitch=0.05))
    assert judged(criteria=path, config=replace(CONFIG, settings=fine))['verdict'] == 'PASS'


def test_it_cannot_be_waived(tmp_path: Path) -> None:
    """Who wants a run on stairs to pass names a rule: a waiver of the safeguard is refused."""
    with pytest.raises(BadConfig, match=r'site.yaml:\d+: waive.ground: it cannot be waived'):
        load_criteria(site(tmp_path, 'waive: {ground: we know}\n'), CONFIG.settings)


@pytest.mark.parametrize(
    ('text', 'told'),
    [
        ('ground: {kind: rubble}\n', "ground.kind: expected 'flat', 'uneven' or 'stairs'"),
        ('ground: {accept: trend}\n', 'ground.reason: expected a reason'),
        ('ground: {reason: r}\n', 'ground.accept: expected the rule'),
        ('ground: {accept: luck, reason: r}\n', "ground.accept: expected 'trend' or 'cautious'"),
        ('ground: {windows: [{kind: stairs}]}\n', 'windows.0.between: expected this key'),
        ('ground: {windows: [{kind: stairs, between_s: [4, 2]}]}\n', 'expected a start'),
    ],
)
def test_what_is_wrong_is_said_with_file_line_and_key(tmp_path: Path, text: str, told: str) -> None:
    """A kind, a rule or times that are none are refused, as is a rule without its reason."""
    with pytest.raises(BadConfig) as raised:
        load_criteria(site(tmp_path, text), CONFIG.settings)
    assert 'site.yaml:3' in str(raised.value)
    assert told in str(raised.value)


def test_criteria_and_command_line_add_to_the_configuration(tmp_path: Path) -> None:
    """The kind of the command line comes before that of the criteria; windows of both count."""
    path = site(tmp_path, 'ground: {kind: uneven, windows: [{kind: flat, between_s: [0, 5]}]}\n')
    result = judged(PART, criteria=path)
    assert result['ground']['kind'] == UNEVEN
    kinds = [(w['kind'], w['start_s']) for w in result['ground']['windows']]
    assert kinds == [(FLAT, 0.0), (STAIRS, 12.0)]
    assert judged(Ground(STAIRS), criteria=path)['ground']['kind'] == STAIRS


def test_flippers_that_carry_the_body_are_named_with_their_seconds(tmp_path: Path) -> None:
    """On flat ground alone; on stairs the whole margin is an upper bound anyway."""
    low = tmp_path / 'low.yaml'
    text = CONFIG.path.read_text('utf-8').replace('../urdf', str(CONFIG.urdf_path.parent))
    # Flippers folded back reach below tracks that are 0.2 m higher than they are.
    low.write_text(text.replace('height_m: 0', 'height_m: 0.2'), 'utf-8')
    raised = load(low)
    what = 'ground under the flippers'
    assert lines(judged(config=raised), what) == [CARRIED]
    assert not lines(judged(), what)
    assert not lines(judged(Ground(STAIRS), config=raised), what)
