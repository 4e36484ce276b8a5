"""What recordings tell of their robots, whatever file and topics it stands in."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bag.bag_cases import SHARED
from bag.recordings import write_other
from configure.seen_robots import (
    Sent,
    description,
    joint,
    later,
    mounted,
    recorded,
    static,
    urdf_of,
)
from made.run import EPOCH, NS, Imu, Message

from ugv_acceptance import BadBag
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.config.urdf import read_urdf
from ugv_acceptance.configure.evidence import Evidence
from ugv_acceptance.configure.recorded import evidence_of

ARM = Sent({'lift': 0.4, 'bend': -0.7})
URDF = urdf_of(joint('lift'), joint('bend', parent='lift_link'))
NO_TURN = (0.0, 0.0, 0.0, 1.0)


def at_rest(evidence: Evidence) -> dict[str, float]:
    """Where the joints rest, by the names of messages."""
    return {seen.topic_name: round(seen.at_rest, 6) for seen in evidence.joints}


def test_a_recording_tells_its_robot(tmp_path: Path) -> None:
    """URDF, fixed frames, joints at rest and IMU, each topic with count, rate and frames."""
    frames = static([('/base_link', 'imu_link', (0.1, 0.0, 0.2), NO_TURN)])
    bag = recorded(tmp_path / 'run.mcap', description(URDF), frames, ARM.states(), ARM.imu())
    found = evidence_of(bag)
    assert found.urdf == URDF.encode()
    assert [(t.parent, t.child, t.xyz) for t in found.transforms] == [
        ('base_link', 'imu_link', (0.1, 0.0, 0.2))
    ]
    assert found.joint_states == '/joint_states'
    assert at_rest(found) == ARM.joints
    assert [seen.effort for seen in found.joints] == [True, True]
    (imu,) = found.imus
    assert (imu.topic, imu.frame) == ('/imu/data', 'imu_link')
    assert imu.specific_force == pytest.approx((0.0, 0.0, 9.81))
    assert np.allclose(imu.orientation or (), np.eye(3))
    topic = next(topic for topic in found.topics if topic.name == '/imu/data')
    assert (topic.count, round(topic.rate), topic.frames) == (80, 20, ('imu_link',))
    assert found.doubts == ()


@pytest.mark.parametrize('suffix', ['.db3', '.bag'])
def test_sqlite_and_ros_1_tell_the_same(tmp_path: Path, suffix: str) -> None:
    """As an MCAP of the same messages."""
    parts = (description(URDF), static([('base_link', 'x', (1.0, 2.0, 3.0), NO_TURN)]))
    messages: list[Message] = [*parts, *ARM.states().messages(), *ARM.imu().messages()]
    other = tmp_path / f'run{suffix}'
    write_other(other, [(m.topic, m.type, m.log, m.data) for m in messages])
    one = evidence_of(recorded(tmp_path / 'run.mcap', *parts, ARM.states(), ARM.imu()))
    found = evidence_of(other)
    assert replace(found, where='', topics=()) == replace(one, where='', topics=())


def test_a_recording_of_the_projects_own_writer_is_read(tmp_path: Path) -> None:
    """With the URDF kept for late subscribers."""
    with BagWriter(tmp_path / 'run') as writer:
        message = description(URDF)
        writer.add_topic(message.topic, message.type)
        writer.write(message.topic, message.log, message.data)
    assert evidence_of(tmp_path / 'run').urdf == URDF.encode()


def test_joint_states_that_tell_a_part_each_are_merged(tmp_path: Path) -> None:
    """Arm and flipper in messages of their own."""
    other = replace(Sent({'flip': 1.0}, hz=5).states(), topic='/joint_states')
    found = evidence_of(recorded(tmp_path / 'run.mcap', ARM.states(), other))
    assert at_rest(found) == {**ARM.joints, 'flip': 1.0}


def test_the_posture_is_that_of_the_longest_rest(tmp_path: Path) -> None:
    """A robot that lies for a second, rises, and stands for four stands."""
    time = EPOCH + np.arange(140) * (NS // 20)
    knee = np.concatenate((np.full(20, -2.0), np.linspace(-2.0, -1.0, 40), np.full(80, -1.0)))
    states = replace(ARM.states(effort=False), names=('knee',), log=time, stamp=time)
    found = evidence_of(recorded(tmp_path / 'run.mcap', replace(states, position=knee[:, None])))
    (seen,) = found.joints
    assert (seen.at_rest, seen.lowest, seen.highest, seen.effort) == (-1.0, -2.0, -1.0, False)


def test_a_joint_that_never_rests_is_told(tmp_path: Path) -> None:
    """Its position is then a median, and a doubt says so."""
    states = ARM.states()
    moving = states.position + np.linspace(0.0, 1.5, ARM.count)[:, None]
    found = evidence_of(recorded(tmp_path / 'run.mcap', replace(states, position=moving)))
    assert any('never rest' in doubt for doubt in found.doubts)


def test_a_posture_that_is_told_once_is_at_rest(tmp_path: Path) -> None:
    """As of a driver that sends its joint states when they change alone."""
    once = ARM.states().kept(slice(1))
    found = evidence_of(recorded(tmp_path / 'run.mcap', once))
    assert (at_rest(found), found.doubts) == (ARM.joints, ())


def test_wheels_that_turn_leave_an_arm_at_rest(tmp_path: Path) -> None:
    """The posture of a robot that drives all the time is that of its other joints."""
    sent = Sent({'lift': 0.4, 'wheel': 0.0})
    states = sent.states()
    turning = states.position.copy()
    turning[:, 1] = np.linspace(0.0, 40.0, sent.count)
    found = evidence_of(recorded(tmp_path / 'run.mcap', replace(states, position=turning)))
    assert at_rest(found)['lift'] == 0.4
    assert found.doubts == ()


def test_the_topic_is_the_one_whose_names_the_urdf_has(tmp_path: Path) -> None:
    """Another one with more names is not taken."""
    more = Sent({f'finger_{k}': 0.0 for k in range(5)}).states('/hand/joint_states')
    bag = recorded(tmp_path / 'run.mcap', more, ARM.states('/arm/joint_states'))
    found = evidence_of(bag, read_urdf(URDF.encode(), 'x'))
    assert (found.joint_states, found.rivals) == ('/arm/joint_states', ())


def test_two_robots_are_told(tmp_path: Path) -> None:
    """Topics that fit equally well are named, unless a URDF stands beside one of them."""
    both = ARM.states('/r1/joint_states'), ARM.states('/r2/joint_states')
    found = evidence_of(recorded(tmp_path / 'a.mcap', *both))
    assert (found.joint_states, found.rivals) == ('/r1/joint_states', ('/r2/joint_states',))
    assert any('two robots' in doubt for doubt in found.doubts)
    told = description(URDF, '/r2/robot_description')
    found = evidence_of(recorded(tmp_path / 'b.mcap', *both, told))
    assert (found.joint_states, found.rivals) == ('/r2/joint_states', ())


def test_the_last_of_several_urdfs_is_taken_and_that_is_told(tmp_path: Path) -> None:
    """A description that was sent again and is the same raises no doubt."""
    first, last = description(URDF), description(URDF + '\n', log=EPOCH + NS)
    found = evidence_of(recorded(tmp_path / 'a.mcap', first, last))
    assert found.urdf == (URDF + '\n').encode()
    assert any('2 different URDFs' in doubt for doubt in found.doubts)
    same = evidence_of(recorded(tmp_path / 'b.mcap', first, description(URDF, log=EPOCH + NS)))
    assert (same.urdf, same.doubts) == (URDF.encode(), ())


def test_what_is_no_urdf_is_none(tmp_path: Path) -> None:
    """An empty description is not taken, one that cannot be read is told and kept."""
    assert evidence_of(recorded(tmp_path / 'a.mcap', description(''))).urdf is None
    found = evidence_of(recorded(tmp_path / 'b.mcap', description('<robot name="x"')))
    assert any('/robot_description' in doubt for doubt in found.doubts)


def test_a_monitors_own_topics_are_not_the_robots(tmp_path: Path) -> None:
    """Its margins are JointState messages too, with the robot's names."""
    own = ARM.states('/acceptance_monitor/static_torque')
    assert evidence_of(recorded(tmp_path / 'run.mcap', own)).joint_states is None


