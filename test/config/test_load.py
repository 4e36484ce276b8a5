"""Reading and checking a robot's YAML file against its URDF."""

import hashlib
import math
import re
from pathlib import Path

import numpy as np
import pytest
from config.robot_files import URDF, YAML, write_robot

from ugv_acceptance import BadConfig
from ugv_acceptance.config import Config, load, name_and_topics
from ugv_acceptance.model.robot import Mimic


def config_of(folder: Path, yaml: str = YAML, urdf: str = URDF) -> Config:
    """Load the two texts."""
    return load(write_robot(folder, yaml, urdf))


def swap(old: str, new: str) -> str:
    """Return YAML with one text in place of another that is there."""
    assert old in YAML
    return YAML.replace(old, new)


def test_numbers_come_out_in_si(tmp_path: Path) -> None:
    """Degrees, pounds-force feet and centimetres are converted once, here."""
    yaml = swap('limit_nm: 30', 'limit: 30 lbf*ft\n    offset_deg: 90\n    sign: -1')
    yaml = yaml.replace('position_m: [1, 1, 0]', 'position_cm: [100, 1e2, 0]')
    settings = config_of(tmp_path, yaml).settings
    assert settings.limits.torque == pytest.approx((40.67453845, 100.0))
    assert (settings.joints[0].sign, settings.joints[0].offset) == (-1.0, math.pi / 2)
    assert settings.robot.contacts[0].position == (1.0, 1.0, 0.0)


def test_name_and_topics_need_no_urdf(tmp_path: Path) -> None:
    """Where only the robot tells its URDF they come from the file alone, else they are the same."""
    path = write_robot(tmp_path, YAML, URDF)
    config = load(path)
    assert name_and_topics(path) == (config.name, config.topics)
    line = next(line for line in YAML.splitlines() if line.startswith('urdf:'))
    alone = tmp_path / 'alone.yaml'
    alone.write_text(YAML.replace(line, 'topics: {imu: {name: my_imu}, joint_states: null}'))
    name, topics = name_and_topics(alone)
    assert (name, topics.names) == (config.name, (None, 'my_imu', config.topics.payload.name))
    assert topics.payload == config.topics.payload


def test_defaults_are_those_of_the_settings(tmp_path: Path) -> None:
    """What the file leaves out is what evaluation/settings.py says."""
    settings = config_of(tmp_path).settings
    assert settings.delays == type(settings.delays)()
    assert settings.imu == type(settings.imu)()
    assert settings.limits.tip_warn == math.radians(10)


def test_joints_keep_the_order_of_the_file(tmp_path: Path) -> None:
    """Joint order of the robot, the inputs and the limits is one."""
    yaml = swap(
        '  lift:\n    limit_nm: 30\n  slide:\n    limit_n: 100\n',
        '  slide: {topic_name: s}\n  lift: {topic_name: l}\n',
    )
    settings = config_of(tmp_path, yaml).settings
    assert settings.robot.joint_names == ('slide', 'lift')
    assert [joint.topic_name for joint in settings.joints] == ['s', 'l']
    assert settings.limits.torque == (100.0, 40.0)


def test_without_joints_all_movable_ones_are_taken(tmp_path: Path) -> None:
    """A URDF whose names are those of the messages needs no list."""
    yaml = re.sub(r'joints:\n(  .*\n)+', 'held: {slide: 20 cm}\n', YAML)
    robot = config_of(tmp_path, yaml).settings.robot
    assert (robot.joint_names, robot.held) == (('lift',), (('slide', 0.2),))


def test_the_hash_covers_both_files(tmp_path: Path) -> None:
    """sha256 is that of the YAML's bytes followed by the URDF's."""
    assert config_of(tmp_path).sha256 == hashlib.sha256((YAML + URDF).encode()).hexdigest()


def test_a_urdf_given_replaces_the_one_named(tmp_path: Path) -> None:
    """The file's own URDF need not exist then."""
    path = write_robot(tmp_path, swap('two.urdf', 'none.urdf'))
    with pytest.raises(BadConfig, match=r'none\.urdf: .*--urdf'):
        load(path)
    assert load(path, urdf=tmp_path / 'two.urdf').urdf_path == tmp_path / 'two.urdf'


