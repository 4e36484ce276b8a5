"""A plan done by the runner in simulated time: real MuJoCo, real recordings, no ROS."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from run.runners import CONFIG, HOME, NEAR, plan_of, results, runner_of

from ugv_acceptance.bag.reader import open_bag
from ugv_acceptance.run.actuation import OPERATOR
from ugv_acceptance.run.simulated_world import Offline
from ugv_acceptance.run.step_verdict import seen_in

TIPS: dict[str, Any] = {
    'where': 'simulation', 'action': 'tip', 'payload_kg': 2.0,
    'ground': {'orientation': 'left', 'tilt_deg': 25.0},
    'posture_deg': {**HOME, 'turret_joint': 90.0, 'shoulder_joint': 40.0, 'elbow_joint': -85.0},
    'alerts': {'must': ['ERROR TIP_OVER left'], 'must_not': []},
}  # fmt: skip


def test_a_posture_is_reached_held_and_passes(tmp_path: Path) -> None:
    """What the recording shows in the hold is the posture that was asked for."""
    runner = runner_of(tmp_path / 'out', plan_of({}))
    (result,) = results(runner)
    assert (result['verdict'], result['earlier']) == ('PASS', [])
    time, q, _, _ = seen_in(tmp_path / 'out' / 'steps' / 's0', CONFIG).joined()
    start = open_bag(tmp_path / 'out' / 'steps' / 's0').start_ns
    held = q[(time - start) / 1e9 >= result['window_s'][1]]
    wanted = [math.radians(NEAR[n]) for n in CONFIG.settings.robot.joint_names]
    assert np.abs(held - wanted).max() < math.radians(2.0)


def test_the_same_seed_gives_the_same_recording(tmp_path: Path) -> None:
    """In simulated time nothing depends on the machine: the same bytes, twice."""
    for name in 'ab':
        list(results(runner_of(tmp_path / name, plan_of({}))))
    one, two = (tmp_path / name / 'steps' / 's0' / 's0_0.mcap' for name in 'ab')
    assert one.read_bytes() == two.read_bytes()


def test_a_tip_over_is_seen_and_the_next_step_stands_again(tmp_path: Path) -> None:
    """The alarm comes before the fall; afterwards the robot is set up from the start."""
    first, second = results(runner_of(tmp_path / 'out', plan_of(TIPS, {})))
    assert (first['verdict'], second['verdict']) == ('PASS', 'PASS')
    path = tmp_path / 'out' / 'steps' / 's0'
    time, _, _, tilt = seen_in(path, CONFIG).joined()
    fallen = time[tilt.min(axis=1) < math.radians(-20.0)]
    assert len(fallen)
    raised = next(a for a in first['alerts'] if a['level'] == 'ERROR' and a['code'] == 'TIP_OVER')
    assert raised['start_s'] < (fallen[0] - open_bag(path).start_ns) / 1e9


def test_an_alarm_that_is_not_expected_stops_the_fall(tmp_path: Path) -> None:
    """The same motion where the alarm is not expected: frozen in time, the robot does not tip."""
    unexpected = {**TIPS, 'alerts': {'must_not': ['ERROR TIP_OVER']}}
    (result,) = results(runner_of(tmp_path / 'out', plan_of(unexpected)))
    assert result['verdict'] == 'FAIL'
    assert result['reasons'][0].startswith('stopped: DANGER TIP_OVER left')
    path = tmp_path / 'out' / 'steps' / 's0'
    time, q, _, tilt = seen_in(path, CONFIG).joined()
    after = (time - open_bag(path).start_ns) / 1e9 > result['window_s'][2] + 0.5
    assert after.sum() > 10
    assert np.ptp(q[after], axis=0).max() < math.radians(1.0)
    assert tilt.min() > 0.0


def test_missing_messages_are_tried_again_and_told(tmp_path: Path) -> None:
    """An IMU that is dead for a while: inconclusive first, then done again and passed."""
    runner = runner_of(tmp_path / 'out', plan_of({}), 'dead:imu@1.5-9')
    (result,) = results(runner)
    assert result['verdict'] == 'PASS'
    assert [e['verdict'] for e in result['earlier']] == ['INCONCLUSIVE']
    assert 'STALE' in result['earlier'][0]['reasons'][0]
    assert open_bag(tmp_path / 'out' / 'steps' / 's0.attempt-1').topics['/imu/data'].count > 10


def test_a_monitor_that_is_silent_for_a_moment_makes_no_step_fail(tmp_path: Path) -> None:
    """On a busy machine it is heard again before the stop is looked at: done again and passed."""
    runner, silent = runner_of(tmp_path / 'out', plan_of({})), 'the monitor has said nothing'
    world = runner.world

    def watchdog(now: float) -> None:
        if now > 3.0 and world.brake.armed and not (tmp_path / 'told').exists():
            (tmp_path / 'told').touch()
            world.brake.stop(silent, blind=True)

    assert isinstance(world, Offline)
    world.progress = watchdog
    (result,) = results(runner)
    assert not world.dead()
    assert result['verdict'] == 'PASS'
    assert [(e['verdict'], e['reasons']) for e in result['earlier']] == [('INCONCLUSIVE', [silent])]


def test_messages_that_never_come_back_show_nothing(tmp_path: Path) -> None:
    """After the last attempt without messages a step is INCONCLUSIVE, with the reason."""
    (result,) = results(runner_of(tmp_path / 'out', plan_of({}), 'dead:imu@1.5'))
    assert result['verdict'] == 'INCONCLUSIVE'
    assert 'NO DATA INPUT_STALE imu' in result['reasons'][0]


def test_a_posture_that_is_not_reached_fails(tmp_path: Path) -> None:
    """A joint whose encoder froze: the joint that is off is named."""
    (result,) = results(runner_of(tmp_path / 'out', plan_of({}), 'frozen-encoder:shoulder_joint'))
    assert result['verdict'] == 'FAIL'
    assert result['reasons'][0].startswith('the posture was not reached: shoulder_joint is ')


def test_a_posture_that_is_left_during_the_hold_fails(tmp_path: Path) -> None:
    """A step fails if the arm leaves its posture during the hold."""
    runner = runner_of(tmp_path / 'out', plan_of({'hold_s': 4.0}))
    world = runner.world

    def meddle(now: float) -> None:
        if now > 6.0:
            world.commands.move({'shoulder_joint': math.radians(112.0)}, 0.5)

    assert isinstance(world, Offline)
    world.progress = meddle
    (result,) = results(runner)
    assert result['verdict'] == 'FAIL'
    assert result['reasons'][0].startswith('the posture was not held: shoulder_joint')


def test_a_pull_is_felt(tmp_path: Path) -> None:
    """The simulated drag holds at the plan's force and slips well above it."""
    moved = []
    for force in (170.0, 260.0):
        runner = runner_of(tmp_path / f'{force}', plan_of(
            {'action': 'pull', 'force_n': force, 'hold_s': 2.0, 'posture_deg': HOME}
        ))  # fmt: skip
        list(results(runner))
        assert isinstance(runner.world, Offline)
        moved.append(-float(runner.world.virtual.remote.simulation.base()[0][0]))
    assert moved[0] < 0.01
    assert moved[1] > 0.1


