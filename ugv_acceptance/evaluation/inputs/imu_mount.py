"""How the IMU is mounted: decided once, by the configuration or the frame its messages name.

On a link that joints move, each message is turned into what an IMU at the base's origin would have
measured, by the newest positions and rates of these joints; all checks then work in base axes.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import reduce
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.alerts.state_machine import Signal, feed
from ugv_acceptance.evaluation.inputs.frames import Place, place_of, without_prefix
from ugv_acceptance.evaluation.inputs.imu import ImuRows, ImuTracker
from ugv_acceptance.evaluation.inputs.imu_turn import (
    Felt,
    Raw,
    Turn,
    in_order,
    raw_of,
    rows_of,
    runs_of,
)
from ugv_acceptance.evaluation.inputs.joint_rows import JointRows
from ugv_acceptance.evaluation.inputs.low_pass import NOWHERE
from ugv_acceptance.evaluation.row_ends import preceded
from ugv_acceptance.evaluation.samples import ImuColumns
from ugv_acceptance.evaluation.settings import AUTO, GIVEN, UNKNOWN, Settings
from ugv_acceptance.model.carried import carriers
from ugv_acceptance.model.robot import IDENTITY, ZERO, Matrix, Robot, Vector
from ugv_acceptance.type_aliases import Floats

Mask = NDArray[np.bool_]

# Where a mounting comes from, as results name it.
CONFIGURATION, URDF, TF_STATIC, NOBODY = 'configuration', 'urdf', 'tf_static', 'unknown'
SOURCE_WORDS = {
    CONFIGURATION: 'the configuration',
    URDF: 'the URDF',
    TF_STATIC: '/tf_static',
}
NAMELESS = 'imu.mounting is auto, and its messages name no frame (frame_id is empty)'


@dataclass(frozen=True, slots=True)
class Mounted:
    """How the IMU is mounted: `rotation` turns its axes into those of `link`, it is at `xyz` (m).

    `source` is one of SOURCE_WORDS, `frame` that of its messages ('': any), `steps` the frames on
    the way to the link. `joints` (numbers) move the link; `held` are movable joints on the way that
    no message tells, with the positions at which they are held (rad, m).
    """

    source: str
    frame: str
    link: str
    rotation: Matrix
    xyz: Vector
    steps: tuple[str, ...] = ()
    joints: tuple[int, ...] = ()
    held: tuple[tuple[str, float], ...] = ()


class Joints(Protocol):
    """The newest joint states, as JointMerger holds them."""

    @property
    def q(self) -> Sequence[float]:
        """Positions (j,), rad or m."""

    @property
    def qd(self) -> Sequence[float]:
        """Rates (j,), rad/s or m/s."""

    @property
    def seen(self) -> Sequence[int]:
        """When each joint was last received (ns)."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Messages of an IMU in order; which are `told` (n,), None: all; `raw` (n, 10) if turned."""

    columns: Sequence[ImuColumns]
    told: Mask | None = None
    raw: Floats | None = None


