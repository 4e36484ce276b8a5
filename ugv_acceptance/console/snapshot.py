"""The console's view of one moment, and the interface of live robot and recording."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

from ugv_acceptance.evaluation.alerts.state_machine import STALE
from ugv_acceptance.evaluation.inputs.low_pass import NOWHERE
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Payload, Vector
from ugv_acceptance.model.stability import SIDES, UNKNOWN

# What gives the answer to a command once a snapshot has brought it, None until then; to be called
# after each snapshot. It raises BadSample if the command was refused or is not answered.
Awaited = Callable[[], str | None]
NOTHING = (math.nan,) * len(SIDES)
NO_LOAD = Payload()
# Text beside a payload's topic on which nothing came.
NO_PAYLOAD = 'optional; none was declared'


@dataclass(frozen=True, slots=True)
class AlertRow:
    """One alert as shown: `state` in words, times in ns, `offers` the commands allowed on it.

    `key` is the same for the same alert in all snapshots. `unseen`: nobody acknowledged it. `worst`
    (ns) is when the value in `text` came; None where it is not known. `peak` is that value, in SI
    as the alert's rule has it (of TIP_OVER minus the tilt left, rad); NaN where it is not known.
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
    worst: int | None = None
    peak: float = math.nan


@dataclass(frozen=True, slots=True)
class LastKnown:
    """The margins that were known last, and when (ns); see Snapshot for what they are."""

    time: int
    angle: tuple[float, ...]
    torque: tuple[float, ...]
    rough: bool = False


@dataclass(frozen=True, slots=True)
class Countdown:
    """A margin that shrinks: `seconds` until the robot `tips` to a side, or a joint saturates."""

    tips: bool
    subject: str
    seconds: float


@dataclass(frozen=True, slots=True)
class InputRow:
    """The state of an input: `rate` in Hz and `age` in s (NaN: unknown), publishers, faults."""

    name: str
    topic: str
    level: int
    rate: float
    age: float
    publishers: tuple[str, ...] = ()
    text: str = ''


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All that is known at one `time` (ns). SI and radians; joints as in `robot.joint_names`.

    `level` is that of the verdict. Where the margins are not `known`, `problem` may say why and the
    numbers are NaN. `torque` (N m; N), `angle` (rad) the tilt left to each of SIDES, `state` a
    number in STATES, `effort` what the motors measure, `hints` what else
    the operator should know, in words. `stamp` (ns) is in the header of the newest message.
    `ground` says in words what the ground is taken for; where it is not flat (`rough`) the angles
    are an upper bound, and `cautious` (rad) is the cautious margin. `carried`: points below the
    tracks carry the robot. `countdown` is the margin used up first, None where none shrinks.
    `black_box` is 'on', 'off', or what is wrong with it ('': not known); `running` (s) how long the
    monitor has been active, NaN where that is not known; in a recording the time since its start.
    `last` are the margins known last, where none are now; None where none ever were. `source` is
    live, bag or drill.
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
    ground: str = ''
    rough: bool = False
    cautious: float = math.nan
    carried: bool = False
    countdown: Countdown | None = None
    black_box: str = ''
    running: float = math.nan
    last: LastKnown | None = None
    source: str = 'live'


@dataclass(slots=True)
class Memory:
    """Keeps the margins of a feed that were known last."""

    last: LastKnown | None = None

    def keep(self, snapshot: Snapshot) -> Snapshot:
        """Return a snapshot that knows what was known last, and remember what it knows itself.

        Numbers that come while an alert says that there are no data are none.
        """
        lost = any(row.level == STALE and row.end is None for row in snapshot.alerts)
        if snapshot.known and not lost:
            self.last = LastKnown(snapshot.time, snapshot.angle, snapshot.torque, snapshot.rough)
            return snapshot
        return snapshot if self.last is None else replace(snapshot, last=self.last)


class Feed(Protocol):
    """A source of snapshots: a live robot or a recording.

    Its methods are called from one thread, 15 times a second.
    """

    settings: Settings

    def describe(self) -> dict[str, Any]:
        """Return what a page needs once beside the robot: `source` and its `title`."""

    def snapshot(self) -> Snapshot:
        """Return the newest snapshot; never waits."""

    def extra(self) -> dict[str, Any]:
        """Return what this source adds to each frame, such as the position in a recording."""

    def command(self, do: str, values: dict[str, Any]) -> str | Awaited:
        """Carry out an operator's command; return what was done, or what will tell it.

        Raises BadSample if refused.
        """
