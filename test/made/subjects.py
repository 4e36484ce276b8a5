"""The robots whose recordings are made: PackBot, and wheeled ones configured from their URDFs.

The robots of others are read from ../shared/robots. Where that folder is absent the tracked robot
of test/robots.py stands in for them.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from robots import tracked
from scipy.spatial.transform import Rotation

from ugv_acceptance.model.robot import Robot

ROOT = Path(__file__).parents[2]
ROBOTS = ROOT.parent / 'shared' / 'robots'
PACKBOT = 'packbot'


@dataclass(frozen=True, slots=True)
class Wheeled:
    """What a URDF does not tell: its IMU's link, arm, the link that carries, poses of the arm.

    `parts` are words in the names of the links that stand on the ground. `calm` is a folded pose of
    the arm and `reach` one that loads `weak` most, in degrees; `limit` (N m) is that of `weak`
    where the URDF's needs a load that tips the robot. Without an arm the wheels are the joints.
    """

    imu: str
    parts: tuple[str, ...] = ('wheel',)
    arm: tuple[str, ...] = ()
    hand: str = ''
    calm: tuple[float, ...] = ()
    reach: tuple[float, ...] = ()
    weak: str = ''
    limit: float | None = None


WHEELED = {
    'husky': Wheeled('imu_link'),
    'jackal': Wheeled('imu_link'),
    'leo': Wheeled('imu_frame'),
    'summit_xl': Wheeled('summit_xl_imu_link'),
    'dingo': Wheeled('imu_link', ('_wheel_link', 'caster')),
    'husky_ur5': Wheeled(
        'imu_link',
        arm=(
            *('ur5_shoulder_pan_joint', 'ur5_shoulder_lift_joint', 'ur5_elbow_joint'),
            *('ur5_wrist_1_joint', 'ur5_wrist_2_joint', 'ur5_wrist_3_joint'),
        ),
        hand='ur5_tool0',
        calm=(180.0, -80.0, 140.0, 0.0, 0.0, 0.0),
        reach=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        weak='ur5_shoulder_lift_joint',
        limit=90.0,
    ),
    'tb3_manip': Wheeled(
        'imu_link',
        ('wheel', 'caster'),
        ('joint1', 'joint2', 'joint3', 'joint4'),
        'end_effector_link',
        (0.0, -90.0, 60.0, -80.0),
        (0.0, 80.0, -50.0, -30.0),
        'joint2',
    ),
}


@dataclass(frozen=True, eq=False)
class Subject:
    """A robot: its configuration as data, its URDF, and how its arm is moved.

    `urdf` is its path or its text. `arm` are columns of the joints that move, `calm` and `reach`
    poses (rad) of all joints, `weak` the column of the joint that is overloaded (None without an
    arm), `mounting` the IMU's axes.
    """

    name: str
    document: Mapping[str, Any]
    urdf: Path | str
    arm: tuple[int, ...]
    calm: tuple[float, ...]
    reach: tuple[float, ...]
    weak: int | None
    mounting: Rotation
    imu_position: tuple[float, float, float]

    def config(self, folder: Path, changes: Mapping[str, Any] | None = None) -> Path:
        """Write the configuration with changes (`limits.tip_error_deg: 5`, None: left out)."""
        urdf = self.urdf if isinstance(self.urdf, Path) else folder / 'robot.urdf'
        if isinstance(self.urdf, str):
            urdf.write_text(self.urdf, encoding='utf-8')
        document = deepcopy(dict(self.document)) | {'urdf': str(urdf)}
        for key, value in (changes or {}).items():
            *way, last = key.split('.') if key not in document else [key]
            place = document
            for part in way:
                place = place.setdefault(part, {})
            if value is None and len(way) == 0:
                place.pop(last, None)
            else:
                place[last] = value
        path = folder / f'{self.name}.yaml'
        path.write_text(yaml.safe_dump(document, sort_keys=False), encoding='utf-8')
        return path


def packbot() -> Subject:
    """Return the PackBot that ships with this project."""
    path = ROOT / 'msg_configs' / 'packbot.yaml'
    document = yaml.safe_load(path.read_text(encoding='utf-8'))
    calm, reach = (0.0, 2.0, -2.5, math.pi), (0.0, 0.0, 0.0, math.pi)
    place = document['imu']['position_m']
    urdf = ROOT / 'urdf' / 'packbot.urdf'
    return Subject(
        PACKBOT, document, urdf, (0, 1, 2), calm, reach, 1, Rotation.identity(), tuple(place)
    )


def stand_in() -> Subject:
    """Return the tracked robot of test/robots.py, for where ../shared/robots is absent."""
    robot = tracked()
    document = {
        'robot': {'name': robot.name},
        'topics': {'payload': {'name': 'payload', 'frame_id': robot.payload_link}},
        'joints': {n: {'limit_nm': 60.0 if n == 'shoulder' else None} for n in robot.joint_names},
        'contacts': {
            c.name: {'link': c.link, 'position_m': list(c.position)} for c in robot.contacts
        },
        'payload': {'link': robot.payload_link, 'mass_kg': 0.0},
        'imu': {'position_m': [0.0, 0.0, 0.1]},
    }
    calm, reach = (0.0, 2.0, -2.5, math.pi), (0.0, 0.0, 0.0, math.pi)
    arm, turn = (0, 1, 2), Rotation.identity()
    return Subject(robot.name, document, urdf_of(robot), arm, calm, reach, 1, turn, (0.0, 0.0, 0.1))


def urdf_of(robot: Robot) -> str:
    """Return a robot as a URDF; its joints' axes turn with the joint, their frames do not."""
    parts = [f'<robot name="{robot.name}">']
    for link in robot.links:
        (a, b, c), (_, d, e), (_, _, f) = link.inertia
        cog = ' '.join(map(str, link.cog))
        parts.append(
            f'<link name="{link.name}"><inertial><origin xyz="{cog}"/><mass value="{link.mass}"/>'
            f'<inertia ixx="{a}" ixy="{b}" ixz="{c}" iyy="{d}" iyz="{e}" izz="{f}"/>'
            '</inertial></link>'
        )
    for joint in robot.joints:
        place, axis = (' '.join(map(str, v)) for v in (joint.xyz, joint.axis))
        parts.append(
            f'<joint name="{joint.name}" type="continuous"><parent link="{joint.parent}"/>'
            f'<child link="{joint.child}"/><origin xyz="{place}"/><axis xyz="{axis}"/></joint>'
            if joint.kind != 'fixed'
            else f'<joint name="{joint.name}" type="fixed"><parent link="{joint.parent}"/>'
            f'<child link="{joint.child}"/><origin xyz="{place}"/></joint>'
        )
    return '\n'.join([*parts, '</robot>'])


