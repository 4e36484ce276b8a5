"""A frozen IMU: bit-identical after it kept changing, whatever its stamps do."""

from dataclasses import replace

import numpy as np
import pytest
from evaluation.imu_runs import NS, ImuRun, good_run
from evaluation.inputs.test_imu_motion import codes, facts, live, of, recorded

from ugv_acceptance.evaluation.alerts.state_machine import ERROR


def frozen(run: ImuRun, begin: float, seconds: float, hz: float = 100.0) -> ImuRun:
    """Return a run whose values stand still for a while."""
    a, b = int(begin * hz), int((begin + seconds) * hz)
    copies = [v.copy() for v in (run.q, run.w, run.a)]
    for v in copies:
        v[a:b] = v[a]
    return replace(run, q=copies[0], w=copies[1], a=copies[2])


@pytest.mark.parametrize('stamps', ['running', 'standing'])
@pytest.mark.parametrize('seconds', [1.05, 2.0, 6.0])
def test_values_that_stand_still_are_not_evaluated(stamps: str, seconds: float) -> None:
    """From a second after they began to until they change, and not the second before either."""
    run = frozen(good_run(2, 12.0), 4.0, seconds)
    if stamps == 'standing':
        still = (run.seconds >= 4.0) & (run.seconds < 4.0 + seconds)
        run = replace(run, stamp=np.where(still, run.stamp[400], run.stamp))
    rows, watch = recorded(run)
    alert = of(watch, 'IMU_FROZEN')
    assert alert.rule.level == ERROR
    assert alert.start == run.time[400] + NS
    assert alert.end == run.time[int(400 + seconds * 100)] + NS
    assert alert.rule.reach == NS
    assert np.isnan(rows[0].gravity[500 : int(400 + seconds * 100)]).all()


@pytest.mark.parametrize(('seconds', 'hz'), [(0.95, 100.0), (1.5, 10.0)])
def test_a_shorter_standstill_is_none(seconds: float, hz: float) -> None:
    """Less than a second, or fewer than 20 messages."""
    run = frozen(good_run(2, 12.0, hz), 4.0, seconds, hz)
    assert 'IMU_FROZEN' not in codes(recorded(run)[1])


def test_an_imu_that_never_varied_is_not_frozen() -> None:
    """A simulator without noise looks the same; so does one with fewer than ten values before."""
    run = frozen(good_run(2, 12.0), 0.0, 12.0)
    assert 'IMU_FROZEN' not in codes(recorded(run)[1])
    few = good_run(2, 12.0)
    few = frozen(few, 0.08, 12.0)
    assert 'IMU_FROZEN' not in codes(recorded(few)[1])


def test_two_values_in_turn_are_not_ten() -> None:
    """An IMU that only goes to and fro between two values did not keep changing."""
    run = good_run(2, 12.0)
    q, w, a = (v[np.arange(len(v)) % 2] for v in (run.q, run.w, run.a))
    assert 'IMU_FROZEN' not in codes(recorded(frozen(replace(run, q=q, w=w, a=a), 4.0, 5.0))[1])


def test_an_orientation_alone_may_stand_still() -> None:
    """While rates or acceleration go on changing nothing is frozen."""
    run = good_run(2, 12.0)
    assert 'IMU_FROZEN' not in codes(recorded(replace(run, q=run.q[:1].repeat(len(run.q), 0)))[1])


@pytest.mark.parametrize('number', range(10))
def test_one_number_that_changes_is_enough(number: int) -> None:
    """An IMU is not frozen while any of its ten numbers goes on changing, live and recorded."""
    run = frozen(good_run(2, 12.0), 4.0, 3.0)
    table = np.hstack((run.q, run.w, run.a))
    table[400:700, number] += 1e-6 * np.arange(300)
    run = replace(run, q=table[:, :4], w=table[:, 4:7], a=table[:, 7:])
    assert 'IMU_FROZEN' not in codes(recorded(run)[1])
    assert 'IMU_FROZEN' not in codes(live(run)[2])


def test_an_orientation_that_is_not_a_number_freezes_with_the_rest() -> None:
    """NaN in the orientation counts as the same as NaN."""
    run = frozen(good_run(2, 12.0), 4.0, 3.0)
    assert 'IMU_FROZEN' in codes(recorded(replace(run, q=run.q * np.nan))[1])
    assert 'IMU_FROZEN' in codes(live(replace(run, q=run.q * np.nan))[2])


def test_who_declares_an_imu_without_noise_hears_nothing() -> None:
    """With imu.noise_free values may stand still."""
    run = frozen(good_run(2, 12.0), 4.0, 3.0)
    assert 'IMU_FROZEN' not in codes(recorded(run, noise_free=True)[1])
    assert 'IMU_FROZEN' not in codes(live(run, noise_free=True)[2])


@pytest.mark.parametrize(
    'cuts', [[], [399], [400], [401], [450, 499], [500], [501, 650], [700, 701]]
)
def test_cuts_of_a_recording_change_nothing(cuts: list[int]) -> None:
    """A standstill that begins, is confirmed or ends at the edge of a part is the same."""
    run = frozen(frozen(good_run(2, 12.0), 4.0, 3.0), 8.5, 1.5)
    assert facts(recorded(run, cuts)[1].log) == facts(live(run)[2].log)
