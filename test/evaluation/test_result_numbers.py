"""The numbers of a result: seconds, degrees and margins that follow from what was gathered."""

import math

import numpy as np
import pytest
from evaluation.streams import MS, T0, S, settings

from ugv_acceptance.evaluation.alerts.state_machine import ERROR, WARN, Alert, Rule
from ugv_acceptance.evaluation.settings import Limits
from ugv_acceptance.evaluation.summary import Extreme, Summary, alert_result, result_of

TOLD = settings(limits=Limits((40.0, 30.0)))


def gathered() -> Summary:
    """Return a summary of three evaluated seconds."""
    found = Summary(TOLD, evaluated=3 * S, messages=77, tip_violation=S // 2)
    found.load[0].see(np.array((10.0, 35.0, 20.0)), T0 + np.array((0, 500, 900)) * MS)
    found.load_violation = [S // 4, 0]
    for side, tilt in enumerate((0.3, 0.1, math.inf, 0.2)):
        found.tip[side].see(np.array((-tilt, -tilt - 0.1)), T0 + np.array((100, 200)) * MS)
    found.states = {'standing': 70, 'inverted': 7}
    return found


def test_a_result_is_told_in_seconds_newton_metres_and_degrees() -> None:
    """What was never seen is None; the least tilt names its edge."""
    found = result_of(gathered(), [], T0 - S, 4 * S)
    assert found['coverage'] == {
        'evaluated_s': 3.0, 'duration_s': 4.0, 'fraction': 0.75, 'messages_judged': 77,
        'longest_unseen_s': 0.0, 'unseen_s': [], 'unseen_stretches': 0, 'unseen_total_s': 0.0,
    }  # fmt: skip
    assert found['torque']['lift'] == {
        'limit': 40.0, 'unit': 'N m', 'max_abs': 35.0, 'min_margin': 5.0, 'time_of_min_s': 1.5,
        'time_in_violation_s': 0.25,
    }  # fmt: skip
    assert found['torque']['slide'] == {
        'limit': 30.0, 'unit': 'N', 'max_abs': None, 'min_margin': None, 'time_of_min_s': None,
        'time_in_violation_s': 0.0,
    }  # fmt: skip
    stability = found['stability']
    assert stability['min_angle_deg'] == pytest.approx(math.degrees(0.1))
    assert (stability['edge'], stability['time_of_min_s']) == ('left', pytest.approx(1.1))
    assert stability['time_in_violation_s'] == 0.5
    assert sorted(stability['edges']) == ['front', 'left', 'right']
    assert stability['edges']['front']['min_angle_deg'] == pytest.approx(math.degrees(0.3))
    assert stability['states'] == {'standing': 70, 'inverted': 7}


def test_nothing_seen_is_nothing_told() -> None:
    """A recording without margins has None for every worst value, and a coverage of 0."""
    found = result_of(Summary(TOLD), [], T0, 0)
    assert found['coverage']['fraction'] == 0.0
    assert found['stability']['min_angle_deg'] is None
    assert found['stability']['edge'] is None
    assert found['stability']['time_of_min_s'] is None


def test_an_alert_is_told_with_its_times_and_peak() -> None:
    """The peak of a tilt is the tilt left in degrees; an active alert has no end."""
    tip = Alert(Rule('TIP_OVER', 'left', ERROR, -0.1, -0.12, 0, 0), T0 + S, -0.05)
    found = alert_result(tip, TOLD, T0 - S // 2)
    assert (found['start_s'], found['end_s']) == (1.5, None)
    assert found['peak'] == pytest.approx(math.degrees(0.05))
    assert (found['code'], found['subject'], found['level']) == ('TIP_OVER', 'left', 'ERROR')
    assert not found['advice_computed']
    torque = Alert(Rule('TORQUE_LIMIT', 'lift', WARN, 32.0, 30.0, 0, 0), T0, 33.0)
    torque.end = T0 + 3 * S
    found = alert_result(torque, TOLD, T0, 'lower the arm')
    assert (found['start_s'], found['end_s'], found['peak']) == (0.0, 3.0, 33.0)
    assert (found['advice'], found['advice_computed']) == ('lower the arm', True)
    unknown = Alert(Rule('TORQUE_LIMIT', 'lift', WARN, 32.0, 30.0, 0, 0), T0, -math.inf)
    assert alert_result(unknown, TOLD, T0)['peak'] is None


def test_an_alert_is_told_with_the_time_of_its_peak() -> None:
    """That is not when it was raised; nothing where there is no value, or nobody knows when."""
    alert = Alert(Rule('TORQUE_LIMIT', 'lift', WARN, 32.0, 30.0, 0, 0), T0, 33.0)
    assert alert_result(alert, TOLD, T0)['worst_s'] is None
    alert.worst_at = T0 + 3 * S
    assert alert_result(alert, TOLD, T0 - S // 2)['worst_s'] == 3.5
    alert.peak = -math.inf
    assert alert_result(alert, TOLD, T0)['worst_s'] is None


def test_the_largest_is_the_first_of_equals_and_never_not_a_number() -> None:
    """Of equal largest values the first is kept, across parts too, and never NaN."""
    found = Extreme()
    found.see(np.array((np.nan, 2.0, 2.0)), np.array((1, 2, 3)))
    found.see(np.array((2.0, np.nan)), np.array((4, 5)))
    assert (found.value, found.time) == (2.0, 2)
    found.see(np.array((np.nan, 2.5)), np.array((6, 7)))
    assert (found.value, found.time) == (2.5, 7)