def wheeled(name: str) -> Subject:
    """Return a robot of ../shared/robots, on points below the axes of its wheels."""
    facts, urdf = WHEELED[name], ROBOTS / name / f'{name}.urdf'
    tree = ET.parse(urdf).getroot()  # noqa: S314 (the project's own test data)
    joints = {_end(j, 'child'): j for j in tree.findall('joint')}
    feet = {}
    for link in tree.findall('link'):
        link_name, collision = str(link.get('name')), link.find('collision')
        if collision is not None and any(part in link_name for part in facts.parts):
            _, centre = _place(link_name, joints)
            feet[link_name] = centre - np.array((0.0, 0.0, _radius(collision)))
    ground = min(float(p[2]) for p in feet.values())
    turn, at = _place(facts.imu, joints)
    moving = [n for n in joints if joints[n].get('type') == 'continuous' and 'wheel' in n]
    names = facts.arm or tuple(str(joints[n].get('name')) for n in moving)
    document = {
        'robot': {'name': name},
        'topics': {
            'joint_states': {'name': 'joint_states'},
            'imu': {'name': 'imu/data', 'frame_id': facts.imu},
        },
        'joints': {
            n: {'limit_nm': facts.limit} if facts.limit and n == facts.weak else {} for n in names
        },
        'imu': {
            'mounting_rpy_deg': [float(x) for x in turn.as_euler('xyz', degrees=True)],
            'position_m': [round(float(x), 4) for x in at],
        },
        'contacts': {
            n: {'link': _root(joints), 'position_m': [float(p[0]), float(p[1]), ground]}
            for n, p in feet.items()
        },
        'ground': {'height_m': ground},
    }
    if facts.hand:
        document['payload'] = {'link': facts.hand, 'mass_kg': 0.0}
        document['topics']['payload'] = {'name': 'payload', 'frame_id': facts.hand}  # type: ignore[index]
    zeros = (0.0,) * len(names)
    arm = tuple(range(len(facts.arm)))
    calm, reach = (
        tuple(math.radians(x) for x in pose) or zeros for pose in (facts.calm, facts.reach)
    )
    weak = names.index(facts.weak) if facts.weak else None
    return Subject(name, document, urdf, arm, calm, reach, weak, turn, _three(at))


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _end(joint: ET.Element, which: str) -> str:
    """Return the name of a joint's parent or child."""
    return next(str(part.get('link')) for part in joint.findall(which))


def _root(joints: Mapping[str, ET.Element]) -> str:
    parents = {_end(j, 'parent') for j in joints.values()}
    return next(iter(parents - set(joints)))


def _place(link: str, joints: Mapping[str, ET.Element]) -> tuple[Rotation, Any]:
    """Return how a link is turned and where it is (m) in the root link, all joints at zero."""
    turn, at = Rotation.identity(), np.zeros(3)
    while link in joints:
        joint = joints[link]
        origin = joint.find('origin')
        given = {} if origin is None else origin.attrib
        xyz = np.array([float(x) for x in given.get('xyz', '0 0 0').split()])
        rpy = [float(x) for x in given.get('rpy', '0 0 0').split()]
        step = Rotation.from_euler('xyz', rpy)
        turn, at = step * turn, xyz + step.apply(at)
        link = _end(joint, 'parent')
    return turn, at


def _radius(collision: ET.Element) -> float:
    shape = collision.find('geometry')[0]  # type: ignore[index]
    size = shape.get('radius')
    return float(size) if size else float(str(shape.get('size')).split()[-1]) / 2.0


@cache
def subjects() -> dict[str, Subject]:
    """Return every robot that can be configured here, by name."""
    found = {PACKBOT: packbot()}
    if ROBOTS.is_dir():
        return found | {name: wheeled(name) for name in WHEELED}
    return found | {'tracked': stand_in()}
