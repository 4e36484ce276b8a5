"""A plan as a file: what is written is read, what is wrong is said with file and line."""

import math
import re
from pathlib import Path

import pytest
import yaml

from ugv_acceptance import BadConfig
from ugv_acceptance.config import load
from ugv_acceptance.plan.plan import Plan, matches, plan_text, read_plan

STEP = {'id': 'one', 'group': 'g', 'title': 't', 'purpose': 'p', 'posture_deg': {'elbow_joint': 9}}
PLAN = {
    'plan': 'small',
    'robot': 'packbot',
    'config_sha256': '0',
    'home_deg': {'elbow_joint': 0},
    'steps': [STEP],
}


def written(folder: Path, text: str) -> Path:
    """Return a plan file with this text."""
    path = folder / 'plan.yaml'
    path.write_text(text, 'utf-8')
    return path


def test_a_plan_that_is_written_is_read_again(tmp_path: Path) -> None:
    """Writing and reading keeps everything, so the hash too."""
    plan = Plan.model_validate(PLAN)
    (tmp_path / 'plan.yaml').write_text(plan_text(plan), 'utf-8')
    assert read_plan(tmp_path / 'plan.yaml') == plan


def test_comments_and_the_order_of_keys_do_not_change_the_hash(tmp_path: Path) -> None:
    """The hash is that of what the plan says."""
    turned = dict(reversed(PLAN.items()))
    text = '# edited by hand\n' + yaml.safe_dump(turned, sort_keys=False)
    assert read_plan(written(tmp_path, text)).sha256 == Plan.model_validate(PLAN).sha256


@pytest.mark.parametrize('change', [{'hold_s': 9.0}, {'payload_kg': 1.0}, {'title': 'other'}])
def test_any_change_of_a_step_changes_the_hash(change: dict[str, object]) -> None:
    """A result names the plan it was made with, to the last word."""
    changed = {**PLAN, 'steps': [{**STEP, **change}]}
    assert Plan.model_validate(changed).sha256 != Plan.model_validate(PLAN).sha256


@pytest.mark.parametrize(
    ('change', 'said'),
    [
        ({'colour': 'red'}, r'plan.yaml:\d+: steps.0.colour'),
        ({'hold_s': -1}, r'plan.yaml:\d+: steps.0.hold_s: expected .*greater than 0, got -1'),
        ({'hold_s': float('nan')}, r'steps.0.hold_s: expected a finite number'),
        ({'alerts': {'must': ['ERROR TIPS']}}, 'expected LEVEL .*got .ERROR TIPS'),
        ({'ground': {'orientation': 'up'}}, 'expected one of level, right'),
        ({'action': 'drive'}, 'expected drive'),
        ({'action': 'fly'}, 'steps.0.action'),
        ({'posture_deg': {'wing': 3}}, 'expected joints of packbot, got wing'),
    ],
)
def test_what_is_wrong_is_said_with_file_line_and_field(
    tmp_path: Path, change: dict[str, object], said: str
) -> None:
    """One line: where, what was expected, what came."""
    text = yaml.safe_dump({**PLAN, 'steps': [{**STEP, **change}]}, sort_keys=False)
    path = written(tmp_path, text)
    with pytest.raises(BadConfig) as error:
        read_plan(path, load().settings.robot)
    assert re.search(said, str(error.value)), str(error.value)
    assert '\n' not in str(error.value)


@pytest.mark.parametrize('text', ['', '[]', 'plan: 3', ': :', '\x00', 'a: &a [*a]'])
def test_text_that_is_no_plan_is_refused(tmp_path: Path, text: str) -> None:
    """Whatever is in the file, BadConfig names it."""
    with pytest.raises(BadConfig, match=re.escape('plan.yaml')):
        read_plan(written(tmp_path, text))


def test_two_steps_of_one_id_are_refused(tmp_path: Path) -> None:
    """A plan with two steps of one id is refused: results are filed by id."""
    text = yaml.safe_dump({**PLAN, 'steps': [STEP, STEP]})
    with pytest.raises(BadConfig, match='expected a different id for every step, got one twice'):
        read_plan(written(tmp_path, text))


EOD = load('packbot_eod').settings.robot
POSED = {**STEP, 'posture': 'DRIVE', 'posture_deg': {'turret_joint': 20}}


