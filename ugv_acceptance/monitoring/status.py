"""What a monitor says of one part of it or of the robot, as ROS's diagnostics do."""

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Status:
    """One diagnostic status: `level` as in DiagnosticStatus, name, a sentence, and values."""

    level: int
    name: str
    message: str
    values: dict[str, object] = field(default_factory=dict)
