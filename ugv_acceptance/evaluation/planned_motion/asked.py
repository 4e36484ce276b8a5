"""What of a request can be used: which joints move, through which points, from where; or why not.

Sentences here say why nobody can know; none of them is of a limit that is passed.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ugv_acceptance.evaluation.ground import KINDS
from ugv_acceptance.evaluation.inputs.turns import turning_of
from ugv_acceptance.evaluation.planned_motion import words
from ugv_acceptance.evaluation.planned_motion.path import CARRYING, SLIDE, STEP, Knots
from ugv_acceptance.evaluation.planned_motion.request import Conditions, Trajectory
from ugv_acceptance.evaluation.settings import CONTACTS, Settings
from ugv_acceptance.model.mechanics import Mechanics
from ugv_acceptance.model.robot import Joint
from ugv_acceptance.type_aliases import Floats

# A motion that begins at once may begin so far (rad, m) from where the joints stand: encoders.
NEAR, NEAR_SLIDE = 0.02, 0.005
# Ways to the first point that are looked at: three joints, each two ways round.
MOST_WAYS = 8
# Names that are listed in one sentence.
FEW = 4


def undefined(trajectory: Trajectory) -> list[str]:
    """Return why a trajectory is no motion that can be computed; [] if it is one."""
    n, m = len(trajectory.times), len(trajectory.names)
    if not n or not m:
        return ['the trajectory has no points' if m else 'the trajectory names no joints']
    twice = sorted({name for name in trajectory.names if trajectory.names.count(name) > 1})
    if twice:
        return [f'the trajectory names {_listed(twice)} twice']
    tables = (
        ('positions', trajectory.positions),
        ('velocities', trajectory.velocities),
        ('accelerations', trajectory.accelerations),
    )
    for what, table in tables:
        if table is not None and table.shape != (n, m):
            return [f'{what} of {table.shape} numbers: expected {n} points of {m} joints']
    return [*_bad_times(trajectory.times), *_bad_numbers(trajectory, tables)]


def _bad_times(times: Floats) -> Iterator[str]:
    if not np.isfinite(times).all() or times[0] < 0.0:
        yield 'a time is not a number of 0 s or more'
    elif len(times) > 1 and not (np.diff(times) > 0.0).all():
        k = int(np.flatnonzero(np.diff(times) <= 0.0)[0])
        yield (
            f'times do not increase: point {k + 1} is at {times[k]:g} s, '
            f'point {k + 2} at {times[k + 1]:g} s'
        )


def _bad_numbers(
    trajectory: Trajectory, tables: Sequence[tuple[str, Floats | None]]
) -> Iterator[str]:
    for what, table in tables:
        if table is None:
            continue
        bad = ~np.isfinite(table)
        if what != 'positions':  # a whole row says that the point has none
            bad &= ~np.isnan(table).all(axis=1, keepdims=True)
        if bad.any():
            k, j = (int(x) for x in np.argwhere(bad)[0])
            yield f'{what} of point {k + 1}: {trajectory.names[j]} is {table[k, j]}, not a number'
    rates, accelerations = trajectory.velocities, trajectory.accelerations
    if accelerations is not None:
        rated = np.isfinite(accelerations).all(axis=1)
        if rates is not None:
            rated &= ~np.isfinite(rates).all(axis=1)
        if rated.any():
            k = int(rated.argmax())
            yield f'point {k + 1} has accelerations and no velocities: no controller follows that'


def joints_of(settings: Settings, names: Sequence[str]) -> tuple[list[int], list[str]]:
    """Return the numbers of the joints that a trajectory names, and names of none."""
    number = {joint.topic_name: j for j, joint in enumerate(settings.joints)}
    unknown = [name for name in names if name not in number]
    return [number[name] for name in names if name in number], unknown


def not_known(settings: Settings, conditions: Conditions) -> Iterator[str]:
    """Yield what is missing in the conditions, and without which no margin can be computed."""
    gravity, payload = conditions.gravity, conditions.payload
    if gravity is None or not all(map(math.isfinite, gravity)):
        yield 'the attitude of the robot is not known'
    if payload is None or not all(map(math.isfinite, (payload.mass, *payload.cog))):
        yield 'the payload is not known'
    elif payload.mass < 0.0:
        yield f'the payload is {payload.mass:g} kg: expected 0 kg or more'
    elif payload.mass > 0.0 and settings.robot.payload_link is None:
        yield 'the configuration does not say which link carries the payload'
    if conditions.ground is not None and conditions.ground not in KINDS:
        yield f'the ground is {conditions.ground!r}: expected one of {", ".join(KINDS)}'
    if not conditions.corner > 0.0:
        yield f'the drives take {conditions.corner:g} s for another rate: expected more than 0 s'
    if not conditions.at_rest:
        yield 'the robot moves already: a motion is checked from rest'


def not_configured(settings: Settings) -> Iterator[str]:
    """Yield what the configuration says to be unknown: nothing is permitted then."""
    for key in settings.unknown:
        what = 'on what the robot stands' if key == CONTACTS else key
        yield f'the configuration does not know {what}'


def standing_joints(
    settings: Settings, conditions: Conditions, moved: Sequence[int]
) -> tuple[list[float], list[str]]:
    """Return where all joints stand at the start (j), and a sentence if one is not known.

    A joint that nobody told may stand where `Settings.untold` takes it, if it changes no margin,
    and anywhere if turning it moves nothing, as of a wheel.
    """
    robot = settings.robot
    names, given = robot.joint_names, conditions.posture
    if given and len(given) != len(names):
        return [], [f'the posture has {len(given)} positions: expected {len(names)}']
    q = list(given) or [math.nan] * len(names)
    missing = []
    known = given and all(map(math.isfinite, given))
    turning = [] if known else turning_of(robot)
    for j, position in enumerate(q):
        if math.isfinite(position) or (j in moved and conditions.from_first_point):
            continue
        untold = settings.untold[j] if settings.untold else None
        if untold is not None and untold.harmless and j not in moved:
            q[j] = untold.position
        elif not turning[j].moves and not robot.joint(names[j]).slides and j not in moved:
            q[j] = 0.0
        else:
            missing.append(names[j])
    if missing:
        return q, [f'where {_listed(missing)} stands is not known']
    return q, []


def drives(settings: Settings, moved: Sequence[int], wheels: Sequence[str]) -> list[str]:
    """Return a sentence if the trajectory turns wheels: the base then does not stand still."""
    names = [settings.robot.joint_names[j] for j in moved]
    turned = [name for name in names if name in wheels]
    return [f'{_listed(turned)} drives the robot: the base is to stand still'] if turned else []


def knots_of(settings: Settings, trajectory: Trajectory, moved: Sequence[int]) -> Knots:
    """Return the points of a trajectory of the joints `moved`, in the robot's own sense."""
    inputs = [settings.joints[j] for j in moved]
    sign = np.array([of.sign for of in inputs])
    offset = np.array([of.offset for of in inputs])
    none = np.full(trajectory.positions.shape, np.nan)
    rates, more = trajectory.velocities, trajectory.accelerations
    return Knots(
        np.asarray(trajectory.times, np.float64),
        sign * trajectory.positions + offset,
        none if rates is None else sign * rates,
        none if more is None else sign * more,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Begin:
    """How a motion may begin: `ways`, the points with each way to the first; sentences on it.

    `jumps` refuse it, `cautions` are as those of CheckedMotion.
    """

    ways: tuple[Knots, ...]
    jumps: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()


def begin_of(
    settings: Settings, knots: Knots, moved: Sequence[int], start: Sequence[float] | None
) -> Begin:
    """Return how a motion may begin from `start` (m,); None: at its first point.

    Which way round a joint without end goes to a first point that is half a turn away or more
    depends on the controller: by its numbers, or the shorter way. Both are returned.
    """
    if start is None:
        return Begin((knots,))
    robot = settings.robot
    joints = [robot.joint(robot.joint_names[j]) for j in moved]
    at, first = np.array(start), knots.position[0]
    if knots.time[0] > 0.0:
        pairs = zip(joints, (first - at).tolist(), strict=True)
        turns = [_turns(joint, way) for joint, way in pairs]
        names = _listed([joint.name for joint, of in zip(joints, turns, strict=True) if any(of)])
        every = itertools.product(*turns)
        ways = tuple(
            _with_start(knots, at + math.tau * np.array(of, np.float64))
            for of in itertools.islice(every, MOST_WAYS + 1)
        )
        return Begin(ways, cautions=(words.round_words(names),) if names else ())
    # Due at once there is no time for a whole turn either, which not every controller takes off.
    way = first - at
    near = np.where(slides_of(settings, moved), NEAR_SLIDE, NEAR)
    jumps = [k for k, far in enumerate(np.abs(way) > near) if far]
    return Begin((knots,), tuple(_jump(joints[k].name, joints[k].slides, way[k]) for k in jumps))


def _turns(joint: Joint, way: float) -> tuple[int, ...]:
    """Return by how many turns a joint may count as away from where it is told to stand.

    `way` (rad, m) is how far its first point is.
    """
    if joint.kind != 'continuous':
        return (0,)
    nearest = round(way / math.tau)
    if not nearest and abs(way) > math.pi - NEAR:
        return (int(math.copysign(1.0, way)), 0)
    return (0, nearest) if nearest else (0,)


def slides_of(settings: Settings, moved: Sequence[int]) -> NDArray[np.bool_]:
    """Return which joints (m,) of a trajectory move along their axis."""
    robot = settings.robot
    return np.array([robot.joint(robot.joint_names[j]).slides for j in moved], np.bool_)


def farthest(settings: Settings, mechanics: Mechanics, moved: Sequence[int]) -> Floats:
    """Return how far each joint (m,) of a trajectory may move between two moments (rad, m)."""
    carrying = {joint for joint, _ in mechanics.carried}
    part = np.array([CARRYING if j in carrying else 1.0 for j in moved])
    most: Floats = part * np.where(slides_of(settings, moved), SLIDE, STEP)
    return most


def _with_start(knots: Knots, at: Floats) -> Knots:
    """Return the knots with one before them, at time 0, where the joints stand at `at` (m,)."""
    still = np.zeros((1, len(at)))
    return Knots(
        np.concatenate(([0.0], knots.time)),
        np.concatenate((at[None], knots.position)),
        np.concatenate((still, knots.rate)),
        np.concatenate((still, knots.acceleration)),
        0,
    )


def _jump(name: str, slides: bool, way: float) -> str:  # noqa: FBT001 - of a joint
    far = f'{abs(way):.4g} m' if slides else f'{math.degrees(abs(way)):.4g} deg'
    return (
        f'{name} stands {far} from the first point, which is due at 0 s: it would jump; '
        'give the first point a time'
    )


def _listed(names: Sequence[str]) -> str:
    more = f' and {len(names) - FEW} more' if len(names) > FEW else ''
    return ', '.join(names[:FEW]) + more