def posed(folder: Path, step: dict[str, object]) -> Plan:
    """Return a plan of one step, read for a robot that has poses."""
    plan = {**PLAN, 'home_deg': {'shoulder_joint': 5}, 'steps': [step]}
    return read_plan(written(folder, yaml.safe_dump(plan)), EOD)


def test_a_step_may_name_a_pose_of_the_robot(tmp_path: Path) -> None:
    """The step has the angles of the pose; its own posture_deg replaces single joints."""
    (step,) = posed(tmp_path, POSED).steps
    pose = next(dict(pose.positions) for pose in EOD.poses if pose.name == 'DRIVE')
    assert math.radians(step.posture_deg['elbow_1_joint']) == pytest.approx(pose['elbow_1_joint'])
    assert step.posture_deg['turret_joint'] == 20
    assert set(step.posture_deg) == set(pose)
    alone = {k: v for k, v in POSED.items() if k != 'posture_deg'}
    assert posed(tmp_path, alone).steps[0].posture_deg['turret_joint'] == 0


def test_a_plan_with_poses_is_written_and_read_again(tmp_path: Path) -> None:
    """Its record has the angles too, and keeps its hash."""
    plan = posed(tmp_path, POSED)
    again = read_plan(written(tmp_path, plan_text(plan)), EOD)
    assert (again, again.sha256) == (plan, plan.sha256)
    text = plan_text(Plan.model_validate({**PLAN, 'steps': [{**STEP, 'posture_deg': {}}]}))
    assert read_plan(written(tmp_path, text)).steps[0].posture_deg == {}


def test_other_angles_of_a_pose_change_the_hash(tmp_path: Path) -> None:
    """A result names the angles that the pose had then."""
    moved = {**POSED, 'posture_deg': {'turret_joint': 21}}
    assert posed(tmp_path, moved).sha256 != posed(tmp_path, POSED).sha256


@pytest.mark.parametrize(
    ('posture', 'said'),
    [
        ({'posture': 'DRVE'}, r'plan.yaml:\d+: steps.0.posture: expected a pose \(.*DRIVE'),
        ({'posture': 'DRVE'}, r'did you mean DRIVE\?'),
        ({}, 'expected posture_deg, or posture with the name of a pose'),
    ],
)
def test_an_unknown_pose_of_a_step_is_said_with_file_and_line(
    tmp_path: Path, posture: dict[str, object], said: str
) -> None:
    """A step names a pose that the robot has, or angles."""
    bare = {k: v for k, v in STEP.items() if k != 'posture_deg'}
    with pytest.raises(BadConfig, match=said):
        posed(tmp_path, {**bare, **posture})


@pytest.mark.parametrize(
    ('pattern', 'found'),
    [('ERROR', True), ('ERROR TIP_OVER', True), ('ERROR TIP_OVER left', True),
     ('WARN', False), ('ERROR TORQUE_LIMIT', False), ('ERROR TIP_OVER right', False)],
)  # fmt: skip
def test_a_pattern_names_level_code_and_subject_as_far_as_it_goes(
    pattern: str, *, found: bool
) -> None:
    """An alert pattern matches any value of the parts that it leaves out."""
    assert matches(pattern, 'ERROR', 'TIP_OVER', 'left') is found


def with_ground(**ground: object) -> Plan:
    """Return the plan with this ground in its step."""
    return Plan.model_validate({**PLAN, 'steps': [{**STEP, 'ground': ground}]})


def test_a_plan_without_kinds_of_ground_keeps_its_hash() -> None:
    """The hash counts a kind only where a step has one, so that plans made before are the same."""
    assert with_ground(tilt_deg=0.0).sha256 == Plan.model_validate(PLAN).sha256
    kinds = {with_ground(kind=kind).sha256 for kind in ('flat', 'uneven', 'stairs')}
    assert len(kinds | {Plan.model_validate(PLAN).sha256}) == 4
    text = plan_text(with_ground(kind='stairs', accept='trend', reason='belayed'))
    assert 'kind: stairs' in text
    assert 'kind' not in plan_text(Plan.model_validate(PLAN))


@pytest.mark.parametrize(
    'ground', [{'kind': 'rubble'}, {'accept': 'trend'}, {'reason': 'r'}, {'accept': 'cautious'}]
)
def test_a_step_names_a_known_ground_and_a_rule_with_its_reason(ground: dict[str, object]) -> None:
    """Anything else is refused."""
    with pytest.raises(ValueError, match='ground'):
        with_ground(**ground)
