"""Labelled runs: events come from the simulation's truth, alerts from the evaluator."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.labelled_runs import SATURATION, TIP, Labelled, cases, label
from ugv_acceptance.config import load
from ugv_acceptance.offline.evaluate import evaluate
from ugv_acceptance.run.catalogue import Case, case_of
from ugv_acceptance.run.record import record
from ugv_acceptance.simulation.faults import fault_of
from ugv_acceptance.simulation.repertoire import KINDS, SECONDS

CONFIG = load()
ROBOT = CONFIG.settings.robot


def labelled(kind: str, seed: int, seconds: float | None = None, fault: str = '') -> Labelled:
    """Return a labelled run of a kind."""
    scenario = KINDS[kind](ROBOT, np.random.default_rng(seed), seconds or SECONDS[kind])
    faults = (fault_of(fault, 'imu', 2.0),) if fault else ()
    return label(CONFIG, kind, seed, Case(scenario, faults))


def test_a_slow_tip_over_is_warned_of_in_time() -> None:
    """A slow tip-over comes at least 0.5 s after its ERROR, and that 0.5 s after its WARN."""
    (event,) = [e for e in labelled('tilt', 1).events if e.kind == TIP]
    assert event.warned + 0.5 < event.alarmed < event.time - 0.5


def test_a_dead_imu_is_alarmed_before_the_robot_tips() -> None:
    """A dead IMU raises NO DATA before the robot tips, and gives no predictions."""
    (event,) = [e for e in labelled('tilt', 1, fault='dead').events if e.kind == TIP]
    assert event.alarmed < 3.0
    assert event.predicted == np.inf


def test_a_reach_saturates_and_is_warned_of() -> None:
    """A shoulder that saturates raised the warning of its limit well before."""
    events = [e for e in labelled('reach', 0).events if e.kind == SATURATION]
    assert [e.subject for e in events] == ['shoulder_joint']
    assert events[0].warned < events[0].time - 0.3


def test_a_weak_motor_is_told_when_it_gives_no_more() -> None:
    """A motor weaker than declared is found when its effort stops following the need."""
    found = [
        label(CONFIG, *case) for case in cases(CONFIG, 200, 0) if case[0] == 'reach+weak-motor'
    ]
    told = [e.warned - e.time for r in found for e in r.events]
    assert len(told) > 2
    assert all(0.2 < late < 0.6 for late in told)


def test_a_second_publisher_is_alarmed_before_the_robot_tips() -> None:
    """With positions of two robots in turn, margins are unknown within a second."""
    told = [
        event
        for case in cases(CONFIG, 200, 0)
        if case[0] == 'swing+second-publisher'
        for event in label(CONFIG, *case).events
        if event.kind == TIP
    ]
    assert len(told) > 2
    assert all(e.alarmed < 4.1 < e.time - 0.5 for e in told)


def test_braking_is_an_impact_and_a_swinging_arm_is_none() -> None:
    """A shove to the base before a tip-over is an impact; gravity and a moving arm are not."""
    dashed = [e.impact for s in (0, 1, 4) for e in labelled('dash', s).events if e.kind == TIP]
    swung = [e.impact for s in range(6) for e in labelled('swing', s).events if e.kind == TIP]
    snatched = [e.impact for s in (2,) for e in labelled('snatch', s).events if e.kind == TIP]
    lifted = [e.impact for s in (1, 6, 9) for e in labelled('grasp', s).events if e.kind == TIP]
    assert dashed == [True] * 3
    assert swung == [False] * len(swung) != []
    assert snatched == [True]
    assert lifted == [False] * 3


def test_quiet_work_is_quiet() -> None:
    """Quiet work with obstacles and loads has no event, no alarm and no prediction."""
    found = labelled('work', 1, seconds=120.0)
    assert found.events == ()
    assert found.for_nothing == ()
    assert found.predictions_for_nothing == 0


def test_there_are_as_many_runs_as_asked() -> None:
    """As many runs as requested are made, of every kind, no seed twice."""
    found = list(cases(CONFIG, 200, 0))
    assert len(found) >= 200
    assert len({seed for _, seed, _ in found}) == len(found)
    assert set(KINDS) - {'work'} <= {kind.split('+')[0] for kind, _, _ in found}


@pytest.mark.parametrize('seed', [1, 2])
def test_a_label_says_what_the_recording_says(tmp_path: Path, seed: int) -> None:
    """Columns given to the evaluator give the same alerts as the recorded messages."""
    case = case_of('swing', ROBOT, seed, 8.0)
    case = replace(case, scenario=replace(case.scenario, joint_rate=100.0, imu_rate=200.0))
    record(CONFIG, case, seed, tmp_path / 'run')
    alerts = evaluate(tmp_path / 'run', config=CONFIG).alerts
    started = [a.start_s for a in alerts if a.code == 'TIP_OVER']
    events = [e for e in label(CONFIG, 'swing', seed, case).events if e.kind == TIP]
    for event in events:
        assert min(started) == pytest.approx(event.warned, abs=0.05)
    assert bool(events) <= bool(started)
