"""Run a scenario to its end as fast as it goes and return what its topics would have said."""

import math

from ugv_acceptance.model.robot import Robot
from ugv_acceptance.simulation.scenario import Recording, Scenario
from ugv_acceptance.simulation.simulation import BUILD
from ugv_acceptance.simulation.stretches import stretches
from ugv_acceptance.simulation.vehicle import Build


def run(robot: Robot, scenario: Scenario, seed: int, build: Build = BUILD) -> Recording:
    """Simulate `scenario` in one stretch; the same seed gives the same bits.

    Raises as `stretches` does.
    """
    (recording,) = stretches(robot, scenario, seed, math.inf, build)
    return recording
