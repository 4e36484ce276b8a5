"""What a console knows of one moment, and what every source of snapshots offers."""

import math
from dataclasses import dataclass
from typing import Any, Protocol

from ugv_acceptance.evaluation.alerts.state_machine import STALE
from ugv_acceptance.evaluation.inputs.low_pass import NOWHERE
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload, Vector
from ugv_acceptance.model.stability import SIDES, UNKNOWN

NOTHING = (math.nan,) * len(SIDES)
NO_LOAD = Payload()
# What stands beside a payload's topic on which nothing came.
NO_PAYLOAD = 'optional; none was declared'


@dataclass(frozen=True, slots=True)
class AlertRow:
    """One alert as it stands: `state` in words, times in ns, `offers` what one may do with it.

    `key` is the same for the same alert in all snapshots. `unseen`: nobody acknowledged it.
    """

    key: str
    code: str
    subject: str
    level: int
    state: str
    text: str
    advice: str
    start: int
    end: int | None = None
    unseen: bool = False
    offers: tuple[str, ...] = ()
    note: str = ''


@dataclass(frozen=True, slots=True)
class InputRow:
    """How an input is: `rate` Hz (NaN: unknown), `age` s (NaN: none came), publishers, faults."""

    name: str
    topic: str
    level: int
    rate: float
    age: float
    publishers: tuple[str, ...] = ()
    text: str = ''


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One moment at `time` (ns). SI and radians; joints in the order of `robot.joint_names`.

    `level` is that of the verdict. Where the margins are not `known`, `problem` may say why and the
    numbers are NaN. `torque` (N m; N), `angle` (rad) the tilt left to each of SIDES, `state` a
    number in STATES, `effort` what the motors measure, `hints` what else
    the operator should know, in words. `stamp` (ns) is in the header of the newest message.
    """

    time: int
    level: int = STALE
    problem: str = ''
    known: bool = False
    q: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()
    gravity: Vector = NOWHERE
    torque: tuple[float, ...] = ()
    angle: tuple[float, ...] = NOTHING
    state: int = UNKNOWN
    payload: Payload = NO_LOAD
    alerts: tuple[AlertRow, ...] = ()
    inputs: tuple[InputRow, ...] = ()
    hints: tuple[str, ...] = ()
    stamp: int | None = None


class Feed(Protocol):
    """A live robot or a recording; its methods are called from one thread, 20 times a second."""

    settings: Settings

    def describe(self) -> dict[str, Any]:
        """Return what a page must know once beside the robot: `source` and its `title`."""

    def snapshot(self) -> Snapshot:
        """Return the newest snapshot; never waits."""

    def extra(self) -> dict[str, Any]:
        """Return what this source adds to each frame, such as where a recording is played."""

    def command(self, do: str, values: dict[str, Any]) -> str:
        """Do what an operator asks; return what was done. Raises BadSample where it cannot be."""
