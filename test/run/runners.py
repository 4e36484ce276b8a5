"""Runners of small plans in simulated time, for the tests of this room."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ugv_acceptance.config import load
from ugv_acceptance.plan.plan import Plan
from ugv_acceptance.run.actuation import SIM, Ask, Hands
from ugv_acceptance.run.fault_text import fault_from
from ugv_acceptance.run.folder import open_folder
from ugv_acceptance.run.runner import Runner
from ugv_acceptance.run.simulated_robot import VirtualRobot
from ugv_acceptance.run.simulated_world import Offline

CONFIG = load()
HOME = {
    'turret_joint': 0.0, 'shoulder_joint': 95.0, 'elbow_joint': 140.0, 'flipper_joint': 180.0
}  # fmt: skip
NEAR = {**HOME, 'shoulder_joint': 105.0}


def plan_of(*steps: dict[str, Any]) -> Plan:
    """Return a plan of steps near home that expect nothing, changed as given."""
    usual = {
        'group': 'g', 'title': 't', 'purpose': 'p', 'hold_s': 0.5, 'speed_degps': 35.0,
        'posture_deg': NEAR, 'alerts': {'must_not': ['ERROR', 'STALE']},
    }  # fmt: skip
    written = [{'id': f's{k}', **usual, **step} for k, step in enumerate(steps)]
    return Plan.model_validate(
        {'plan': 'tiny', 'robot': 'packbot', 'config_sha256': CONFIG.sha256, 'home_deg': HOME,
         'steps': written}
    )  # fmt: skip


def runner_of(
    out: Path, plan: Plan, *faults: str, mode: str = SIM, ask: Ask = lambda *_: False
) -> Runner:
    """Return a runner of a plan in a folder, its robot with faults."""
    home = tuple(math.radians(HOME[n]) for n in CONFIG.settings.robot.joint_names)
    found = tuple(fault_from(text, CONFIG.settings.robot) for text in faults)
    world = Offline(VirtualRobot(CONFIG, 1, found, home), lambda _: None)
    folder = open_folder(out, plan, None, mode, CONFIG, resume=False)
    return Runner(CONFIG, folder, world, Hands(world, mode, ask), attempts=2)


def results(runner: Runner) -> Iterator[dict[str, Any]]:
    """Do all steps and yield what came of each."""
    for step in runner.folder.plan.steps:
        result = runner.run(step)
        assert result is not None
        yield result
