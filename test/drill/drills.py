"""Drills of an operator called Ada, as they ended."""

from pathlib import Path
from typing import Any

from ugv_acceptance.bag.atomic_files import write_json
from ugv_acceptance.config import load
from ugv_acceptance.drill.outcome import Drill, Outcome
from ugv_acceptance.drill.record import SITUATIONS, record_json

STARTED = '2025-05-04T09:30:00Z'


def outcome(name: str, *, passed: bool = True, least: float = 12.5) -> Outcome:
    """Return how one situation ended."""
    return Outcome(
        situation=name,
        title=f'The {name}',
        seed=7,
        passed=passed,
        answers=(('stop', 3.25), ('lower', 5.0)),
        happened='the robot stayed on its tracks' if passed else 'it tipped to the right',
        lesson='lower the arm before you drive on',
        least_deg=least,
    )


def drill(
    *outcomes: Outcome, operator: str = 'Ada', started: str = STARTED, scripted: bool = False
) -> Drill:
    """Return a drill on the PackBot that ships."""
    robot = load('packbot')
    return Drill(operator, robot.name, robot.sha256, 3, started, 24.0, outcomes, scripted)


ALL = tuple(outcome(name) for name in SITUATIONS)
ONE_FAILED = (outcome('slope', passed=False, least=float('nan')), *ALL[1:])


def written(path: Path, *outcomes: Outcome, **changes: Any) -> Path:
    """Write the record of a drill on the PackBot that ships, and return its path."""
    write_json(path, record_json(drill(*outcomes, **changes)))
    return path
