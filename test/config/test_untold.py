"""Which joints margins can do without, and what is said where no message tells one."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from config.robot_files import write_robot

import ugv_acceptance as ugv
from ugv_acceptance.bag.encode import imu_cdr, joint_state_cdr
from ugv_acceptance.bag.writer import BagWriter
from ugv_acceptance.config import load
from ugv_acceptance.config.untold import CONTACT_OFF, MOST_TILT
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.settings import Untold
from ugv_acceptance.model.statics import centre_of_gravity, static_torque

NS = 1_000_000_000
T0 = 1_700_000_000 * NS


def body(name: str, mass: float, x: float = 0.0) -> str:
    """Return a link with mass."""
    return (
        f'<link name="{name}"><inertial><origin xyz="{x} 0 0"/><mass value="{mass}"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def joint(name: str, kind: str, ends: str, xyz: str, axis: str, limit: str = '') -> str:
    """Return a joint."""
    parent, child = ends.split()
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


RANGE = '<limit lower="-1.5" upper="1.5" effort="{}" velocity="1"/>'
URDF = ''.join(
    [
        '<robot name="rover">',
        body('base', 40),
        joint('wheel', 'continuous', 'base spun', '0.3 0.2 0.1', '0 1 0'),
        body('spun', 2),
        joint('caster', 'continuous', 'base fork', '-0.3 0 0.05', '0 0 1'),
        body('fork', 0.2, -0.01),
        joint('torso', 'prismatic', 'base trunk', '0 0 0.3', '0 0 1', RANGE.format(900)),
        body('trunk', 6),
        joint('pan', 'revolute', 'trunk eye', '0 0 0.3', '0 0 1', RANGE.format(5)),
        body('eye', 0.3, 0.01),
        joint('lift', 'revolute', 'trunk arm', '0.2 0 0', '0 -1 0', RANGE.format(60)),
        body('arm', 3, 0.3),
        joint(
            'finger',
            'prismatic',
            'arm tip',
            '0.6 0 0',
            '0 1 0',
            RANGE.format(9).replace('1.5', '0.1'),
        ),
        body('tip', 0.01),
        '</robot>',
    ]
)
CONTACTS = """contacts:
  left: {link: base, position_m: [0.3, 0.2, 0]}
  right: {link: base, position_m: [0.3, -0.2, 0]}
  rear: {link: fork, position_m: [-0.02, 0, -0.05]}
