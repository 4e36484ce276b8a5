"""The interface between a runner and a robot with its monitor; the brake on unexpected alerts."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from ugv_acceptance.config import Config
from ugv_acceptance.evaluation.alerts.messages import pattern_words
from ugv_acceptance.plan.plan import matches

ERROR, STALE = 'ERROR', 'STALE'
# Level, code and subject of an alert that is active.
Active = tuple[str, str, str]


@dataclass(slots=True)
class Brake:
    """Freezes all motion at an alert the current step does not expect, and keeps the reason.

    `unwanted` are alert patterns. `stopped` is the first reason since the brake was armed; empty:
    nothing stopped it. `blind` says that data was missing then, so that nothing was shown.
    `freeze()` holds the robot still, `on_stop(reason)` informs people.
    """

    freeze: Callable[[], None]
    on_stop: Callable[[str], None]
    unwanted: tuple[str, ...] = ()
    armed: bool = False
    stopped: str = ''
    blind: bool = False
    active: set[Active] = field(default_factory=set)

    def arm(self, unwanted: tuple[str, ...]) -> None:
        """Watch from now on, and freeze motion at alerts that match a pattern in `unwanted`."""
        self.unwanted, self.stopped, self.blind, self.armed = unwanted, '', False, True

    def disarm(self) -> None:
        """Ignore all alerts, as while a person changes the set-up."""
        self.armed = False

    def stop(self, reason: str, *, blind: bool = False) -> None:
        """Freeze all motion now; `blind`: because data is missing, as at a STALE alert."""
        self.freeze()
        if not self.stopped:
            self.stopped, self.blind = reason, blind
            self.on_stop(reason)

    def raised(self, alert: Active, text: str) -> None:
        """Take an alert that was raised, and freeze where it is unwanted; `text` describes it."""
        self.active.add(alert)
        if self.armed and self.stops(alert):
            self.stop(f'{alert_words(alert)}: {text}', blind=alert[0] == STALE)

    def stops(self, alert: Active) -> bool:
        """Return whether an alert stops the current step: ERROR or STALE, and not expected."""
        level = alert[0]
        return level in {ERROR, STALE} and any(matches(p, *alert) for p in self.unwanted)

    @property
    def trouble(self) -> list[Active]:
        """The alerts that are active and would stop the step in hand."""
        return sorted(alert for alert in list(self.active) if self.stops(alert))


def alert_words(alert: Active) -> str:
    """Return an alert as people read it: DANGER TIP_OVER left."""
    return pattern_words(' '.join(alert))


@dataclass(slots=True)
class Positions:
    """The newest position (rad) of each of the robot's joints, from a driver's joint states."""

    config: Config
    now: dict[str, float] = field(default_factory=dict)

    def take(self, names: Sequence[str], position: Sequence[float]) -> None:
        """Take a message; joints that are not the robot's, and NaN, are left out."""
        settings = self.config.settings
        for joint, name in zip(settings.joints, settings.robot.joint_names, strict=True):
            if joint.topic_name in names:
                place = names.index(joint.topic_name)
                value = position[place] if place < len(position) else math.nan
                if math.isfinite(value):
                    self.now[name] = joint.sign * value + joint.offset


class Commands(Protocol):
    """The commands a runner gives: to the robot, and to the test ground of a simulated one."""

    def move(self, posture: Mapping[str, float], seconds: float) -> None:
        """Start a motion to `posture` (rad) that takes `seconds`."""

    def freeze(self) -> None:
        """Stop arm and tracks and hold them still."""

    def drive(self, forward: float, yaw: float) -> None:
        """Drive at `forward` (m/s) and `yaw` (rad/s) for half a second unless told again."""

    def declare(self, mass: float) -> None:
        """Declare to the monitor what is carried (kg)."""

    def tell_ground(self, kind: str | None) -> None:
        """Tell the monitor the kind of ground; None: that of the configuration."""

    def may_touch(self, *, allowed: bool) -> None:
        """Say to the monitor whether the arm may touch the ground from now on."""

    def tilt(self, tilt: float, heading: float, rate: float) -> None:
        """Tilt the ground: rad, down towards `heading` (rad), at a peak `rate` (rad/s)."""

    def load(self, mass: float) -> None:
        """Put a load (kg) into the gripper."""

    def pull(self, force: float) -> None:
        """Pull backwards at the hitch (N) until told otherwise."""

    def stand_up(self) -> None:
        """Reset the robot to its start: on level ground, the gripper empty."""


class World(Protocol):
    """A robot and its monitor, over ROS or simulated in this process; times in s, stamps in ns."""

    brake: Brake
    commands: Commands
    positions: Positions

    def missing(self) -> str:
        """Return what has not been heard, or does not listen, yet; empty when all is there."""

    def dead(self) -> bool:
        """Return whether the monitor has fallen silent."""

    def now(self) -> float:
        """Return the time (s) of this world's clock, real or simulated."""

    def fed(self) -> float:
        """Return for how long (s) joint states kept coming; stands still while they do not."""

    def stamp(self) -> int:
        """Return the time (ns) that a message recorded now carries."""

    def wait(self, seconds: float) -> None:
        """Wait `seconds` of this world's time."""

    def record(self, folder: Path) -> None:
        """Begin to record all messages into a new folder."""

    def stop_recording(self) -> None:
        """Close the recording, if there is one."""