def test_mass_and_centre_of_gravity_of_a_link_can_be_replaced(tmp_path: Path) -> None:
    """A link that was weighed overrides the URDF; the rest of it stays."""
    links = config_of(tmp_path, YAML + 'links: {arm: {mass_kg: 5}}\n').settings.robot.links
    assert (links[1].mass, links[1].cog) == (5.0, (0.5, 0.0, 0.0))


def test_the_imu_mounting_turns_sensor_axes_into_base_link(tmp_path: Path) -> None:
    """An IMU upside down (roll 180 deg) has its z axis pointing down."""
    imu = config_of(tmp_path, YAML + 'imu: {mounting_rpy_deg: [180, 0, 0]}\n').settings.imu
    np.testing.assert_allclose(np.array(imu.mounting) @ [0, 0, 1], [0, 0, -1], rtol=0, atol=1e-15)


def test_a_urdf_can_stand_in_a_ros_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """package://NAME is the share folder of a package of the ROS set-up."""
    pytest.importorskip('ament_index_python', reason='needs ROS')
    prefix = tmp_path / 'install'
    for folder in ('share/ament_index/resource_index/packages', 'share/two_description'):
        (prefix / folder).mkdir(parents=True)
    (prefix / 'share/ament_index/resource_index/packages/two_description').touch()
    (prefix / 'share/two_description/two.urdf').write_text(URDF, encoding='utf-8')
    path = write_robot(tmp_path, swap('two.urdf', 'package://two_description/two.urdf'))
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix))
    assert load(path).urdf_path == prefix / 'share/two_description/two.urdf'


def test_a_ros_package_that_is_not_there_is_refused(tmp_path: Path) -> None:
    """package://NAME of an unknown package is refused, with and without ROS."""
    path = write_robot(tmp_path, swap('two.urdf', 'package://no_such_package/two.urdf'))
    with pytest.raises(BadConfig, match='expected a ROS package of this set-up'):
        load(path)


REFUSED = [
    ('lift:', 'lfit:', '4: joints.lfit: the URDF has no movable joint "lfit"; did you mean lift?'),
    ('limit_nm: 30', 'limt_nm: 30', '5: joints.lift.limt_nm: unknown key; did you mean limit?'),
    ('limit_nm: 30', 'xyz: 30', '5: joints.lift.xyz: unknown key; known are topic_name, sign'),
    ('limit_nm: 30', 'limit_kg: 30', '5: joints.lift.limit_kg: expected a torque'),
    ('limit_nm: 30', 'limit_n: 30', '5: joints.lift.limit_n: expected a torque'),
    ('limit_n: 100', 'limit_nm: 100', '7: joints.slide.limit_nm: expected a force'),
    ('limit_nm: 30', 'limit: 30 deg', '5: joints.lift.limit: expected a torque'),
    ('limit_nm: 30', 'limit_nm: .nan', '5: joints.lift.limit_nm: expected a finite number'),
    ('limit_nm: 30', 'limit_nm: .inf', '5: joints.lift.limit_nm: expected a finite number'),
    ('limit_nm: 30', 'limit_nm: -30', '5: joints.lift.limit_nm: expected a limit above 0'),
    ('limit_nm: 30', 'limit_nm: 0', '5: joints.lift.limit_nm: expected a limit above 0'),
    ('limit_nm: 30', 'limit_nm: yes', '5: joints.lift.limit_nm: expected a torque'),
    ('limit_nm: 30', 'limit_nm: 3\n    limit: 4', '6: joints.lift.limit: given twice'),
    ('limit_nm: 30', 'limit_nm: 3\n    limit_nm: 4', '6: joints.lift.limit_nm: key given twice'),
    ('limit_nm: 30', 'sign: 2', '5: joints.lift.sign: expected 1 or -1, got 2'),
    ('limit_nm: 30', 'topic_name: slide', '5: joints.lift.topic_name: expected a name of its own'),
    ('limit_nm: 30', 'effort_scale: 0', '5: joints.lift.effort_scale: expected greater than 0'),
    ('limit_nm: 30', 'offset_m: 1', '5: joints.lift.offset_m: expected an angle'),
    ('limit_nm: 30', 'on: 1', 'joints.lift.True: expected a text as key'),
    ('mass_kg: 1', 'mass_kg: -1', 'payload.mass_kg: expected greater than or equal to 0'),
    ('link: hand', 'link: hnd', 'payload.link: the URDF has no link "hnd"; did you mean hand?'),
    (
        '{link: base, position_m: [1',
        '{link: bas, position_m: [1',
        'contacts.a.link: the URDF has no',
    ),
    ('[1, 1, 0]', '[1, 1]', 'contacts.a.position_m: expected a list of three numbers'),
    ('[1, 1, 0]', '[1, .nan, 0]', 'contacts.a.position_m: expected a finite number'),
    ('robot: {name: two}', 'robot: {}', '1: robot.name: expected this key, got none'),
    ('robot: {name: two}\n', '', 'robot: expected this key, got none'),
    ('robot: {name: two}', 'robot: two', '1: robot: expected keys with values, got "two"'),
    ('urdf: two.urdf\n', '', 'urdf: expected the path of a URDF'),
]


