"""The named runs of `simulate`: fixed ones, random ones with a seed, and one for every fault."""

from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.model.roles import ARM_ALONE, LEGGED, NONE, roles_of
from ugv_acceptance.simulation.faults import KINDS as FAULTS
from ugv_acceptance.simulation.faults import PHYSICAL, Fault, fault_of
from ugv_acceptance.simulation.repertoire import KINDS, SECONDS
from ugv_acceptance.simulation.scenario import Scenario, noise_of
from ugv_acceptance.simulation.scenarios import SCENARIOS, scenario_of

# When (s) the fault of a fault-KIND run sets in.
SETS_IN = 6.0
FAULT_PREFIX = 'fault-'
# Runs that need an arm, and those that need a load in its gripper too.
NEEDS_ARM = ('overreach', 'fetch', 'swing', 'reach', 'grasp', 'snatch')
NEEDS_LOAD = ('overreach', 'fetch', 'grasp', 'snatch')
# Why a robot cannot be driven in a simulation, by its kind.
NOT_DRIVEN = {
    LEGGED: 'it walks on legs',
    ARM_ALONE: 'it is an arm without contact points on the ground',
    NONE: 'it has no contact points on the ground',
}


@dataclass(frozen=True, slots=True)
class Case:
    """A simulated run: its scenario and the faults injected into it."""

    scenario: Scenario
    faults: tuple[Fault, ...] = ()


def names() -> dict[str, str]:
    """Return the name of every run with a description, in the order of the help text."""
    fixed = {name: _sentence(make.__doc__) for name, make in SCENARIOS.items()}
    drawn = {name: f'{_sentence(make.__doc__)} (drawn by --seed)' for name, make in KINDS.items()}
    faulty = {
        f'{FAULT_PREFIX}{name}': 'gentle, but '
        + ('' if name in PHYSICAL else f'from {SETS_IN:g} s on ')
        + kind.words
        for name, kind in FAULTS.items()
    }
    return fixed | drawn | faulty


def case_of(
    name: str, robot: Robot, seed: int, seconds: float | None, faults: tuple[Fault, ...] = ()
) -> Case:
    """Return a run by name, cut to `seconds` if given.

    Raises BadConfig for an unknown name and for a run that is not one for this robot.
    """
    if seconds is not None and not 0.0 < seconds < 1e6:
        raise BadConfig(f'seconds: expected a number above 0 and below a million, got {seconds:g}')
    known = names()
    if name not in known:
        raise BadConfig(f'scenario: expected one of {", ".join(known)}, got {name!r}')
    check_drives(robot)
    _check_needs(name, robot)
    noise = noise_of(robot)
    if name in KINDS:
        length = SECONDS[name] if seconds is None else seconds
        drawn = KINDS[name](robot, np.random.default_rng(seed), length)
        return Case(replace(drawn, noise=noise), faults)
    if name.startswith(FAULT_PREFIX):
        faults = (_usual(name.removeprefix(FAULT_PREFIX), robot), *faults)
        name = 'gentle'
    scenario = replace(scenario_of(name, robot), noise=noise)
    return Case(scenario if seconds is None else replace(scenario, duration=seconds), faults)


def check_drives(robot: Robot) -> None:
    """Raise BadConfig unless the robot stands on wheels or tracks."""
    why = NOT_DRIVEN.get(roles_of(robot).kind)
    if why:
        raise BadConfig(
            f'{robot.name}: expected a robot on wheels or tracks to simulate, but {why}; '
            'model, evaluate and monitor take it'
        )


def _check_needs(name: str, robot: Robot) -> None:
    roles = roles_of(robot)
    if name in NEEDS_ARM and not roles.axes:
        has = 'an arm without a joint that lifts' if roles.arm else 'none'
        raise BadConfig(f'{name} needs an arm that lifts; {robot.name} has {has}')
    if name in NEEDS_LOAD and robot.payload_link is None:
        raise BadConfig(f'{name} needs payload.link in the configuration; {robot.name} has none')


def _usual(kind: str, robot: Robot) -> Fault:
    """Return the fault of the run `fault-KIND`: at the arm's last axis where it needs a joint.

    Without an arm at the last driven joint. Raises BadConfig without any joint.
    """
    start = 0.0 if kind in PHYSICAL else SETS_IN
    if FAULTS[kind].subject != 'joint':
        return fault_of(kind, '', start)
    limited = [n for n in robot.joint_names if np.isfinite(robot.joint(n).effort)]
    names = roles_of(robot).axes or limited or robot.joint_names
    if not names:
        raise BadConfig(
            f'{FAULT_PREFIX}{kind} needs a joint whose position a message tells; '
            f'{robot.name} has none'
        )
    return fault_of(kind, names[-1], start)


def _sentence(text: str | None) -> str:
    return ' '.join((text or '').split()).rstrip('.')
