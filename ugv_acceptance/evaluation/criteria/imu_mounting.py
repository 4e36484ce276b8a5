"""How the IMU was mounted in a run, where that is known from, and what stays unchecked of it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from ugv_acceptance.evaluation.criteria.criteria import INCONCLUSIVE
from ugv_acceptance.evaluation.criteria.statement import NotChecked, Objection, Statement
from ugv_acceptance.evaluation.inputs.imu import ImuTracker
from ugv_acceptance.evaluation.inputs.imu_mount import NOBODY, ImuMount, Mounted, source_words
from ugv_acceptance.evaluation.inputs.imu_turn import LATE
from ugv_acceptance.evaluation.margin_table import MarginRows
from ugv_acceptance.evaluation.settings import Settings
from ugv_acceptance.model.robot import Matrix


@dataclass(frozen=True, slots=True)
class MountExamination:
    """States how the IMU was mounted, under `imu_mounting`: null where no IMU is used."""

    mount: ImuMount
    tracker: ImuTracker

    def add(self, rows: MarginRows) -> None:
        """Take the margins of the next part of the recording: they tell nothing of this."""

    def statement(self, start: int, end: int) -> Statement:
        """Return the mounting in force; an unknown one is an objection."""
        del start, end
        settings, found = self.mount.settings, self.mount.found
        if not settings.hears_imu:
            return Statement({'imu_mounting': None})
        if found is None:
            why = self.mount.why
            told = {'imu_mounting': mounting_json(settings, None, why)}
            if not self.tracker.seen.messages:  # their absence is told elsewhere
                return Statement(told)
            reason = f'how the IMU is mounted is not known, so neither is any margin: {why}'
            unchecked = NotChecked('tilt, and what follows from it', why)
            return Statement(told, (Objection('imu', INCONCLUSIVE, reason),), (unchecked,))
        told = {'imu_mounting': mounting_json(settings, found)}
        return Statement(told, not_checked=tuple(_unchecked(settings, found)))


def _unchecked(settings: Settings, found: Mounted) -> Iterator[NotChecked]:
    robot = settings.robot
    for name, position in found.held:
        joint = robot.joint(name)
        at = f'{position:g} m' if joint.slides else f'{math.degrees(position):g} deg'
        yield NotChecked(
            f'position of {name}', f'it moves the IMU, and no message tells it: held at {at}'
        )
    if found.joints:
        names = ', '.join(robot.joint_names[j] for j in found.joints)
        yield NotChecked(
            f'tilt while {names} moves',
            'the IMU is on that link: the tilt follows from the newest joint states, and may be '
            f'off by what the joints turned since, about {math.degrees(LATE):.0f} degrees at most: '
            'where it could be more, no margin is known',
        )


def mounting_json(settings: Settings, found: Mounted | None, why: str = '') -> dict[str, object]:
    """Return a mounting for JSON: angles in deg, lengths in m, in the axes of `link`."""
    if found is None:
        return {'source': NOBODY, 'why': why}
    moved_by = [settings.robot.joint_names[j] for j in found.joints]
    return {
        'source': found.source,
        'frame': found.frame or None,
        'link': found.link,
        'rpy_deg': [math.degrees(angle) for angle in rpy_of(found.rotation)],
        'position_m': list(found.xyz),
        'steps': list(found.steps),
        'moved_by': moved_by,
        'held': dict(found.held),
    }


def mounting_words(settings: Settings, found: Mounted | None, why: str = '') -> str:
    """Return a mounting in words: where it is known from, the numbers, what moves it."""
    if found is None:
        return f'not known: {why}'
    numbers = ' '.join(f'{math.degrees(angle) + 0.0:.4g}' for angle in rpy_of(found.rotation))
    place = ' '.join(f'{round(x, 4) + 0.0:g}' for x in found.xyz)
    text = f'from {source_words(found)}: rpy {numbers} deg, at {place} m in {found.link}'
    if found.joints:
        text += f', moved by {", ".join(settings.robot.joint_names[j] for j in found.joints)}'
    if found.held:
        held = (f'{name} ({position:g})' for name, position in found.held)
        text += f', with {", ".join(held)} held'
    return text


def rpy_of(rotation: Matrix) -> tuple[float, float, float]:
    """Return a rotation as roll, pitch and yaw (rad) about fixed axes, as URDF and the file do."""
    (a, _, _), (d, e, f), (g, h, i) = rotation
    pitch = math.atan2(-g, math.hypot(a, d))
    if math.hypot(a, d) < 1e-9:  # the roll is then a part of the yaw
        return 0.0, pitch, math.atan2(-f if g > 0.0 else f, e)
    return math.atan2(h, i), pitch, math.atan2(d, a)
