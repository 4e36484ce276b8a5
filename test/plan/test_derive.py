"""A derived plan checked against the model, posture by posture and motion by motion."""

import math
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from ugv_acceptance.config import Config, load
from ugv_acceptance.evaluation.alerts.messages import RECORDED
from ugv_acceptance.model.robot import Payload
from ugv_acceptance.model.stability import stability
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.plan.arm_paths import Routes, safe_path
from ugv_acceptance.plan.card import SHOWN, card_of, group_of
from ugv_acceptance.plan.derive import Wanted, derive
from ugv_acceptance.plan.order import distance, way
from ugv_acceptance.plan.plan import ROBOT, SIMULATION, Ground, Plan, Step, read_plan, vector_of
from ugv_acceptance.plan.search import Arm
from ugv_acceptance.plan.sketch import sketch
from ugv_acceptance.report.format import time_text
from ugv_acceptance.studies.orientations import ORIENTATIONS

CONFIG: Config = load()
PLAN: Plan = derive(CONFIG)
LIMITS = np.array(CONFIG.settings.limits.torque)
LEVEL = (('level', 0.0), 4.0)
HELD = [s for s in PLAN.steps if s.action in {'hold', 'tip'}]


def margins_of(step: Step, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return use (n,) and tilt left (n,) deg of postures (n, j) in a step's set-up."""
    robot = CONFIG.settings.robot
    load_ = Payload(step.payload_kg, robot.payload.cog)
    gravity = step.gravity(robot.gravity)
    use = (np.abs(static_torque(robot, q, gravity, load_)) / LIMITS).max(axis=-1)
    left = np.degrees(np.min(np.array(stability(robot, q, gravity, load_).angle), axis=0))
    return use, left


def vector(posture: dict[str, float]) -> np.ndarray:
    """Return the positions of a posture, the others at home."""
    return np.array(vector_of(CONFIG.settings.robot, PLAN.home_deg, posture))


def paths() -> Iterator[tuple[Step, np.ndarray]]:
    """Yield the postures (n, j) that each robot's step passes, from the step before or home."""
    before, setup = PLAN.home_deg, None
    for step in PLAN.steps:
        if step.where == ROBOT and step.action == 'hold':
            start = before if setup == (step.ground, step.payload_kg) else PLAN.home_deg
            stops = [vector(p) for p in (start, *step.via_deg, step.posture_deg)]
            parts = [a + np.linspace(0.0, 1.0, 181)[:, None] * (b - a) for a, b in pairwise(stops)]
            yield step, np.concatenate(parts)
        before, setup = step.posture_deg, (step.ground, step.payload_kg)


@pytest.mark.parametrize(('step', 'path'), list(paths()), ids=lambda x: getattr(x, 'id', ''))
def test_no_way_of_the_robot_passes_a_limit(step: Step, path: np.ndarray) -> None:
    """From the posture before, by the postures between, every margin is kept."""
    use, left = margins_of(step, path)
    assert use.max() < CONFIG.settings.limits.torque_error
    assert left.min() > math.degrees(CONFIG.settings.limits.tip_error)


@pytest.mark.parametrize('step', HELD, ids=lambda s: s.id)
def test_the_margins_a_step_expects_are_those_of_its_posture(step: Step) -> None:
    """What the plan tells the reader is what torque and stability give."""
    use, left = margins_of(step, vector(step.posture_deg)[None, :])
    assert step.expected['use'] == pytest.approx(float(use[0]), abs=2e-3)
    assert step.expected['tilt_left_deg'] == pytest.approx(float(left[0]), abs=0.05)


def shares(where: str) -> list[float]:
    """Return the shoulder's torque over its limit, with its sign, of the boundary's steps."""
    robot = CONFIG.settings.robot
    k = robot.joint_names.index('shoulder_joint')
    found = []
    for step in PLAN.steps:
        if step.group == 'torque boundary' and step.where == where:
            load_ = Payload(step.payload_kg, robot.payload.cog)
            torque = static_torque(
                robot, vector(step.posture_deg)[None, :], step.gravity(robot.gravity), load_
            )
            found.append(float(torque[0, k] / LIMITS[k]))
    return found


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_both_sides_of_the_torque_boundary_are_there(sign: float) -> None:
    """Each torque limit is tested below its warning and inside on the robot, outside simulated."""
    on_robot = [sign * s for s in shares(ROBOT)]
    simulated = [sign * s for s in shares(SIMULATION)]
    assert any(0.7 < s < 0.77 for s in on_robot)
    assert any(0.9 < s < 1.0 for s in on_robot)
    assert any(1.0 < s < 1.15 for s in simulated)


@pytest.mark.parametrize('side', ['nose-down', 'nose-up', 'left', 'right'])
@pytest.mark.parametrize('band', [(10.0, 13.0), (5.0, 9.0), (0.0, 4.0)])
def test_both_sides_of_the_rollover_boundary_are_there(
    side: str, band: tuple[float, float]
) -> None:
    """Each side's tilt limit is tested before the warning, inside the limit, and beyond it."""
    steps = [s for s in PLAN.steps if s.group == 'rollover boundary']
    left = [s.expected['tilt_left_deg'] for s in steps if s.ground.orientation == side]
    assert any(band[0] < x < band[1] for x in left)


def test_the_robot_tips_over_in_simulation() -> None:
    """The plan has simulated steps that tip the robot over, to more than one side."""
    tips = [s for s in PLAN.steps if s.action == 'tip']
    assert all(s.where == SIMULATION and s.expected['tilt_left_deg'] < 0.0 for s in tips)
    assert len({s.ground.orientation for s in tips}) >= 2


def test_a_posture_behind_a_limit_is_reached_around_it() -> None:
    """Where the straight way passes a limit, the search finds postures between that do not."""
    arm = Arm(CONFIG.settings)
    home = vector(PLAN.home_deg)
    paths = Routes(arm, home).paths(('level', 0.0), 4.0)
    behind = [q for q in paths.q[paths.reachable] if not safe_path(arm, (home, q), *LEVEL)]
    assert behind
    for q in behind[::100]:
        middle = paths.to(q)
        assert middle
        assert safe_path(arm, (home, *middle, q), *LEVEL)


def test_nothing_that_fails_is_run_on_the_robot() -> None:
    """No step on the robot expects a critical alert; only simulated steps do."""
    asked = [p for s in PLAN.steps if s.where == ROBOT for p in s.alerts.must]
    assert not [p for p in asked if p.startswith(('ERROR', 'STALE'))]


def test_every_orientation_is_there() -> None:
    """The plan has every orientation of Figure 6 besides level ground."""
    found = {s.ground.orientation for s in PLAN.steps if s.group == 'orientations'}
    assert found == set(ORIENTATIONS) - {'level'}


def test_lifts_are_below_and_above_the_largest_load() -> None:
    """At the largest load the first margin is used up: 90 % keeps it, 112 % does not."""
    for step in (s for s in PLAN.steps if s.group == 'lift'):
        use, left = margins_of(step, vector(step.posture_deg)[None, :])
        kept = bool(use[0] < 1.0 and left[0] > 0.0)
        assert kept is (step.where == ROBOT), step.id


def test_speeds_are_below_and_above_the_static_limit() -> None:
    """The limit of 36 deg/s has a motion on either side, for each judged joint."""
    speeds = [s.speed_degps for s in PLAN.steps if s.action == 'sweep']
    assert sum(v < 36.0 for v in speeds) == sum(v > 36.0 for v in speeds) == 2


def test_the_robot_comes_before_the_simulation() -> None:
    """What is simulated only is last, so a person can stop reading there."""
    where = [s.where for s in PLAN.steps]
    assert where == sorted(where)


def test_the_greedy_order_is_shorter_than_by_title() -> None:
    """Within one set-up the arm goes to the nearest posture next."""
    setup = [s for s in PLAN.steps if s.group == 'torque boundary' and s.where == SIMULATION]
    by_title = sorted(setup, key=lambda s: s.title)
    assert way(setup, PLAN.home_deg) <= way(by_title, PLAN.home_deg)
    assert distance(PLAN.home_deg, setup[0].posture_deg) > 0.0


def test_the_same_robot_gives_the_same_plan() -> None:
    """Deriving a plan twice for one robot gives the same plan."""
    assert derive(CONFIG).sha256 == PLAN.sha256


def test_the_short_plan_that_ships_is_the_one_derived(repository: Path) -> None:
    """`ugv-acceptance plan --short` gives bags/packbot_short_plan.yaml."""
    shipped = read_plan(repository / 'bags' / 'packbot_short_plan.yaml', CONFIG.settings.robot)
    assert shipped.steps == derive(CONFIG, Wanted(short=True)).steps


def test_the_card_shows_every_step_and_loads_nothing() -> None:
    """One file: every step, drawn, the hash, what the alerts mean; no address to fetch from."""
    card = card_of(PLAN, CONFIG)
    assert all(f'</span>{step.title}</h3>' in card for step in PLAN.steps)
    assert card.count('aria-label="the robot from') == len(PLAN.steps)
    assert PLAN.sha256 in card
    assert 'The ground is taken as flat (not entered)' in card
    assert 'src=' not in card
    assert '<link' not in card
    used = {p.split()[1] for s in PLAN.steps for p in s.alerts.must}
    assert all(f'<code>{code}</code>' in card for code in used)
    assert used <= set(SHOWN)


def test_the_card_says_what_every_alert_means() -> None:
    """The card explains every alert code, because any can come during a test."""
    assert sorted(SHOWN) == sorted(RECORDED)


@pytest.mark.parametrize(
    ('seconds', 'text'), [(16.2, '16 s'), (119.0, '119 s'), (1500.0, '25 min'), (22000.0, '6.1 h')]
)
def test_a_length_is_told_in_the_unit_that_fits(seconds: float, text: str) -> None:
    """The length of a plan is told in a suitable unit, a short one not as 0 min."""
    assert time_text(seconds, digits=2) == text


@pytest.mark.parametrize(
    ('ground', 'turret', 'view', 'lean'),
    [
        ('nose-down', 0.0, 'from its right side', 25.0),
        ('nose-up', 0.0, 'from its right side', -25.0),
        ('right', -90.0, 'from behind', 25.0),
        ('left', 90.0, 'from behind', -25.0),
    ],
)
def test_a_drawing_leans_to_the_low_side(
    ground: str, turret: float, view: str, lean: float
) -> None:
    """Ahead is right in a side view, the robot's right is right from behind; clockwise is plus."""
    step = PLAN.steps[0].model_copy(
        update={'ground': Ground(orientation=ground, tilt_deg=25.0), 'payload_kg': 1.0}
    )
    posture = {**PLAN.home_deg, 'turret_joint': turret, 'shoulder_joint': 0.0, 'elbow_joint': 0.0}
    drawn = sketch(Arm(CONFIG.settings), vector(posture), step)
    assert f'aria-label="the robot {view}"' in drawn
    assert float(re.findall(r'rotate\((-?[\d.]+)\)', drawn)[0]) == pytest.approx(lean)
    line = re.findall(r'polyline points="([^"]+)"', drawn)[0]
    points = [tuple(map(float, p.split(','))) for p in line.split()]
    # The arm stretched out points to the low side: towards the side it is turned to, level.
    assert (points[-1][0] - points[0][0]) * (1.0 if 'up' in ground else lean) > 0.0
    assert points[-1][1] == pytest.approx(points[0][1], abs=0.02)


def test_the_card_says_what_each_step_stands_on() -> None:
    """Where a step's ground is not flat, the card says what the tilt left is worth there."""
    step, arm = PLAN.steps[0], Arm(CONFIG.settings)
    for ground, told in (
        (Ground(kind='stairs'), 'is an upper bound; tip-over not judged as passed)'),
        (Ground(kind='uneven', accept='trend', reason='r'), 'upper bound; tip-over by the trend)'),
    ):
        on = step.model_copy(update={'ground': ground})
        (row,) = group_of(arm, PLAN, [on]).rows
        assert row.ground.startswith(f'{ground.kind}; ')
        assert row.ground.endswith(told)
    assert 'upper bound' not in group_of(arm, PLAN, [step]).rows[0].ground
