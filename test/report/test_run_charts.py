"""Charts of a run: its alerts in lanes, however many they are."""

from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex

from ugv_acceptance.config import load
from ugv_acceptance.evaluation.downsampling import Strips
from ugv_acceptance.report.acceptance import MOST_TITLES, _spans
from ugv_acceptance.report.run_charts import ALERT_COLOURS, run_chart

SETTINGS = load().settings
LENGTH = 100.0


def alert(start: float, end: float | None, level: str = 'WARN', **more: Any) -> dict[str, Any]:
    """Return an alert of a result: TIP_OVER to the right, unless told otherwise."""
    told = {'code': 'TIP_OVER', 'subject': 'right', 'worst_s': start, 'message': f'at {start}'}
    return {**told, 'start_s': start, 'end_s': end, 'level': level, **more}


def lanes(alerts: list[dict[str, Any]]) -> Axes:
    """Return the axes of the alerts of a run of 100 s."""
    nothing: Any = {'first_gaps_s': []}
    result = {
        'alerts': alerts,
        'coverage': {'duration_s': LENGTH},
        'inputs': {'joint_states': nothing, 'imu': nothing},
    }
    time = np.arange(0.0, LENGTH)
    joints = len(SETTINGS.robot.joint_names)
    of_joints = np.zeros((len(time), joints))
    strips = Strips(time, of_joints, np.full((len(time), 4), 0.3), of_joints)
    made = run_chart(strips, result, SETTINGS)
    assert made is not None
    return made.axes[2]


def bars(axes: Axes) -> list[tuple[float, float, float, float, str]]:
    """Return (from, to, lower edge, upper edge, hatch) of every bar that is drawn, in order."""
    found = []
    for drawn in axes.collections:
        assert isinstance(drawn, PolyCollection)
        for path in drawn.get_paths():
            corners = np.asarray(path.vertices)
            (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
            places = (round(float(x), 9) for x in (left, right, low, high))
            found.append((*places, drawn.get_hatch() or ''))
    return found  # type: ignore[return-value]


def test_every_alert_has_a_bar_from_its_beginning_to_its_end() -> None:
    """In its lane, high and hatched for DANGER, and over the CAUTION that it began as."""
    told = [
        alert(10.0, 20.0),
        alert(12.0, 15.0, 'ERROR'),
        alert(30.0, None),
        alert(40.0, 41.0, 'STALE', code='INPUT_STALE', subject='imu'),
        alert(50.0, 50.0, 'WARN'),
    ]
    axes = lanes(told)
    found = bars(axes)
    assert sorted(found) == [
        (10.0, 20.0, -0.2, 0.2, ''),
        (12.0, 15.0, -0.35, 0.35, '////'),
        (30.0, LENGTH, -0.2, 0.2, ''),
        (40.0, 41.0, 0.8, 1.2, '..'),
        (50.0, 50.0, -0.2, 0.2, ''),
    ]
    order = [bar[4] for bar in found if bar[2] < 0.5]
    assert order == ['', '', '', '////']
    colours = {to_hex(np.asarray(drawn.get_facecolor())[0]) for drawn in axes.collections}
    assert colours == set(ALERT_COLOURS.values())
    assert [text.get_text() for text in axes.get_yticklabels()] == [
        'TIP_OVER right',
        'INPUT_STALE imu',
    ]


def test_the_worst_value_of_an_alert_is_marked_at_its_time() -> None:
    """A triangle in its lane; alerts without a time have none."""
    axes = lanes([alert(10.0, 20.0, worst_s=13.0), alert(30.0, 31.0, worst_s=None)])
    marks = [line for line in axes.lines if line.get_marker() == 'v']
    assert [(list(line.get_xdata()), list(line.get_ydata())) for line in marks] == [([13.0], [0])]  # type: ignore[arg-type]
    assert marks[0].get_linestyle() == 'None'


@pytest.mark.parametrize('count', [3, 3000])
def test_what_is_drawn_is_a_lane_and_not_an_alert(count: int) -> None:
    """As many things to draw for three thousand alerts as for three, and each has its bar."""
    step = LENGTH / count
    axes = lanes([alert(k * step, (k + 0.5) * step, 'WARN') for k in range(count)])
    assert len(axes.collections) == 1
    assert not axes.patches
    assert len(axes.lines) == 1
    assert len(bars(axes)) == count


def test_a_caption_names_a_few_alerts_and_counts_the_rest() -> None:
    """Alerts that follow each other closely are one picture; no caption is a list of hundreds."""
    told = [alert(k * 0.1, k * 0.1 + 0.05, 'ERROR') for k in range(900)]
    ((caption, start, end),) = _spans({'alerts': told, 'coverage': {'duration_s': LENGTH}})
    assert start == 0.0
    assert end == pytest.approx(94.95)
    assert caption.count('DANGER') == MOST_TITLES
    assert caption.endswith(f'; and {900 - MOST_TITLES} more alerts')
    few = _spans({'alerts': told[:2], 'coverage': {'duration_s': LENGTH}})
    assert few[0][0] == '0.00 s: DANGER, at 0.0; 0.10 s: DANGER, at 0.1'
