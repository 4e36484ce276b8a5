"""What a situation of a drill consists of: how it begins, what goes wrong, what one may do."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ugv_acceptance.model.robot import Robot
from ugv_acceptance.simulation.faults import Fault
from ugv_acceptance.simulation.shape import Block

# Keys of the answers that every situation has: do what the monitor says; act as if nothing were
# said; stop everything and think on; leave the robot to itself.
ADVICE, GO_ON, STOP, WAIT = 'advice', 'go_on', 'stop', 'wait'


@dataclass(frozen=True, slots=True)
class Act:
    """One thing done at `at` (s after the answer, or after the beginning): a kind of acts.ACTS.

    What `subject`, `amount`, `other` and `rate` mean is said there, beside each kind.
    """

    kind: str
    at: float = 0.0
    subject: str = ''
    amount: float = 0.0
    other: float = 0.0
    rate: float = 0.0


@dataclass(frozen=True, slots=True)
class Choice:
    """An answer: `words` as shown, what is then done, and `lesson`, why it is wrong if it is.

    It `halts` the course of the situation, unless the operator lets that go on beside the acts.
    """

    key: str
    words: str
    acts: tuple[Act, ...] = ()
    lesson: str = ''
    halts: bool = True


@dataclass(frozen=True, slots=True)
class Setup:
    """How a situation begins: posture and slope (rad; tilt, heading), load (kg), ground.

    `posture` pairs joints with positions, others stand at 0; `load` is in the gripper and declared.
    `ground` is what the monitor is told; `blocks` lie on it.
    """

    posture: tuple[tuple[str, float], ...]
    slope: tuple[float, float] = (0.0, 0.0)
    load: float = 0.0
    ground: str | None = None
    blocks: tuple[Block, ...] = ()


@dataclass(frozen=True, slots=True)
class Trouble:
    """When the question is asked: once one of `codes` has been active for `lasting` (s).

    Without codes once the robot has fallen and lies still. Not before `after` (s).
    """

    codes: frozenset[str] = frozenset()
    after: float = 2.0
    lasting: float = 0.5


@dataclass(frozen=True, slots=True)
class Case:
    """A situation with its numbers: `course` is what happens unless the operator acts.

    `sensor` are the faults that the act `fail` brings. Following the monitor's general advice means
    `advised`, described by `advised_words` ('': the monitor's own). `patience` (s) is how long the
    question stands, `watched` (s) how long the robot is watched after the answer. `needs` name what
    must be so in the end (judge.NEEDS).
    """

    story: str
    question: str
    setup: Setup
    course: tuple[Act, ...]
    trouble: Trouble
    choices: tuple[Choice, ...]
    advised: tuple[Act, ...]
    needs: tuple[str, ...]
    lesson: str
    advised_words: str = ''
    patience: float = 20.0
    watched: float = 25.0
    sensor: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True)
class Situation:
    """A kind of situation; `draw` makes one of it with numbers of a seed."""

    name: str
    title: str
    draw: Callable[[Robot, np.random.Generator], Case]
