"""`ugv-acceptance init`: a configuration from a URDF, questions, checks, and what stays unknown."""

import re
import subprocess
from pathlib import Path

import pytest
import yaml
from cli.here import ugv
from configure.init_robots import arm_alone, dog, rover, tracked_arm
from configure.small_robots import box, joint, link, shape, tyre, wheel
from configure.small_robots import rover as small_rover

from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr, string_message
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.cli.init_work import Asked, make_it
from ugv_acceptance.config import load
from ugv_acceptance.config.uncertain import sources_from
from ugv_acceptance.configure.questions import Answers

S, MS = 1_000_000_000, 1_000_000
T0 = 1_700_000_000 * S
GRADED = re.compile(r'.*\S  # (certain|check|ask): \S.*')
ROBOTS = {'rover': rover, 'tracked': tracked_arm, 'bench_arm': arm_alone, 'dog': dog}
Done = subprocess.CompletedProcess[str]


def init(folder: Path, text: str, *options: str) -> Done:
    """Write a URDF into a folder and run init on it there; the YAML is robot.yaml."""
    (folder / 'my.urdf').write_text(text, 'utf-8')
    return ugv('init', folder / 'my.urdf', '-o', folder / 'robot.yaml', *options)


def recorded(
    folder: Path, names: list[str], q: list[float], up: tuple[float, float, float]
) -> Path:
    """Write a recording of five seconds of a robot that rests; `up` is what its IMU feels."""
    with BagWriter(folder) as bag:
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        for k in range(500):
            now = T0 + k * 10 * MS
            if k % 2:
                bag.write('/joint_states', now, joint_state_cdr(now, '', names, q))
            still, level = (0.0, 0.0, 0.0), (0.0005, 0.0, 0.0, 1.0)
            bag.write('/imu/data', now, imu_cdr(now, 'imu_link', level, still, up))
    return folder


@pytest.mark.parametrize('name', list(ROBOTS))
def test_every_line_says_how_sure_it_is_and_why(tmp_path: Path, name: str) -> None:
    """Each line of the YAML that is not a comment ends in its grade and its source."""
    init(tmp_path, ROBOTS[name]())
    lines = (tmp_path / 'robot.yaml').read_text('utf-8').splitlines()
    assert len(lines) > 20
    assert not [x for x in lines if x and not x.startswith('#') and not GRADED.fullmatch(x)]


@pytest.mark.parametrize('name', list(ROBOTS))
def test_what_was_written_loads_and_is_the_same_twice(tmp_path: Path, name: str) -> None:
    """`config.load` reads the file, with its +/-; a second run gives the same bytes."""
    init(tmp_path, ROBOTS[name]())
    first = (tmp_path / 'robot.yaml').read_bytes()
    config = load(tmp_path / 'robot.yaml')
    assert sources_from(config)
    assert config.assumed
    init(tmp_path, ROBOTS[name](), '--overwrite')
    assert (tmp_path / 'robot.yaml').read_bytes() == first


def test_a_rover_is_done_when_its_mass_is_told(tmp_path: Path) -> None:
    """Nothing but the mass is asked of a rover: unanswered exit 3, answered exit 0 and done."""
    open_ = init(tmp_path, rover())
    assert open_.returncode == 3, open_.stdout
    assert '--mass' in open_.stdout
    done = init(tmp_path, rover(), '--overwrite', '--mass', '20.5kg')
    assert done.returncode == 0, done.stdout
    robot = load(tmp_path / 'robot.yaml').settings.robot
    assert robot.mass == pytest.approx(20.5)
    assert {contact.link for contact in robot.contacts} == {'base_link'}
    where = sorted(contact.position for contact in robot.contacts)
    assert where == [
        pytest.approx((x, y, -0.15), abs=1e-4)
        for x in (-0.2, 0.2)
        for y in (-0.275, -0.225, 0.225, 0.275)
    ]
    assert robot.ground == pytest.approx(-0.15)


