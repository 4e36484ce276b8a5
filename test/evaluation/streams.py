"""A small robot, and streams of its messages as a live monitor and as a recording take them."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from hypothesis import strategies as st

from ugv_acceptance.evaluation.alerts.state_machine import Alert
from ugv_acceptance.evaluation.live import LiveEvaluator
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.recorded import RecordedEvaluator
from ugv_acceptance.evaluation.sample_margins import Margins
from ugv_acceptance.evaluation.samples import (
    Batch,
    ImuColumns,
    JointStateColumns,
    PayloadColumns,
)
from ugv_acceptance.evaluation.settings import Delays, ImuInput, JointInput, Limits, Settings
from ugv_acceptance.model.robot import Contact, Joint, Link, Payload, Robot

MS = 1_000_000
S = 1_000_000_000
T0 = 1_700_000_000 * S
LEVEL = (0.0, 0.0, 0.0, 1.0)
REST = (0.0, 0.0, 9.81)
STILL = (0.0, 0.0, 0.0)


def robot() -> Robot:
    """A base on four points, a lifting arm (1 m, 4 kg) and a slide at its end with a payload."""
    links = (
        Link('base', 20.0, (0.0, 0.0, 0.2)),
        Link('arm', 4.0, (0.5, 0.0, 0.0)),
        Link('hand', 1.0, (0.05, 0.0, 0.0)),
    )
    joints = (
        Joint('lift', 'revolute', 'base', 'arm', (0.1, 0.0, 0.3), axis=(0.0, -1.0, 0.0),
              lower=-1.5, upper=1.6, effort=40.0, velocity=2.0),
        Joint('slide', 'prismatic', 'arm', 'hand', (1.0, 0.0, 0.0), axis=(1.0, 0.0, 0.0),
              lower=-0.2, upper=0.4, effort=100.0, velocity=1.0),
    )  # fmt: skip
    feet = ((0.4, 0.3), (0.4, -0.3), (-0.4, 0.3), (-0.4, -0.3))
    contacts = tuple(Contact(f'foot_{k}', 'base', (x, y, 0.0)) for k, (x, y) in enumerate(feet))
    return Robot(
        'two', links, joints, ('lift', 'slide'), contacts,
        payload_link='hand', payload=Payload(1.0, (0.1, 0.0, 0.0)),
    )  # fmt: skip


def settings(
    imu: ImuInput | None = None, delays: Delays | None = None, limits: Limits | None = None
) -> Settings:
    """Settings of the small robot; the lift counts downwards from 0.1 rad and efforts in kN m."""
    joints = (
        JointInput('lift', sign=-1.0, offset=0.1, effort_sign=-1.0, effort_scale=1000.0),
        JointInput('hand_slide'),
    )
    return Settings(
        robot(),
        joints,
        imu or ImuInput(),
        limits or Limits((45.0, 30.0), speed=(0.6, math.inf)),
        delays or Delays(),
    )


@dataclass(frozen=True, slots=True)
class Joints:
    """A JointState message received at `time` (ns)."""

    time: int
    names: tuple[str, ...] = ('lift', 'hand_slide')
    position: tuple[float, ...] = (0.1, 0.0)
    velocity: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()
    stamp: int | None = None


@dataclass(frozen=True, slots=True)
class Imu:
    """An Imu message received at `time` (ns)."""

    time: int
    orientation: tuple[float, ...] = LEVEL
    omega: tuple[float, ...] = STILL
    acceleration: tuple[float, ...] = REST
    covariance_0: float = 0.0
    stamp: int | None = None
    frame: str = 'imu_link'
    omega_covariance_0: float = 0.0


@dataclass(frozen=True, slots=True)
class Carry:
    """A payload declared at `time` (ns)."""

    time: int
    mass: float = 2.0
    com: tuple[float, ...] = (0.0, 0.0, 0.0)
    frame: str = 'hand'


Message = Joints | Imu | Carry


def stamp_of(message: Joints | Imu) -> int:
    """Return its header stamp: the time of receipt unless it says otherwise."""
    return message.time if message.stamp is None else message.stamp


def tilted(roll: float, pitch: float = 0.0) -> tuple[float, ...]:
    """Return the quaternion of a base rolled and pitched (rad, small or not, about x then y)."""
    r, p = roll / 2, pitch / 2
    return (
        math.sin(r) * math.cos(p),
        math.cos(r) * math.sin(p),
        -math.sin(r) * math.sin(p),
        math.cos(r) * math.cos(p),
    )


def upright(orientation: Sequence[float], g: float = 9.81) -> tuple[float, ...]:
    """Return the specific force that an accelerometer with this orientation shows at rest."""
    x, y, z, w = orientation
    return (2 * g * (x * z - w * y), 2 * g * (y * z + w * x), g * (1 - 2 * (x * x + y * y)))


def give(evaluator: LiveEvaluator, message: Message) -> Margins | None:
    """Hand one message to a live evaluator."""
    m = message
    if isinstance(m, Carry):
        evaluator.carry(m.time, m.mass, m.com, m.frame)
        return None
    if isinstance(m, Joints):
        return evaluator.joint_state(m.time, stamp_of(m), m.names, m.position, m.velocity, m.effort)
    return evaluator.imu(
        m.time,
        stamp_of(m),
        m.orientation,
        m.covariance_0,
        m.omega,
        m.acceleration,
        m.frame,
        m.omega_covariance_0,
    )


def live(
    told: Settings, messages: Iterable[Message], end: int, ticks: Iterable[int] = ()
) -> tuple[list[tuple[Message, Margins | None]], list[Alert]]:
    """Return the margins after each message, and the alerts, of a live evaluation."""
    evaluator = LiveEvaluator(told)
    evaluator.start(T0)
    waiting = sorted(ticks)
    found = []
    for message in messages:
        while waiting and waiting[0] < message.time:
            evaluator.tick(waiting.pop(0))
        found.append((message, give(evaluator, message)))
    evaluator.tick(end)
    return found, evaluator.watch.log


def recorded(
    told: Settings, parts: Iterable[Sequence[Message]], end: int, *, detail: bool = True
) -> tuple[list[MarginRows], RecordedEvaluator]:
    """Return the margins of every part of a recording, and its evaluator at the end."""
    evaluator = RecordedEvaluator(told, detail)
    evaluator.start(T0)
    rows = [evaluator.batch(batch_of(part)) for part in parts]
    evaluator.finish(end)
    return rows, evaluator


def batch_of(messages: Sequence[Message]) -> Batch:
    """Return messages as columns, grouped as a reader of bags groups them."""
    joints = [m for m in messages if isinstance(m, Joints)]
    keys = list(dict.fromkeys(map(_shape, joints)))
    carried = [m for m in messages if isinstance(m, Carry)]
    felt = [m for m in messages if isinstance(m, Imu)]
    return Batch(
        joints=[joint_columns([m for m in joints if _shape(m) == key]) for key in keys],
        imu=[
            imu_columns([m for m in felt if m.frame == frame])
            for frame in dict.fromkeys(m.frame for m in felt)
        ],
        payload=[
            payload_columns([m for m in carried if m.frame == frame])
            for frame in dict.fromkeys(m.frame for m in carried)
        ],
    )


def _shape(message: Joints) -> tuple[Any, ...]:
    return message.names, len(message.position), len(message.velocity), len(message.effort)


def joint_columns(messages: Sequence[Joints]) -> JointStateColumns:
    """Return messages of one shape as columns."""

    def table(rows: list[tuple[float, ...]]) -> Any:
        return np.array(rows, np.float64).reshape(len(messages), -1)

    return JointStateColumns(
        messages[0].names,
        np.array([m.time for m in messages], np.int64),
        np.array([stamp_of(m) for m in messages], np.int64),
        table([m.position for m in messages]),
        table([m.velocity for m in messages]),
        table([m.effort for m in messages]),
    )


def imu_columns(messages: Sequence[Imu]) -> ImuColumns:
    """Return messages as columns."""
    n = len(messages)
    return ImuColumns(
        messages[0].frame if messages else '',
        np.array([m.time for m in messages], np.int64),
        np.array([stamp_of(m) for m in messages], np.int64),
        np.array([m.orientation for m in messages]).reshape(n, 4),
        np.array([m.omega for m in messages]).reshape(n, 3),
        np.array([m.acceleration for m in messages]).reshape(n, 3),
        np.array([m.covariance_0 for m in messages], np.float64),
        np.array([m.omega_covariance_0 for m in messages], np.float64),
        np.zeros(n),
    )


def payload_columns(messages: Sequence[Carry]) -> PayloadColumns:
    """Return messages of one frame as columns."""
    times = np.array([m.time for m in messages], np.int64)
    mass = np.array([m.mass for m in messages], np.float64)
    com = np.array([m.com for m in messages], np.float64).reshape(len(messages), 3)
    return PayloadColumns(messages[0].frame, times, times, mass, com)


def split(messages: Sequence[Message], cuts: Iterable[int]) -> list[Sequence[Message]]:
    """Return messages cut into consecutive parts, some of which may be empty."""
    places = [0, *sorted(min(cut, len(messages)) for cut in cuts), len(messages)]
    return [messages[a:b] for a, b in pairwise(places)]


def run_of(
    seconds: float, joints_hz: float = 50.0, imu_hz: float = 100.0, joints: Joints | None = None,
    imu: Imu | None = None,
) -> list[Message]:  # fmt: skip
    """Return a run in which nothing happens, from T0 on."""
    j, i = joints or Joints(0), imu or Imu(0)
    found: list[Message] = [
        replace(j, time=T0 + round(k * S / joints_hz)) for k in range(int(seconds * joints_hz))
    ]
    found += [
        replace(i, time=T0 + MS + round(k * S / imu_hz)) for k in range(int(seconds * imu_hz))
    ]
    return sorted(found, key=lambda m: m.time)


odd = st.sampled_from([math.nan, math.inf, -math.inf, 1e308, -1e308, 0.0, 180.0])


def mostly(usual: st.SearchStrategy[float], seldom: st.SearchStrategy[float] = odd) -> Any:
    """Return numbers that are strange once in sixteen."""
    return st.integers(0, 15).flatmap(lambda k: seldom if k == 0 else usual)


_positions = st.tuples(mostly(st.floats(-1.5, 1.5)), mostly(st.floats(-0.2, 0.4)))
_rates = st.one_of(st.just(()), st.tuples(mostly(st.floats(-1, 1)), mostly(st.floats(-1, 1))))
_partial = st.sampled_from(
    [
        (('lift', 'hand_slide'), (0, 1)),
        (('hand_slide', 'lift'), (1, 0)),
        (('lift',), (0,)),
        (('hand_slide',), (1,)),
        (('wheel', 'lift', 'hand_slide'), (0, 0, 1)),
        (('lift', 'lift', 'hand_slide'), (0, 0, 1)),
        (('wheel',), (0,)),
        ((), ()),
    ]
)


@st.composite
def joint_messages(draw: st.DrawFn) -> Joints:
    """Return joint states: whole, partial, in other order, with odd numbers or empty arrays."""
    names, places = draw(st.one_of(st.just((('lift', 'hand_slide'), (0, 1))), _partial))
    arrays = [draw(_positions), draw(_rates), draw(_rates)]
    if draw(st.integers(0, 19)) == 0:
        arrays[0] = ()
    position, velocity, effort = (tuple(a[k] for k in places) if a else () for a in arrays)
    return Joints(0, names, position, velocity, effort)


@st.composite
def imu_messages(draw: st.DrawFn) -> Imu:
    """Return IMU messages: level and tilted, at rest and not, and of every kind of fault."""
    orientation = draw(
        st.one_of(
            st.builds(tilted, st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)),
            st.sampled_from([LEVEL, (0.0,) * 4, (100.0, 100.0, 100.0, 92.0)]),
            st.tuples(*[mostly(st.floats(-1, 1))] * 4),
        )
    )
    acceleration = draw(
        st.one_of(
            st.just(upright(orientation)),
            st.sampled_from([REST, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, -9.81)]),
            st.tuples(*[mostly(st.integers(-12000, 12000).map(lambda k: k / 1000))] * 3),
        )
    )
    omega = draw(st.one_of(st.just(STILL), st.tuples(*[mostly(st.floats(-0.2, 0.2))] * 3)))
    frame = draw(st.sampled_from(['imu_link', 'imu_link', '/imu_link', 'r/imu_link', '', 'other']))
    covariance_0 = draw(st.sampled_from([0.0, 0.0, 0.01, -1.0]))
    return Imu(0, orientation, omega, acceleration, covariance_0, frame=frame)


carries = st.builds(
    Carry,
    st.just(0),
    mostly(st.floats(0, 8)),
    st.tuples(*[mostly(st.floats(-0.2, 0.2))] * 3),
    st.sampled_from(['hand', '/hand', 'r/hand', '', 'arm']),
)
# Milliseconds between messages: mostly regular, some gaps, some bursts.
_waits = st.one_of(st.integers(1, 20), st.integers(1, 20), st.sampled_from([1, 90, 400, 1500]))
_shifts = st.one_of(st.just(0), st.just(0), st.sampled_from([-S, -2 * S, 3600 * S, -T0]))


def shortened(messages: list[Message], room: int) -> list[Message]:
    """Return messages whose silences come to about `room` (ns): later ones are cut to 20 ms.

    For who looks at each millisecond. Silences are what is longer than 20 ms. No messages meet, and
    a stamp stays as far from its time as it was.
    """
    found: list[Message] = []
    before = now = T0
    for message in messages:
        gap, before = message.time - before, message.time
        kept = gap if gap <= 20 * MS else min(gap, max(room, 20 * MS))
        room -= kept if gap > 20 * MS else 0
        now += kept
        moved = replace(message, time=now)
        if not isinstance(moved, Carry) and moved.stamp is not None:
            moved = replace(moved, stamp=moved.stamp + now - message.time)
        found.append(moved)
    return found


@st.composite
def streams(draw: st.DrawFn, most: int = 120) -> list[Message]:
    """Return messages in order of receipt, no two at the same time."""
    kinds = st.one_of(joint_messages(), imu_messages(), carries)
    pool = draw(st.lists(kinds, min_size=1, max_size=6))
    pool += [draw(joint_messages()), draw(imu_messages()), Joints(0), Imu(0)]
    now = T0
    found: list[Message] = []
    for _ in range(draw(st.integers(1, most))):
        now += draw(_waits) * MS
        message = draw(st.sampled_from(pool))
        if isinstance(message, Carry):
            found.append(replace(message, time=now))
        else:
            found.append(replace(message, time=now, stamp=now + draw(_shifts)))
    return found
