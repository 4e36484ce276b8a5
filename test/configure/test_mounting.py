"""How the IMU is mounted: what URDF and /tf_static say, held against gravity at rest."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from bag.bag_cases import SHARED
from configure.seen_robots import G, joint, mounted, urdf_of
from scipy.spatial.transform import Rotation

from ugv_acceptance.config.urdf import Urdf, read_urdf, rotation_from_rpy
from ugv_acceptance.configure.draft import ASK, CERTAIN, CHECK, Mounting
from ugv_acceptance.configure.evidence import Evidence, SeenImu, StaticTransform
from ugv_acceptance.configure.imu_frames import rpy_of
from ugv_acceptance.configure.mounting import derive_mounting
from ugv_acceptance.configure.recorded import evidence_of
from ugv_acceptance.model.robot import IDENTITY, Matrix, Vector

LEVEL = Rotation.identity()


def of(text: str) -> Urdf:
    """The URDF of a text."""
    return read_urdf(text.encode(), 'made.urdf')


def matrix(rotation: Rotation) -> Matrix:
    """A rotation as the model has it."""
    a, b, c = (tuple(row) for row in rotation.as_matrix().tolist())
    return (a, b, c)


def imu(
    sensor: Rotation = LEVEL,
    lean: Rotation = LEVEL,
    frame: str = 'imu_link',
    topic: str = '/imu/data',
    *,
    force: bool = True,
    orientation: bool = True,
    unit: float = 1.0,
) -> SeenImu:
    """An IMU turned so on a robot that leans so, at rest; what it lacks is None."""
    world = lean * sensor
    x, y, z = (world.inv().apply((0.0, 0.0, G)) * unit).tolist()
    told = matrix(world) if orientation else None
    return SeenImu(topic, frame, (x, y, z) if force else None, told)


def seen(*imus: SeenImu, frames: Sequence[StaticTransform] = ()) -> Evidence:
    """What was seen of a robot with these IMUs."""
    return Evidence('/runs/run.mcap', transforms=tuple(frames), imus=imus)


def found(urdf: str, *imus: SeenImu, frames: Sequence[StaticTransform] = ()) -> Mounting:
    """The mounting derived."""
    return derive_mounting(of(urdf), seen(*imus, frames=frames), {})


def degrees(mounting: Mounting) -> tuple[float, ...]:
    """The rotation as rpy in degrees."""
    assert mounting.rotation.value is not None
    rpy = np.degrees(rpy_of(mounting.rotation.value))
    return tuple(round(float(angle)) + 0.0 for angle in rpy)


@pytest.mark.parametrize('rpy', [(180, 0, 0), (90, 0, 0), (0, -90, 0), (180, 0, 90), (0, 60, 30)])
def test_a_mounting_of_the_urdf_that_gravity_confirms_is_certain(
    rpy: tuple[float, float, float],
) -> None:
    """Where the robot's own axes do not fit; that the yaw is the URDF's word is told."""
    mounting = found(urdf_of(mounting=rpy), imu(mounted(*rpy)))
    wanted = rotation_from_rpy((math.radians(rpy[0]), math.radians(rpy[1]), math.radians(rpy[2])))
    assert np.allclose(mounting.rotation.value or (), wanted)
    assert (mounting.rotation.grade, mounting.question) == (CERTAIN, '')
    assert mounting.position.value == pytest.approx((0.1, 0.0, 0.2))
    assert any('yaw' in remark for remark in mounting.remarks)


def test_an_imu_that_is_not_turned_is_certain() -> None:
    """With a frame of the URDF, with a slash or a namespace before it."""
    for frame in ('imu_link', '/imu_link', 'robot/imu_link', 'base_link'):
        mounting = found(urdf_of(), imu(frame=frame))
        assert (mounting.rotation.value, mounting.rotation.grade) == (IDENTITY, CERTAIN), frame
        assert mounting.topic.value == 'imu/data'


def test_messages_in_the_robots_axes_though_the_urdf_turns_the_imu_are_asked_about() -> None:
    """The best guess is then that they are not turned; gravity denies the URDF."""
    mounting = found(urdf_of(mounting=(180.0, -90.0, 0.0)), imu())
    assert (mounting.rotation.value, mounting.rotation.grade) == (IDENTITY, ASK)
    assert "contradicts the URDF's link imu_link" in mounting.question


def test_a_yaw_that_gravity_cannot_tell_is_asked_for() -> None:
    """The URDF's is the best guess; left for right would be a wrong tilt."""
    mounting = found(urdf_of(mounting=(0.0, 0.0, 90.0)), imu(mounted(0.0, 0.0, 90.0)))
    assert degrees(mounting) == (0.0, 0.0, 90.0)
    assert mounting.rotation.grade == ASK
    assert '[0, 0, 90]' in mounting.question
    assert '[0, 0, 0]' in mounting.question