def test_an_imu_is_judged_by_its_first_rest(tmp_path: Path) -> None:
    """What it tells later, on a slope, is not how it is mounted."""
    bag = recorded(tmp_path / 'run.mcap', ARM.imu(), _turning(4.0), later(ARM.imu(lean=0.5), 5.0))
    (imu,) = evidence_of(bag).imus
    assert imu.specific_force == pytest.approx((0.0, 0.0, 9.81))


def _turning(start: float) -> Imu:
    one = Sent({'x': 0.0}, seconds=1.0).imu()
    return later(one.with_values(one.orientation, one.rate + 1.0, one.force), start)


def test_two_imus_on_one_topic_are_two(tmp_path: Path) -> None:
    """Each frame has its own means, and a doubt names them."""
    other = ARM.imu(mounted(90.0, 0.0, 0.0), frame='lidar')
    found = evidence_of(recorded(tmp_path / 'run.mcap', ARM.imu(), other))
    assert {imu.frame for imu in found.imus} == {'imu_link', 'lidar'}
    assert any('several frames' in doubt for doubt in found.doubts)


def test_what_an_imu_does_not_hold_is_none(tmp_path: Path) -> None:
    """Covariance -1, quaternions that are no rotation, NaN."""
    imu = ARM.imu()
    undeclared = replace(imu, covariances=(-1.0, 0.0, -1.0))
    (seen,) = evidence_of(recorded(tmp_path / 'a.mcap', undeclared)).imus
    assert (seen.specific_force, seen.orientation) == (None, None)
    nothing = imu.with_values(imu.orientation * 0.0, imu.rate, imu.force * math.nan)
    (seen,) = evidence_of(recorded(tmp_path / 'b.mcap', nothing)).imus
    assert (seen.specific_force, seen.orientation) == (None, None)


