"""Robots that report something else than torque: efforts made from a model that is itself off."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from robots import LIFT, box, paper_arm, random_robot, tracked

from ugv_acceptance.config import load
from ugv_acceptance.config.urdf import read_urdf
from ugv_acceptance.evaluation.effort.arm import Arm
from ugv_acceptance.evaluation.effort.facts import (
    CONSTANT,
    NONE,
    OTHER_SIGN,
    SATURATED,
    SCALED,
    TORQUE,
    WITHOUT,
)
from ugv_acceptance.evaluation.effort.model_errors import (
    Sizes,
    levers,
    loaded,
    model_errors,
    sizes_of,
    sources_for,
)
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Joint, Link, Payload, Robot
from ugv_acceptance.model.statics import static_torque
from ugv_acceptance.type_aliases import Floats

SIGNS = np.array((-1.0, 1.0))
MEANINGS = (TORQUE, OTHER_SIGN, SCALED, WITHOUT, NONE, CONSTANT, SATURATED)
SHARED = Path(__file__).resolve().parents[4] / 'shared' / 'robots'
# Robots of others with arms: the joints that move, and the link that carries.
ARMS = {
    'husky_ur5': (
        [f'ur5_{name}_joint' for name in ['shoulder_pan', 'shoulder_lift', 'elbow']]
        + [f'ur5_wrist_{k}_joint' for k in (1, 2, 3)],
        'ur5_tool0',
    ),
    'tiago': (
        ['torso_lift_joint', 'head_1_joint', 'head_2_joint']
        + [f'arm_{k}_joint' for k in range(1, 8)],
        'gripper_link',
    ),
    'tb3_manip': ([f'joint{k}' for k in range(1, 5)], 'link5'),
    'z1': ([f'joint{k}' for k in range(1, 7)], 'link06'),
}


def of_others(name: str, folder: Path = SHARED) -> Robot:
    """Return a robot whose URDF others made, with the joints of its arm."""
    joints, link = ARMS[name]
    read = read_urdf((folder / name / f'{name}.urdf').read_bytes(), name)
    return Robot(name, read.links, read.joints, tuple(joints), payload_link=link)


def random_arm(rng: np.random.Generator) -> Robot:
    """Return a base with an arm of three to six joints, one of which may slide."""
    links, joints = [Link('base', 30.0)], []
    for k in range(int(rng.integers(3, 7))):
        slides = rng.random() < 0.15
        length, mass = float(rng.uniform(0.15, 0.6)), float(rng.uniform(0.5, 4.0))
        axis = ((0.0, 0.0, 1.0), LIFT, (1.0, 0.0, 0.0))[int(rng.choice(3, p=(0.2, 0.65, 0.15)))]
        place = (float(0.0 if not k else links[-1].cog[0] * 2.0), 0.0, 0.2 * (not k))
        joints.append(
            Joint(
                f'joint{k}', 'prismatic' if slides else 'revolute', links[-1].name, f'link{k}',
                place, axis=axis, lower=-0.2 if slides else -2.5, upper=0.3 if slides else 2.5,
            )
        )  # fmt: skip
        links.append(Link(f'link{k}', mass, (length / 2.0, 0.0, 0.0), box(mass, length, 0.1, 0.1)))
    names = tuple(joint.name for joint in joints)
    return Robot('arm', tuple(links), tuple(joints), names, payload_link=links[-1].name)


def own_robots(seed: int, trees: int) -> Iterator[tuple[str, Robot]]:
    """Yield the robots of this project and random ones, none with a declared load."""
    yield 'packbot', replace(load().settings.robot, payload=Payload())
    yield 'tracked', replace(tracked(), payload=Payload())
    yield 'paper', replace(paper_arm(), payload=Payload())
    for k in range(trees):
        rng = np.random.default_rng((seed, k))
        yield f'arm {k}', random_arm(rng)
        tree = random_robot(rng, 4)
        yield f'tree {k}', replace(tree, payload=Payload(0.0, tree.payload.cog))


def others(folder: Path = SHARED) -> Iterator[tuple[str, Robot]]:
    """Yield the robots of others with arms, where they are."""
    for name in ARMS:
        if (folder / name).is_dir():
            yield name, of_others(name, folder)


@dataclass(frozen=True, slots=True)
class Falsified:
    """A run's rest postures with efforts, what each joint's effort truly is, and the true load."""

    arm: Arm
    truth: tuple[str, ...]
    load: float
    q: Floats
    gravity: Floats


def other_truth(robot: Robot, rng: np.random.Generator, mass: float, cog: float) -> Robot:
    """Return the robot as it truly is: every body's mass (share) and centre (m) a little off."""
    tree = mechanics_of(robot).tree
    factors = 1.0 + mass * rng.normal(size=len(tree.bodies))
    shifts = cog * rng.normal(size=(len(tree.bodies), 3))
    links = []
    for link in robot.links:
        body, rotation, _ = tree.frames[link.name]
        x, y, z = (np.array(link.cog) + np.array(rotation).T @ shifts[body]).tolist()
        links.append(replace(link, mass=link.mass * float(factors[body]), cog=(x, y, z)))
    return replace(robot, links=tuple(links))


