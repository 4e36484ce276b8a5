"""What the checks of the IMU judged in a recording, and what they cannot tell on it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from evaluation.imu_runs import ImuRun, good_run, tilted_by
from evaluation.streams import settings

from ugv_acceptance.evaluation.alerts.rules import RuleSet
from ugv_acceptance.evaluation.criteria.imu_statement import ImuExamination
from ugv_acceptance.evaluation.criteria.statement import Statement
from ugv_acceptance.evaluation.inputs.imu import ImuTracker
from ugv_acceptance.evaluation.settings import ImuInput


def stated(run: ImuRun | None, covariances: float = 0.0, **imu: Any) -> Statement:
    """Return the statement on a run; `covariances` of rate and acceleration."""
    told = settings(ImuInput(**imu))
    tracker = ImuTracker(told, RuleSet(told).attitude)
    if run is None:
        return ImuExamination(tracker).statement(0, 1)
    columns = [
        replace(
            c,
            angular_velocity_covariance_0=c.angular_velocity_covariance_0 + covariances,
            linear_acceleration_covariance_0=c.linear_acceleration_covariance_0 + covariances,
        )
        for c in run.columns()
    ]
    tracker.columns(columns)
    return ImuExamination(tracker).statement(int(run.time[0]), int(run.time[-1]))


def gaps(statement: Statement) -> dict[str, str]:
    """Return what was not checked, and why."""
    return {gap.what: gap.why for gap in statement.not_checked}


def checks(statement: Statement) -> Any:
    """Return the result's part."""
    return statement.result['imu_checks']


def test_the_windows_of_a_good_run_are_counted() -> None:
    """Every second from the first whole window on; none contradicts, those that turn are verified."""
    found = checks(stated(good_run(1, 60.0)))
    assert [found['gravity'][t]['windows'] for t in ('2 s', '5 s', '10 s')] == [58, 55, 50]
    for window in found['gravity'].values():
        assert window['contradicting'] == 0
        assert 0.0 < window['worst_mps2'] < window['threshold_mps2']
    rates = found['rates']
    assert rates['windows'] == 57
    assert 0 < rates['verified'] <= rates['turning'] < 57
    assert rates['contradicting'] == 0
    assert found['frozen']['changes'] == 6000
    assert found['two_sources']['windows'] == 29


def test_windows_that_contradict_are_counted() -> None:
    """With the worst beside the threshold that it passed."""
    found = checks(stated(tilted_by(good_run(1, 30.0), 30.0)))['gravity']['5 s']
    assert found['windows'] == 25
    assert found['contradicting'] >= 24
    assert found['worst_mps2'] > found['threshold_mps2']


def test_a_good_run_tells_how_small_an_error_may_be_missed() -> None:
    """One line, and none of what was checked."""
    found = gaps(stated(good_run(1, 60.0)))
    assert list(found) == ['tilt errors']
    assert 'less than about 9 degrees' in found['tilt errors']


@pytest.mark.parametrize(
    ('change', 'imu', 'what', 'why'),
    [
        ({'w': 0.0}, {}, 'orientation against the gyro', 'nothing but 0'),
        ({'q': 0.0}, {'rest_rate': 0.0}, 'tilt', 'never verified at rest'),
    ],
)
def test_what_a_run_cannot_tell_is_listed(
    change: dict[str, float], imu: dict[str, float], what: str, why: str
) -> None:
    """A gyro of zeros; an accelerometer alone that never rests."""
    run = good_run(1, 30.0)
    run = replace(run, **{name: getattr(run, name) * by for name, by in change.items()})
    assert why in gaps(stated(run, **imu))[what]


def test_too_few_messages_tell_nothing_of_the_gyro() -> None:
    """Below 40 a second; the number is told."""
    assert (
        '25 messages a second'
        in gaps(stated(good_run(1, 30.0, 25.0)))['orientation against the gyro']
    )


def test_an_imu_that_never_varied_is_told_unless_it_is_declared() -> None:
    """With imu.noise_free it is as it should be."""
    run = good_run(1, 30.0)
    run = replace(run, **{n: getattr(run, n)[:1].repeat(len(run.q), 0) for n in 'qwa'})
    assert 'never varied' in gaps(stated(run))['imu']
    assert 'imu' not in gaps(stated(run, noise_free=True))


def test_numbers_that_are_declared_as_not_measured_are_told() -> None:
    """Covariance -1 beside numbers."""
    found = gaps(stated(good_run(1, 30.0), -1.0))
    assert 'they are used' in found['rate and acceleration of the IMU']


def test_without_an_imu_nothing_is_stated() -> None:
    """Neither numbers nor gaps: that there is no IMU is told elsewhere."""
    assert stated(None) == Statement({'imu_checks': None})
    assert np.isfinite(checks(stated(good_run(1, 30.0)))['rates']['threshold_cosine'])
