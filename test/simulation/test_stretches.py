"""Runs simulated in parts, faults of sensors, and a robot under live commands."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ugv_acceptance import BadSample
from ugv_acceptance.config import load
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.simulation.corruption import Corruption, weakened
from ugv_acceptance.simulation.drive_by_wire import RemoteRobot
from ugv_acceptance.simulation.faults import Fault
from ugv_acceptance.simulation.poses import STOWED
from ugv_acceptance.simulation.repertoire import KINDS
from ugv_acceptance.simulation.scenario import ImuLog, JointLog, Scenario
from ugv_acceptance.simulation.scenarios import gentle
from ugv_acceptance.simulation.simulation import BUILD
from ugv_acceptance.simulation.stretches import run, stretches

ROBOT = load().settings.robot
SHORT = Scenario('short', 2.0, start=STOWED, commands=gentle().commands[:1])


def test_one_stretch_is_the_whole_run() -> None:
    """A run simulated as one part is that of `run`, bit for bit."""
    whole, (stretch,) = run(ROBOT, SHORT, 3), stretches(ROBOT, SHORT, 3, math.inf)
    assert np.array_equal(whole.joints.position, stretch.joints.position)
    assert np.array_equal(whole.imu.linear_acceleration, stretch.imu.linear_acceleration)


def test_stretches_only_cut_the_run() -> None:
    """The truth does not depend on how a run is cut into parts; no sample is lost or doubled."""
    (whole,) = stretches(ROBOT, SHORT, 3, math.inf)
    parts = list(stretches(ROBOT, SHORT, 3, 0.5))
    assert len(parts) > 2
    for name in ('stamp', 'lean', 'position', 'slope'):
        joined = np.concatenate([getattr(p.truth, name) for p in parts])
        assert np.array_equal(joined, getattr(whole.truth, name)), name
    assert np.array_equal(np.concatenate([p.imu.stamp for p in parts]), whole.imu.stamp)


@pytest.mark.parametrize('kind', KINDS)
def test_a_seed_draws_one_scenario(kind: str) -> None:
    """The same seed gives the same commands, another seed others."""
    one, same, other = (KINDS[kind](ROBOT, np.random.default_rng(s), 30.0) for s in (1, 1, 2))
    assert one == same
    assert one != other


def joint_log(n: int = 5) -> JointLog:
    """Return joint states a second apart, each position of its own."""
    q = np.arange(4.0 * n).reshape(n, 4)
    return JointLog(np.arange(float(n)), q, q + 100.0, q)


def test_a_frozen_encoder_tells_its_last_position() -> None:
    """From its start to its end one joint tells the same, at rest; the others go on."""
    fault = Fault('frozen-encoder', 'shoulder_joint', start=1.0, end=3.0)
    log, j = joint_log(), ROBOT.joint_names.index('shoulder_joint')
    told = Corruption((fault,), ROBOT.joint_names).joints(log)
    assert told.position[:, j].tolist() == [*log.position[[0, 1, 1, 3, 4], j]]
    assert told.velocity[1:3, j].tolist() == [0.0, 0.0]
    assert np.array_equal(np.delete(told.position, j, 1), np.delete(log.position, j, 1))


def test_a_frozen_encoder_is_the_same_row_by_row() -> None:
    """A live simulator, which has one row at a time, gives what a recording gives."""
    fault = Fault('frozen-encoder', 'elbow_joint', start=1.0, end=4.0)
    log, at_once = joint_log(), Corruption((fault,), ROBOT.joint_names)
    live = Corruption((fault,), ROBOT.joint_names)
    rows = [
        live.joints(JointLog(*(x[k : k + 1] for x in
                               (log.stamp, log.position, log.velocity, log.effort))))
        for k in range(5)
    ]  # fmt: skip
    assert np.array_equal(np.concatenate([r.position for r in rows]), at_once.joints(log).position)


def test_another_robot_stands_where_this_one_was() -> None:
    """Behind each message comes one that tells the first position again; rates of a row at rest."""
    fault = Fault('second-publisher', 'joint_states', start=1.0, end=4.0)
    log = joint_log()
    told = Corruption((fault,), ROBOT.joint_names).joints(log)
    assert told.stamp.tolist() == [0.0, 1.0, 1.001, 2.0, 2.001, 3.0, 3.001, 4.0]
    rows = [0, 1, 1, 2, 1, 3, 1, 4]
    assert np.array_equal(told.position, log.position[rows])


def test_a_turned_imu_tells_what_a_turned_sensor_measures() -> None:
    """Vectors and orientation turn together, as scipy turns them."""
    rng = np.random.default_rng(0)
    log = ImuLog(np.zeros(1), Rotation.random(1, random_state=1).as_quat(),
                 rng.normal(size=(1, 3)), rng.normal(size=(1, 3)))  # fmt: skip
    told = Corruption((Fault('wrong-mounting', amount=30.0),), ()).imu(log)
    turn = Rotation.from_euler('z', 30.0, degrees=True)
    assert told.linear_acceleration == pytest.approx(turn.inv().apply(log.linear_acceleration))
    expected = Rotation.from_quat(log.orientation) * turn
    apart = (Rotation.from_quat(told.orientation).inv() * expected).magnitude()
    assert apart == pytest.approx(0.0, abs=1e-9)


def test_messages_are_dropped_and_doubled_as_often_as_asked() -> None:
    """Shares are met within what chance allows (five standard deviations)."""
    rng = np.random.default_rng(0)
    for kind, expected in (('dropped', 0.7), ('duplicated', 1.3)):
        road = Corruption((Fault(kind, 'imu', 0.3),), ())
        count = sum(len(road.arrivals('imu', 0.0, rng)) for _ in range(4000)) / 4000
        assert count == pytest.approx(expected, abs=5 * math.sqrt(0.21 / 4000))
        assert len(road.arrivals('joint_states', 0.0, rng)) == 1


def test_a_weak_motor_is_the_only_thing_that_changes() -> None:
    """The robot that is simulated differs in one effort limit from the one that is declared."""
    weak = weakened(ROBOT, (Fault('weak-motor', 'elbow_joint', 0.5),))
    changed = [(a.name, b.effort / a.effort) for a, b in zip(ROBOT.joints, weak.joints, strict=True)
               if a != b]  # fmt: skip
    assert changed == [('elbow_joint', 0.5)]


def remote() -> RemoteRobot:
    """Return a robot that waits for commands, stowed."""
    return RemoteRobot(ROBOT, BUILD, STOWED)


def passed(robot: RemoteRobot, seconds: float) -> dict[str, float]:
    """Let time pass; return the joints' positions."""
    for _ in range(round(seconds / 0.005)):
        robot.advance(0.005)
    return dict(zip(ROBOT.joint_names, robot.simulation.joints()[0].tolist(), strict=True))