def test_an_input_that_begins_after_that_minute_is_read(tmp_path: Path) -> None:
    """As of an arm that is switched on later."""
    long = Sent({'x': 0.0}, seconds=80.0, hz=2).imu()
    late = replace(ARM.states(), log=ARM.time + 75 * NS)
    found = evidence_of(recorded(tmp_path / 'run.mcap', long, late))
    assert at_rest(found) == ARM.joints


def test_no_more_than_a_minute_of_a_topic_is_read(tmp_path: Path) -> None:
    """But a URDF that comes later is."""
    long = Sent({'lift': 0.0}, seconds=80.0, hz=2)
    states = long.states()
    position = np.where(np.arange(long.count) > 130, 1.0, 0.0)[:, None]
    late = description(URDF, log=EPOCH + 75 * NS)
    found = evidence_of(recorded(tmp_path / 'run.mcap', replace(states, position=position), late))
    assert (found.joints[0].highest, found.urdf) == (0.0, URDF.encode())


def test_a_recording_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    """In one line that names it."""
    path = tmp_path / 'run.mcap'
    path.write_text('nothing', encoding='utf-8')
    for bad in (path, tmp_path / 'none.mcap'):
        with pytest.raises(BadBag, match=bad.name) as refused:
            evidence_of(bad)
        assert '\n' not in str(refused.value)


def test_what_breaks_off_is_used_as_far_as_it_goes(tmp_path: Path) -> None:
    """And a doubt says so."""
    path = recorded(tmp_path / 'run.mcap', description(URDF), ARM.states())
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])
    found = evidence_of(path)
    assert found.urdf == URDF.encode()
    assert found.doubts


@pytest.mark.skipif(not SHARED.is_dir(), reason="../shared/bags is absent: others' recordings")
def test_recordings_of_others_are_read() -> None:
    """MCAP, ROS 1 in files of their own and in MCAP, damaged and odd ones."""
    husky = evidence_of(SHARED / 'robot_localization' / 'robot_localization_test1.bag')
    assert husky.imus[0].specific_force == pytest.approx((0.0, 9.8, 0.0), abs=0.05)
    turtle = evidence_of(SHARED / 'fuse_turtlebot3' / 'fuse_turtlebot3.bag')
    assert [seen.topic_name for seen in turtle.joints] == ['wheel_right_joint', 'wheel_left_joint']
    assert len(evidence_of(SHARED / 'abitobot').joints) == 10
    cases = sorted((SHARED / 'cases').iterdir())
    told = {case.name: evidence_of(case) for case in cases}
    untold = {name for name, found in told.items() if not found.joints}
    assert untold == {
        'dynamic_joint_states_only', 'json_messages', 'names_empty_positions', 'position_shorter',
    }  # fmt: skip
    assert all(told[name].doubts for name in untold)
