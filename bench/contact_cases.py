"""Random robots on uneven feet, on a slowly tilting plane in MuJoCo: when they really tip.

Tipping is a turn of TIPPED from where the robot had come to rest.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from ugv_acceptance.model.robot import Contact, Joint, Link, Payload, Robot
from ugv_acceptance.simulation import oracle
from ugv_acceptance.simulation.engine import mujoco
from ugv_acceptance.simulation.vehicle import Vehicle, gravity_on_slope, vehicle_of
from ugv_acceptance.type_aliases import Floats

TIPPED = np.radians(5.0)
# Rates (rad/s) at which the plane tilts, and how far (rad) before the last result the next starts.
RATES, BACK = np.radians((12.0, 2.0, 0.2)), np.radians((7.0, 2.0))
# On the fastest plane a tip is noticed late, by less than this (rad).
LATE = float(np.radians(1.0))
# It is still at rest so much (rad) before it has turned by TIPPED.
FALLING = float(np.radians(0.5))
# Tilt (rad) at which a search ends, and how often (s) its states are kept.
LAST, KEPT = float(np.radians(75.0)), 0.1
# Headings closer than this (rad) count as one.
FINE = float(np.radians(5.0))
# A robot that turns so far (rad) while it settles does not stand on these feet.
FALLEN = np.radians(30.0)
KINDS = ('tracks and flippers', 'four feet', 'four to seven feet', 'flippers up or down', 'legs')
TRACKS = ((0.25, 0.202), (0.25, -0.202), (-0.25, 0.202), (-0.25, -0.202))
MASS, GRAVITY = 30.0, 9.81


@dataclass(frozen=True, slots=True)
class Case:
    """A rigid robot: its contacts (n, 3) and centre of gravity (m), and where the plane tilts to.

    `moving` of the contacts, the last ones, are on a link that moves; `ground` (m) is its plane.
    """

    seed: int
    kind: str
    points: Floats
    cog: Floats
    heading: float
    moving: int = 0
    ground: float = 0.0


@dataclass(frozen=True, slots=True)
class Truth:
    """What the simulation did: the tilt at which it tipped (rad; infinite: never), and its rests.

    `rests` are pairs of a tilt and the attitude (3, 3) at it, before it tipped; the first is that
    on the level. Empty where it did not stand at all.
    """

    tilt: float
    rests: tuple[tuple[float, Floats], ...]


def random_case(seed: int) -> Case:
    """Return the case of a seed; the kinds take turns.

    Feet are up to 2, 6 or 20 mm too high or low; flippers are up to 30 deg from the ground; legs
    keep the body level on a slope of up to 20 deg.
    """
    rng, kind = np.random.default_rng(seed), seed % len(KINDS)
    spread = 0.02 * float(rng.choice((0.1, 0.3, 1.0)))
    angle = np.radians(-14.92 + (rng.uniform(-30.0, 30.0) if kind == 3 else 0.0))
    if kind in {0, 3}:
        x = 0.239 + 0.24201 * np.cos(angle) + 0.03382 * np.sin(angle)
        z = 0.095 + 0.24201 * np.sin(angle) - 0.03382 * np.cos(angle)
        tracks = np.column_stack((TRACKS, np.zeros(4)))
        points = np.vstack((tracks, ((x, 0.228, z), (x, -0.228, z))))
    elif kind == 2:
        count = int(rng.integers(4, 8))
        around, out = np.sort(rng.uniform(-np.pi, np.pi, count)), rng.uniform(0.2, 0.5, count)
        points = np.column_stack((out * np.cos(around), out * np.sin(around), np.zeros(count)))
    else:
        size = rng.uniform((0.15, 0.12, 0.0), (0.4, 0.35, 0.0))
        points = np.sign(np.column_stack((TRACKS, np.zeros(4)))) * size
        points[:, :2] += rng.uniform(-0.04, 0.04, (4, 2))
    if kind == 4:
        steep, way = np.tan(rng.uniform(0.0, np.radians(20.0))), rng.uniform(-np.pi, np.pi)
        points[:, 2] += steep * (points[:, :2] @ (np.cos(way), np.sin(way)))
    points[:, 2] += rng.uniform(-spread, spread, len(points)) * (0.1 if kind == 3 else 1.0)
    inside = (rng.dirichlet(np.full(len(points), 1.5)) @ points)[:2]
    cog = np.array((*inside, rng.uniform(0.1, 0.5)))
    moving, ground = (2 if kind in {0, 3} else len(points)), (-0.5 if kind == 4 else 0.0)
    heading = float(rng.uniform(-np.pi, np.pi))
    return Case(seed, KINDS[kind], points, cog, heading, moving, ground)


def robot_of(case: Case) -> Robot:
    """Return the robot of a case; its moving contacts are on a link with a joint at zero."""
    inertia = ((0.02 * MASS, 0.0, 0.0), (0.0, 0.03 * MASS, 0.0), (0.0, 0.0, 0.03 * MASS))
    body = Link('base_link', MASS, _three(case.cog), inertia)
    split = len(case.points) - case.moving
    contacts = tuple(
        Contact(f'contact{k}', 'base_link' if k < split else 'moving', _three(point))
        for k, point in enumerate(case.points)
    )
    joint = Joint('joint', 'revolute', 'base_link', 'moving', axis=(0.0, 1.0, 0.0))
    links = (body, Link('moving'))
    return Robot('feet', links, (joint,), ('joint',), contacts, ground=case.ground)


def _three(values: Floats) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z


def truth_of(case: Case, headings: Sequence[float] | None = None) -> Truth:
    """Return when and how the robot tips: towards the case's heading, or the first of several."""
    vehicle = vehicle_of(oracle.rigid(robot_of(case), (0.0,), Payload()), oracle.BUILD)
    start = oracle.settled(vehicle, np.eye(3))
    rest = oracle.attitude(vehicle, start)
    if oracle.turn(rest, np.eye(3)) > FALLEN:
        return Truth(0.0, ())
    slopes = [_Slope(vehicle, start, heading) for heading in headings or (case.heading,)]
    coarse: list[float] = []
    for slope in slopes:
        coarse.append(slope.first(min(coarse, default=LAST) + LATE))
    near = min(coarse) + LATE
    found = [s.finer(t) if t <= near else np.inf for s, t in zip(slopes, coarse, strict=True)]
    least = int(np.argmin(found))
    rests = ((0.0, rest), *slopes[least].rests(found[least]))
    return Truth(found[least], rests)


