"""Where a file says that the IMU is, and in which frame viewers get the robot's shapes."""

from collections.abc import Callable, Sequence
from difflib import get_close_matches

from ugv_acceptance import BadConfig
from ugv_acceptance.config.document import Path
from ugv_acceptance.config.schema import File
from ugv_acceptance.config.units import shown
from ugv_acceptance.config.urdf import rotation_from_rpy
from ugv_acceptance.evaluation.settings import AUTO, GIVEN, ImuInput
from ugv_acceptance.model.carried import carriers
from ugv_acceptance.model.robot import Robot

Refuse = Callable[[Path, str], BadConfig]
Warn = Callable[[Path, str], None]


def imu_from(file: File, robot: Robot, refuse: Refuse) -> ImuInput:
    """Return how the IMU is mounted and used; `refuse` of what is said twice, and of no link."""
    section, given = file.imu, file.imu.model_fields_set
    values = section.model_dump()
    rotation = rotation_from_rpy(values.pop('mounting_rpy'))
    placed, link = values.pop('mounting') or GIVEN, values.pop('link') or ''
    beside = {'mounting_rpy', 'link', *(['position'] if placed == AUTO else [])} & given
    if placed != GIVEN and beside:
        raise refuse(
            ('imu', 'mounting'),
            f'expected {placed} alone, or numbers alone, got {" and ".join(sorted(beside))} too',
        )
    links = [one.name for one in robot.links]
    if link and link not in links:
        near = get_close_matches(link, links, 1, 0.5)
        hint = f'; did you mean {near[0]}?' if near else ''
        raise refuse(('imu', 'link'), f'the URDF has no link {shown(link)}{hint}')
    named = file.topics.imu.frame_id if file.topics.imu else None
    frame = (named or '').lstrip('/')
    return ImuInput(mounting=rotation, frame=frame, placed=placed, link=link, **values)


def base_frame_from(file: File, robot: Robot, refuse: Refuse, warn: Warn) -> str:
    """Return the frame in which shapes are sent; `refuse` of one that moves on the robot."""
    frame, path = file.robot.base_frame, ('robot', 'base_frame')
    if frame is None:
        return ''
    if not any(link.name == frame for link in robot.links):
        warn(path, f'{frame} is no link of the URDF: taken as another name of {robot.root}')
    elif moved_by := carriers(robot, frame):
        names: Sequence[str] = [robot.joint_names[j] for j in moved_by]
        raise refuse(
            path, f'expected a link that no joint moves, got {frame}, on {", ".join(names)}'
        )
    return frame
