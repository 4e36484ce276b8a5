"""Who moves the robot: a person who does what is asked, one who refuses, the simulator itself."""

import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from run.runners import CONFIG, HOME, NEAR, plan_of, results, runner_of

from ugv_acceptance import BadConfig
from ugv_acceptance.run.actuation import OPERATOR, SIM, Hands
from ugv_acceptance.run.motions import REFUSED
from ugv_acceptance.run.report import coverage_of
from ugv_acceptance.run.runner import Runner
from ugv_acceptance.run.simulated_robot import VirtualRobot
from ugv_acceptance.run.simulated_world import Offline
from ugv_acceptance.run.step_verdict import seen_in

RAISED = {**HOME, 'shoulder_joint': 100.0}


class Person:
    """Brings the arm where he is told; does not do what contains `wont`; is off once by `slip`."""

    def __init__(self, wont: str = 'nothing', slip: float = 0.0) -> None:
        self.asked: list[str] = []
        self.wont, self.slip = wont, slip
        self.runner: Runner | None = None

    def __call__(self, text: str, going: Callable[[], bool]) -> bool:
        """Do what `text` asks for; return whether it was done."""
        self.asked.append(text)
        assert self.runner is not None
        assert going()
        found = re.findall(
            r'(\w+_joint) (-?\d+) deg', text.rsplit('bring the arm to', maxsplit=1)[-1]
        )
        if self.wont in text:
            return False
        if 'bring the arm to' in text:
            aim = {name: math.radians(float(deg) + self.slip) for name, deg in found}
            self.slip = 0.0
            self.runner.world.commands.move(aim, 1.0)
            self.runner.world.wait(1.5)
        return True


def of_person(out: Path, person: Person, *steps: dict[str, object]) -> Runner:
    """Return the runner of a plan whose robot a person moves."""
    person.runner = runner_of(out, plan_of(*steps), mode=OPERATOR, ask=person)
    return person.runner


def test_an_operator_who_does_as_told_passes(tmp_path: Path) -> None:
    """He is told what to set up and where to bring the arm; the joint states show that he did."""
    person = Person()
    (result,) = results(of_person(tmp_path / 'out', person, {'preparation': ['level ground']}))
    assert (result['verdict'], result['reasons']) == ('PASS', ['all alerts as expected'])
    assert person.asked[0].startswith('stand the robot on its tracks')
    assert 's0: set up: level ground' in person.asked
    assert person.asked[-1].startswith('s0: bring the arm to ')


def test_an_operator_who_misses_is_asked_again(tmp_path: Path) -> None:
    """What is off is named, and he is asked until the joint states show the posture."""
    person = Person(slip=8.0)
    (result,) = results(of_person(tmp_path / 'out', person, {}))
    assert result['verdict'] == 'PASS'
    again = [text for text in person.asked if text.startswith('the posture was not reached: ')]
    assert len(again) == 1
    assert ' deg off; way: bring the arm to ' in again[0]


@pytest.mark.parametrize(
    ('step', 'told'),
    [
        ({'action': 'drive', 'drive': (0.2, 0.0)}, 's0: drive at 0.2 m/s for 0.5 s, then stand'),
        ({'action': 'drive', 'drive': (0.0, 30.0)}, 's0: turn at 30 deg/s for 0.5 s, then stand'),
        ({'action': 'pull', 'force_n': 90.0}, 's0: pull with 90 N for 0.5 s, then let go'),
        ({'preparation': ('a box',)}, 's0: set up: a box'),
        ({}, 's0: bring the arm to'),
    ],
)
def test_what_an_operator_refuses_shows_nothing(
    tmp_path: Path, step: dict[str, object], told: str
) -> None:
    """Whatever it is that he does not do, the step neither passes nor fails nor is tried again."""
    person = Person(wont=told)
    (result,) = results(of_person(tmp_path / 'out', person, step))
    assert (result['verdict'], result['reasons']) == ('INCONCLUSIVE', [REFUSED])
    assert result['earlier'] == []
    assert sum(told in text for text in person.asked) == 1


def test_what_would_pass_a_limit_is_not_asked_of_a_person(tmp_path: Path) -> None:
    """A step for the simulation is skipped on a robot, with its reason, and nobody is asked."""
    person = Person()
    (result,) = results(of_person(tmp_path / 'out', person, {'where': 'simulation'}))
    assert (result['verdict'], person.asked) == ('SKIPPED', [])
    assert result['reasons'] == ['would exceed a limit: in simulation only']


