"""The taxonomy of failures (Carlson and Murphy): the part, or the person, that failed."""

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
        """The path from the root of the taxonomy, such as "physical / effector"."""
        return f'{"physical" if self.physical else "human"} / {self.value}'


HUMAN = frozenset({FailureSource.DESIGN, FailureSource.INTERACTION})
