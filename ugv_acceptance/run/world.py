"""What a runner needs of its world: messages heard, time that passes, stopping motion."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from ugv_acceptance.config import Config
from ugv_acceptance.plan.plan import matches

# Level, code and subject of an alert that is active.
Active = tuple[str, str, str]


@dataclass(slots=True)
class Brake:
    """Freezes motion at an alert that is not wanted now, and says why.

    `unwanted` are alert patterns, `stopped` is the first reason since the brake was armed; empty:
    nothing stopped it; `blind` says that something was missing then, so that nothing was shown.
    `freeze()` holds the robot still, `on_stop(reason)` tells people.
    """

    freeze: Callable[[], None]
    on_stop: Callable[[str], None]
    unwanted: tuple[str, ...] = ()
    armed: bool = False
    stopped: str = ''
    blind: bool = False
    active: set[Active] = field(default_factory=set)

    def arm(self, unwanted: tuple[str, ...]) -> None:
        """Watch from now on; what freezes is named by alert patterns."""
        self.unwanted, self.stopped, self.blind, self.armed = unwanted, '', False, True

    def disarm(self) -> None:
        """Let everything pass, as while a person changes the set-up."""
        self.armed = False

    def stop(self, reason: str, *, blind: bool = False) -> None:
        """Freeze all motion now; `blind`: because something is missing, as at a STALE alert."""
        self.freeze()
        if not self.stopped:
            self.stopped, self.blind = reason, blind or reason.startswith('STALE')
            self.on_stop(reason)

    def raised(self, alert: Active, text: str) -> None:
        """Take an alert that was raised; `text` says it in words."""
        self.active.add(alert)
        if self.armed and self.stops(alert):
            self.stop(f'{" ".join(alert)}: {text}')

    def stops(self, alert: Active) -> bool:
        """Return whether an alert stops the step in hand: ERROR or STALE, and not expected."""
        level = alert[0]
        return level in {'ERROR', 'STALE'} and any(matches(p, *alert) for p in self.unwanted)

    @property
    def trouble(self) -> list[str]:
        """The alerts that are active and would stop the step in hand."""
        return sorted(' '.join(alert) for alert in list(self.active) if self.stops(alert))


@dataclass(slots=True)
class Positions:
    """The newest joint positions (rad) by the robot's joint names, from what a driver publishes."""

    config: Config
    now: dict[str, float] = field(default_factory=dict)

    def take(self, names: Sequence[str], position: Sequence[float]) -> None:
        """Take a message; joints that are not the robot's, and not-a-number, are left out."""
        settings = self.config.settings
        for joint, name in zip(settings.joints, settings.robot.joint_names, strict=True):
            if joint.topic_name in names:
                place = names.index(joint.topic_name)
                value = position[place] if place < len(position) else math.nan
                if math.isfinite(value):
                    self.now[name] = joint.sign * value + joint.offset


class Commands(Protocol):
    """What a robot, and the test ground of a simulated one, can be told."""

    def move(self, posture: Mapping[str, float], seconds: float) -> None:
        """Start a motion to `posture` (rad) that takes `seconds`."""

    def freeze(self) -> None:
        """Hold arm and tracks still."""

    def drive(self, forward: float, yaw: float) -> None:
        """Drive at m/s and rad/s, for half a second unless told again."""

    def declare(self, mass: float) -> None:
        """Tell the monitor what is carried (kg)."""

    def tilt(self, tilt: float, heading: float, rate: float) -> None:
        """Tilt the ground: rad, down towards `heading` (rad), at a peak `rate` (rad/s)."""

    def load(self, mass: float) -> None:
        """Put a load (kg) into the hand."""

    def pull(self, force: float) -> None:
        """Pull backwards at the hitch (N), until told otherwise."""

    def stand_up(self) -> None:
        """Put the robot on level ground as at the start, its hand empty."""


class World(Protocol):
    """A robot and its monitor, over ROS or simulated in this process; times in s, stamps in ns."""

    brake: Brake
    commands: Commands
    positions: Positions

    def missing(self) -> str:
        """Return who was not heard, or does not listen, yet; empty when everything is there."""

    def dead(self) -> bool:
        """Return whether the monitor has fallen silent."""

    def now(self) -> float:
        """Return the time that passes here (s)."""

    def fed(self) -> float:
        """Return for how long (s) joint states kept coming: it stands still while they do not."""

    def stamp(self) -> int:
        """Return the time (ns) that recordings carry."""

    def wait(self, seconds: float) -> None:
        """Let time pass."""

    def record(self, folder: Path) -> None:
        """Record into a new folder from now on."""

    def stop_recording(self) -> None:
        """Close the recording, if there is one."""
