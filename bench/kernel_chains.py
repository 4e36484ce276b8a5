"""How the live cost grows with the joints of an arm: a chain of 4, 8, 15 and 30 joints.

`python -m bench.bench_kernels --chains` prints, for each: operations of the posture kernel (torque
gradients, centre of gravity, contact points and their levers), its CPU time for one live sample,
Pinocchio's for computeGeneralizedGravity (the torques alone, of one gravity), and that of a whole
joint message; `a joint`: what each joint costs that the chain has more than the one before. The
joints turn about z and y in turn; two contact points hang on the tip. CPU us, best of rounds, all
in one run.
"""

import math
import time
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pinocchio as pin

from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.settings import ImuInput, JointInput, Limits, Settings
from ugv_acceptance.model.kernels import compile_kernel
from ugv_acceptance.model.mechanics import posture_formula
from ugv_acceptance.model.robot import Contact, Joint, Link, Payload, Robot
from ugv_acceptance.model.tree import tree_of

ROUNDS, CALLS = 7, 400
CHAINS = (4, 8, 15, 30)
AXES = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
PITCH = (0.1, 0.0, 0.05)
CORNERS = ((0.9, 0.8), (0.9, -0.8), (-0.9, -0.8), (-0.9, 0.8))
MS = 1_000_000


def chain(joints: int) -> Robot:
    """Return a base on four points with an arm of so many joints and two points at its tip."""
    names = tuple(f'joint_{k}' for k in range(joints))
    links = (
        Link('base', 200.0, (0.0, 0.0, 0.1)),
        *(Link(n, 0.5, (0.05, 0.01, 0.02)) for n in names),
    )
    parents = ('base', *names)
    moving = [
        Joint(name, 'revolute', parents[k], name, PITCH, axis=AXES[k % 2])
        for k, name in enumerate(names)
    ]
    feet = [Contact(f'foot_{k}', 'base', (x, y, 0.0)) for k, (x, y) in enumerate(CORNERS)]
    feet += [Contact(f'tip_{k}', names[-1], (0.05, 0.02 * k, 0.0)) for k in range(2)]
    load = Payload(1.0, (0.1, 0.0, 0.0))
    return Robot(
        'chain', links, tuple(moving), names, tuple(feet), payload_link=names[-1], payload=load
    )


def pinocchio_call(robot: Robot, q: Sequence[float]) -> Callable[[], object]:
    """Return a call of Pinocchio's gravity torques for a chain."""
    model, place = pin.Model(), 0
    for joint, link in zip(robot.joints, robot.links[1:], strict=True):
        turns = pin.JointModelRevoluteUnaligned(np.array(joint.axis))
        at = pin.SE3(np.eye(3), np.array(joint.xyz))
        place = model.addJoint(place, turns, at, joint.name)
        body = pin.Inertia(link.mass, np.array(link.cog), np.zeros((3, 3)))
        model.appendBodyToJoint(place, body, pin.SE3.Identity())
    data, angles = model.createData(), np.array(q)
    return lambda: pin.computeGeneralizedGravity(model, data, angles)


def live_call(robot: Robot, q: Sequence[float]) -> Callable[[], object]:
    """Return a call that hands a live evaluator another joint message, on level ground."""
    n = len(robot.joint_names)
    inputs = tuple(JointInput(name) for name in robot.joint_names)
    evaluator = LiveEvaluator(Settings(robot, inputs, ImuInput(), Limits((1000.0,) * n)))
    now = [1_700_000_000_000 * MS]
    evaluator.start(now[0])
    still = (0.0,) * n
    messages = [tuple(x + 1e-6 * k for x in q) for k in range(2)]

    def run() -> None:
        now[0] += MS
        if now[0] % (10 * MS) == 0:
            rest = (0.0, 0.0, robot.gravity)
            evaluator.imu(
                now[0], now[0], (0.0, 0.0, 0.0, 1.0), 0.0, (0.0,) * 3, rest, 'imu_link', 0.0
            )
        q = messages[now[0] // MS % 2]
        evaluator.joint_state(now[0], now[0], robot.joint_names, q, still, ())

    return run


def microseconds(run: Callable[[], object]) -> float:
    """Return the CPU time of a call, best of rounds."""
    best = math.inf
    for _ in range(ROUNDS):
        began = time.process_time()
        for _ in range(CALLS):
            run()
        best = min(best, (time.process_time() - began) / CALLS)
    return best * 1e6


def print_chains() -> None:
    """Print the table."""
    heads = (
        'operations',
        'a joint',
        'kernel us',
        'a joint',
        'Pinocchio us',
        'message us',
        'a joint',
    )
    print(f'{"joints":>6}' + ''.join(f'{head:>14}' for head in heads))
    before: tuple[float, ...] = (0, 0, 0.0, 0.0)
    for n in CHAINS:
        robot = chain(n)
        inputs = [*robot.joint_names, 'mass', 'x', 'y', 'z']
        kernel = compile_kernel(posture_formula(robot, tree_of(robot)), inputs)
        q = [0.02 * (-1) ** k for k in range(n)]
        values = (*q, robot.payload.mass, *robot.payload.cog)
        lines = kernel.source.count(' = ')
        ours = microseconds(partial(kernel.one, *values))
        message = microseconds(live_call(robot, q))
        theirs = microseconds(pinocchio_call(robot, q))
        slopes = [
            (x - y) / (n - before[0])
            for x, y in zip((lines, ours, message), before[1:], strict=True)
        ]
        print(
            f'{n:6}{lines:14}{slopes[0]:14.0f}{ours:14.1f}{slopes[1]:14.2f}'
            f'{theirs:14.2f}{message:14.1f}{slopes[2]:14.2f}'
        )
        before = (n, lines, ours, message)