def test_what_is_not_asked_of_a_robot_does_not_count_against_it(tmp_path: Path) -> None:
    """All it was asked for passed: so does the run, and it says what was not asked."""
    runner = of_person(tmp_path / 'out', Person(), {}, {'where': 'simulation'})
    assert [r['verdict'] for r in results(runner)] == ['PASS', 'SKIPPED']
    whole = runner.folder.finish(CONFIG, coverage_of(CONFIG, []))
    assert (whole['verdict'], whole['asked']) == ('PASS', 1)
    report = (tmp_path / 'out' / 'report.txt').read_text()
    assert (
        '2 steps: 1 SKIPPED, 1 PASS; 1 would exceed a limit and are for simulation only' in report
    )


def test_a_plan_that_asks_nothing_of_a_robot_shows_nothing(tmp_path: Path) -> None:
    """Where every step is for the simulation, a run on the robot is inconclusive."""
    runner = of_person(tmp_path / 'out', Person(), {'where': 'simulation'})
    assert [r['verdict'] for r in results(runner)] == ['SKIPPED']
    assert runner.folder.finish(CONFIG, coverage_of(CONFIG, []))['verdict'] == 'INCONCLUSIVE'


def test_a_simulated_robot_drives_and_stands_still_again(tmp_path: Path) -> None:
    """It gets as far as speed and time say, and rests when the step is over."""
    step = {'action': 'drive', 'drive': (0.4, 0.0), 'hold_s': 1.0, 'posture_deg': HOME}
    runner = runner_of(tmp_path / 'out', plan_of(step))
    (result,) = results(runner)
    simulation = runner.world.virtual.remote.simulation  # type: ignore[attr-defined]
    assert result['verdict'] == 'PASS'
    assert float(simulation.base()[0][0]) == pytest.approx(0.4, abs=0.15)
    runner.world.wait(1.0)  # it brakes
    before = float(simulation.base()[0][0])
    runner.world.wait(0.5)
    assert float(simulation.base()[0][0]) == pytest.approx(before, abs=0.01)


def test_a_cycle_goes_round_for_its_time(tmp_path: Path) -> None:
    """From posture to posture and back, so often as the time allows; its way home stays short."""
    step = {'action': 'cycle', 'via_deg': [NEAR, RAISED], 'hold_s': 4.0, 'posture_deg': HOME}
    runner = runner_of(tmp_path / 'out', plan_of(step))
    (result,) = results(runner)
    assert result['verdict'] == 'PASS'
    _, q, _, _ = seen_in(tmp_path / 'out' / 'steps' / 's0', CONFIG).joined()
    shoulder = q[:, CONFIG.settings.robot.joint_names.index('shoulder_joint')]
    high = shoulder > math.radians(103.0)
    assert (high[1:] & ~high[:-1]).sum() >= 2
    assert len(runner.moves.trail) <= 3


def test_a_sweep_passes_through_its_postures(tmp_path: Path) -> None:
    """It goes to where the sweep begins slowly and on at its speed, without a hold in between."""
    step = {'action': 'sweep', 'via_deg': [RAISED], 'speed_degps': 30.0}
    (result,) = results(runner_of(tmp_path / 'out', plan_of(step)))
    assert result['verdict'] == 'PASS'
    begin, hold, end = result['window_s']
    assert begin < hold < end


class Deaf(Offline):
    """A world whose monitor was never heard."""

    def missing(self) -> str:
        """Return who was not heard."""
        return 'the monitor'

    def dead(self) -> bool:
        """Return whether the monitor is silent."""
        return True


def without_monitor(out: Path) -> Runner:
    """Return a runner whose world has no monitor."""
    runner = runner_of(out, plan_of({}))
    world = Deaf(VirtualRobot(CONFIG, 1), lambda _: None)
    return Runner(CONFIG, runner.folder, world, Hands(world, SIM, lambda *_: False))


def test_a_robot_without_a_monitor_is_not_moved(tmp_path: Path) -> None:
    """Where nothing is heard in time, the error says of whom."""
    with pytest.raises(BadConfig, match=r'expected the monitor within 0\.5 s, got nothing'):
        without_monitor(tmp_path / 'out').wait_for_all(0.5)


def test_a_monitor_that_falls_silent_ends_the_run(tmp_path: Path) -> None:
    """No step is begun that nobody would watch, and the run says why it is over."""
    runner = without_monitor(tmp_path / 'out')
    (result,) = results(runner)
    assert (result['verdict'], result['reasons']) == (
        'INCONCLUSIVE',
        ['the monitor publishes nothing'],
    )
    assert runner.over == 'the monitor publishes nothing'


def test_a_step_tells_the_monitor_its_kind_of_ground(tmp_path: Path) -> None:
    """The evaluation stands on it from the set-up on; a step without one, as configured."""
    plan = plan_of({'ground': {'kind': 'stairs'}}, {})
    runner = runner_of(tmp_path, plan)
    evaluator = runner.world.evaluator  # type: ignore[attr-defined]  # the simulated world's
    seen = []
    for one in plan.steps:
        assert runner.hands.set_up(one)
        seen.append(evaluator.settings.ground.kind)
    assert seen == ['stairs', None]
