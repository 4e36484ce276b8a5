"""The paper's Figure 1: where a failure of an unmanned ground vehicle has its source."""

from enum import Enum


class Source(Enum):
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


HUMAN = frozenset({Source.DESIGN, Source.INTERACTION})
