"""Verdicts by measured efforts: recordings whose efforts, positions or loads are falsified."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from offline.falsified_recordings import Change, efforts, rewritten

import ugv_acceptance as ugv
from ugv_acceptance.bag.cdr import JointStateSample
from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.type_aliases import Json

ROBOT = load().settings.robot
LEVEL = (0.0, 0.0, -9.81)
ARM = ('shoulder_joint', 'elbow_joint')
Efforts = Callable[[float, JointStateSample], Sequence[float]]


@pytest.fixture
def judged(repository: Path, tmp_path: Path) -> Callable[[Change], Json]:
    """Return a function that evaluates packbot_pass, which carries 1 kg, with a change."""
    (source,) = (repository / 'bags' / 'packbot_pass').glob('*.mcap')

    def judge(change: Change) -> Json:
        return ugv.evaluate(rewritten(source, tmp_path / 'run', change)).to_dict()

    return judge


def held(sample: JointStateSample, mass: float) -> list[float]:
    """Return the static torque of each joint of a message with a load (kg)."""
    q = [sample.position[sample.names.index(name)] for name in ROBOT.joint_names]
    torque = dict(
        zip(ROBOT.joint_names, static_torque(ROBOT, q, LEVEL, Payload(mass)), strict=True)
    )
    return [float(torque[name]) for name in sample.names]


def changed(sample: JointStateSample, more: float) -> list[float]:
    """Return the recorded efforts with `more` kg in the hand."""
    extra = zip(sample.effort, held(sample, 1.0 + more), held(sample, 1.0), strict=True)
    return [e + a - b for e, a, b in extra]


def only(name: str, value: float, first: float, last: float) -> Efforts:
    """Return efforts of which one joint's is `value` from `first` to `last` (s)."""

    def of(at: float, sample: JointStateSample) -> Sequence[float]:
        pairs = zip(sample.names, sample.effort, strict=True)
        return [value if n == name and first < at < last else e for n, e in pairs]

    return of


UNUSABLE: dict[str, tuple[Efforts, str]] = {
    'zero': (lambda _, s: [0.0] * len(s.effort), 'none'),
    'missing': (lambda _, s: [np.nan] * len(s.effort), 'none'),
    'a twelfth': (lambda _, s: [e / 12.0 for e in s.effort], 'scaled'),
    'percent': (lambda _, s: [-30.0 * e for e in s.effort], 'scaled'),
    'without gravity': (
        lambda _, s: [e - g for e, g in zip(s.effort, held(s, 1.0), strict=True)],
        'without gravity',
    ),
}


@pytest.mark.parametrize('name', UNUSABLE)
def test_unusable_efforts_tell_neither_load_nor_contact(
    name: str, judged: Callable[[Change], Json]
) -> None:
    """Zero, missing, scaled and gravity compensated efforts: a PASS that names what they are."""
    of, meaning = UNUSABLE[name]
    result = judged(efforts(of))
    check = result['model_check']
    assert result['verdict'] == 'PASS'
    assert {check['joints'][joint]['meaning'] for joint in ARM} == {meaning}
    assert (check['loads'], check['contacts']) == ([], [])
    assert 'pushes' not in str(result)
    told = ' '.join(one['what'] for one in result['not_checked'])
    assert 'the payload that was carried' in told
    assert all(joint in told for joint in ARM)


def test_an_honest_run_weighs_the_kilogram_it_carries(judged: Callable[[Change], Json]) -> None:
    """1.0 +/- 0.12 kg by shoulder and elbow, as declared."""
    result = judged(lambda _, sample: sample)
    (told,) = result['model_check']['loads']
    assert result['verdict'] == 'PASS'
    assert told['mass_kg']['value'] == pytest.approx(1.0, abs=0.05)
    assert told['mass_kg']['high'] - told['mass_kg']['value'] == pytest.approx(0.12, abs=0.03)
    assert not told['differs']


def test_a_load_that_was_not_declared_is_no_pass(judged: Callable[[Change], Json]) -> None:
    """2.5 kg carried where 1 is declared: INCONCLUSIVE, with the load and its interval."""
    result = judged(efforts(lambda _, s: changed(s, 1.5)))
    assert result['verdict'] == 'INCONCLUSIVE'
    assert any('2.50 +/- ' in reason and '1.00 kg' in reason for reason in result['reasons'])


