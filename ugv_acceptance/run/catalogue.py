"""The named runs of `simulate`: fixed ones, random ones with a seed, and one for every fault."""

from dataclasses import dataclass, replace

import numpy as np

from ugv_acceptance import BadConfig
from ugv_acceptance.model.robot import Robot
from ugv_acceptance.simulation.faults import KINDS as FAULTS
from ugv_acceptance.simulation.faults import PHYSICAL, Fault, fault_of
from ugv_acceptance.simulation.repertoire import KINDS, SECONDS
from ugv_acceptance.simulation.scenario import Scenario
from ugv_acceptance.simulation.scenarios import SCENARIOS

# When (s) the fault of a fault-KIND run sets in.
SETS_IN = 6.0
FAULT_PREFIX = 'fault-'


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
    """Return a run by name, cut to `seconds` if given. Raises BadConfig for an unknown name."""
    if seconds is not None and not 0.0 < seconds < 1e6:
        raise BadConfig(f'seconds: expected a number above 0 and below a million, got {seconds:g}')
    known = names()
    if name not in known:
        raise BadConfig(f'scenario: expected one of {", ".join(known)}, got {name!r}')
    if name in KINDS:
        length = SECONDS[name] if seconds is None else seconds
        return Case(KINDS[name](robot, np.random.default_rng(seed), length), faults)
    if name.startswith(FAULT_PREFIX):
        faults = (_usual(name.removeprefix(FAULT_PREFIX), robot), *faults)
        name = 'gentle'
    scenario = SCENARIOS[name]()
    return Case(scenario if seconds is None else replace(scenario, duration=seconds), faults)


def _usual(kind: str, robot: Robot) -> Fault:
    """Return the fault of the run `fault-KIND`: at the last driven joint where it needs a joint."""
    start = 0.0 if kind in PHYSICAL else SETS_IN
    joint = next(
        (n for n in reversed(robot.joint_names) if np.isfinite(robot.joint(n).effort)),
        robot.joint_names[-1],
    )
    return fault_of(kind, joint if FAULTS[kind].subject == 'joint' else '', start)


def _sentence(text: str | None) -> str:
    return ' '.join((text or '').split()).rstrip('.')
