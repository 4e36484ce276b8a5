"""The comparison of model and efforts finds what was put into synthetic efforts."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.streams import T0, Joints, Message, S, batch_of, run_of, settings
from scipy import stats

from ugv_acceptance.evaluation.downsampling import MOST_SAMPLES
from ugv_acceptance.evaluation.effort.model_check import (
    ModelCheck,
    independent_samples,
    least_squares,
)
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
            rate = 0.0 if part < 1.0 else (0.2 if int(step) % 8 < 4 else -0.2)
            level = 0.1 + 0.2 * (4 - abs(int(step) % 8 - 4))
            q = (level + (rate * (part - 1.0) if rate else 0.0), 0.0)
            torque = float(static_torque(TOLD.robot, q, DOWN)[0])
            message = replace(  # noqa: PLW2901
                message, position=q, velocity=(rate, 0.0), effort=(effort(torque, rate, at), np.nan)
            )
        found.append(message)
    return found


def check(messages: list[Message]) -> Any:
    """Return the comparison of a run."""
    evaluator, found = RecordedEvaluator(TOLD), ModelCheck(TOLD)
    evaluator.start(T0)
    found.add(evaluator.batch(batch_of(messages)))
    return found.result()


def noise(at: float) -> float:
    """Return what an effort is off by: the same for the same time."""
    return float(np.random.default_rng(int(at * 1e6)).normal(0.0, 0.2))


def test_bias_and_scale_are_found_within_their_intervals() -> None:
    """Effort = 0.9 torque + 2 N m + noise."""
    found = check(swinging(lambda torque, _, at: 0.9 * torque + 2.0 + noise(at)))['joints']['lift']
    assert found['scale']['low'] < 0.9 < found['scale']['high']
    assert found['scale']['high'] - found['scale']['low'] < 0.1
    assert found['sign'] == 'same'


def test_a_wrong_sign_is_told() -> None:
    """An effort that counts the other way is found as a scale of -1."""
    found = check(swinging(lambda torque, _, at: -torque + noise(at)))['joints']['lift']
    assert found['sign'] == 'opposite'
    assert found['scale']['value'] == pytest.approx(-1.0, abs=0.05)


def test_a_load_nobody_declared_is_weighed() -> None:
    """0.5 kg more in the hand than the model knows, with its interval."""

    def effort(torque: float, _: float, at: float) -> float:
        one, none = (
            float(static_torque(TOLD.robot, (0.0, 0.0), DOWN, Payload(m, (0.1, 0.0, 0.0)))[0])
            for m in (1.0, 0.0)
        )
        level = float(static_torque(TOLD.robot, (0.0, 0.0), DOWN)[0])
        # All loads are on one line with the arm: they scale with the cosine of its angle.
        return torque + 0.5 * (one - none) * torque / level + noise(at)

    found = check(swinging(effort))
    for told in (found['payload'], found['joints']['lift']['payload_kg']):
        assert told['low'] < 0.5 < told['high']
        assert told['high'] - told['low'] < 0.1


def test_friction_is_found_in_motion() -> None:
    """3 N m against the motion, whatever its speed, both ways; and F says that it moves."""
    found = check(swinging(lambda torque, rate, at: torque + 3.0 * np.sign(rate) + noise(at)))
    joint = found['joints']['lift']
    # All motion is at one speed, so that Coulomb and viscous friction cannot be told apart.
    assert joint['friction'] is None
    assert joint['f_test']['f'] > joint['f_test']['critical']
    assert joint['f_test']['rms_motion'] == pytest.approx(3.0, abs=0.1)
    assert not joint['f_test']['static_model_holds']


def test_without_friction_motion_differs_no_more_than_rest() -> None:
    """The same noise everywhere: F stays below its critical value."""
    joint = check(swinging(lambda torque, _, at: torque + noise(at)))['joints']['lift']
    assert joint['f_test']['f'] < joint['f_test']['critical']
    assert joint['f_test']['static_model_holds']


@pytest.mark.parametrize(
    ('effort', 'words'),
    [(lambda *_: np.nan, 'not recorded'), (lambda *_: 5.0, 'constant at 5')],
)
def test_an_effort_that_says_nothing_is_told_so(effort: Effort, words: str) -> None:
    """Missing and constant efforts give no number, and the result says so."""
    assert check(swinging(effort))['joints']['lift'] == {'effort': words}


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
    each = (0.7, -0.5, 0.3, -0.5)
    for message in run_of(32.0, joints_hz=10.0, imu_hz=20.0):
        if isinstance(message, Joints):
            step, part = divmod((message.time - T0) / S % 16.0, 4.0)
            rate = each[int(step)]
            at = -1.2 + 4.0 * sum(each[: int(step)]) + rate * part
            message = replace(message, position=(at, 0.0), velocity=(rate, 9.0))  # noqa: PLW2901
        run.append(message)
    found = check(run)['speed_validity']
    assert found['share'] == pytest.approx(0.75, abs=0.02)
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
    found = check_of.result()
    assert MOST_SAMPLES / 2 <= found['samples'] <= MOST_SAMPLES
    assert found['samples'] * found['spacing_s'] == pytest.approx(9000.0, rel=0.01)
    assert found['joints'] == short.result()['joints']


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