def test_a_trajectory_is_followed_in_its_time() -> None:
    """Both points are reached when they are due."""
    robot = remote()
    robot.follow(['shoulder_joint'], [(2.0, [1.7]), (4.0, [1.5])])
    assert passed(robot, 2.1)['shoulder_joint'] == pytest.approx(1.7, abs=0.03)
    assert passed(robot, 2.1)['shoulder_joint'] == pytest.approx(1.5, abs=0.03)


def test_an_empty_trajectory_stops_the_arm_where_it_is() -> None:
    """The brake holds: half a second later nothing has moved on."""
    robot = remote()
    robot.follow(['turret_joint'], [(4.0, [1.5])])
    passed(robot, 2.0)
    robot.follow([], [])
    there = passed(robot, 0.3)['turret_joint']
    assert 0.5 < there < 1.0
    assert passed(robot, 0.5)['turret_joint'] == pytest.approx(there, abs=0.01)


def test_the_tracks_stop_without_new_commands() -> None:
    """The tracks stop when drive commands stop coming, as after a lost link."""
    robot = remote()
    robot.drive(0.3, 0.0)
    passed(robot, 1.0)
    before = robot.simulation.base()[0]
    passed(robot, 1.0)
    moved = np.linalg.norm(robot.simulation.base()[0] - before)
    assert before[0] > 0.05
    assert moved < 0.01


def test_a_motor_gives_no_more_than_it_can() -> None:
    """With 8 kg held out the shoulder sinks, at the limit of its motor."""
    robot = remote()
    robot.follow(['shoulder_joint', 'elbow_joint'], [(3.0, [0.9, -0.6])])
    passed(robot, 3.5)
    robot.take(Payload(8.0, ROBOT.payload.cog))
    there = passed(robot, 1.0)['shoulder_joint']
    effort = robot.simulation.joints()[2][ROBOT.joint_names.index('shoulder_joint')]
    assert there < 0.85
    assert abs(effort) <= 50.0 + 1e-9


def test_it_tips_over_and_stands_up_again() -> None:
    """A ground too steep lays it on its side; a reset puts it back."""
    robot = remote()
    robot.follow(['shoulder_joint', 'elbow_joint'], [(1.5, [1.5, -0.2])])
    robot.take(Payload(4.0, ROBOT.payload.cog))
    passed(robot, 2.0)
    robot.tilt(math.radians(38.0), math.pi / 2.0, 0.6)
    passed(robot, 4.0)
    assert robot.simulation.base()[1][2] < 0.9
    robot.reset()
    assert passed(robot, 0.2)['shoulder_joint'] == pytest.approx(
        dict(STOWED)['shoulder_joint'], abs=0.03
    )
    assert robot.simulation.base()[1][2] > 0.999


@pytest.mark.parametrize(
    ('names', 'points'),
    [(['wing'], [(1.0, [0.0])]), (['elbow_joint'], [(1.0, [0.0, 1.0])]),
     (['elbow_joint'], [(1.0, [math.nan])]), (['elbow_joint'], [(2.0, [0.0]), (1.0, [0.0])])],
)  # fmt: skip
def test_a_trajectory_that_makes_no_sense_changes_nothing(
    names: list[str], points: list[tuple[float, list[float]]]
) -> None:
    """It is refused whole; the robot stays where it is."""
    robot = remote()
    before = passed(robot, 0.1)
    with pytest.raises(BadSample, match='trajectory: expected'):
        robot.follow(names, points)
    assert passed(robot, 0.5) == pytest.approx(before, abs=1e-3)