def test_limits_in_doubt_are_unknown_until_somebody_tells_them(tmp_path: Path) -> None:
    """An effort of 1000 is asked; unanswered it is `unknown`, answered it is the limit."""
    open_ = init(tmp_path, tracked_arm(shoulder='1000'), '--mass', 'urdf')
    assert open_.returncode == 3
    assert '--limit shoulder=50' in open_.stdout
    data = yaml.safe_load((tmp_path / 'robot.yaml').read_text('utf-8'))
    assert data['joints']['shoulder']['limit_nm'] == 'unknown'
    assert load(tmp_path / 'robot.yaml').settings.unknown == ('joints.shoulder.limit',)
    done = init(
        tmp_path,
        tracked_arm(shoulder='1000'),
        '--mass',
        'urdf',
        '--limit',
        'shoulder=55',
        '--overwrite',
    )
    assert done.returncode == 0, done.stdout
    settings = load(tmp_path / 'robot.yaml').settings
    assert dict(zip(settings.robot.joint_names, settings.limits.torque, strict=True)) == {
        'turret': 30.0, 'shoulder': 55.0, 'elbow': 40.0,
    }  # fmt: skip
    assert settings.robot.payload_link == 'gripper_link'


def test_nothing_passes_while_something_is_unknown(tmp_path: Path) -> None:
    """A recording judged by a file with an open question is INCONCLUSIVE and says what is open."""
    init(tmp_path, tracked_arm(shoulder='1000'))
    run = recorded(tmp_path / 'run', ['turret', 'shoulder', 'elbow'], [0.0, 1.5, 0.0], (0, 0, 9.81))
    judged = ugv('evaluate', run, '--config', tmp_path / 'robot.yaml')
    assert judged.returncode == 3
    assert 'NOT CHECKED' in judged.stdout
    assert 'torque of shoulder' in judged.stdout


def test_refused_contacts_are_unknown(tmp_path: Path) -> None:
    """`--contacts no` leaves no point: contacts are `unknown`, and tip-over is not checked."""
    done = init(tmp_path, rover(), '--mass', 'urdf', '--contacts', 'no')
    assert done.returncode == 3
    assert not load(tmp_path / 'robot.yaml').settings.judges_tilt


def test_links_that_touch_the_ground_can_be_named(tmp_path: Path) -> None:
    """`--contacts LINK,LINK` takes the points of these links alone; an unknown one is refused."""
    names = 'front_left_wheel_link,front_right_wheel_link,rear_left_wheel_link'
    init(tmp_path, rover(), '--mass', 'urdf', '--contacts', names)
    assert len(load(tmp_path / 'robot.yaml').settings.robot.contacts) == 6
    wrong = init(tmp_path, rover(), '--contacts', 'front_left_wheel', '--overwrite')
    assert wrong.returncode == 2
    assert 'did you mean front_left_wheel_link?' in wrong.stderr


def test_the_joints_of_a_recording_have_to_be_those_of_the_robot(tmp_path: Path) -> None:
    """An elbow of the arm that no message tells is a check that fails: not done, exit 1."""
    run = recorded(tmp_path / 'run', ['turret', 'shoulder'], [0.0, 1.5], (0.0, 0.0, 9.81))
    done = init(tmp_path, tracked_arm(), str(run), '--mass', 'urdf')
    assert done.returncode == 1, done.stdout
    assert 'elbow' in done.stdout
    assert 'NOT done' in done.stdout


def test_a_recording_that_fits_makes_it_certain(tmp_path: Path) -> None:
    """URDF and recording together: all is told and gravity agrees, so nothing is left unseen."""
    run = recorded(
        tmp_path / 'run', ['turret', 'shoulder', 'elbow'], [0.0, 1.5, 0.0], (0.0, 0.0, 9.81)
    )
    done = init(tmp_path, tracked_arm(), str(run), '--mass', 'urdf')
    assert done.returncode == 0, done.stdout
    assert 'not seen' not in done.stdout
    checked = ugv('init', run, '--check', tmp_path / 'robot.yaml')
    assert checked.returncode == 0, checked.stdout


def test_an_imu_against_gravity_fails_a_check(tmp_path: Path) -> None:
    """A mounting that puts gravity sideways is told by `--check` with a recording."""
    init(tmp_path, tracked_arm(), '--mass', 'urdf', '--mounting', '90deg,0,0')
    run = recorded(
        tmp_path / 'run', ['turret', 'shoulder', 'elbow'], [0.0, 1.5, 0.0], (0.0, 0.0, 9.81)
    )
    checked = ugv('init', run, '--check', tmp_path / 'robot.yaml')
    assert checked.returncode == 1
    assert 'IMU against gravity' in checked.stdout