@dataclass(slots=True)
class ImuMount:
    """Decides how the IMU is mounted, and turns its messages into base axes where joints move it.

    `signal` is bad while it is not known; `doubt`, which says that gravity denies the mounting, is
    told where that comes from. While not `busy` messages can be taken as they come;
    else `told` says whether the newest message's attitude is known, and `raw` is the message as it
    came if it was turned into base axes.
    """

    settings: Settings
    signal: Signal
    doubt: Signal
    found: Mounted | None = None
    frame: str = ''
    told: bool = True
    busy: bool = field(init=False)
    raw: Raw | None = None
    _turn: Turn | None = None
    _tracker: ImuTracker | None = None
    _place: Callable[[Settings], None] = lambda _: None

    def __post_init__(self) -> None:
        imu = self.settings.imu
        self.busy = self.settings.hears_imu and imu.placed != GIVEN
        if self.settings.hears_imu and imu.placed == GIVEN:
            self.found = mounted(self.settings, imu.frame)
            self._work()
            self.busy = self._turn is not None
        elif self.busy and imu.placed == AUTO and imu.frame:
            self._decide(imu.frame)

    def serve(self, tracker: ImuTracker, place: Callable[[Settings], None]) -> None:
        """Tell `tracker` how the IMU is mounted when that is decided, and call `place`."""
        self._tracker, self._place = tracker, place
        if self._turn is not None:
            tracker.motion.mounting.raised = self._turn.raised

    def applied(self, settings: Settings) -> Settings:
        """Return settings in which the IMU is placed as it was decided; as they are before that."""
        found = self.found
        if found is None or (settings.imu.placed == GIVEN and not settings.imu.link):
            return settings
        frame = settings.imu.frame or (found.frame if settings.imu.placed == AUTO else '')
        here = replace(settings.imu, placed=GIVEN, link='', frame=frame, transforms=())
        turned, place = found.rotation, found.xyz
        if self._turn is not None:
            turned, place = IDENTITY, ZERO
        return replace(settings, imu=replace(here, mounting=turned, position=place))

    @property
    def seeks(self) -> bool:
        """Whether transforms of /tf_static would help: a frame was named that no link has."""
        return self.found is None and self.settings.imu.placed == AUTO and bool(self.frame)

    @property
    def why(self) -> str:
        """Why the mounting is not known, in words."""
        if self.settings.imu.placed == UNKNOWN:
            return 'the configuration says imu.mounting: unknown'
        if not self.frame:
            return NAMELESS
        robot = self.settings.robot
        return (
            f'its frame {self.frame!r} is no link of the URDF, and /tf_static does not lead from '
            f'it to {robot.root}'
        )

    def learn(self, settings: Settings) -> None:
        """Take settings with other transforms: they may tell where the named frame is."""
        self.settings = settings
        if self._turn is not None:
            self._turn.settings = settings
        if self.seeks:
            self._decide(self.frame)

    def hear(self, now: int, frame: str) -> None:
        """Take the frame that a message at `now` (ns) names; the first one decides."""
        if self.found is None:
            if frame and not self.frame and self.settings.imu.placed == AUTO:
                self._decide(frame)
                if self.found is None:
                    self._reason()
            if self.found is None:
                if not self.signal.raw:
                    self._reason()
                self.signal.step(now, 1.0)
        if self.found is not None and not self.signal.quiet:
            self.signal.step(now, 0.0)

    def one(self, now: int, frame: str, felt: Felt, joints: Joints) -> Felt:
        """Take a message: orientation, its covariance_0, rate, force; return it in base axes."""
        self.hear(now, frame)
        self.told = self.found is not None
        if self._turn is None:
            self.busy = not self.told
            return felt
        orientation, _, omega, force = felt
        self.raw = orientation, omega, force
        age = (now - min(joints.seen)) * 1e-9
        found = self._turn.one(age, felt, joints.q, joints.qd)
        self.told = found is not None
        return found or ((0.0, 0.0, 0.0, 0.0), -1.0, NOWHERE, NOWHERE)

    def parts(self, segments: Sequence[ImuColumns], joints: JointRows) -> Iterator[Part]:
        """Yield messages in base axes part by part, in order.

        `joints` are the joint states, preceded by the newest before them.
        """
        columns = [s for s in segments if len(s.log_time)]
        if not self.busy or not columns:
            yield Part(segments)
            return
        names, every = in_order(columns)
        time = every.log_time
        first = int(np.argmax(names != '')) if (names != '').any() else len(names)
        if self.found is None and not self.frame and first > 0:
            yield self._part(names[:first], rows_of(every, slice(None, first)), joints)
            names, every = names[first:], rows_of(every, slice(first, None))
            time = time[first:]
        if len(time):
            self.hear(int(time[0]), str(names[0]))
            yield self._part(names, every, joints)

    def _part(self, names: NDArray[np.str_], every: ImuColumns, joints: JointRows) -> Part:
        n = len(every.log_time)
        if self.found is None:
            if not self.signal.raw:
                self._reason()
            feed(self.signal, every.log_time, np.ones(n))
            return Part(runs_of(names, every), np.zeros(n, np.bool_))
        if self._turn is None:
            self.busy = False
            return Part(runs_of(names, every))
        turned, told = self._turn.columns(every, joints)
        return Part(runs_of(names, turned), told, raw_of(every))

    def _reason(self) -> None:
        self.signal.detail = self.why
        if self.signal.alert is not None:
            self.signal.alert.detail = self.why

    def _decide(self, frame: str) -> None:
        """Look for a frame among the robot's links and the transforms; settle if it is found."""
        self.frame = frame.lstrip('/')
        self.found = mounted(self.settings, frame)
        if self.found is not None:
            self.told = True
            self._work()
            placed = self.applied(self.settings)
            self._place(placed)
            if self._tracker is not None:
                self._tracker.adopt(placed)
                self.serve(self._tracker, self._place)

    def _work(self) -> None:
        """Begin to work by what was found."""
        found = self.found
        if found is not None and found.joints:
            of = found.link, found.rotation, found.xyz
            self._turn = Turn(self.settings, found.joints, *of)
        if found is not None and self.settings.imu.placed == AUTO:
            self.doubt.detail = f'imu.mounting: auto took it from {source_words(found)}'
        elif found is not None and found.joints:
            self.doubt.detail = f'the configuration says that it is on {found.link}'


