"""Candidate motions for advice: one joint moved in one direction, or the robot turned in place."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.clearance import CLEARANCE, clearance_at
from ugv_acceptance.model.mechanics import mechanics_of
from ugv_acceptance.model.robot import Joint, Payload, Robot
from ugv_acceptance.model.row_selection import ALL
from ugv_acceptance.model.stability import STANDING, stability
from ugv_acceptance.type_aliases import Floats

# Duration of a path (s) and its number of steps; a joint that moves contact points takes finer
# steps (rad), since a contact counts only while it is within the ground's tolerance.
HORIZON, STEPS, FINE = 4.0, 16, 0.01
# Speed assumed for a joint (rad/s; m/s) without a known speed; share of a known speed that is used.
CAREFUL, SHARE = 0.3, 0.9
# Turning on the spot: rate and step (rad/s, rad), and the slope (as sin) from which it matters.
TURN_RATE, TURN_STEP, LEVEL = 0.4, float(np.radians(5.0)), 0.05
# Share of the weight on the lighter track below which it slips: the robot then drives off instead
# of turning (bench/bench_advice.py).
GRIP = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """A candidate motion of `subject` (a joint, or 'robot') in n steps from the present posture.

    `q` (n, j) and `gravity` (n, 3) are posture and gravity after each step, `amount` (n,) the
    motion so far (rad, or m if prismatic), `seconds` (n,) the time at which the step is reached.
    `forbidden` (n,) marks steps that the motion must not reach.
    """

    subject: str
    q: Floats
    gravity: Floats
    amount: Floats
    seconds: Floats
    forbidden: NDArray[np.bool_]


def joint_speed(settings: Settings, j: int) -> float:
    """Return a speed (rad/s; m/s) that joint j can reach and at which the static model is valid."""
    robot, speeds = settings.robot, settings.limits.speed
    known = [robot.joint(robot.joint_names[j]).velocity, speeds[j] if speeds else np.inf]
    least = min(known)
    return SHARE * least if np.isfinite(least) else CAREFUL


def joint_paths(settings: Settings, q: Floats, gravity: Floats, torque: Floats) -> list[Path]:
    """Return one path per joint and direction, but none that lifts what the motor cannot hold.

    `q` (j,) rad or m, `gravity` (3,) m/s2 in `base_link`, `torque` (j,) static, N m or N.
    """
    robot = settings.robot
    found: list[Path] = []
    for j, name in enumerate(robot.joint_names):
        joint, speed = robot.joint(name), joint_speed(settings, j)
        for way in (1.0, -1.0):
            if abs(torque[j]) >= settings.limits.torque[j] and np.sign(torque[j]) == way:
                continue
            amount = _amounts(robot, joint, float(q[j]), way * speed * HORIZON)
            path = np.tile(q, (len(amount), 1))
            path[:, j] += amount
            down = np.broadcast_to(gravity, (len(amount), 3))
            free = np.zeros(len(amount), dtype=bool)
            found.append(Path(name, path, down, amount, np.abs(amount) / speed, free))
    return _above_ground(robot, q, [path for path in found if len(path.amount)])


def _amounts(robot: Robot, joint: Joint, start: float, reach: float) -> Floats:
    """Return the steps (n,) of a joint's path from `start` by `reach`, cut at the joint's limit."""
    end = float(np.clip(start + reach, joint.lower, joint.upper)) - start
    if np.sign(end) != np.sign(reach):
        return np.empty(0)
    fine = _moves_contacts(robot, joint.child)
    count = max(STEPS, int(abs(end) / FINE)) if fine else STEPS
    steps: Floats = np.linspace(0.0, end, count + 1)[1:]
    return steps


def _moves_contacts(robot: Robot, link: str) -> bool:
    """Return whether a contact point is on `link` or on a link that it carries."""
    carried = [j.child for j in robot.joints if j.parent == link]
    here = any(contact.link == link for contact in robot.contacts)
    return here or any(_moves_contacts(robot, child) for child in carried)


def _above_ground(robot: Robot, q: Floats, paths: list[Path]) -> list[Path]:
    """Return the paths with steps forbidden where the arm is below CLEARANCE and lower than now."""
    if not paths:
        return paths
    every = np.vstack((q, *(path.q for path in paths)))
    height = clearance_at(mechanics_of(robot), None, list(every.T), robot.payload.cog, ALL)
    below = height[1:] < min(CLEARANCE, float(height[0])) - 1e-6
    ends = np.cumsum([len(path.q) for path in paths])[:-1]
    parts = zip(paths, np.split(below, ends), strict=True)
    return [replace(path, forbidden=part) for path, part in parts]


def turn_paths(robot: Robot, q: Floats, gravity: Floats, payload: Payload) -> Iterator[Path]:
    """Yield a half turn to the left and one to the right; none on level ground.

    Steps are forbidden where one track carries too little weight: skid steering needs both.
    """
    across = float(np.hypot(gravity[0], gravity[1]))
    if across < LEVEL * float(np.linalg.norm(gravity)):
        return
    for way in (1.0, -1.0):
        amount = way * np.arange(TURN_STEP, np.pi + 1e-9, TURN_STEP)
        c, s = np.cos(amount), np.sin(amount)
        # Seen from a robot that turns left, gravity turns right.
        x, y = c * gravity[0] + s * gravity[1], c * gravity[1] - s * gravity[0]
        down = np.column_stack((x, y, np.full(len(amount), gravity[2])))
        path = np.tile(q, (len(amount), 1))
        slips = _slips(robot, np.vstack((q, path)), np.vstack((gravity, down)), payload)
        seconds = np.abs(amount) / TURN_RATE
        yield Path('robot', path, down, amount, seconds, slips[1:] | slips[0])


def _slips(robot: Robot, q: Floats, gravity: Floats, payload: Payload) -> NDArray[np.bool_]:
    """Return at which postures (n,) one track carries too little, or the robot is not on both."""
    found = stability(robot, q, gravity, payload)
    left, right = (np.asarray(found.moment[k], dtype=np.float64) for k in (1, 3))
    # The moment that holds the robot down about one side's edge is carried by the other side.
    shared = np.minimum(left, right) >= GRIP * (left + right)
    slips: NDArray[np.bool_] = ~(shared & (np.asarray(found.state) == STANDING))
    return slips