def arm_of(
    robot: Robot, q: Floats, gravity: Floats, effort: Floats, declared: float = 0.0
) -> tuple[Arm, Sizes]:
    """Return the rest postures of a run as the model sees them."""
    carrying, _ = loaded(robot)
    sizes = sizes_of(robot)
    torque = static_torque(carrying, q, gravity, Payload(declared, robot.payload.cog))
    errors = model_errors(carrying, sources_for(carrying, ()), q, gravity, declared)
    arm = Arm(
        effort, torque, levers(carrying, q, gravity), np.full(len(q), declared), errors,
        sizes.torque, sizes.most,
    )  # fmt: skip
    return arm, sizes


@dataclass(frozen=True, slots=True)
class Off:
    """How far the truth is from the model: masses, centres (m), zeros (rad), friction (shares)."""

    mass: float = 0.03
    cog: float = 0.005
    zero: float = np.radians(1.0)
    friction: tuple[float, float] = (0.01, 0.08)


def falsified(
    robot: Robot,
    meanings: Sequence[str],
    postures: int,
    rng: np.random.Generator,
    load: float | None = None,
    off: Off = Off(),
) -> Falsified:
    """Return a run in random postures; each joint's effort has one of `meanings`, drawn."""
    sizes, n = sizes_of(robot), len(robot.joint_names)
    if load is None:
        load = float(rng.choice((0.0, rng.uniform(0.05, 0.6) * sizes.most)))
    truth = other_truth(robot, rng, off.mass, off.cog)
    slides = np.array([robot.joint(name).slides for name in robot.joint_names])
    ends = np.array([robot.joint(name).travel(0.3) for name in robot.joint_names])
    low, high = np.maximum(ends[:, 0], -np.pi), np.minimum(ends[:, 1], np.pi)
    q = rng.uniform(low, high, (postures, n))
    gravity = np.array((0.0, 0.0, -9.81)) + np.append(
        rng.uniform(-0.9, 0.9, (postures, 2)), np.zeros((postures, 1)), axis=1
    )
    gravity *= 9.81 / np.linalg.norm(gravity, axis=1)[:, None]
    zeros = off.zero * rng.normal(size=n) * np.where(slides, 0.1, 1.0)
    torque = static_torque(truth, q + zeros, gravity, Payload(load, robot.payload.cog))
    model = static_torque(robot, q, gravity, Payload(0.0, robot.payload.cog))
    size = sizes.torque
    friction = rng.choice((-1.0, 1.0), torque.shape) * rng.uniform(*off.friction, n) * size
    full = torque + friction * rng.uniform(0.3, 1.0, torque.shape)
    full += rng.uniform(-0.02, 0.02, n) * size + 0.004 * size * rng.normal(size=torque.shape)
    truths = tuple(str(rng.choice(meanings)) for _ in range(n)) if len(meanings) > 1 else (
        meanings[0],
    ) * n  # fmt: skip
    columns = [_reported(truths[j], full[:, j], model[:, j], size[j], rng) for j in range(n)]
    effort = np.column_stack(columns)
    return Falsified(arm_of(robot, q, gravity, effort)[0], truths, load, q, gravity)


def _reported(
    meaning: str, full: Floats, gravity: Floats, size: float, rng: np.random.Generator
) -> Floats:
    """Return what is reported of the torque `full`, of which `gravity` holds the arm alone."""
    makers: dict[str, Callable[[], Floats]] = {
        OTHER_SIGN: lambda: -full,
        SCALED: lambda: _scale(rng) * full,
        WITHOUT: lambda: full - gravity,
        NONE: lambda: np.full(len(full), rng.choice((0.0, np.nan, 5e-310))),
        CONSTANT: lambda: np.full(len(full), rng.normal() * size),
        SATURATED: lambda: np.clip(full, *(np.quantile(np.abs(full), 0.5) * SIGNS)),
    }
    return makers.get(meaning, lambda: full)()


def _scale(rng: np.random.Generator) -> float:
    """Return a scale of either sign that is not near 1."""
    spans = (rng.uniform(np.log(0.01), np.log(0.65)), rng.uniform(np.log(1.6), np.log(100.0)))
    return float(np.exp(rng.choice(spans)) * rng.choice((-1.0, 1.0)))