class _Slope:
    """A plane that tilts down towards one heading, with the states the robot went through."""

    def __init__(self, vehicle: Vehicle, start: mujoco.MjData, heading: float) -> None:
        self.vehicle, self.heading = vehicle, heading
        self.upright = oracle.attitude(vehicle, start)
        self.states = [(0.0, _state(start), self.upright)]

    def first(self, last: float) -> float:
        """Return the tilt (rad) at which it tips on a plane that tilts fast, up to `last`."""
        return self._tilt(0.0, RATES[0], min(last, LAST))

    def finer(self, tilt: float) -> float:
        """Return a tilt found fast, found again on ever slower planes."""
        for rate, back in zip(RATES[1:], BACK, strict=True):
            if tilt < np.inf:
                tilt = self._tilt(max(tilt - back, 0.0), rate)
        return tilt

    def rests(self, before: float) -> Iterator[tuple[float, Floats]]:
        """Yield tilts (rad) and attitudes before a tilt, one a degree and the last."""
        last = before - FALLING
        known = sorted(((t, a) for t, _, a in self.states if t <= last), key=lambda s: s[0])
        known = known or [(0.0, self.upright)]
        for goal in np.arange(1.0, np.degrees(min(before, LAST)), 1.0):
            yield min(known, key=lambda s: abs(s[0] - np.radians(goal)))
        yield known[-1]

    def _tilt(self, first: float, rate: float, last: float = LAST) -> float:
        """Tilt on from the last state before `first` until it tips; return that tilt (rad)."""
        model = self.vehicle.model
        tilt, state, _ = max((s for s in self.states if s[0] <= first), key=lambda s: s[0])
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:], data.qacc_warmstart[:] = state
        model.opt.gravity[:] = gravity_on_slope(GRAVITY, tilt, self.heading)
        oracle._calm(model, data)  # noqa: SLF001 - the same as the oracle of the margins does
        kept = tilt
        while tilt < last:
            tilt += rate * oracle.STRIDE * model.opt.timestep
            model.opt.gravity[:] = gravity_on_slope(GRAVITY, tilt, self.heading)
            mujoco.mj_step(model, data, nstep=oracle.STRIDE)
            attitude = oracle.attitude(self.vehicle, data)
            if oracle.turn(attitude, self.upright) > TIPPED:
                return float(tilt)
            if tilt - kept > rate * KEPT:
                self.states.append((tilt, _state(data), attitude))
                kept = tilt
        return float('inf')


def _state(data: mujoco.MjData) -> tuple[Floats, Floats, Floats]:
    return data.qpos.copy(), data.qvel.copy(), data.qacc_warmstart.copy()


def headings_of(points: Floats) -> tuple[float, ...]:
    """Return the headings (rad) square to the lines between any two contacts, 5 deg apart."""
    lines = [(b - a)[:2] for a, b in permutations(points, 2)]
    return tuple(sorted({round(float(np.arctan2(-x, y)) / FINE) * FINE for x, y in lines}))


def lowered(robot: Robot, name: str, height: float) -> Robot:
    """Return a robot whose contact `name` lies lower by `height` (m)."""
    contacts = []
    for contact in robot.contacts:
        x, y, z = contact.position
        down = height if contact.name == name else 0.0
        contacts.append(replace(contact, position=(x, y, z - down)))
    return replace(robot, contacts=tuple(contacts))
