"""The faults a simulated run can have: their names, effects and amounts."""

import math
from dataclasses import dataclass

INPUTS = ('joint_states', 'imu')


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of fault: its effect, whether it hits a joint, an input or neither, and its amounts.

    `subject` is joint, input or empty; `low` to `high` bound the amount, which stands for {} in
    `text`; where it is an `angle`, in degrees.
    """

    text: str
    subject: str = ''
    amount: float = 0.0
    low: float = 0.0
    high: float = 0.0
    angle: bool = False

    @property
    def words(self) -> str:
        """Return the effect as text, with the usual amount."""
        return self.text.format(f'{self.amount:g}')


KINDS: dict[str, Kind] = {
    'dropped': Kind('a share of {} of the messages is lost', 'input', 0.3, 0.0, 1.0),
    'late': Kind('messages come {} s late', 'input', 0.3, 0.0, 60.0),
    'reordered': Kind(
        'a share of {} of the messages comes after the next ones', 'input', 0.2, 0.0, 1.0
    ),
    'duplicated': Kind('a share of {} of the messages comes twice', 'input', 0.2, 0.0, 1.0),
    'dead': Kind('no message comes at all', 'input'),
    'nan': Kind('positions, or orientation and acceleration, are NaN', 'input'),
    'dead-encoder': Kind('a joint is missing from the messages', 'joint'),
    'frozen-encoder': Kind('a joint reports the same position however it moves', 'joint'),
    'effort-missing': Kind('joint states contain no efforts'),
    'imu-bias': Kind('the acceleration forward is {} m/s2 too large', '', 2.0, -50.0, 50.0),
    'wrong-mounting': Kind(
        'the IMU is mounted turned by {} deg about its z axis', '', 90.0, -360.0, 360.0, angle=True
    ),
    'identity-orientation': Kind('the IMU reports a level orientation, whatever its tilt'),
    'clock-jump': Kind('header stamps are off by {} s', 'input', -5.0, -1e8, 1e8),
    'second-publisher': Kind('another robot that stands still publishes as well', 'input'),
    'heavy-payload': Kind('the load is {} times as heavy as declared', '', 2.0, 0.0, 100.0),
    'weak-motor': Kind('a motor gives a share of {} of its torque', 'joint', 0.6, 0.0, 1.0),
}
# These are in the robot, not in its messages: from the start to the end.
PHYSICAL = ('heavy-payload', 'weak-motor')


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault that is active from `start` until before `end` (s); `subject` is a joint or input.

    `subject` is empty where the kind has none. A fault of the inputs without a subject hits both.
    """

    kind: str
    subject: str = ''
    amount: float = 0.0
    start: float = 0.0
    end: float = math.inf

    def hits(self, subject: str) -> bool:
        """Return whether the fault applies to this input or joint."""
        return self.subject in ('', subject)


def fault_of(kind: str, subject: str = '', start: float = 0.0, end: float = math.inf) -> Fault:
    """Return a fault of a kind with its usual amount."""
    return Fault(kind, subject, KINDS[kind].amount, start, end)
