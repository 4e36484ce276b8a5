"""Messages and files for the tests of the bag room, made and read with rosbags and mcap."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

from ugv_acceptance.evaluation.samples import Batch, ImuColumns, JointStateColumns

STORE = get_typestore(Stores.ROS2_JAZZY)
JOINT_STATE = 'sensor_msgs/msg/JointState'
IMU = 'sensor_msgs/msg/Imu'
INERTIA = 'geometry_msgs/msg/InertiaStamped'
SHARED = Path(__file__).parents[3] / 'shared' / 'bags'

Message = tuple[str, str, int, bytes]  # topic, type, log time in ns, content

_T: Any = STORE.types
texts = st.text(st.characters(exclude_categories=['Cs'], exclude_characters='\0'), max_size=7)
stamps = st.tuples(st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1))


def header(stamp: tuple[int, int], frame_id: str) -> Any:
    """A std_msgs/Header of (sec, nanosec)."""
    time = _T['builtin_interfaces/msg/Time'](sec=stamp[0], nanosec=stamp[1])
    return _T['std_msgs/msg/Header'](stamp=time, frame_id=frame_id)


def joint_state(
    stamp: tuple[int, int] = (1, 2),
    frame_id: str = '',
    names: Iterable[str] = ('shoulder', 'elbow'),
    arrays: Iterable[Iterable[float]] = ((0.1, 0.2), (), (3.0, 4.0)),
) -> Any:
    """A sensor_msgs/JointState for rosbags; `arrays` are position, velocity, effort."""
    position, velocity, effort = (np.array(list(a), np.float64) for a in arrays)
    return _T[JOINT_STATE](
        header=header(stamp, frame_id),
        name=list(names),
        position=position,
        velocity=velocity,
        effort=effort,
    )


def imu(stamp: tuple[int, int] = (1, 2), frame_id: str = 'imu', values: Any = None) -> Any:
    """A sensor_msgs/Imu of 37 values in the order of the definition."""
    v = np.arange(37.0) if values is None else np.array(values, np.float64)
    vector = _T['geometry_msgs/msg/Vector3']
    return _T[IMU](
        header=header(stamp, frame_id),
        orientation=_T['geometry_msgs/msg/Quaternion'](*v[0:4].tolist()),
        orientation_covariance=v[4:13],
        angular_velocity=vector(*v[13:16].tolist()),
        angular_velocity_covariance=v[16:25],
        linear_acceleration=vector(*v[25:28].tolist()),
        linear_acceleration_covariance=v[28:37],
    )


def inertia(stamp: tuple[int, int] = (1, 2), frame_id: str = 'grip', values: Any = None) -> Any:
    """A geometry_msgs/InertiaStamped of 10 values: mass, centre of gravity, moments."""
    v = list(range(10)) if values is None else values
    body = _T['geometry_msgs/msg/Inertia'](
        float(v[0]), _T['geometry_msgs/msg/Vector3'](*map(float, v[1:4])), *map(float, v[4:10])
    )
    return _T[INERTIA](header=header(stamp, frame_id), inertia=body)


def cdr(message: Any, *, little: bool = True) -> bytes:
    """The message serialised by rosbags."""
    kind = {_T[name]: name for name in (JOINT_STATE, IMU, INERTIA)}[type(message)]
    return bytes(STORE.serialize_cdr(message, kind, little_endian=little))


floats = st.floats(allow_nan=True, width=64)


@st.composite
def joint_states(draw: st.DrawFn) -> Any:
    """Any JointState whose arrays are empty or of the length of its names."""
    names = draw(st.lists(texts, max_size=4))
    full = st.lists(floats, min_size=len(names), max_size=len(names))
    arrays = [draw(st.one_of(full, st.just([]))) for _ in range(3)]
    return joint_state(draw(stamps), draw(texts), names, arrays)


@st.composite
def imus(draw: st.DrawFn) -> Any:
    """Any Imu."""
    return imu(draw(stamps), draw(texts), draw(st.lists(floats, min_size=37, max_size=37)))


@st.composite
def inertias(draw: st.DrawFn) -> Any:
    """Any InertiaStamped."""
    return inertia(draw(stamps), draw(texts), draw(st.lists(floats, min_size=10, max_size=10)))


def numbers(message: Any) -> tuple[Any, ...]:
    """What a message of rosbags says, as comparable values; floats as their bits."""
    stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    if hasattr(message, 'name'):
        arrays = (message.position, message.velocity, message.effort)
        return (stamp, tuple(message.name), *(bits(a) for a in arrays))
    if hasattr(message, 'inertia'):
        body = message.inertia
        return (stamp, message.header.frame_id, bits([body.m, body.com.x, body.com.y, body.com.z]))
    q, w, a = message.orientation, message.angular_velocity, message.linear_acceleration
    return (
        stamp,
        message.header.frame_id,
        bits([q.x, q.y, q.z, q.w, w.x, w.y, w.z, a.x, a.y, a.z]),
        bits(
            [
                message.orientation_covariance[0],
                message.angular_velocity_covariance[0],
                message.linear_acceleration_covariance[0],
            ]
        ),
    )


def bits(values: Any) -> bytes:
    """Floats as bytes, so that NaN equals itself and -0 differs from 0."""
    return np.asarray(values, np.float64).tobytes()


def rows(batches: Iterable[Batch]) -> list[tuple[int, tuple[Any, ...]]]:
    """(log time, numbers) of every message in batches, in log time order as `numbers` gives."""
    found = []
    for batch in batches:
        part: list[tuple[int, tuple[Any, ...]]] = []
        for columns in (*batch.joints, *batch.imu, *batch.payload):
            part += _rows(columns)
        found += sorted(part, key=lambda row: row[0])
    return found


def _rows(columns: Any) -> list[tuple[int, tuple[Any, ...]]]:
    times = zip(columns.log_time.tolist(), columns.stamp.tolist(), strict=True)
    out = []
    for i, (log_time, stamp) in enumerate(times):
        if isinstance(columns, JointStateColumns):
            arrays = (columns.position, columns.velocity, columns.effort)
            said = (stamp, columns.names, *(bits(a[i]) for a in arrays))
        elif isinstance(columns, ImuColumns):
            c = columns
            vectors = (c.orientation[i], c.angular_velocity[i], c.linear_acceleration[i])
            first = (
                c.orientation_covariance_0[i],
                c.angular_velocity_covariance_0[i],
                c.linear_acceleration_covariance_0[i],
            )
            said = (stamp, c.frame_id, bits(np.concatenate(vectors)), bits(first))
        else:
            said = (stamp, columns.frame_id, bits([columns.mass[i], *columns.com[i]]))
        out.append((log_time, said))
    return out


def run(count: int = 200, *, rate: int = 100) -> list[Message]:
    """A short recording: joint states and an IMU message 1 ms after each, at `rate` Hz."""
    messages: list[Message] = []
    for i in range(count):
        time = 10**9 + i * (10**9 // rate)
        joints = joint_state((i, 5), '', ('a', 'bcd'), ((i, 0.5), (), (1.0, -i)))
        messages.append(('/joint_states', JOINT_STATE, time, cdr(joints)))
        moving = cdr(imu((i, 7), 'imu', np.arange(37.0) * i))
        messages.append(('/imu/data', IMU, time + 10**6, moving))
    return messages


def expected(messages: Iterable[Message]) -> list[tuple[int, tuple[Any, ...]]]:
    """What rosbags makes of the messages, as `rows` gives it."""
    return [(time, numbers(STORE.deserialize_cdr(data, kind))) for _, kind, time, data in messages]


def write_mcap(path: Path, messages: Iterable[Message], **options: Any) -> Path:
    """An MCAP written by the mcap package with these options of its Writer."""
    with path.open('wb') as file:
        writer = Writer(file, **{'chunk_size': 4096, **options})
        writer.start('ros2', 'test')
        channels: dict[str, int] = {}
        for topic, kind, time, data in messages:
            if topic not in channels:
                text, _ = STORE.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, 'ros2msg', text.encode())
                channels[topic] = writer.register_channel(topic, 'cdr', schema)
            writer.add_message(channels[topic], time, data, time)
        writer.finish()  # type: ignore[no-untyped-call]
    return path