def test_a_load_is_told_by_stretches_and_not_as_a_mean(judged: Callable[[Change], Json]) -> None:
    """2 kg more from 9 to 18 s alone: three stretches, each with its own load."""
    result = judged(efforts(lambda at, s: changed(s, 2.0 if 9.0 < at < 18.0 else 0.0)))
    loads = result['model_check']['loads']
    assert [round(x['mass_kg']['value']) for x in loads] == [1, 3, 1]
    assert [x['differs'] for x in loads] == [False, True, False]


def test_a_torque_beyond_the_limit_is_a_failure(judged: Callable[[Change], Json]) -> None:
    """5 kg more in the hand than declared: the shoulder gives 63 of 50 N m."""
    result = judged(efforts(lambda _, s: changed(s, 5.0)))
    assert result['verdict'] == 'FAIL'
    assert 'its limit is 50.0 N m' in result['reasons'][0]
    (of,) = (one for one in result['safeguards'] if one['name'] == 'measured_effort')
    assert of['verdict'] == 'FAIL'


@pytest.mark.parametrize('joint', ARM)
def test_an_effort_beyond_the_limit_is_no_pass_whatever_it_means(
    joint: str, judged: Callable[[Change], Json]
) -> None:
    """70 of 50 N m for ten seconds."""
    result = judged(efforts(only(joint, 70.0, 10.0, 20.0)))
    assert result['verdict'] != 'PASS'
    (of,) = (one for one in result['safeguards'] if one['name'] == 'measured_effort')
    assert of['verdict'] != 'PASS'
    assert joint in of['reasons'][0]


@pytest.mark.parametrize('noise', [0.0, 2e-4])
def test_a_stuck_encoder_is_no_pass(noise: float, judged: Callable[[Change], Json]) -> None:
    """The shoulder's position stands still, but for 0.2 mrad, while its effort grows to 45 N m."""
    rng, stuck = np.random.default_rng(1), {}

    def change(at: float, sample: JointStateSample) -> JointStateSample:
        k = sample.names.index('shoulder_joint')
        position, effort = list(sample.position), list(sample.effort)
        position[k] = stuck.setdefault(at > 12.0, position[k]) if at > 12.0 else position[k]
        position[k] += noise * rng.normal() * (at > 12.0)
        effort[k] += min(max(at - 12.0, 0.0) * 4.0, 22.0)
        return sample._replace(position=tuple(position), effort=tuple(effort))

    result = judged(change)
    assert result['verdict'] == 'INCONCLUSIVE'
    assert 'ENCODER_FROZEN' in {alert['code'] for alert in result['alerts']}


def test_a_wrong_sign_passes_and_is_named(judged: Callable[[Change], Json]) -> None:
    """All efforts turned round: the margins hold, and effort_sign is told for both joints."""
    result = judged(efforts(lambda _, s: [-e for e in s.effort]))
    assert result['verdict'] == 'PASS'
    for joint in ARM:
        assert any(
            f'set effort_sign: -1 for {joint}' in x for x in result['model_check']['findings']
        )


CASES = {
    'effort_currents': 'scaled',
    'effort_gravity_compensated': 'none',
    'effort_nan': 'none',
    'effort_sign_flipped': 'other sign',
    'base': 'torque',
}


@pytest.mark.parametrize('case', CASES)
def test_the_efforts_of_the_cases_are_named(case: str, shared_bags: Path) -> None:
    """Recordings of one quirk each, of ten seconds in one posture."""
    result = ugv.evaluate(shared_bags / 'cases' / case).to_dict()
    check = result['model_check']
    assert result['verdict'] == 'PASS'
    assert {check['joints'][joint]['meaning'] for joint in ARM} == {CASES[case]}
    assert 'pushes' not in str(result)
    if CASES[case] in {'scaled', 'none'}:
        assert check['loads'] == []
    if case == 'effort_currents':
        ratio = check['joints']['elbow_joint']['ratio']
        assert ratio['low'] < 0.12 < ratio['high']


def test_of_a_foreign_recording_only_the_ratio_is_certain(
    shared_bags: Path, repository: Path
) -> None:
    """98.0 N may be 1.25 times 8 kg: one sliding joint that holds one torque tells no load."""
    folder = shared_bags / 'abitobot'
    config = load(repository / 'msg_configs' / 'abitobot.yaml', urdf=folder / 'robot.urdf')
    check = ugv.evaluate(folder, config=config).to_dict()['model_check']
    assert check['joints']['arm_3_link_joint']['meaning'] == 'unknown'
    assert (check['loads'], check['contacts']) == ([], [])