@pytest.mark.parametrize('wrong', ['raised', 'narrow', 'away'])
def test_a_wrong_contact_fails_a_check(tmp_path: Path, wrong: str) -> None:
    """Points in a tilted plane, or beside the centre of gravity, are told: exit 1."""
    assert init(tmp_path, rover(), '--mass', 'urdf').returncode == 0
    path = tmp_path / 'robot.yaml'
    text = path.read_text('utf-8')
    found = {
        'raised': text.replace('-0.15]', '-0.12]', 2),
        'narrow': text.replace('[-0.2,', '[0.1,'),
        'away': text.replace('[0.2, 0.275,', '[0.5, 0.375,'),
    }[wrong]
    assert found != text
    path.write_text(found, 'utf-8')
    checked = ugv('init', '--check', path)
    assert checked.returncode == 1, checked.stdout
    assert 'FAILS' in checked.stdout


def test_nothing_is_replaced_unasked(tmp_path: Path) -> None:
    """A YAML that exists stays, and so does a URDF that is read; one line, exit 2."""
    init(tmp_path, rover())
    again = init(tmp_path, rover())
    assert again.returncode == 2
    assert '--overwrite' in again.stderr
    own = ugv('init', tmp_path / 'my.urdf', '-o', tmp_path / 'my.urdf', '--overwrite')
    assert own.returncode == 2
    assert len(own.stderr.splitlines()) == 1


XACRO = """<robot name="rover" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:include filename="$(find {package})/rover.xacro"/>
</robot>
"""


def test_a_xacro_that_lacks_a_package_names_it(tmp_path: Path) -> None:
    """The package that is not found is named, with the option that would give it; exit 2."""
    (tmp_path / 'r.urdf.xacro').write_text(XACRO.format(package='wheels_of_nobody'), 'utf-8')
    done = ugv('init', tmp_path / 'r.urdf.xacro', '-o', tmp_path / 'robot.yaml')
    assert done.returncode == 2
    assert 'wheels_of_nobody' in done.stderr
    assert '--meshes' in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_xacro_is_expanded_with_packages_of_a_folder(tmp_path: Path) -> None:
    """Packages are found in the folders of --meshes; the URDF is written beside the YAML."""
    package = tmp_path / 'src' / 'parts'
    package.mkdir(parents=True)
    (package / 'package.xml').write_text('<package><name>rover_parts</name></package>', 'utf-8')
    body = rover().partition('\n')[2].rpartition('</robot>')[0]
    inner = f'<robot xmlns:xacro="http://www.ros.org/wiki/xacro">{body}</robot>'
    (package / 'rover.xacro').write_text(inner, 'utf-8')
    (tmp_path / 'x').mkdir()
    path = tmp_path / 'x' / 'r.urdf.xacro'
    path.write_text(XACRO.format(package='rover_parts'), 'utf-8')
    out = tmp_path / 'x' / 'robot.yaml'
    done = ugv('init', path, '--meshes', tmp_path / 'src', '-o', out, '--mass', 'urdf')
    assert done.returncode == 0, done.stdout + done.stderr
    assert (out.with_suffix('.urdf')).is_file()
    assert load(out).settings.robot.mass == pytest.approx(20.0)


@pytest.mark.parametrize('ending', ['png', 'html'])
def test_the_picture_is_drawn(tmp_path: Path, ending: str) -> None:
    """--picture draws the robot as PNG or as one HTML page; our own picture is drawn again."""
    path = tmp_path / f'robot.{ending}'
    for _ in range(2):
        done = init(tmp_path, rover(), '--picture', str(path), '--overwrite')
        assert done.returncode == 3, done.stderr
    start = b'\x89PNG' if ending == 'png' else b'<!DOCTYPE html>'
    assert path.read_bytes().startswith(start)


def test_a_person_is_asked_what_no_file_tells(tmp_path: Path) -> None:
    """Each open question is asked, again where the answer cannot be used; Enter takes the guess."""
    (tmp_path / 'my.urdf').write_text(tracked_arm(shoulder='1000'), 'utf-8')
    asked = Asked((tmp_path / 'my.urdf',), (), None, {}, None, overwrite=False, say=lambda _: None)
    typed, texts = ['heavy', '', 'shoulder=55'], []

    def person(text: str, guess: str) -> str:
        texts.append((text, guess))
        return typed[len(texts) - 1]

    found = make_it(tmp_path / 'robot.yaml', asked, Answers(), person)
    assert [guess for _, guess in texts] == ['urdf', 'urdf', '']
    assert 'on scales' in texts[0][0]
    assert found.questions == ()
    assert load(tmp_path / 'robot.yaml').settings.limits.torque == (30.0, 55.0, 40.0)


