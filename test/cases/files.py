"""Cases of files and topics: encodings, schemas, names of topics, folders, damaged messages."""

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from bag.bag_cases import STORE
from cases.base import NAMES, Base, base
from made.judged import EXIT_2, FAIL, INCONCLUSIVE, PASS, Expected
from made.run import EPOCH, IMU, JOINT_STATE, NS, PLAIN, Form, Message, write
from made.subjects import ROOT

from ugv_acceptance.bag.writer import BagWriter

File = Callable[[Path], Path]
OK = Expected((PASS,))


def _written(change: Callable[[Base], Iterable[Message]], form: Form = PLAIN) -> File:
    def made(folder: Path) -> Path:
        return write(folder / 'run.mcap', change(base(imu_hz=50)), form)

    return made


def _each(change: Callable[[int, Message], Message]) -> File:
    return _written(lambda b: [change(k, m) for k, m in enumerate(b.messages())])


def _big_endian(_: int, message: Message) -> Message:
    read: Any = STORE.deserialize_cdr(message.data, message.type)
    data = bytes(STORE.serialize_cdr(read, message.type, little_endian=False))
    return message._replace(data=data)


def _cut_some(k: int, message: Message) -> Message:
    """Cut every hundredth joint state short, and empty another hundredth."""
    if message.type != JOINT_STATE or k // 2 % 50 != 7:
        return message
    return message._replace(data=message.data[:37] if k // 2 % 100 == 7 else b'')


def _ros1(_: int, message: Message) -> Message:
    return message._replace(data=bytes(STORE.cdr_to_ros1(message.data, message.type)))


def _json(_: int, message: Message) -> Message:
    stamp = {'sec': message.log // NS, 'nanosec': message.log % NS}
    content = {'header': {'stamp': stamp, 'frame_id': ''}, 'name': list(NAMES)}
    return message._replace(data=json.dumps(content).encode())


def _in_json(folder: Path) -> Path:
    messages = [_json(0, m) for m in base(imu_hz=50).messages()[:160]]
    return write(folder / 'run.mcap', messages, Form('json', 'jsonschema', empty=True))


def _backwards(b: Base) -> list[Message]:
    return [m if m.log < EPOCH + 6 * NS else m._replace(log=m.log - 4 * NS) for m in b.messages()]


def _dynamic(folder: Path) -> Path:
    kind = 'control_msgs/msg/DynamicJointState'
    messages = [
        m._replace(topic='/dynamic_joint_states', type=kind, data=bytes(28))
        if m.type == JOINT_STATE
        else m
        for m in base(imu_hz=50).messages()[:260]
    ]
    path = folder / 'run.mcap'
    return write(path, messages, Form(empty=True))


def _topics(*names: tuple[str, str]) -> File:
    """Return a file with the messages under each pair of topics (joints, IMU)."""

    def change(b: Base) -> list[Message]:
        return [
            m._replace(topic=names[k][m.type == IMU])
            for m in b.messages()
            for k in range(len(names))
            if names[k][m.type == IMU]
        ]

    return _written(change)


def _only_joints(b: Base) -> list[Message]:
    return [m for m in b.messages() if m.type == JOINT_STATE]


def _folder(folder: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    """Return a rosbag2 folder with something in its metadata changed."""
    where = folder / 'run7'
    with BagWriter(where) as bag:
        bag.add_topic('/joint_states', JOINT_STATE)
        bag.add_topic('/imu/data', IMU)
        for message in base(imu_hz=50).messages():
            bag.write(message.topic, message.log, message.data)
    file = where / 'metadata.yaml'
    data = yaml.safe_load(file.read_text(encoding='utf-8'))
    change(data['rosbag2_bagfile_information'])
    file.write_text(yaml.safe_dump(data), encoding='utf-8')
    return where


def _renamed(folder: Path) -> Path:
    def rename(about: dict[str, Any]) -> None:
        about['relative_file_paths'] = ['monday_0.mcap']
        about['files'][0]['path'] = 'monday_0.mcap'

    return _folder(folder, rename)


def _no_storage(folder: Path) -> Path:
    return _folder(folder, lambda about: about.update(storage_identifier=''))


def _stretched(folder: Path) -> Path:
    made = base((0.0, 0.04, -0.03, math.pi))
    joints = replace(made.joints, effort=np.zeros((500, 4)))
    return write(folder / 'run.mcap', replace(made, joints=joints).messages())


def robot_beside(folder: Path, *, turned: bool = False) -> Path:
    """Write PackBot's configuration into a folder; `turned`: its arm's axes the other way round."""
    text = (ROOT / 'msg_configs' / 'packbot.yaml').read_text(encoding='utf-8')
    urdf = (ROOT / 'urdf' / 'packbot.urdf').read_text(encoding='utf-8')
    text = text.replace('../urdf/packbot.urdf', 'robot.urdf')
    if turned:
        head, *joints = urdf.split('<joint ')
        arm = ('name="shoulder', 'name="elbow')
        flip = [
            j.replace('xyz="0 -1 0"', 'xyz="0 1 0"') if j.startswith(arm) else j for j in joints
        ]
        urdf = '<joint '.join([head, *flip])
        text = text.replace('    sign: 1\n', '    sign: -1\n').replace(
            'topic_name: elbow_joint\n', 'topic_name: elbow_joint\n    sign: -1\n'
        )
    (folder / 'robot.urdf').write_text(urdf, encoding='utf-8')
    path = folder / 'robot.yaml'
    path.write_text(text, encoding='utf-8')
    return path


def _turned(folder: Path) -> Path:
    robot_beside(folder, turned=True)
    return _stretched(folder)


def _plain(folder: Path) -> Path:
    robot_beside(folder)
    return _stretched(folder)


ADVICE = Expected(
    (FAIL,),
    ('past tipping: FRONT', '(raise|lower|fold) the (elbow|shoulder|arm)'),
    ('(elbow|shoulder)[^;:]*to the (left|right)',),
)
SAYS_WHICH = ('/r1/joint_states', '/r2/joint_states')
FILE_CASES: dict[str, tuple[File, Expected]] = {
    'advice_axis_y': (_plain, ADVICE),
    'advice_axis_y_turned': (_turned, ADVICE),
    'cdr_big_endian': (_each(_big_endian), OK),
    'cdr_truncated_some': (_each(_cut_some), Expected((PASS,), ('10 malformed',))),
    'dynamic_joint_states_only': (
        _dynamic,
        Expected((EXIT_2,), ('DynamicJointState', 'sensor_msgs/msg/JointState')),
    ),
    'imu_raw_and_filtered': (
        _topics(('/joint_states', '/imu/raw'), ('', '/imu/madgwick')),
        Expected((EXIT_2,), ('/imu/raw', '/imu/madgwick', r'topics\.imu\.name')),
    ),
    'imu_topic_no_message': (
        _written(_only_joints, Form(silent=(('/imu/data', IMU),))),
        Expected((INCONCLUSIVE,), ('no message from imu',)),
    ),
    'json_messages': (_in_json, Expected((EXIT_2,), ('json',))),
    'log_time_backwards': (
        _written(_backwards),
        Expected((PASS,), ('CLOCK|back',), (' -[0-9.]+ s',)),
    ),
    'namespaced_topics': (_topics(('/ugv3/joint_states', '/ugv3/imu/data')), OK),
    'no_imu': (_written(_only_joints), Expected((INCONCLUSIVE,), ('imu',))),
    'no_schema_data': (_written(Base.messages, Form(empty=True)), OK),
    'renamed_file': (_renamed, Expected((PASS, EXIT_2), ('monday_0.mcap',))),
    'ros1_in_mcap': (
        lambda folder: write(
            folder / 'run.mcap',
            [_ros1(0, m) for m in base(imu_hz=50).messages()],
            Form('ros1', 'ros1msg', types={k: k.replace('/msg/', '/') for k in (IMU, JOINT_STATE)}),
        ),
        OK,
    ),
    'ros2idl_schema': (_written(Base.messages, Form(schema='ros2idl')), OK),
    'storage_id_empty': (_no_storage, OK),
    'two_robots': (
        _topics(('/r1/joint_states', '/r1/imu'), ('/r2/joint_states', '/r2/imu')),
        Expected((EXIT_2,), SAYS_WHICH),
    ),
}