def test_a_small_yaw_is_taken_from_the_urdf() -> None:
    """To be checked: a few degrees turn no tilt to another side."""
    mounting = found(urdf_of(mounting=(0.0, 0.0, 5.0)), imu(mounted(0.0, 0.0, 5.0)))
    assert (degrees(mounting), mounting.rotation.grade) == ((0.0, 0.0, 5.0), CHECK)


@pytest.mark.parametrize(
    ('rpy', 'says'),
    [((90.0, 0.0, 0.0), 'y axis points up'), ((180.0, 0.0, 0.0), 'upside down, or NED')],
)
def test_a_mounting_that_nothing_tells_is_asked_for(
    rpy: tuple[float, float, float], says: str
) -> None:
    """By the axis that points up, with the right angles that would fit."""
    for urdf in (urdf_of(), urdf_of(mounting=(180.0, -90.0, 0.0))):
        mounting = found(urdf, imu(mounted(*rpy)))
        assert mounting.rotation.grade == ASK
        assert says in mounting.question
        up = mounted(*rpy).inv().apply((0.0, 0.0, 1.0))
        assert np.array(mounting.rotation.value) @ up == pytest.approx((0.0, 0.0, 1.0), abs=0.01)


def test_a_tilt_beyond_a_slope_is_asked_about() -> None:
    """From ten degrees on; below it is told from three on."""
    lean = Rotation.from_euler('x', 20.0, degrees=True)
    mounting = found(urdf_of(), imu(lean=lean))
    assert (mounting.rotation.value, mounting.rotation.grade) == (IDENTITY, ASK)
    assert mounting.question.startswith('Is this tilt real?')
    assert '20 deg' in mounting.question
    slope = found(urdf_of(), imu(lean=Rotation.from_euler('y', 5.0, degrees=True)))
    assert (slope.rotation.grade, slope.question) == (CERTAIN, '')
    assert any('5.0 deg off the vertical' in remark for remark in slope.remarks)


def test_acceleration_and_orientation_that_contradict_each_other_are_asked_about() -> None:
    """Neither verifies a mounting then."""
    level, lying = imu(), imu(mounted(90.0, 0.0, 0.0))
    torn = SeenImu('/imu/data', 'imu_link', level.specific_force, lying.orientation)
    mounting = found(urdf_of(), torn)
    assert mounting.rotation.grade == ASK
    assert 'differ by 90 deg' in mounting.question


@pytest.mark.parametrize(
    ('one', 'words'),
    [
        (imu(unit=1.0 / G, orientation=False), 'it is in g'),
        (imu(unit=0.0), 'gravity is subtracted'),
        (imu(orientation=False), 'no valid orientation'),
    ],
)
def test_what_is_odd_with_the_numbers_is_told(one: SeenImu, words: str) -> None:
    """The mounting is verified by what is left."""
    mounting = found(urdf_of(), one)
    assert mounting.rotation.grade == CERTAIN
    assert any(words in remark for remark in mounting.remarks)


def test_an_imu_that_tells_no_gravity_is_asked_about() -> None:
    """Its mounting cannot be verified."""
    mounting = found(urdf_of(), imu(force=False, orientation=False))
    assert mounting.rotation.grade == ASK
    assert 'do not show gravity' in mounting.question


def test_the_urdf_alone_is_to_be_checked() -> None:
    """Without any messages: its link of an IMU is the best guess."""
    mounting = derive_mounting(of(urdf_of(mounting=(180.0, 0.0, 0.0))), None, {})
    assert (degrees(mounting), mounting.rotation.grade) == ((180.0, 0.0, 0.0), CHECK)
    assert (mounting.topic.value, mounting.topic.grade) == ('imu/data', CHECK)
    bare = derive_mounting(of(urdf_of(joint('lift'), imu='')), None, {})
    assert (bare.rotation.value, bare.rotation.grade) == (IDENTITY, ASK)


def test_a_recording_without_an_imu_is_asked_about() -> None:
    """It has no topic."""
    mounting = derive_mounting(of(urdf_of()), Evidence('/runs/run.mcap'), {})
    assert mounting.topic.value is None
    assert mounting.rotation.grade == ASK
    assert 'run.mcap' in mounting.question


def test_a_frame_that_only_tf_static_knows_is_found() -> None:
    """By its chain up to a link, where the URDF has none of that name."""
    x, y, z = (0.0, 0.0, 0.5)
    frames = [
        StaticTransform('base_link', 'mast', (x, y, z), matrix(mounted(180.0, 0.0, 0.0))),
        StaticTransform('mast', 'chip', (0.1, 0.0, 0.0), matrix(LEVEL)),
    ]
    sensor = imu(mounted(180.0, 0.0, 0.0), frame='chip')
    mounting = found(urdf_of(imu=''), sensor, frames=frames)
    assert (degrees(mounting), mounting.rotation.grade) == ((180.0, 0.0, 0.0), CERTAIN)
    assert mounting.position.value == pytest.approx((0.1, 0.0, 0.5))