def test_a_tyre_of_two_cylinders_stands_on_the_larger(tmp_path: Path) -> None:
    """A narrow ring around a wider hub: the points are under the ring, and no check minds."""
    hub = '<collision><origin rpy="1.5707963267948966 0 0"/><geometry>'
    hub += '<cylinder radius="0.09" length="0.08"/></geometry></collision>'
    text = rover().replace(
        '<collision><origin xyz="0 0 0" rpy', f'{hub}<collision><origin xyz="0 0 0" rpy'
    )
    assert text.count('0.09') == 4
    done = init(tmp_path, text, '--mass', 'urdf')
    assert done.returncode == 0, done.stdout
    assert {c.position[2] for c in load(tmp_path / 'robot.yaml').settings.robot.contacts} == {-0.15}


def test_an_arm_that_is_bolted_down_is_done_without_an_imu(tmp_path: Path) -> None:
    """`--contacts none`: it stands on nothing, its torques are judged, tip-over is not."""
    open_ = init(tmp_path, arm_alone(), '--mass', 'urdf')
    assert open_.returncode == 3
    done = init(tmp_path, arm_alone(), '--mass', 'urdf', '--contacts', 'none', '--overwrite')
    assert done.returncode == 0, done.stdout
    settings = load(tmp_path / 'robot.yaml').settings
    assert not settings.hears_imu
    assert settings.robot.payload_link == 'tool0'


def test_the_urdf_of_a_recording_is_written_beside_the_yaml(tmp_path: Path) -> None:
    """A recording with /robot_description alone is enough; without it the URDF is asked for."""
    run = tmp_path / 'run'
    with BagWriter(run) as bag:
        bag.add_topic('/robot_description', 'std_msgs/msg/String')
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        bag.write('/robot_description', T0, string_message(rover()))
        for k in range(500):
            now = T0 + k * 10 * MS
            still, level = (0.0, 0.0, 0.0), (0.0005, 0.0, 0.0, 1.0)
            bag.write('/imu/data', now, imu_cdr(now, 'imu_link', level, still, (0.0, 0.0, 9.81)))
    done = ugv('init', run, '-o', tmp_path / 'robot.yaml', '--mass', 'urdf')
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / 'robot.urdf').read_text('utf-8') == rover()
    assert load(tmp_path / 'robot.yaml').urdf_path == (tmp_path / 'robot.urdf').resolve()
    bare = recorded(tmp_path / 'bare', ['a'], [0.0], (0.0, 0.0, 9.81))
    none = ugv('init', bare, '-o', tmp_path / 'other.yaml')
    assert none.returncode == 2
    assert '/robot_description' in none.stderr


def test_a_source_is_needed(tmp_path: Path) -> None:
    """Without a source, or with one that is not there, one line says what is expected; exit 2."""
    for arguments in ((), (tmp_path / 'no.urdf',)):
        done = ugv('init', *arguments, '-o', tmp_path / 'robot.yaml')
        assert done.returncode == 2
        assert 'expected a URDF' in done.stderr
        assert len(done.stderr.splitlines()) == 1


def test_legs_in_a_guessed_posture_are_asked_about(tmp_path: Path) -> None:
    """Without a recording nobody knows how the legs stand; with one of it standing it is known."""
    guessed = init(tmp_path, dog(), '--mass', 'urdf', '--limit', '*=urdf')
    assert guessed.returncode == 3
    assert not load(tmp_path / 'robot.yaml').settings.judges_tilt
    names = [
        f'{end}_{side}_{joint}'
        for end in ('front', 'rear')
        for side in ('left', 'right')
        for joint in ('hip', 'knee')
    ]
    run = recorded(tmp_path / 'run', names, [0.4, -0.8] * 4, (0.0, 0.0, 9.81))
    done = init(tmp_path, dog(), str(run), '--mass', 'urdf', '--limit', '*=urdf', '--overwrite')
    assert done.returncode == 0, done.stdout
    links = {contact.link for contact in load(tmp_path / 'robot.yaml').settings.robot.contacts}
    assert len(links) == 4


