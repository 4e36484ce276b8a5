"""The comparison of model and efforts finds what was put into synthetic efforts."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.streams import T0, Joints, Message, S, batch_of, run_of, settings
from scipy import stats

from ugv_acceptance.evaluation.criteria.statement import Statement
from ugv_acceptance.evaluation.downsampling import MOST_SAMPLES
from ugv_acceptance.evaluation.effort.model_check import ModelCheck
from ugv_acceptance.evaluation.effort.regression import independent_samples, least_squares
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.settings import JointInput, Limits, Settings
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.statics import static_torque

Effort = Callable[[float, float, float], float]
TOLD: Settings = replace(
    settings(limits=Limits((45.0, 300.0), speed=(0.6, np.inf))),
    joints=(JointInput('lift'), JointInput('hand_slide')),
)
DOWN = (0.0, 0.0, -9.81)


def swinging(effort: Effort, seconds: float = 40.0) -> list[Message]:
    """Return a run whose arm steps through twenty angles, moving half of the time."""
    found: list[Message] = []
    for message in run_of(seconds, joints_hz=20.0, imu_hz=20.0):
        if isinstance(message, Joints):
            at = (message.time - T0) / S
            step, part = divmod(at, 2.0)
            rate = 0.0 if part < 1.0 else (0.35 if int(step) % 8 < 4 else -0.35)
            level = 0.1 + 0.35 * (4 - abs(int(step) % 8 - 4))
            q = (level + (rate * (part - 1.0) if rate else 0.0), 0.0)
            torque = float(static_torque(TOLD.robot, q, DOWN)[0])
            message = replace(  # noqa: PLW2901
                message, position=q, velocity=(rate, 0.0), effort=(effort(torque, rate, at), np.nan)
            )
        found.append(message)
    return found


def stated(messages: list[Message]) -> Statement:
    """Return what is stated of a run."""
    evaluator, found = RecordedEvaluator(TOLD), ModelCheck(TOLD)
    evaluator.start(T0)
    found.add(evaluator.batch(batch_of(messages)))
    return found.statement(T0, messages[-1].time)


def check(messages: list[Message]) -> Any:
    """Return the comparison of a run."""
    return stated(messages).result['model_check']


def noise(at: float) -> float:
    """Return what an effort is off by: the same for the same time."""
    return float(np.random.default_rng(int(at * 1e6)).normal(0.0, 0.2))


def test_bias_and_scale_are_found_within_their_intervals() -> None:
    """Effort = 0.97 torque + 2 N m + noise: a torque, a little off."""
    found = check(swinging(lambda torque, _, at: 0.97 * torque + 2.0 + noise(at)))['joints']['lift']
    assert found['meaning'] == 'torque'
    assert found['scale']['low'] < 0.97 < found['scale']['high']
    assert found['scale']['high'] - found['scale']['low'] < 0.1


def test_a_wrong_sign_is_told() -> None:
    """An effort that counts the other way is named, with what to set, and is no load.

    Of one joint alone its scale is not certain, but its sign is.
    """
    statement = stated(swinging(lambda torque, _, at: -torque + noise(at)))
    found: Any = statement.result['model_check']
    assert any('set effort_sign: -1 for lift' in text for text in found['findings'])
    assert any('effort_sign: -1' in one.why for one in statement.not_checked)
    assert not statement.objections
    assert not found['contacts']


@pytest.mark.parametrize(('scale', 'meaning'), [(1.0 / 12.0, 'scaled'), (12.0, 'scaled')])
def test_another_unit_gives_its_scale_and_no_load(scale: float, meaning: str) -> None:
    """Effort in another unit: its scale with an interval; nothing else follows from it."""
    statement = stated(swinging(lambda torque, _, at: scale * (torque + noise(at))))
    found: Any = statement.result['model_check']
    lift = found['joints']['lift']
    assert lift['meaning'] == meaning
    assert lift['ratio']['low'] < scale < lift['ratio']['high']
    assert 'bias' not in lift
    assert (found['loads'], found['contacts']) == ([], [])
    assert {'measured effort of lift', 'the payload that was carried'} <= {
        one.what for one in statement.not_checked
    }


@pytest.mark.parametrize('load', [0.6, 3.0])
def test_a_load_nobody_declared_is_weighed(load: float) -> None:
    """More in the hand than the model knows, with its interval, and no PASS."""

    def effort(torque: float, _: float, at: float) -> float:
        one, none = (
            float(static_torque(TOLD.robot, (0.0, 0.0), DOWN, Payload(m, (0.1, 0.0, 0.0)))[0])
            for m in (1.0, 0.0)
        )
        level = float(static_torque(TOLD.robot, (0.0, 0.0), DOWN)[0])
        # All loads are on one line with the arm: they scale with the cosine of its angle.
        return torque + load * (one - none) * torque / level + noise(at)

    statement = stated(swinging(effort))
    found: Any = statement.result['model_check']
    # One joint cannot tell a load from another scale: whatever is told of it must hold the truth.
    for told in found['loads']:
        assert told['mass_kg']['low'] < 1.0 + load < told['mass_kg']['high']
    assert not found['contacts']


def test_motion_that_uses_up_the_margin_matters() -> None:
    """3 N m more error in motion matter where 5 N m are left of 45, and not where 20 are of 60."""

    def moving(limit: float) -> Any:
        told = replace(TOLD, limits=Limits((limit, 300.0)))
        evaluator, found = RecordedEvaluator(told), ModelCheck(told)
        evaluator.start(T0)
        run = swinging(lambda torque, rate, at: torque + 3.0 * np.sign(rate) + noise(at))
        found.add(evaluator.batch(batch_of(run)))
        result: Any = found.statement(T0, T0).result['model_check']
        return result['joints']['lift']

    for limit, matters in ((45.0, True), (60.0, False), (np.inf, None)):
        joint = moving(limit)
        # All motion is at one speed, so that Coulomb and viscous friction cannot be told apart.
        assert joint['friction'] is None
        assert joint['f_test']['f'] > joint['f_test']['critical']
        assert joint['f_test']['added'] == pytest.approx(3.0, abs=0.1)
        assert joint['f_test']['matters'] is matters


def test_without_friction_motion_differs_no_more_than_rest() -> None:
    """The same noise everywhere: F stays below its critical value."""
    joint = check(swinging(lambda torque, _, at: torque + noise(at)))['joints']['lift']
    assert joint['f_test']['f'] < joint['f_test']['critical']
    assert joint['f_test']['matters'] is False


@pytest.mark.parametrize(
    ('effort', 'words'),
    [
        (lambda *_: np.nan, 'none'), (lambda *_: 0.0, 'none'), (lambda *_: 5e-310, 'none'),
        (lambda *_: 5.0, 'constant'),
    ],
)  # fmt: skip
def test_an_effort_that_says_nothing_is_told_so(effort: Effort, words: str) -> None:
    """Missing, zero and constant efforts give no number, and are told as not checked."""
    statement = stated(swinging(effort))
    found: Any = statement.result['model_check']
    assert found['joints']['lift']['meaning'] == words
    assert 'bias' not in found['joints']['lift']
    assert (found['loads'], found['contacts'], statement.objections) == ([], [], ())
    assert 'measured effort of lift' in ' '.join(one.what for one in statement.not_checked)


def test_a_clipped_effort_does_not_count() -> None:
    """At its limit an effort says nothing about the load."""
    honest = check(swinging(lambda torque, _, at: torque + noise(at)))
    clipped = check(
        swinging(lambda torque, _, at: 45.0 if int(at * 20) % 5 == 0 else torque + noise(at))
    )
    lift = clipped['joints']['lift']
    assert lift['clipped_samples'] > 0
    assert lift['bias']['value'] == pytest.approx(
        honest['joints']['lift']['bias']['value'], abs=0.1
    )


def test_the_share_of_slow_samples_is_counted() -> None:
    """A quarter of the messages above 0.6 rad/s leaves three quarters."""
    run: list[Message] = []
    for message in run_of(40.0, joints_hz=10.0, imu_hz=20.0):
        if isinstance(message, Joints):
            fast = (message.time - T0) // S % 4 == 0
            message = replace(message, velocity=(0.7 if fast else 0.5, 9.0))  # noqa: PLW2901
        run.append(message)
    found = check(run)['speed_validity']
    assert found['share'] == pytest.approx(0.75, abs=0.01)
    assert found['joints'] == ['lift']


def test_a_long_run_keeps_a_bounded_number_of_samples() -> None:
    """Samples are thinned evenly; what is left still spans the run and says the same."""
    check_of, short = ModelCheck(TOLD), ModelCheck(TOLD)
    evaluator = RecordedEvaluator(TOLD)
    evaluator.start(T0)
    for start in range(0, 9000, 1000):
        run = run_of(1000.0, joints_hz=10.0, imu_hz=10.0)
        part = [replace(m, time=m.time + start * S) for m in run]
        rows = evaluator.batch(batch_of(part))
        check_of.add(rows)
        if not start:
            short.add(rows)
    found: Any = check_of.statement(T0, T0).result['model_check']
    assert MOST_SAMPLES / 2 <= found['samples'] <= MOST_SAMPLES
    assert found['samples'] * found['spacing_s'] == pytest.approx(9000.0, rel=0.01)
    other: Any = short.statement(T0, T0).result['model_check']
    assert found['joints'] == other['joints']


def test_least_squares_gives_the_line_and_interval_of_scipy() -> None:
    """For independent errors slope and half width are those of scipy.stats.linregress."""
    rng = np.random.default_rng(1)
    x = rng.uniform(-1.0, 1.0, 4000)
    y = 2.0 * x + 1.0 + rng.normal(0.0, 0.3, 4000)
    fit, line = least_squares(np.column_stack((x, np.ones(4000))), y), stats.linregress(x, y)
    assert fit is not None
    assert fit.value == pytest.approx([line.slope, line.intercept], rel=1e-9)
    assert fit.half_width[0] == pytest.approx(1.96 * line.stderr, rel=0.05)


def test_an_interval_holds_the_truth_as_often_as_it_says() -> None:
    """Of 400 runs with errors that resemble their neighbours some 95 % hold the mean."""
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(400):
        error = np.empty(300)
        error[0] = rng.normal()
        for k, shock in enumerate(rng.normal(0.0, 1.0, 299), start=1):
            error[k] = 0.7 * error[k - 1] + shock * np.sqrt(1.0 - 0.49)
        fit = least_squares(np.ones((300, 1)), error)
        assert fit is not None
        held += bool(abs(fit.value[0]) <= fit.half_width[0])
    assert 0.90 <= held / 400 <= 0.98


def test_equal_columns_have_no_fit() -> None:
    """A fit of equal columns has no result."""
    x = np.linspace(0.0, 1.0, 50)
    assert least_squares(np.column_stack((x, 2.0 * x)), x) is None


def test_neighbours_that_are_alike_count_less() -> None:
    """Samples whose neighbours correlate by 0.5 count as a third as many."""
    rng = np.random.default_rng(3)
    error = np.zeros(50_000)
    for k, shock in enumerate(rng.normal(size=49_999), start=1):
        error[k] = 0.5 * error[k - 1] + shock
    assert independent_samples(error) == pytest.approx(50_000 / 3.0, rel=0.05)