def test_tf_static_may_correct_the_urdf() -> None:
    """Gravity decides between them; that they differ is told."""
    frames = [StaticTransform('base_link', 'imu_link', (0.1, 0.0, 0.2), matrix(mounted(90, 0, 0)))]
    mounting = found(urdf_of(mounting=(0.0, -90.0, 0.0)), imu(mounted(90, 0, 0)), frames=frames)
    assert degrees(mounting) == (90.0, 0.0, 0.0)
    assert mounting.rotation.grade == ASK
    assert any('disagree' in remark for remark in mounting.remarks)


def test_a_frame_that_nothing_knows_is_verified_by_gravity_alone() -> None:
    """As with a simulator's scoped names: not turned fits, and is to be checked."""
    sensor = imu(frame='robot/base_footprint/imu_sensor')
    mounting = found(urdf_of(imu=''), sensor)
    assert (mounting.rotation.value, mounting.rotation.grade) == (IDENTITY, CHECK)
    on_link = found(urdf_of(imu=''), imu(frame='robot/base_link/imu_sensor'))
    assert on_link.rotation.grade == CHECK
    assert any('the link base_link' in remark for remark in on_link.remarks)


def test_an_imu_on_a_moving_link_is_placed_by_the_posture() -> None:
    """The joints that move it are named."""
    urdf = of(urdf_of(joint('lift'), parent='lift_link'))
    sensor = imu(Rotation.from_euler('y', 0.6))
    mounting = derive_mounting(urdf, seen(sensor), {'lift': 0.6})
    assert np.allclose(mounting.rotation.value or (), Rotation.from_euler('y', 0.6).as_matrix())
    assert (mounting.rotation.grade, mounting.joints) == (CHECK, ('lift',))


def test_of_several_imus_the_whole_one_on_the_base_is_taken() -> None:
    """A camera's, a raw one and another robot's are named as others."""
    camera = imu(frame='camera_imu', topic='/camera/imu')
    raw = imu(orientation=False, topic='/imu/data_raw')
    mounting = found(urdf_of(), camera, raw, imu())
    assert (mounting.topic.value, mounting.topic.grade) == ('imu/data', CHECK)
    assert '/camera/imu' in mounting.remarks[0]
    twins = imu(topic='/r1/imu'), imu(topic='/r2/imu')
    assert found(urdf_of(), *twins).topic.grade == ASK
    beside = Evidence('/x', joint_states='/r2/joint_states', imus=twins)
    assert derive_mounting(of(urdf_of()), beside, {}).topic.value == 'r2/imu'


@pytest.mark.skipif(not SHARED.is_dir(), reason="../shared is absent: others' robots and runs")
def test_the_mounting_of_others_robots_is_right_or_asked_for() -> None:
    """Husky's URDF says 180, -90, 0, its recording that y is up; Jackal sends the base's axes."""
    robots, runs = SHARED.parent / 'robots', SHARED / 'robot_localization'
    husky, jackal = (of((robots / x / f'{x}.urdf').read_text()) for x in ('husky', 'jackal'))
    asked = derive_mounting(husky, evidence_of(runs / 'robot_localization_test1.bag'), {})
    assert asked.rotation.grade == ASK
    assert 'y axis points up' in asked.question
    sure = derive_mounting(jackal, evidence_of(runs / 'robot_localization_test2.bag'), {})
    assert (sure.rotation.value, sure.rotation.grade) == (IDENTITY, CERTAIN)


@pytest.mark.skipif(not SHARED.is_dir(), reason="../shared is absent: others' robots")
def test_no_mounting_of_others_robots_is_wrong_in_silence() -> None:
    """Whether drivers send the axes of the IMU's link, the robot's, or others: right, or asked."""
    wrong = []
    for path in sorted((SHARED.parent / 'robots').glob('*/*.urdf')):
        robot = of(path.read_text(encoding='utf-8'))
        chain = derive_mounting(robot, None, {})
        if not chain.frame:
            continue  # an arm alone has none
        said = Rotation.from_matrix(np.array(chain.rotation.value))
        ways = (said, LEVEL, *(mounted(*rpy) for rpy in ((90, 0, 0), (180, 0, 0), (0, 90, 0))))
        for true in ways:
            mounting = derive_mounting(robot, seen(imu(true, frame=chain.frame)), {})
            right = np.allclose(mounting.rotation.value or (), true.as_matrix(), atol=1e-3)
            if not right and mounting.rotation.grade != ASK:
                wrong.append((path.stem, true.as_euler('xyz', degrees=True).tolist()))
    assert not wrong


def test_rpy_gives_the_rotation_back() -> None:
    """Also where the pitch is a right angle."""
    rng = np.random.default_rng(3)
    angles: list[Vector] = [(0.3, math.pi / 2, 0.2), (3.0, -math.pi / 2, 0.0)]
    angles += [(float(a), float(b), float(c)) for a, b, c in rng.uniform(-3.0, 3.0, (20, 3))]
    for rpy in angles:
        rotation = rotation_from_rpy(rpy)
        assert np.allclose(rotation_from_rpy(rpy_of(rotation)), rotation, atol=1e-9)
