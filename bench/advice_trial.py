"""Tries advice out: the simulated robot follows it, and its margins are compared."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.evaluation.advice.search import Advice, advise
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.attitude import up_from_orientation
from ugv_acceptance.model.robot import IDENTITY, Payload
from ugv_acceptance.model.stability import NO_CONTACT, SIDES, margins
from ugv_acceptance.simulation.scenario import Command
from ugv_acceptance.simulation.simulation import Simulation
from ugv_acceptance.simulation.tip_cases import TipCase, random_cases
from ugv_acceptance.type_aliases import Floats

# Time (s) after which a motion that has ended has calmed down.
CALM = 0.8
STEEPEST = 0.5
# Skid steering: what is asked for (rad/s), of which the ground leaves a part; how often (s) an
# operator looks how far the robot has turned, and how much longer than was said he tries.
YAW_RATE, TICK, PATIENCE = 0.6, 0.05, 2.0
# A case begins with at least this margin (rad), so that the robot stands until it can be told, and
# with motors that give what the model says (N m; N): else the arm leans on the ground or the body.
STANDS, LEANS = math.radians(2.0), 2.0


@dataclass(frozen=True, slots=True)
class Trial:
    """A trial of advice: the margin the advice is for, in the simulation before and after.

    In rad of tilt, or N m (N) between limit and what the motor was measured to give. `least` is the
    smallest tilt left (rad) to any side on the way, -inf where there was no margin at all.
    """

    case: TipCase
    advice: Advice
    before: float
    after: float
    least: float

    @property
    def helped(self) -> bool:
        """Whether the margin is larger than before."""
        return self.after > self.before

    @property
    def tipped(self) -> bool:
        """Whether the robot lost all its tilt margin on the way."""
        return not self.least > 0.0


def trials(settings: Settings, count: int, seed: int, kinds: tuple[str, ...]) -> Iterator[Trial]:
    """Yield `count` trials of the best advice of these kinds (joint, turn, payload).

    Random postures, loads and slopes in which a margin is below its warning limit and the robot
    still stands.
    """
    found, offset = 0, 0
    while found < count:
        for case in random_cases(settings.robot, 50, seed + offset, steepest=STEEPEST):
            trial = _trial(settings, case, kinds) if _stands(settings, case) else None
            if trial is not None:
                found += 1
                yield trial
            if found == count:
                return
        offset += 1


def _stands(settings: Settings, case: TipCase) -> bool:
    """Return whether the robot stands on its tracks and holds its arm, with a margin left."""
    s, c = math.sin(case.tilt), math.cos(case.tilt)
    across = (s * math.cos(case.heading), s * math.sin(case.heading), -c)
    down = settings.robot.gravity * np.array(across)
    now = margins(settings.robot, case.q, down, case.payload)
    if now.state != 0 or not (now.angle > STANDS).all():
        return False
    holds = np.abs(now.torque) < 0.95 * np.array(settings.limits.torque)
    return bool(holds.all() and advise(settings, case.q, down.tolist(), case.payload))


def _trial(settings: Settings, case: TipCase, kinds: tuple[str, ...]) -> Trial | None:
    start = tuple(zip(settings.robot.joint_names, case.q, strict=True))
    simulation = Simulation(settings.robot, start, (case.tilt, case.heading), case.payload)
    q, down, effort = _state(simulation)
    model = margins(settings.robot, q, down, case.payload).torque
    if np.abs(effort - model).max() > LEANS:
        return None
    told = advise(settings, q.tolist(), down.tolist(), case.payload)
    advice = next((a for a in told if a.kind in kinds), None)
    if advice is None:
        return None
    before = _margin(settings, simulation, advice, case.payload)
    load = Payload(0.0, case.payload.cog) if advice.kind == 'payload' else case.payload
    least = min(_least(settings, simulation, load) for _ in _follow(simulation, advice, load))
    return Trial(case, advice, before, _margin(settings, simulation, advice, load), least)


def _follow(simulation: Simulation, advice: Advice, load: Payload) -> Iterator[None]:
    """Follow the advice, with this load (kg) from then on, and yield every TICK on the way."""
    now = simulation.time
    if advice.kind == 'payload':
        simulation.apply(Command(now, payload=load))
    elif advice.kind == 'turn':
        yield from _turn(simulation, advice)
    else:
        j = simulation.robot.joint_names.index(advice.subject)
        target = float(simulation.joints()[0][j]) + advice.amount
        speed = abs(advice.amount) / advice.seconds
        simulation.apply(Command(now, ((advice.subject, target),), speed))
        # A smooth motion of that peak speed takes pi / 2 as long as one at that speed throughout.
        yield from _wait(simulation, advice.seconds * math.pi / 2.0)
    yield from _wait(simulation, CALM)


def _turn(simulation: Simulation, advice: Advice) -> Iterator[None]:
    """Turn on the spot until the robot faces the advised way or does not turn any more."""
    amount = advice.amount
    wanted = math.copysign(YAW_RATE, amount)
    simulation.apply(Command(simulation.time, drive=(0.0, wanted)))
    turned = 0.0
    for _ in _wait(simulation, PATIENCE * advice.seconds):
        turned += float(simulation.imu()[1][2]) * TICK
        yield
        if turned * wanted >= amount * wanted:
            break
    simulation.apply(Command(simulation.time, drive=(0.0, 0.0)))


def _wait(simulation: Simulation, seconds: float) -> Iterator[None]:
    """Simulate `seconds`, and yield every TICK."""
    for _ in range(math.ceil(seconds / TICK)):
        simulation.advance(TICK)
        yield


def _state(simulation: Simulation) -> tuple[Floats, Floats, Floats]:
    """Return positions, gravity (m/s2, `base_link`) and motor forces as the robot measures them."""
    q, _, effort = simulation.joints()
    orientation, _, _ = simulation.imu()
    x, y, z, w = orientation.tolist()
    up = np.array(up_from_orientation(x, y, z, w, IDENTITY))
    return q.copy(), -simulation.robot.gravity * up, effort.copy()


def _least(settings: Settings, simulation: Simulation, load: Payload) -> float:
    """Return the smallest tilt left (rad) to any side."""
    q, down, _ = _state(simulation)
    now = margins(settings.robot, q, down, load)
    return -math.inf if int(now.state) >= NO_CONTACT else float(now.angle.min())


def _margin(settings: Settings, simulation: Simulation, advice: Advice, load: Payload) -> float:
    """Return the margin the advice is for: tilt left (rad), or the motor's reserve (N m; N)."""
    q, down, effort = _state(simulation)
    if advice.margin not in SIDES:
        j = settings.robot.joint_names.index(advice.margin)
        return settings.limits.torque[j] - abs(float(effort[j]))
    now = margins(settings.robot, q, down, load)
    if int(now.state) >= NO_CONTACT:
        return -math.inf
    return float(now.angle[SIDES.index(advice.margin)])
