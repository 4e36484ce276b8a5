"""The paper's Figure 1: where a failure of an unmanned ground vehicle has its source."""

from enum import Enum


class FailureSource(Enum):
    """A leaf of the taxonomy of failures (Carlson and Murphy); the value is the text people see."""

    EFFECTOR = 'effector'
    SENSOR = 'sensor'
    CONTROL_SYSTEM = 'control system'
    POWER = 'power'
    COMMUNICATIONS = 'communications'
    DESIGN = 'design'
    INTERACTION = 'interaction'

    @property
    def physical(self) -> bool:
        """Whether a part of the robot failed; else a human did."""
        return self not in HUMAN

    @property
    def path(self) -> str:
        """The way down the tree, such as "physical / effector"."""
        return f'{"physical" if self.physical else "human"} / {self.value}'


HUMAN = frozenset({FailureSource.DESIGN, FailureSource.INTERACTION})

# Alert code -> where to look first. An alert shows an effect, so this is a suspicion, no verdict:
# a robot that tips was most often led there, an input that is silent most often lost its way.
FIRST_SUSPECT = {
    'TORQUE_LIMIT': FailureSource.EFFECTOR,
    'TIP_OVER': FailureSource.INTERACTION,
    'NO_SUPPORT': FailureSource.INTERACTION,
    'STATIC_MODEL': FailureSource.INTERACTION,
    'SLIDE': FailureSource.INTERACTION,
    'TIP_AHEAD': FailureSource.INTERACTION,
    'TORQUE_AHEAD': FailureSource.INTERACTION,
    'EFFORT_LIMIT': FailureSource.EFFECTOR,
    'MOTOR_WEAK': FailureSource.EFFECTOR,
    'ENCODER_FROZEN': FailureSource.SENSOR,
    'INPUT_STALE': FailureSource.COMMUNICATIONS,
    'INPUT_INCOMPLETE': FailureSource.SENSOR,
    'INPUT_INVALID': FailureSource.SENSOR,
    'CLOCK': FailureSource.CONTROL_SYSTEM,
    'POSITION_LEAP': FailureSource.SENSOR,
    'IMU_FRAME': FailureSource.DESIGN,
    'IMU_ORIENTATION': FailureSource.SENSOR,
    'IMU_GRAVITY': FailureSource.SENSOR,
    'IMU_INCONSISTENT': FailureSource.SENSOR,
    'PAYLOAD_INVALID': FailureSource.INTERACTION,
    'LIMITS_RELAXED': FailureSource.INTERACTION,
}