"""
HEAD = 'robot: {name: rover}\nurdf: two.urdf\npayload: {link: arm, known: true}\n'
NAMES = ('wheel', 'caster', 'torso', 'pan', 'lift', 'finger')


def untold(folder: Path, yaml: str = HEAD + CONTACTS) -> dict[str, Untold | None]:
    """Return what is taken for each measured joint if no message tells it."""
    settings = load(write_robot(folder, yaml, URDF)).settings
    return dict(zip(settings.robot.joint_names, settings.untold, strict=True))


def test_what_cannot_matter_may_be_untold(tmp_path: Path) -> None:
    """Balanced wheels and a light head; not the arm, a lift, or what would move a contact far."""
    found = untold(tmp_path)
    assert found == {
        'wheel': Untold(0.0, harmless=True),
        'caster': Untold(0.0, harmless=False),  # its contact point goes round with it
        'torso': None,
        'pan': Untold(0.0, harmless=True),
        'lift': None,
        'finger': Untold(0.0, harmless=False),  # the hand may touch the ground with it
    }


@pytest.mark.parametrize(
    ('imu', 'must'),
    [
        ('imu: {link: eye}', {'pan'}),
        ('imu: {link: base}', set()),
        ('imu: {mounting: auto}', {'pan', 'finger'}),  # its frame may be anywhere but on a wheel
        ('imu: {mounting: auto}\ntopics: {imu: {name: imu/data, frame_id: eye}}', {'pan'}),
        ('imu: {mounting: auto}\ntopics: {imu: {name: imu/data, frame_id: base}}', set()),
    ],
)
def test_a_joint_that_may_carry_the_imu_is_told(tmp_path: Path, imu: str, must: set[str]) -> None:
    """Else the tilt of the base would follow from a guess."""
    found = untold(tmp_path, f'{HEAD}{CONTACTS}{imu}\n')
    assert {name for name, of in found.items() if of is None} == {'torso', 'lift'} | must


def test_a_joint_that_the_file_lists_is_told(tmp_path: Path) -> None:
    """Under `joints` the user says that messages tell it: margins are not known without it."""
    yaml = f'{HEAD}{CONTACTS}joints: {{{", ".join(f"{name}: {{}}" for name in NAMES)}}}\n'
    settings = load(write_robot(tmp_path, yaml, URDF)).settings
    assert settings.untold == ()


def test_what_is_harmless_is_so_wherever_it_is(tmp_path: Path) -> None:
    """Turned at random, harmless joints keep within the bounds that are promised."""
    robot = load(write_robot(tmp_path, HEAD + CONTACTS, URDF)).settings.robot
    random = np.random.default_rng(1)
    q = random.uniform(-1.5, 1.5, (200, len(NAMES)))
    held = q.copy()
    for k, name in enumerate(robot.joint_names):
        if name in {'wheel', 'pan'}:
            held[:, k] = 0.0
    off = np.linalg.norm(centre_of_gravity(robot, q) - centre_of_gravity(robot, held), axis=1)
    height = float(centre_of_gravity(robot, np.zeros(len(NAMES)))[2])
    assert 0 < off.max() < math.tan(MOST_TILT) * height
    for gravity in np.eye(3) * 9.81:
        change = static_torque(robot, q, tuple(gravity)) - static_torque(
            robot, held, tuple(gravity)
        )
        limits = load(write_robot(tmp_path, HEAD + CONTACTS, URDF)).settings.limits.torque
        finite = np.isfinite(limits)
        assert (np.abs(change).max(axis=0)[finite] < 0.01 * np.array(limits)[finite]).all()
    assert CONTACT_OFF <= 0.001


def recording(folder: Path, names: tuple[str, ...]) -> Path:
    """Write 12 s of a robot at rest whose messages tell these joints."""
    random = np.random.default_rng(0)
    with BagWriter(folder) as bag:
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
        bag.add_topic('/imu/data', 'sensor_msgs/msg/Imu')
        for k in range(600):
            at = T0 + k * NS // 50
            q = (1e-4 * random.standard_normal(len(names))).tolist()
            bag.write('/joint_states', at, joint_state_cdr(at, '', names, q, [], []))
            turned = (*(1e-4 * random.standard_normal(3)).tolist(), 1.0)
            noise = (1e-3 * random.standard_normal(3)).tolist()
            force = (noise[0], noise[1], 9.81 + noise[2])
            bag.write('/imu/data', at + 1, imu_cdr(at, 'imu_link', turned, noise, force))
    return folder


def judged(folder: Path, names: tuple[str, ...], yaml: str = HEAD + CONTACTS) -> ugv.Evaluation:
    """Judge a recording that tells these joints."""
    config = load(write_robot(folder, yaml, URDF))
    return ugv.evaluate(recording(folder / 'run', names), config=config.path)


def said(found: ugv.Evaluation) -> str:
    """Return all that a verdict says."""
    unchecked = [f'{x["what"]}: {x["why"]}' for x in found.result['not_checked']]
    return '\n'.join([*found.result['reasons'], *unchecked, *(a.message for a in found.alerts)])


def without(*names: str) -> tuple[str, ...]:
    """Return all joints but these."""
    return tuple(name for name in NAMES if name not in names)


def test_harmless_joints_that_nobody_tells_blind_nothing(tmp_path: Path) -> None:
    """Evaluated from the first message on; NOT CHECKED names them, with the line to enter."""
    found = judged(tmp_path, without('wheel', 'pan'))
    assert found.result['coverage']['fraction'] > 0.99
    assert found.verdict == 'PASS'
    assert not [a for a in found.alerts if a.code == 'INPUT_INCOMPLETE']
    assert 'position of wheel, pan: no message told it' in said(found)
    assert 'held: {wheel: 0, pan: 0}' in said(found)


def test_a_joint_that_may_matter_is_evaluated_and_never_passes(tmp_path: Path) -> None:
    """Margins are there, INPUT_INCOMPLETE stands all the time with the line to enter."""
    found = judged(tmp_path, without('caster'))
    assert found.result['coverage']['fraction'] > 0.85
    assert found.verdict == 'INCONCLUSIVE'
    assert 'caster was never told' in said(found)
    assert 'held: {caster: 0}' in said(found)


@pytest.mark.parametrize('name', ['torso', 'lift'])
def test_without_a_joint_that_matters_nothing_is_known(tmp_path: Path, name: str) -> None:
    """What carries the arm, or much mass, has to be told or held; the reason has the line."""
    found = judged(tmp_path, without(name))
    assert found.result['coverage']['fraction'] == 0.0
    assert found.verdict == 'INCONCLUSIVE'
    assert f'{name} was never told' in said(found)
    assert f'held: {{{name}: 0}}' in said(found)


def test_the_line_that_is_shown_can_be_entered(tmp_path: Path) -> None:
    """With it the same recording is evaluated from the start, and no joint is said to be untold."""
    found = judged(tmp_path, without('caster'), f'{HEAD}{CONTACTS}held: {{caster: 0}}\n')
    assert found.result['coverage']['fraction'] > 0.95
    assert 'never told' not in said(found)


def stream(evaluator: LiveEvaluator, names: tuple[str, ...], span: tuple[float, float]) -> Any:
    """Give messages of a robot at rest; return the margins after the last."""
    for k in range(int(span[0] * 50), int(span[1] * 50)):
        at = T0 + k * NS // 50
        evaluator.joint_state(at, at, names, [1e-4 * (k % 3)] * len(names), [], [])
        up = (1e-4 * (k % 5), 0.0, 0.0, 1.0)
        force = (1e-3 * (k % 2), 0.0, 9.81)
        evaluator.imu(at + 1, at, up, 0.0, (1e-4 * (k % 7), 0.0, 0.0), force, 'imu_link')
        evaluator.tick(at + 2)
    return evaluator.margins


def test_live_a_joint_is_taken_as_held_after_half_a_second(tmp_path: Path) -> None:
    """Until then nothing is known; once it is told, its told position counts and the doubt ends."""
    settings = load(write_robot(tmp_path, HEAD + CONTACTS, URDF)).settings
    evaluator = LiveEvaluator(settings)
    evaluator.start(T0)
    assert stream(evaluator, without('caster'), (0, 0.4)) is None
    known = stream(evaluator, without('caster'), (0.4, 2))
    assert known.q[settings.robot.joint_names.index('caster')] == 0.0
    assert evaluator.joints.never_told == ['caster']
    assert [a.rule.code for a in evaluator.watch.active] == ['INPUT_INCOMPLETE']
    assert evaluator.level == 3
    told = stream(evaluator, NAMES, (2, 4))
    assert told.q[settings.robot.joint_names.index('caster')] != 0.0
    assert 'INPUT_INCOMPLETE' not in [a.rule.code for a in evaluator.watch.active]


def test_live_a_harmless_joint_raises_no_alert(tmp_path: Path) -> None:
    """Margins are known, the level is good, and the evaluator says which joints were assumed."""
    settings = load(write_robot(tmp_path, HEAD + CONTACTS, URDF)).settings
    evaluator = LiveEvaluator(settings)
    evaluator.start(T0)
    assert stream(evaluator, without('wheel', 'pan'), (0, 2)) is not None
    assert (evaluator.joints.never_told, evaluator.level) == (['wheel', 'pan'], 0)