def source_words(found: Mounted) -> str:
    """Return where a mounting comes from, with the frames on the way, in words."""
    way = f' ({" - ".join(found.steps)})' if len(found.steps) > 1 else ''
    return SOURCE_WORDS[found.source] + way


def mounted(settings: Settings, frame: str) -> Mounted | None:
    """Return how an IMU whose messages name `frame` is mounted by these settings; None: unknown."""
    imu, robot, prefix = settings.imu, settings.robot, settings.frame_prefix
    if imu.placed == UNKNOWN:
        return None
    if imu.placed == GIVEN and not imu.link:
        return Mounted(CONFIGURATION, frame, robot.root, imu.mounting, imu.position)
    if imu.placed == GIVEN:
        place = place_of(robot, imu.link)
        sensor = Place(imu.link, imu.position, imu.mounting)
        if place is not None:
            place = replace(sensor.within(place.xyz, place.rotation, place.link), steps=place.steps)
        return _on(robot, CONFIGURATION, frame, place)
    transforms = [
        (without_prefix(parent, prefix), without_prefix(child, prefix), xyz, rotation)
        for parent, child, xyz, rotation in imu.transforms
    ]
    bare = without_prefix(frame, prefix)
    if prefix and '/' in bare:  # another robot's
        return None
    place = place_of(robot, bare, transforms)
    links = {link.name for link in robot.links}
    source = URDF if place is not None and place.steps[0] in links else TF_STATIC
    return _on(robot, source, frame.lstrip('/'), place)


def _on(robot: Robot, source: str, frame: str, place: Place | None) -> Mounted | None:
    if place is None:
        return None
    joints = carriers(robot, place.link)
    held = tuple(_held(robot, place.steps))
    return Mounted(source, frame, place.link, place.rotation, place.xyz, place.steps, joints, held)


def _held(robot: Robot, steps: Sequence[str]) -> Iterator[tuple[str, float]]:
    """Yield the movable joints between a frame and the root that are held, with their positions."""
    above = {joint.child: joint for joint in robot.joints}
    link = next((step for step in steps if step in above), robot.root)
    moved = {*robot.joint_names, *(mimic.joint for mimic in robot.mimics)}
    while link in above:
        joint = above[link]
        if joint.kind != 'fixed' and joint.name not in moved:
            yield joint.name, dict(robot.held).get(joint.name, 0.0)
        link = joint.parent


def felt_by(
    mount: ImuMount,
    tracker: ImuTracker,
    felt: Sequence[ImuColumns],
    joints: Sequence[JointRows],
) -> tuple[Sequence[ImuColumns], ImuRows]:
    """Return messages, in base axes where a joint moves the IMU, and the gravity they tell.

    `joints` are the newest joint states before these messages, and those among them.
    """
    if not mount.busy:
        return felt, tracker.columns(felt)
    turned: list[ImuColumns] = []
    found: list[ImuRows] = []
    for part in mount.parts(felt, reduce(preceded, joints)):
        rows = tracker.columns(part.columns, part.raw)
        if part.told is not None:
            rows.gravity[~part.told], rows.unusable[~part.told] = np.nan, False
        found.append(rows)
        turned += part.columns
    names = [f.name for f in fields(ImuRows)]
    together = (np.concatenate([getattr(rows, n) for rows in found]) for n in names)
    return turned, ImuRows(*together)