def test_an_operator_who_refuses_leaves_the_step_open(tmp_path: Path) -> None:
    """A step that the operator refuses neither passes nor fails, and is not tried again."""
    runner = runner_of(tmp_path / 'out', plan_of({}), mode=OPERATOR)
    (result,) = results(runner)
    assert result['verdict'] == 'INCONCLUSIVE'
    assert result['reasons'] == ['the operator did not do what was asked']
    assert result['earlier'] == []


def test_an_interrupted_step_has_no_result(tmp_path: Path) -> None:
    """Asked to end, the runner freezes the robot and leaves the step for --resume."""
    runner = runner_of(tmp_path / 'out', plan_of({}))
    runner.asked = runner.moves.asked = lambda: runner.world.now() > 2.0
    assert runner.run(runner.folder.plan.steps[0]) is None
    lines = (tmp_path / 'out' / 'journal.jsonl').read_text().splitlines()
    assert json.loads(lines[-1])['event'] == 'interrupted'
    assert runner.folder.done(runner.folder.plan.steps[0]) is None


# Behind the robot the hand is 2 cm above the ground: no further than a degree of encoder zeros.
PICKS: dict[str, Any] = {
    'id': 'picks', 'posture_deg': {**HOME, 'shoulder_joint': 130.0, 'elbow_joint': 115.5},
}  # fmt: skip


def test_a_step_may_let_the_hand_touch_the_ground(tmp_path: Path) -> None:
    """With hand_may_touch it passes, and the next step begins at home; without, it is stopped."""
    permitted = {**PICKS, 'id': 'may', 'hand_may_touch': True}
    may, after, not_ = results(runner_of(tmp_path / 'out', plan_of(permitted, {}, PICKS)))
    assert (may['verdict'], may['reasons']) == ('PASS', ['all alerts as expected'])
    assert 'use' not in may['measured']
    assert may['measured']['tilt_left_deg'] > 20.0
    assert after['verdict'] == 'PASS'
    assert not_['verdict'] in ('FAIL', 'INCONCLUSIVE')
    assert 'ARM_ON_GROUND' in not_['reasons'][0]