@pytest.mark.parametrize(('old', 'new', 'sentence'), REFUSED)
def test_a_wrong_field_is_refused_by_name(
    tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    """A wrong field is refused with file, line, field, what was expected and what came."""
    path = write_robot(tmp_path, swap(old, new))
    with pytest.raises(BadConfig) as caught:
        load(path)
    assert str(caught.value).startswith(f'{path}:')
    assert sentence in str(caught.value)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(
    ('more', 'sentence'),
    [
        ('topics: {imu: {name: joint_states}}', 'expected a topic of its own'),
        ('topics: {imu: {name: "a b"}}', 'topics.imu.name: '),
        ('topics: {imu: {name: a, type: std_msgs/msg/String}}', 'expected sensor_msgs/msg/Imu'),
        ('topics: {imu: {name: a, qos: {depth: 0}}}', 'topics.imu.qos.depth: expected greater'),
        ('topics: {imu: {name: a, qos: {reliability: often}}}', "expected 'best_effort' or"),
        ('held: {lift: 0}', 'held.lift: expected a joint that is not under joints too'),
        ('limits: {torque_warn: 1.2}', 'limits.torque_warn: expected at most torque_error'),
        ('limits: {tip_warn_deg: 3}', 'limits.tip_warn_deg: expected at least tip_error'),
        ('delays: {tip_on_s: -1}', 'delays.tip_on_s: expected greater than or equal to 0'),
        ('delays: {tick_ms: 0}', 'delays.tick_ms: expected greater than 0'),
        ('gravity_mps2: -9.81', 'gravity_mps2: expected greater than 0'),
        ('links: {arn: {mass_kg: 1}}', 'links.arn: the URDF has no link "arn"; did you mean arm?'),
        ('imu: {attitude: guess}', "imu.attitude: expected 'auto', 'orientation', 'acceler"),
        ('imu: {specific_force: 1}', 'imu.specific_force: '),
        (
            'links: {base: {mass_kg: 0}, arm: {mass_kg: 0}}',
            'expected links with mass, got none in base, arm',
        ),
        ('uncertainty: {payload.mass_kg: -1}', 'uncertainty.payload.mass_kg: expected greater'),
    ],
)
def test_a_section_that_makes_no_sense_is_refused(tmp_path: Path, more: str, sentence: str) -> None:
    """Values that contradict each other are refused."""
    with pytest.raises(BadConfig) as caught:
        config_of(tmp_path, f'{YAML}{more}\n')
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ('old', 'new', 'sentence'),
    [
        ('limit_nm: 30', 'limit_nm: 15', 'lift.limit_nm: 15 N m cannot hold the own weight'),
        ('  slide:\n    limit_n: 100\n', '', 'neither under joints nor held, so held at 0: slide'),
        ('  c: {link: base, position_m: [0, -1, 0]}\n', '', '2 contact points: no tip-over margin'),
    ],
)
def test_a_doubtful_field_is_warned_of(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    """A doubtful field gives a warning that names it, and the configuration is loaded."""
    assert sentence in '\n'.join(config_of(tmp_path, swap(old, new)).warnings)


def test_a_sound_file_has_no_warning(tmp_path: Path) -> None:
    """A correct file loads without any warning."""
    assert config_of(tmp_path).warnings == ()


def test_a_joint_without_any_limit_is_warned_of_and_not_judged(tmp_path: Path) -> None:
    """An effort of 0 in the URDF means that nothing is known."""
    config = config_of(tmp_path, swap('limit_n: 100', 'sign: 1'), URDF.replace('"100"', '"0"'))
    assert config.settings.limits.torque[1] == math.inf
    assert 'joints.slide: no limit here and an effort of 0 in the URDF' in config.warnings[0]


def test_a_limit_said_to_be_unknown_is_not_asked_for(tmp_path: Path) -> None:
    """`limit_n: null` says on purpose that the joint is not judged: only its weight is told."""
    urdf = URDF.replace('<axis xyz="0 -2 0"/>', '<axis xyz="0 0 1"/>')
    yaml = swap('limit_nm: 30', 'limit_nm: null')  # upright, so it carries no weight
    config = config_of(tmp_path, yaml, urdf)
    assert (config.settings.limits.torque[0], config.warnings) == (math.inf, ())


def test_a_mimic_joint_follows_its_leader(tmp_path: Path) -> None:
    """It is in the model, though no message tells it; a leader that is held holds it as well."""
    yaml = swap('  slide:\n    limit_n: 100\n', '')
    mimic = '<limit lower="-0.1" upper="0.3" effort="100" velocity="1"/>'
    urdf = URDF.replace(mimic, mimic + '<mimic joint="lift" offset="0.1"/>')
    config = config_of(tmp_path, yaml, urdf)
    assert config.settings.robot.mimics == (Mimic('slide', 'lift', 1.0, 0.1),)
    assert (config.settings.robot.held, config.warnings) == ((), ())
    still = swap('joints:\n  lift:\n    limit_nm: 30\n  slide:\n    limit_n: 100\n', '')
    still += 'held: {lift: 90 deg}\ntopics: {joint_states: null}\n'
    held = config_of(tmp_path, still, urdf).settings.robot
    assert dict(held.held) == pytest.approx({'lift': math.pi / 2, 'slide': math.pi / 2 + 0.1})
    assert held.mimics == ()


@pytest.mark.parametrize(
    'content', [b'\xff\xfe', b'', b'[1, 2', b'- a', b'a: &x [*x]', b'\0', b'? [1]\n: 2']
)
def test_what_is_no_configuration_is_refused(tmp_path: Path, content: bytes) -> None:
    """Any bytes give one line that names the file."""
    path = tmp_path / 'x.yaml'
    path.write_bytes(content)
    with pytest.raises(BadConfig, match=re.escape(str(path))):
        load(path)


def test_aliases_of_aliases_are_refused(tmp_path: Path) -> None:
    """Nested YAML aliases that expand to a billion values are refused at once."""
    lines = ['l0: &l0 [1, 1]']
    lines += [f'l{k}: &l{k} [{", ".join([f"*l{k - 1}"] * 9)}]' for k in range(1, 12)]
    with pytest.raises(BadConfig, match='expected at most'):
        config_of(tmp_path, '\n'.join(lines))


@pytest.mark.parametrize('name', ['no_such_robot', 'folder/none.yaml', '.'])
def test_a_file_that_is_not_there_is_refused(name: str) -> None:
    """A name that does not ship is answered with those that do."""
    with pytest.raises(BadConfig, match='expected a'):
        load(Path(name))


def test_names_without_a_folder_are_found_among_those_that_ship() -> None:
    """packbot, packbot.yaml and nothing at all are the same robot."""
    assert load() == load(Path('packbot')) == load(Path('packbot.yaml'))


def test_a_robot_of_five_hundred_links_is_loaded(tmp_path: Path) -> None:
    """Its two measured joints are searched for their worst posture, the others are held."""
    chain = ''.join(
        f'<joint name="j{k}" type="continuous"><origin xyz="0.1 0 0"/><parent link="l{k - 1}"/>'
        f'<child link="l{k}"/><axis xyz="0 1 0"/></joint><link name="l{k}"><inertial>'
        '<mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
        '</inertial></link>'
        for k in range(1, 500)
    )
    urdf = f'<robot name="long"><link name="l0"/>{chain}</robot>'
    yaml = 'robot: {name: long}\nurdf: two.urdf\njoints: {j1: {limit_nm: 1}, j499: {}}\n'
    warnings = '\n'.join(config_of(tmp_path, yaml, urdf).warnings)
    assert f'{9.81 * 0.1 * sum(range(499)):.1f} N m needed' in warnings