def kneeling(shank: str = '-0.1') -> str:
    """Return a dog whose knees are never straight: amid their range it is on them."""
    text = dog().replace('0 0 -0.1"/><geometry><box size="0.03 0.03 0.16"',
                         f'0 0 {shank}"/><geometry><box size="0.03 0.03 0.16"')  # fmt: skip
    return re.sub(
        r'(<joint name="\w+_knee".*?)lower="-2" upper="2"', r'\1lower="-3" upper="-2.8"', text
    )


def test_knees_are_no_feet(tmp_path: Path) -> None:
    """Where the middle of its ranges has a robot on its knees, no yes makes feet of them."""
    text = kneeling()
    asked = init(tmp_path, text, '--mass', 'urdf', '--limit', '*=urdf')
    assert asked.returncode == 3
    assert 'Do these touch the ground: none?' in ' '.join(asked.stdout.split())
    feet = 'front_left_foot,front_right_foot,rear_left_foot,rear_right_foot'
    assert f'--contacts {feet}' in ' '.join(asked.stdout.split())
    yes = init(tmp_path, text, '--mass', 'urdf', '--contacts', 'yes', '--overwrite')
    assert yes.returncode == 2
    named = ('--contacts', feet, '--mass', 'urdf', '--limit', '*=urdf', '--overwrite')
    done = init(tmp_path, text, *named)
    assert done.returncode == 0, done.stdout
    assert 'not seen' in next(x for x in done.stdout.splitlines() if 'how it stands' in x)
    assert not [w for w in load(tmp_path / 'robot.yaml').warnings if 'kneel' in w]


def test_contacts_at_knees_are_warned_of(tmp_path: Path) -> None:
    """A configuration that stands on knees says so when it is loaded, and is not done."""
    feet = 'front_left_foot,front_right_foot,rear_left_foot,rear_right_foot'
    options = ('--contacts', feet, '--mass', 'urdf', '--limit', '*=urdf')
    assert init(tmp_path, dog(), *options).returncode == 0
    path = tmp_path / 'robot.yaml'
    assert not [w for w in load(path).warnings if 'kneel' in w]
    text = path.read_text('utf-8')
    knees = re.sub(
        r'link: (\w+)_foot, position_m: \[.*?\]', r'link: \1_thigh, position_m: [0, 0, -0.2]', text
    )
    path.write_text(knees, 'utf-8')
    warned = [w for w in load(path).warnings if 'does the robot kneel?' in w]
    assert len(warned) == 4
    assert ugv('init', '--check', path).returncode == 3


@pytest.mark.parametrize(('told', 'far'), [((), 0.06), (('fork_joint',), 0.005)])
def test_a_caster_that_nobody_tells_makes_its_points_uncertain(
    tmp_path: Path, told: tuple[str, ...], far: float
) -> None:
    """A point under a swivelling caster is anywhere on its circle, unless messages tell where."""
    names = ['left_joint', 'right_joint', *told]
    text = swivelling()
    run = recorded(tmp_path / 'run', names, [0.0] * len(names), (0.0, 0.0, 9.81))
    init(tmp_path, text, str(run), '--mass', 'urdf')
    spread = dict(load(tmp_path / 'robot.yaml').uncertainty)
    assert (spread['contacts.x_m'], spread['contacts.y_m']) == pytest.approx((far, far))


def swivelling() -> str:
    """Return the URDF of a rover with two wheels and one caster on a fork."""
    round_ = tyre(0.1, 0.04)
    pair = wheel('left', '0.1 0.2 0.1', round_) + wheel('right', '0.1 -0.2 0.1', round_)
    fork = link('fork') + joint('fork', '-0.2 0 0.1', 'continuous', '0 0 1')
    caster = wheel('caster', '-0.03 0 -0.05', tyre(0.05, 0.02), parent='fork')
    imu = link('imu_link') + joint('imu_link', '0 0 0.1', 'fixed')
    return small_rover(shape(box(0.5, 0.3, 0.1), '0 0 0.15'), pair, fork + caster + imu)


def test_what_is_open_is_named_with_what_it_costs(tmp_path: Path) -> None:
    """Of the mass alone the URDF's stands in; what else is open is not checked."""
    mass = init(tmp_path, rover())
    assert mass.returncode == 3
    assert mass.stdout.startswith("NOT done, open: mass; the URDF's is taken\n")
    arm = init(tmp_path, arm_alone(), '--mass', 'urdf', '--overwrite')
    assert arm.returncode == 3
    first = arm.stdout.splitlines()[0]
    assert first.startswith('NOT done, open: ')
    assert 'contacts' in first
    assert 'mass' not in first
